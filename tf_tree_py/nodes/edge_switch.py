# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publishes one edge that several sources measure, and switches between them without a jump."""

from collections.abc import Sequence
from functools import partial
import re
import sys
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from std_srvs.srv import Trigger
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import BEGINNING, format_stamp, from_seconds
from tf_tree_py.limited_log import LimitedLog
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.diagnostics import TransformDiagnostics
from tf_tree_py.ros.topics.qos import dynamic_qos, mismatches, sensor_qos, TF_TOPIC

from .bad_input import BadInput
from .edge_messages import EdgePose, frame_of, LIMITS, limits_of, message_type, samples_of, TYPES
from .parameters import declare, given, Setting
from .robot_topics import RawPublisher, topic_of
from .running import ClosingNode, main_of

NAME = 'edge_switch'

_DESCRIPTION = """\
Publishes one edge, such as odom -> base_link, that several sources measure, such as wheels
and a camera. It follows one source at a time. The service ~/switch_to/NAME blends to another
source without a jump, no faster than max_speed and max_turn_rate. A source that falls silent,
or moves differently from the others, is replaced automatically; the log and /diagnostics
report that. With prefer the edge returns to a better source that is steady again. The sources
must not publish the edge themselves. Press Ctrl-C to stop."""
_EXAMPLES = (
    ('edge_switch --ros-args -p sources:=[wheel,vo]',
     'odom -> base_link, from wheels or a camera'),
    ('edge_switch --ros-args -p sources:=[wheel,vo] -p prefer:=[vo]',
     'back to the camera once it is steady'),
)

SOURCES = Setting(
    'sources', ['wheel', 'vo'], 'names of the sources; the first is preferred at the start')
SETTINGS = (
    Setting('parent_frame', 'odom', 'the parent of the edge'),
    Setting('child_frame', 'base_link', 'its child'),
    *LIMITS,
    Setting('max_age', 0.5, 'a source that is this far behind another is replaced, seconds',
            (0.001, 3600.0)),
    Setting('gate', 0.0, 'a source is replaced if its motion over the window differs by more '
            'from that of most sources, metres; 0: never', (0.0, 1e6)),
    Setting('turn_gate', 0.1, 'the same for rotations, radians; ignored without a gate',
            (0.0, 4.0)),
    Setting('window', 1.0, 'the duration over which motions are compared, seconds', (0.01, 5.0)),
    Setting('prefer', [], 'sources, the best first: the edge returns to a better one that is '
            'steady again; empty: it does not return'),
    Setting('steady', 2.0, 'how long a better source must have published without a gap of max_age '
            'before the edge returns to it, seconds', (0.001, 3600.0)),
)
# Stamps further ahead of the clock are refused: otherwise one would block all later samples.
_AHEAD = Duration(seconds=1.0)
# Names that are valid in the names of services and parameters.
_USABLE = re.compile('[A-Za-z][A-Za-z0-9_]*')


