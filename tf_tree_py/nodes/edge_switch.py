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

"""Several sources of one edge, as one that goes from one to another without a jump."""

from collections.abc import Sequence
from functools import partial
import re
import sys
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from std_srvs.srv import Trigger
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import BEGINNING, format_stamp, from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.diagnostics import TransformDiagnostics
from tf_tree_py.ros.topics.qos import dynamic_qos, sensor_qos, TF_TOPIC

from .bad_input import BadInput
from .blended_edge import frame_of, LIMITS, limits_of
from .edge_messages import message_type, samples_of, TYPES
from .outlets import Outlet
from .parameters import declare, describe, given, Setting
from .running import Parser, run, spin

NAME = 'edge_switch'

_DESCRIPTION = """\
Publishes one edge, such as odom -> base_link, that several sources know: wheels and a camera.
It is what one of them says. The service ~/switch_to/NAME goes over to another without a
jump, no faster than max_speed and max_turn_rate; and one that falls silent, or moves
otherwise than the others, makes way by itself, which the log and /diagnostics tell. The sources'
own transforms of the edge have to be switched off. Ctrl-C ends."""

SOURCES = Setting('sources', ['wheel', 'vo'], 'their names; the first is preferred at the start')
SETTINGS = (
    Setting('parent_frame', 'odom', 'the parent of the edge'),
    Setting('child_frame', 'base_link', 'its child'),
    *LIMITS,
    Setting('max_age', 0.5, 'a source that is so far behind another makes way, seconds',
            (0.001, 3600.0)),
    Setting('gate', 0.0, 'a source whose motion over the window differs by more from what most '
            'say makes way, metres; 0: by any', (0.0, 1e6)),
    Setting('turn_gate', 0.1, 'likewise, radians; of no meaning without a gate', (0.0, 4.0)),
    Setting('window', 1.0, 'over which motions are compared, seconds', (0.01, 5.0)),
)
# Stamps that are further ahead of the clock are refused, or one would keep all others out.
_AHEAD = Duration(seconds=1.0)
# What may stand in the name of a service and of a parameter.
_USABLE = re.compile('[A-Za-z][A-Za-z0-9_]*')


