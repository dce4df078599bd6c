# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Relays transforms from a robot to shared topics or to a fleet, or from a fleet to topics.

Transforms that a robot sent to its fleet, and that return on its own topics, are recognised.
"""

from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, ExitStack
import logging
import sys
import threading
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from tf_tree_py.command.arguments import Parser
from tf_tree_py.command.endings import cannot_after
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.observers import Observer, ReceivedMessage
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.fleet import FleetError, FleetListener
from tf_tree_py.fleet.connection import log, Uplink
from tf_tree_py.fleet.trust import without_others
from tf_tree_py.frame_names import rename
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    static_broadcaster_qos,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)
from tf_tree_py.thinning import MovingSender, Send, StaticSender, Thinner

from .bad_input import BadInput
from .parameters import declare, describe, FRAME_PREFIX, Setting, Values
from .robot_topics import fit_samples, RawPublisher, RobotTopics, topic_of
from .running import ClosingNode, run, spin

NAME = 'tf_relay'

_TOPICS = (
    Setting('source_tf_topic', 'tf', 'where the robot publishes moving transforms'),
    Setting('tf_topic', TF_TOPIC, 'where to publish them'),
    Setting('source_tf_static_topic', 'tf_static', 'where the robot publishes static transforms'),
    Setting('tf_static_topic', TF_STATIC_TOPIC, 'where to publish them'),
)
# Which samples are sent.
_THINNING = (
    Setting('rate_hz', 0.0, 'the highest rate of each frame, Hz of wall time; 0: as often as '
                            'it arrives', (0.0, 1000.0)),
    Setting('rates', {}, 'the same for single frames, by their names on the robot', (0.0, 1000.0)),
    Setting('min_move', 0.0, 'metres within which a frame counts as resting, and is sent once per '
                             'max_silence; 0 here and for min_turn: it is sent like others',
            (0.0, 1000.0)),
    Setting('min_turn', 0.0, 'radians, likewise', (0.0, 3.2)),
    Setting('max_silence', 1.0, 'seconds after which a resting frame is sent anyway',
            (0.001, 3600.0)),
)
# Parameters that are also options of the command line.
OPTIONS = (
    Setting('zenoh', '', 'the router to send the transforms to, instead of topics, such as '
                         'tcp/hall:7447'),
    Setting('from_zenoh', '', 'the router of a fleet to publish on the topics, with the '
                              "robot's name before each frame"),
    Setting('robots', '*', 'which of its robots, comma-separated: names or patterns such as '
                           "'hall*'"),
    Setting('robot', '', 'the name of this robot there; if empty, its namespace'),
    Setting('key_prefix', '', 'the prefix of the robots in Zenoh keys'),
    Setting('zenoh_config', '', 'a Zenoh configuration file (JSON5): TLS, user and password'),
)
SETTINGS = (
    *_TOPICS,
    FRAME_PREFIX,
    Setting('shared_frames', [], 'frames that keep their name, such as [map]; with '
                                 'from_zenoh, [map] if empty'),
    Setting('frame_filter', [], 'the only frames to pass on, by their names on the robot; if '
                                'empty, all'),
    *_THINNING,
    *OPTIONS,
)


def _thinning_of(values: Values) -> Thinner:
    """Return the thinner that the parameters describe; its rates use the robot's frame names."""
    names = rename(frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'])
    renamed = {frame: names(frame, frame) or (frame, frame) for frame in values['rates']}
    return Thinner(
        rate_hz=values['rate_hz'], min_move=values['min_move'], min_turn=values['min_turn'],
        rates={renamed[frame][1]: rate for frame, rate in values['rates'].items()},
        max_silence=values['max_silence'])


# --- links to a fleet

class _ToNode(logging.Handler):
    """Forwards records of Python's ``logging`` to the log of a node."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._logger = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        """Say a line."""
        self._logger.warning(self.format(record))


@contextmanager
def _logged_by(node: Node) -> Iterator[None]:
    """Log events of the connection to a fleet with a node's logger, within the context."""
    handler = _ToNode(node)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


def uplink(node: Node, values: Values) -> Uplink:
    """
    Return a robot's link to its fleet, configured by the parameters.

    :raises BadInput: a parameter is invalid, or Zenoh is not installed.
    """
    robot = values['robot'] or node.get_namespace().strip('/')
    if not robot:
        raise BadInput('the name of this robot is missing: give --robot NAME, or run in its '
                       'namespace (--ros-args -r __ns:=/robot1)')
    with cannot_after(FleetError, ending=BadInput):
        return Uplink(values['zenoh'] or None, robot, config=values['zenoh_config'] or None,
                      key_prefix=values['key_prefix'])


class FleetInput(Observer):
    """Receives from a fleet, and passes messages on; frames are prefixed with robots' names."""

    def __init__(self, values: Values, moving: MovingSender, static: StaticSender) -> None:
        """
        Start to receive, until ``close``.

        :raises BadInput: a parameter is invalid, or Zenoh is not installed.
        """
        self._moving, self._static = moving, static
        shared: Collection[str] = values['shared_frames'] or ['map']
        self._shared = frozenset(shared)
        with cannot_after(FleetError, ending=BadInput):
            self._listener = FleetListener(
                values['from_zenoh'], values['robots'].split(','), shared_frames=shared,
                config=values['zenoh_config'] or None, key_prefix=values['key_prefix'])
        self._listener.buffer.observers.add(self)
        self.name = self._listener.name

    def received(self, arrival: ReceivedMessage) -> None:
        """Pass a message on; the listener logs what is wrong with it."""
        own, _ = without_others(arrival.batch, self._shared, arrival.authority)
        samples = fit_samples(own, arrival.authority)
        (self._static if arrival.static else self._moving).offer(samples)

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()


# --- echoes

# Samples that are remembered: sixteen seconds of 25 frames at 50 Hz.
_REMEMBERED = 20_000
# Two nodes may occasionally send the same sample; this many come from a loop.
_MANY = 200
# The tolerance for a pose that was sent in messages.
_SAME = 1e-9

_CURE = ('a relay of the fleet (--from-zenoh) publishes in the DDS domain of this robot. Run that '
         'relay in a separate domain (ROS_DOMAIN_ID)')


class FleetEchoes:
    """
    Drops samples that return, because they would circulate for ever, and warns once.

    A fleet's relay publishes samples with the robot's name in front, ``robot7/base``, and with
    the stamp of the original ``base``. All methods are thread-safe.
    """

    def __init__(self, robot: str, warn: Callable[[str], object]) -> None:
        """
        Start without sent samples.

        :param robot: its name in the fleet.
        """
        self._prefix, self._warn = f'{robot}/', warn
        self._lock = threading.Lock()
        self._sent: OrderedDict[tuple[str, int], PoseTuple] = OrderedDict()
        self._repeated = 0
        self._warned = False

    def remembering(self, send: Send) -> Send:
        """Return a function that sends a message, and remembers its samples."""
        def sending(samples: Collection[Sample]) -> None:
            self._remember(samples)
            send(samples)

        return sending

    def without(self, receive: Callable[[list[Sample]], None]) -> Callable[[list[Sample]], None]:
        """Return a function that takes a message, and drops samples that return."""
        def receiving(samples: list[Sample]) -> None:
            with self._lock:
                news = [sample for sample in samples if not self._is_echo(sample)]
            # A message without transforms is passed on, too.
            if news or not samples:
                receive(news)

        return receiving

    def _remember(self, samples: Collection[Sample]) -> None:
        with self._lock:
            for sample in samples:
                self._sent[sample.child, sample.stamp] = sample.pose
            while len(self._sent) > _REMEMBERED:
                self._sent.popitem(last=False)

    def _is_echo(self, sample: Sample) -> bool:
        if not sample.child.startswith(self._prefix):
            return False
        if (sample.child.removeprefix(self._prefix), sample.stamp) in self._sent:
            self._warn_once(f'{sample.child!r} comes back from the fleet: {_CURE}')
            return True
        # The robot itself may put its name in front.
        before = self._sent.get((sample.child, sample.stamp))
        if before is None or any(abs(old - new) > _SAME for old, new in zip(
                before, sample.pose, strict=True)):
            return False
        self._repeated += 1
        if self._repeated == _MANY:
            self._warn_once(f'{sample.child!r} and others come back repeatedly: perhaps '
                            f'{_CURE}')
        return True

    def _warn_once(self, sentence: str) -> None:
        if not self._warned:
            self._warned = True
            self._warn(sentence)


# --- the node

_DESCRIPTION = """\
Republishes one robot's transforms on the topics that all robots share, with a prefix
before its frames. Run one relay in each robot's namespace: in that of /robot1 it subscribes to
/robot1/tf and /robot1/tf_static. The robot's odom becomes robot1/odom on /tf, and map stays map.
It can also send the transforms to a fleet over Zenoh, for FleetListener and tf_view --fleet, or
publish all robots of a fleet on the topics of another network, for example for RViz.

Moving transforms can be sent at a lower rate (rate_hz, rates). The first one after a pause
is sent immediately, and then the newest one when it is due, so the last pose always arrives.
They can also be sent only after they moved (min_move, min_turn) or after max_silence. Static
transforms are sent immediately and completely, also to late subscribers. Transforms that a
buffer would refuse are not sent, and the log gives the reason. Press Ctrl-C to stop."""

_EXAMPLES = (
    ('tf_relay --ros-args -r __ns:=/robot1 -p frame_prefix:=robot1/ -p shared_frames:=[map]',
     'with a prefix'),
    ('tf_relay --zenoh tcp/hall:7447 --robot robot7', 'to a fleet'),
    ('tf_relay --from-zenoh tcp/hall:7447', 'from a fleet'),
)


Topics = Mapping[str, str]


class TfRelay(ClosingNode):
    """Receives transforms from a robot or a fleet in internal threads, and passes them on."""

    def __init__(self, **node_options: Any) -> None:
        """
        Start to relay.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid.
        """
        super().__init__(NAME, **node_options)
        values = declare(self, SETTINGS)
        topics = {setting.name: topic_of(self, setting.name, values[setting.name])
                  for setting in _TOPICS}
        with ExitStack() as closing:
            closing.enter_context(_logged_by(self))
            if values['from_zenoh']:
                self._from_fleet(values, topics, closing)
            elif values['zenoh'] or values['zenoh_config']:
                self._to_fleet(values, topics, closing)
            else:
                self._to_topics(values, topics, closing)
            self._closing.push(closing.pop_all())

    def _to_topics(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        _refuse_own_output(*topics.values())
        self._listen(values, topics, *self._outlets(topics), closing)
        self.get_logger().info('{} -> {}, {} -> {}'.format(*topics.values()))

    def _to_fleet(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        link = uplink(self, values)
        closing.callback(link.close)
        echoes = FleetEchoes(link.robot, self.get_logger().warning)
        self._listen(values, topics, link.send, link.send_static, closing, echoes)
        self.get_logger().info(
            f'{topics["source_tf_topic"]} -> {link.key(static=False)}, '
            f'{topics["source_tf_static_topic"]} -> {link.key(static=True)}, '
            f'through {link.name}')

    def _from_fleet(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        wrong = [name for name in ('zenoh', 'robot', 'frame_prefix', 'frame_filter')
                 if values[name]]
        if wrong:
            raise BadInput(f'{wrong[0]} and from_zenoh cannot be used together')
        send, send_static = self._outlets(topics)
        moving = MovingSender(send, _thinning_of(values))
        closing.callback(moving.close)
        fleet = FleetInput(values, moving, StaticSender(send_static))
        closing.callback(fleet.close)
        self.get_logger().info(f'{values["robots"]} of {fleet.name} -> {topics["tf_topic"]}, '
                               f'{topics["tf_static_topic"]}')

    def _outlets(self, topics: Topics) -> tuple[Send, Send]:
        """Return the functions that publish moving and static transforms."""
        return (RawPublisher(self, topics['tf_topic'], dynamic_qos()).send,
                RawPublisher(self, topics['tf_static_topic'], static_broadcaster_qos(),
                             static=True).send)

    def _listen(self, values: Values, topics: Topics, send: Send, send_static: Send,
                closing: ExitStack, echoes: FleetEchoes | None = None) -> None:
        """Pass on what the robot publishes, except for transforms that return from a fleet."""
        source = RobotTopics(self, rename(
            frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'],
            frame_filter=values['frame_filter'] or None))
        receiver = source.listen(
            topics['source_tf_topic'], topics['source_tf_static_topic'],
            MovingSender(echoes.remembering(send) if echoes else send, _thinning_of(values)),
            StaticSender(echoes.remembering(send_static) if echoes else send_static),
            echoes.without if echoes else lambda receive: receive)
        closing.callback(receiver.close)


def _refuse_own_output(source: str, target: str, static_source: str, static_target: str) -> None:
    for topic in {source, static_source} & {target, static_target}:
        raise BadInput(
            f'the relay would receive its own output, because {topic} is both its input and its '
            'output: run it in the namespace of its robot (--ros-args -r __ns:=/robot1), or set '
            'source_tf_topic and source_tf_static_topic')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES, epilog=describe(SETTINGS))
    for setting in OPTIONS:
        parser.add_argument(f'--{setting.name.replace("_", "-")}', help=setting.meaning)
    given = vars(parser.parse_args(parser.own_arguments(argv)))
    overrides = [Parameter(name, value=value) for name, value in given.items()
                 if value is not None]
    return run(NAME, argv, lambda ended: spin(TfRelay(parameter_overrides=overrides), ended))


if __name__ == '__main__':
    sys.exit(main())
