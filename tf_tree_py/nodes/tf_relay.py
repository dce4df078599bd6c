# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Passes transforms on: of a robot to the topics that all share, or to a fleet, or of a fleet."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
import sys
from typing import Any

from rclpy.node import Node
from rclpy.parameter import Parameter
from tf_tree_py.core.arrivals.frame_names import rename
from tf_tree_py.core.departures.sending import Moving, Send, Static
from tf_tree_py.ros.topics.qos import dynamic_qos, static_broadcaster_qos

from .bad_input import BadInput
from .fleet_ends import Fleet, logged_by, uplink
from .outlets import Outlet
from .parameters import declare, describe
from .relay_settings import NAME, OPTIONS, SETTINGS, thinning_of, TOPICS
from .robot_topics import RobotTopics
from .running import Parser, run, spin

_DESCRIPTION = """\
Passes one robot's transforms on to the topics that all robots share, its frames under a
prefix: run one in each robot's namespace.

  tf_relay --ros-args -r __ns:=/robot1 -p frame_prefix:=robot1/ -p shared_frames:=[map]

hears /robot1/tf and /robot1/tf_static; its odom is robot1/odom on /tf, and map is map.
Or to a fleet, over Zenoh, where FleetListener and tf_view --fleet hear it:

  tf_relay --zenoh tcp/hall:7447 --robot robot7

And back: all robots of a fleet on the topics of another network, for RViz, say:

  tf_relay --from-zenoh tcp/hall:7447

What moves may go out less often than it comes (rate_hz, rates): the first after a pause at
once, and then the newest when it is due, so that the last pose always arrives; and only
when it has moved (min_move, min_turn), or after max_silence. What is static goes out at once,
all of it, also to whoever comes later. What no buffer would take stays here, and the log
says why. Ctrl-C ends."""


Values = Mapping[str, Any]
Topics = Mapping[str, str]


class TfRelay(Node):
    """Listens to a robot, or a fleet, in threads of its own, and passes transforms on."""

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
            closing.enter_context(logged_by(self))
            if values['from_zenoh']:
                self._from_fleet(values, topics, closing)
            elif values['zenoh'] or values['zenoh_config']:
                self._to_fleet(values, topics, closing)
            else:
                self._to_topics(values, topics, closing)
            self._closing = closing.pop_all()

    def _resolve(self, parameter: str, topic: str) -> str:
        try:
            return self.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
            raise BadInput(
                f'parameter {parameter} has to be a topic, and {topic!r} is none') from error

    def _to_topics(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        _check_that_it_does_not_hear_itself(*topics.values())
        self._listen(values, topics, *self._outlets(topics), closing)
        self.get_logger().info('{} -> {}, {} -> {}'.format(*topics.values()))

    def _to_fleet(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        link = uplink(self, values)
        closing.callback(link.close)
        self._listen(values, topics, link.send, link.send_static, closing)
        self.get_logger().info(
            f'{topics["source_tf_topic"]} -> {link.key(static=False)}, '
            f'{topics["source_tf_static_topic"]} -> {link.key(static=True)}, '
            f'by way of {link.name}')

    def _from_fleet(self, values: Values, topics: Topics, closing: ExitStack) -> None:
        wrong = [name for name in ('zenoh', 'robot', 'frame_prefix', 'frame_filter')
                 if values[name]]
        if wrong:
            raise BadInput(f'{wrong[0]} and from_zenoh do not go together')
        send, send_static = self._outlets(topics)
        moving = Moving(send, thinning_of(values))
        closing.callback(moving.close)
        fleet = Fleet(values, moving, Static(send_static))
        closing.callback(fleet.close)
        self.get_logger().info(f'{values["robots"]} of {fleet.name} -> {topics["tf_topic"]}, '
                               f'{topics["tf_static_topic"]}')

    def _outlets(self, topics: Topics) -> tuple[Send, Send]:
        """Return what publishes moving and static transforms."""
        return (Outlet(self, topics['tf_topic'], dynamic_qos()).send,
                Outlet(self, topics['tf_static_topic'], static_broadcaster_qos()).send)

    def _listen(self, values: Values, topics: Topics, send: Send, send_static: Send,
                closing: ExitStack) -> None:
        """Pass on what the robot publishes."""
        source = RobotTopics(self, rename(
            frame_prefix=values['frame_prefix'], shared_frames=values['shared_frames'],
            frame_filter=values['frame_filter'] or None))
        receiver = source.listen(
            topics['source_tf_topic'], topics['source_tf_static_topic'],
            Moving(send, thinning_of(values)), Static(send_static))
        closing.callback(receiver.close)

    def destroy_node(self) -> None:
        """Stop listening, and destroy the node."""
        self._closing.close()
        super().destroy_node()


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