class EdgeSwitch(ClosingNode):
    """
    Publishes the edge as soon as a sample of it has been received.

    ``beyond.sources.edge_sources`` chooses the source.

    All callbacks run in the thread that spins the node.
    """

    def __init__(self, **node_options: Any) -> None:
        """
        Start to receive and to publish.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter is invalid.
        """
        super().__init__(NAME, **node_options)
        self._names = _checked_names(given(self, SOURCES))
        values = self._values = declare(self, (SOURCES, *SETTINGS, *settings_of(self._names)))
        self._parent, self._child = (
            frame_of(values, key) for key in ('parent_frame', 'child_frame'))
        self._limits = limits_of(values)._asdict()
        self._better = _checked_order(values['prefer'], self._names)
        self._buffer = Buffer(node=self, max_future=_AHEAD)
        self._requests = LimitedLog(lambda line: self.get_logger().info(line))
        self._has_rule = False
        self._begin_anew()
        self._tf = RawPublisher(self, TF_TOPIC, dynamic_qos())
        for name in self._names:
            self._listen(name, values[f'{name}.topic'], values[f'{name}.type'])
        self._closing.callback(TransformDiagnostics(self._buffer, self).close)
        self.create_timer(1.0, self._write_counts, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _begin_anew(self) -> None:
        """Forget the published samples, because time has restarted."""
        self._last = BEGINNING
        self._awaits_preferred = True

    def _listen(self, name: str, topic: str, type_name: str) -> None:
        resolved = topic_of(self, f'{name}.topic', topic)
        if resolved == self.resolve_topic_name(TF_TOPIC):
            raise BadInput(f'the node would receive its own output: the source {name!r} is on '
                           f'{resolved}, where the edge is published. Set {name}.topic to another '
                           'topic')
        self.create_subscription(
            message_type(type_name), topic, partial(self._hear, name), sensor_qos(),
            event_callbacks=mismatches(resolved, self._buffer.feeds.log))
        self.create_service(Trigger, f'~/switch_to/{name}', partial(self._serve, name))

    def _write_counts(self) -> None:
        for log in (self._buffer.feeds.log, self._requests):
            log.write_counts()

    # --- input

    def _hear(self, source: str, message: EdgePose) -> None:
        try:
            for sample in samples_of(message, self._parent, self._child):
                self._insert(source, sample)
        except TransformException as error:
            self._buffer.feeds.log.write(
                f'unusable message, {type(error).__name__}', source,
                f'A message of the source {source!r} cannot be used: {error}', str(error))
        self._publish()

    def _insert(self, source: str, sample: Sample) -> None:
        incidents = self._buffer.insert_from(source, *sample)
        self._buffer.feeds.note(incidents)
        sources = self._buffer.sources_of(self._child)
        if sources and not self._has_rule:
            self._set_rule()
        # A source that the rule replaced is no longer preferred.
        self._awaits_preferred &= not any(each.made_way for each in sources)
        if self._awaits_preferred and source == self._names[0]:
            self._prefer(source)

    def _set_rule(self) -> None:
        values = self._values
        gate = (values['gate'], values['turn_gate']) if values['gate'] else None
        self._buffer.switch_by_rule(
            self._child, max_age=from_seconds(values['max_age']), gate=gate,
            window=from_seconds(values['window']), prefer=self._better,
            steady=from_seconds(values['steady']), **self._limits)
        self._has_rule = True

    def _prefer(self, source: str) -> None:
        """Switch to the preferred source, if another source was received first."""
        try:
            self._buffer.switch(self._child, to=source, **self._limits)
        except TransformException:
            # It is active already; or it began too late, and its next sample will do.
            self._awaits_preferred = not self._answers(source)
        else:
            self._awaits_preferred = False

    def _answers(self, source: str) -> bool:
        return any(each.name == source and each.is_active
                   for each in self._buffer.sources_of(self._child))

    def _serve(self, source: str, _: Trigger.Request,
               response: Trigger.Response) -> Trigger.Response:
        """Switch to a source because a client called the service."""
        try:
            change = self._buffer.switch(self._child, to=source, **self._limits)
        except TransformException as error:
            response.message = str(error) if self._has_rule else 'no source has been received yet'
            return response
        self._awaits_preferred = False
        response.success = True
        response.message = (
            f'the switch begins as soon as {source!r} has reached the newest sample'
            if change is None else
            f'the switch lasts from {format_stamp(change.begin)} to {format_stamp(change.end)}')
        self._requests.write('request to switch', source,
                             f'Asked to switch to {source!r}: {response.message}')
        self._publish()
        return response

    # --- output

    def _publish(self) -> None:
        """Publish the samples of the edge that are newer than all published ones."""
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


def settings_of(names: Sequence[str]) -> list[Setting]:
    """Return the parameters that each source has."""
    return [setting for name in names for setting in (
        Setting(f'{name}.topic', f'{name}/odom', 'the topic of this source'),
        Setting(f'{name}.type', 'nav_msgs/msg/Odometry', f'one of {", ".join(TYPES)}'))]


def _checked_names(names: list[str]) -> list[str]:
    if len(names) < 2 or len({*names}) < len(names) or not all(map(_USABLE.fullmatch, names)):
        raise BadInput('parameter sources must be two or more names of letters, digits and _, '
                       f'such as [wheel, vo], not {names}')
    return names


def _checked_order(prefer: list[str], names: list[str]) -> list[str]:
    unknown = [name for name in prefer if name not in names]
    if unknown or len({*prefer}) < len(prefer):
        raise BadInput(f'parameter prefer must be some of the sources {names}, each once, '
                       f'not {prefer}')
    return prefer


main = main_of(NAME, _DESCRIPTION, _EXAMPLES, (SOURCES, *SETTINGS, *settings_of(['NAME'])),
               EdgeSwitch)


if __name__ == '__main__':
    sys.exit(main())
