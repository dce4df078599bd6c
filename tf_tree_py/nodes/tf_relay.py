# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Relays transforms from a robot to shared topics or to a fleet, or from a fleet to topics."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
import sys
from typing import Any

from rclpy.parameter import Parameter
from tf_tree_py.command.arguments import Parser
from tf_tree_py.core.messages.frame_names import rename
from tf_tree_py.ros.topics.qos import dynamic_qos, static_broadcaster_qos
from tf_tree_py.thinning import MovingSender, Send, StaticSender

from .bad_input import BadInput
from .closing_node import ClosingNode
from .fleet_echoes import FleetEchoes
from .fleet_links import FleetInput, logged_by, uplink
from .parameters import declare, describe
from .raw_publishers import RawPublisher
from .relay_settings import NAME, OPTIONS, SETTINGS, thinning_of, TOPICS
from .robot_topics import RobotTopics
from .running import run, spin

_DESCRIPTION = """\
Republishes one robot's transforms on the topics that all robots share, with a prefix
before its frames. Run one relay in each robot's namespace:

  tf_relay --ros-args -r __ns:=/robot1 -p frame_prefix:=robot1/ -p shared_frames:=[map]

This relay subscribes to /robot1/tf and /robot1/tf_static. The robot's odom becomes
robot1/odom on /tf, and map stays map. To send the transforms to a fleet over Zenoh, for
FleetListener and tf_view --fleet:

  tf_relay --zenoh tcp/hall:7447 --robot robot7

To publish all robots of a fleet on the topics of another network, for example for RViz:

  tf_relay --from-zenoh tcp/hall:7447

Moving transforms can be sent at a lower rate (rate_hz, rates). The first one after a pause
is sent immediately, and then the newest one when it is due, so the last pose always arrives.
They can also be sent only after they moved (min_move, min_turn) or after max_silence. Static
transforms are sent immediately and completely, also to late subscribers. Transforms that a
buffer would refuse are not sent, and the log gives the reason. Press Ctrl-C to stop."""


Values = Mapping[str, Any]
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
        topics = {setting.name: self._resolve(setting.name, values[setting.name])
                  for setting in TOPICS}
        with ExitStack() as closing:
            closing.enter_context(logged_by(self))
            if values['from_zenoh']:
                self._from_fleet(values, topics, closing)
            elif values['zenoh'] or values['zenoh_config']:
                self._to_fleet(values, topics, closing)
            else:
                self._to_topics(values, topics, closing)
            self._closing.push(closing.pop_all())

    def _resolve(self, parameter: str, topic: str) -> str:
        try:
            return self.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
            raise BadInput(
                f'parameter {parameter} must be a topic name, not {topic!r}') from error

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
        moving = MovingSender(send, thinning_of(values))
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
            MovingSender(echoes.remembering(send) if echoes else send, thinning_of(values)),
            StaticSender(echoes.remembering(send_static) if echoes else send_static),
            echoes.without if echoes else lambda take: take)
        closing.callback(receiver.close)


def _refuse_own_output(source: str, target: str, static_source: str,
                       static_target: str) -> None:
    for topic in {source, static_source} & {target, static_target}:
        raise BadInput(
            f'the relay would receive its own output, because {topic} is both its input and its '
            'output: run it in the namespace of its robot (--ros-args -r __ns:=/robot1), or set '
            'source_tf_topic and source_tf_static_topic')


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, epilog=describe(SETTINGS))
    for setting in OPTIONS:
        parser.add_argument(f'--{setting.name.replace("_", "-")}', help=setting.meaning)
    given = vars(parser.parse_args(parser.own_arguments(argv)))
    overrides = [Parameter(name, value=value) for name, value in given.items()
                 if value is not None]
    return run(NAME, argv, lambda ended: spin(TfRelay(parameter_overrides=overrides), ended))


if __name__ == '__main__':
    sys.exit(main())