class EdgeSwitch(Node):
    """
    Publishes the edge as soon as something of it is heard; see ``core.tree.sources``.

    Everything is served by whoever spins the node, in one thread.
    """

    def __init__(self, **node_options: Any) -> None:
        """
        Begin to listen.

        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter is wrong.
        """
        super().__init__(NAME, **node_options)
        self._names = _checked_names(given(self, SOURCES))
        values = self._values = declare(
            self, (SOURCES, *SETTINGS, *_settings_of(self._names)))
        self._parent, self._child = (
            frame_of(values, key) for key in ('parent_frame', 'child_frame'))
        self._limits = limits_of(values)._asdict()
        self._buffer = Buffer(node=self, max_future=_AHEAD)
        self._has_rule = False
        self._begin_anew()
        self._tf = Outlet(self, TF_TOPIC, dynamic_qos())
        for name in self._names:
            self._listen(name, values[f'{name}.topic'], values[f'{name}.type'])
        self._diagnostics = TransformDiagnostics(self._buffer, self)

    def _begin_anew(self) -> None:
        """Forget what was published, for another time has begun."""
        self._last = BEGINNING
        self._awaits_preferred = True

    def _listen(self, name: str, topic: str, kind: str) -> None:
        try:
            resolved = self.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
            raise BadInput(f'parameter {name}.topic has to be a topic, and {topic!r} is none'
                           ) from error
        if resolved == self.resolve_topic_name(TF_TOPIC):
            raise BadInput(f'it would hear itself: the source {name!r} is on {resolved}, where '
                           f'the edge is published. Set {name}.topic to another topic')
        self.create_subscription(
            message_type(kind), topic, partial(self._hear, name), sensor_qos())
        self.create_service(Trigger, f'~/switch_to/{name}', partial(self._serve, name))

    # --- what comes in

    def _hear(self, source: str, message: Any) -> None:
        try:
            for sample in samples_of(message, self._parent, self._child):
                self._take(source, sample)
        except TransformException as error:
            self.get_logger().warning(f'A message of the source {source!r} is of no use: {error}',
                                      throttle_duration_sec=5.0)
        self._publish()

    def _take(self, source: str, sample: Sample) -> None:
        incidents = self._buffer.insert_from(source, *sample)
        self._buffer.feeds.note(incidents)
        sources = self._buffer.sources_of(self._child)
        if sources and not self._has_rule:
            self._set_rule()
        # One that made way by the rule is not preferred any more.
        self._awaits_preferred &= not any(each.made_way for each in sources)
        if self._awaits_preferred and source == self._names[0]:
            self._prefer(source)

    def _set_rule(self) -> None:
        values = self._values
        gate = (values['gate'], values['turn_gate']) if values['gate'] else None
        self._buffer.switch_by_rule(
            self._child, max_age=from_seconds(values['max_age']), gate=gate,
            window=from_seconds(values['window']), **self._limits)
        self._has_rule = True

    def _prefer(self, source: str) -> None:
        """Go over to the preferred source, if another was heard before it."""
        try:
            self._buffer.switch(self._child, to=source, **self._limits)
        except TransformException:
            # It answers already; or it began too late, and its next sample will do.
            self._awaits_preferred = not self._answers(source)
        else:
            self._awaits_preferred = False

    def _answers(self, source: str) -> bool:
        return any(each.name == source and each.is_active
                   for each in self._buffer.sources_of(self._child))

    def _serve(self, source: str, _: Trigger.Request,
               response: Trigger.Response) -> Trigger.Response:
        """Go over to a source because somebody asks for it."""
        try:
            change = self._buffer.switch(self._child, to=source, **self._limits)
        except TransformException as error:
            response.message = str(error) if self._has_rule else 'nothing was heard yet'
            return response
        self._awaits_preferred = False
        response.success = True
        response.message = (
            f'it begins as soon as {source!r} has reached the newest sample' if change is None else
            f'from {format_stamp(change.begin)} to {format_stamp(change.end)}')
        self.get_logger().info(f'Asked to go over to {source!r}: {response.message}')
        self._publish()
        return response

    # --- what goes out

    def _publish(self) -> None:
        """Publish the samples of the edge that are newer than all that were published."""
        stamps = self._buffer.stamps_of(self._child)
        if len(stamps) and stamps[-1] < self._last:
            self._begin_anew()
        stamps = stamps[stamps > self._last]
        if not len(stamps):
            return
        self._last = int(stamps[-1])
        poses = self._buffer.lookup_many(self._parent, self._child, stamps)
        self._tf.send([Sample(self._parent, self._child, stamp, tuple(pose))
                       for stamp, pose in zip(stamps.tolist(), poses.tolist(), strict=True)])

    def destroy_node(self) -> None:
        """Stop telling how the edge is, and destroy the node."""
        self._diagnostics.close()
        super().destroy_node()


def _settings_of(names: Sequence[str]) -> list[Setting]:
    """Return the parameters that each source has."""
    return [setting for name in names for setting in (
        Setting(f'{name}.topic', f'{name}/odom', 'where it is heard'),
        Setting(f'{name}.type', 'nav_msgs/msg/Odometry', f'one of {", ".join(TYPES)}'))]


def _checked_names(names: list[str]) -> list[str]:
    if len(names) < 2 or len({*names}) < len(names) or not all(map(_USABLE.fullmatch, names)):
        raise BadInput('parameter sources has to be two or more names of letters, digits and _, '
                       f'such as [wheel, vo], not {names}')
    return names


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe((SOURCES, *SETTINGS, *_settings_of(['NAME']))))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: spin(EdgeSwitch(), ended))


if __name__ == '__main__':
    sys.exit(main())
