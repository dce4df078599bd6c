"""Passes one robot's transforms on: to the topics that all robots share, or over Zenoh."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
import sys
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from tf_tree_py.core.arrivals.frame_names import rename
from tf_tree_py.core.departures.sending import Moving, Send, Static
from tf_tree_py.core.departures.thinning import Thinning
from tf_tree_py.fleet import configuration, FleetError
from tf_tree_py.fleet.uplink import Uplink
from tf_tree_py.ros.topics.qos import dynamic_qos, static_broadcaster_qos

from .bad_input import BadInput
from .outlets import Outlet
from .parameters import declare, describe
from .relay_settings import NAME, OPTIONS, SETTINGS, TOPICS
from .robot_topics import RobotTopics
from .running import Parser, run, spin

_DESCRIPTION = """\
Passes one robot's transforms on to the topics that all robots share, its frames under a
prefix: run one in each robot's namespace.

  tf_relay --ros-args -r __ns:=/robot1 -p frame_prefix:=robot1/ -p shared_frames:=[map]

hears /robot1/tf and /robot1/tf_static; its odom is robot1/odom on /tf, and map is map.
Or to a fleet, over Zenoh, where FleetListener and tf_view --fleet hear it:

  tf_relay --zenoh tcp/hall:7447 --robot robot7

What moves may go out less often than it comes (rate_hz, rates): the first after a pause at
once, and then the newest when it is due, so that the last pose always arrives; and only
when it has moved (min_move, min_turn), or after max_silence. What is static goes out at once,
all of it, also to whoever comes later. What no buffer would take stays here, and the log
says why. Ctrl-C ends."""


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
        with ExitStack() as closing:
            over_zenoh = values['zenoh'] or values['zenoh_config']
            moving, static = (self._to_zenoh(values, closing) if over_zenoh else
                              self._to_topics(topics))
            source = RobotTopics(self, rename(
                frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'],
                frame_filter=values['frame_filter'] or None))
            receiver = source.listen(
                topics['source_tf_topic'], topics['source_tf_static_topic'],
                Moving(moving, _thinning(values)), Static(static))
            closing.callback(receiver.close)
            self._closing = closing.pop_all()

    def _resolve(self, parameter: str, topic: str) -> str:
        try:
            return self.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
            raise BadInput(
                f'parameter {parameter} has to be a topic, and {topic!r} is none') from error

    def _to_topics(self, topics: Mapping[str, str]) -> tuple[Send, Send]:
        """Return what publishes moving and static transforms on topics."""
        _check_that_it_does_not_hear_itself(*topics.values())
        self.get_logger().info('{} -> {}, {} -> {}'.format(*topics.values()))
        return (Outlet(self, topics['tf_topic'], dynamic_qos()).send,
                Outlet(self, topics['tf_static_topic'], static_broadcaster_qos()).send)

    def _to_zenoh(self, values: Mapping[str, Any], closing: ExitStack) -> tuple[Send, Send]:
        """Return what sends moving and static transforms over Zenoh."""
        robot = values['robot'] or self.get_namespace().strip('/')
        if not robot:
            raise BadInput('which robot is this? Name it (--robot NAME), or run it in its '
                           'namespace (--ros-args -r __ns:=/robot1)')
        closing.enter_context(logged_by(self))
        try:
            uplink = Uplink(values['zenoh'] or None, robot, config=values['zenoh_config'] or None,
                            key_prefix=values['key_prefix'])
        except FleetError as error:
            raise BadInput(str(error)) from error
        closing.callback(uplink.close)
        self.get_logger().info(
            f'{sources} -> {uplink.keys} by way of {uplink.name}')
        return uplink.send, uplink.send_static

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._closing.close()
        super().destroy_node()


def _thinning(values: Mapping[str, Any]) -> Thinning:
    names = rename(frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'])
    renamed = {frame: names(frame, frame) or (frame, frame) for frame in values['rates']}
    return Thinning(
        rate_hz=values['rate_hz'], min_move=values['min_move'], min_turn=values['min_turn'],
        rates={renamed[frame][1]: rate for frame, rate in values['rates'].items()},
        max_silence=values['max_silence'])


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
    for setting in OPTIONS:
        parser.add_argument(f'--{setting.name.replace("_", "-")}', help=setting.meaning)
    given = vars(parser.parse_args(parser.own_arguments(argv)))
    overrides = [Parameter(name, value=value) for name, value in given.items()
                 if value is not None]
    return run(NAME, argv, lambda ended: spin(TfRelay(parameter_overrides=overrides), ended))


if __name__ == '__main__':
    sys.exit(main())
