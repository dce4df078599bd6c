"""Passes one robot's transforms on to the topics that all robots share."""

from collections.abc import Callable, Mapping, Sequence
import sys
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.frame_names import rename
from tf_tree_py.core.arrivals.incident_log import IncidentLog
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.sample import bad_name, checked, Sample
from tf_tree_py.core.arrivals.wire import WireReader
from tf_tree_py.core.buffer.buffer_core import DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.departures.sending import Moving, Static
from tf_tree_py.core.departures.thinning import Thinning
from tf_tree_py.ros.threads.companion import companion
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics.authority import Authority
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    static_broadcaster_qos,
    static_listener_qos,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)

from .bad_input import BadInput
from .outlets import Outlet
from .parameters import declare, describe, FRAME_PREFIX, Setting
from .running import Parser, run, spin

NAME = 'tf_relay'

_DESCRIPTION = """\
Passes one robot's transforms on to the topics that all robots share, its frames under a
prefix: run one in each robot's namespace.

  tf_relay --ros-args -r __ns:=/robot1 -p frame_prefix:=robot1/ -p shared_frames:=[map]

hears /robot1/tf and /robot1/tf_static; its odom is robot1/odom on /tf, and map is map.
What moves may go out less often than it comes (rate_hz, rates): the first after a pause at
once, and then the newest when it is due, so that the last pose always arrives; and only
when it has moved (min_move, min_turn), or after max_silence. What is static goes out at once,
all of it, also to whoever comes later. What no buffer would take stays here,
and the log says why. Ctrl-C ends."""

TOPICS = (
    Setting('source_tf_topic', 'tf', 'where the robot publishes what moves'),
    Setting('tf_topic', TF_TOPIC, 'where that goes'),
    Setting('source_tf_static_topic', 'tf_static', 'where it publishes what does not move'),
    Setting('tf_static_topic', TF_STATIC_TOPIC, 'where that goes'),
)
SETTINGS = (
    *TOPICS,
    FRAME_PREFIX,
    Setting('shared_frames', [], 'frames that keep their name, such as [map]'),
    Setting('frame_filter', [], 'the only frames to pass on, as the robot calls them; none: all'),
    Setting('rate_hz', 0.0, 'how often each frame goes out at most, by the wall; 0: as often as '
                            'it comes', (0.0, 1000.0)),
    Setting('rates', {}, 'the same for single frames, as the robot calls them', (0.0, 1000.0)),
    Setting('min_move', 0.0, 'metres within which a frame is at rest, and goes out once in '
                             'max_silence; 0 here and for min_turn: it goes out as others do',
            (0.0, 1000.0)),
    Setting('min_turn', 0.0, 'radians, likewise', (0.0, 3.2)),
    Setting('max_silence', 1.0, 'seconds after which a frame at rest goes out all the same',
            (0.001, 3600.0)),
)


class TfRelay(Node):
    """Listens to a robot in a thread of its own, and passes its transforms on."""

    def __init__(self, **node_options: Any) -> None:
        """
        Begin to pass on.

        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter is wrong.
        """
        super().__init__(NAME, **node_options)
        values = declare(self, SETTINGS)
        topics = {setting.name: self._resolve(setting.name, values[setting.name])
                  for setting in TOPICS}
        _check_that_it_does_not_hear_itself(*topics.values())
        self._names = rename(
            frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'],
            frame_filter=values['frame_filter'] or None)
        self._log = IncidentLog(self.get_logger())
        moving = Moving(Outlet(self, topics['tf_topic'], dynamic_qos()).send, _thinning(values))
        static = Static(Outlet(self, topics['tf_static_topic'], static_broadcaster_qos()).send)
        self._home = companion(self, f'{NAME}_impl')
        self._listen(topics['source_tf_topic'], dynamic_qos(), moving.take)
        self._listen(topics['source_tf_static_topic'], static_listener_qos(), static.take)
        self._receiver = Receiver(self._home, moving.close)
        self.get_logger().info('{} -> {}, {} -> {}'.format(*topics.values()))

    def _resolve(self, parameter: str, topic: str) -> str:
        try:
            return self.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
            raise BadInput(
                f'parameter {parameter} has to be a topic, and {topic!r} is none') from error

    def _listen(self, topic: str, qos: QoSProfile, take: Callable[[list[Sample]], None]) -> None:
        reader, authority = WireReader(self._names), Authority(self._home, topic)

        def receive(data: bytes) -> None:
            publisher = authority.name()
            batch = reader.read_or_refuse(data, publisher)
            arrived = [batch] if isinstance(batch, Incident) else [
                _fit(sample, publisher) for sample in batch.samples()]
            self._log.report(each for each in arrived if isinstance(each, Incident))
            take([each for each in arrived if isinstance(each, Sample)])

        self._home.create_subscription(TFMessage, topic, receive, qos, raw=True)

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._receiver.close()
        super().destroy_node()


def _thinning(values: Mapping[str, Any]) -> Thinning:
    names = rename(frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'])
    renamed = {frame: names(frame, frame) or (frame, frame) for frame in values['rates']}
    return Thinning(
        rate_hz=values['rate_hz'], min_move=values['min_move'], min_turn=values['min_turn'],
        rates={renamed[frame][1]: rate for frame, rate in values['rates'].items()},
        max_silence=values['max_silence'])


def _fit(sample: Sample, publisher: str) -> Sample | Incident:
    """Return a sample as a buffer would take it, or why it would refuse it."""
    bad = bad_name(sample.parent, sample.child, sample.stamp, publisher, DEFAULT_MAX_NAME_BYTES)
    return bad or checked(sample, publisher)


def _check_that_it_does_not_hear_itself(source: str, target: str, static_source: str,
                                        static_target: str) -> None:
    for topic in {source, static_source} & {target, static_target}:
        raise BadInput(
            f'it would hear itself, for {topic} is both where it listens and where it talks: '
            'run it in the namespace of its robot (--ros-args -r __ns:=/robot1), or set '
            'source_tf_topic and source_tf_static_topic')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: spin(TfRelay(), ended))


if __name__ == '__main__':
    sys.exit(main())
