# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The health of every edge on ``/diagnostics``, where robots report their faults."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.action.server import RCLError
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from tf_tree_py.beyond.sources.source_samples import EdgeSource
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.messages.incidents import Kind, REMARKS
from tf_tree_py.core.stamp import as_seconds, DEAD_SILENCE, format_span, format_stamp
from tf_tree_py.core.text import listed
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.health.checks.pieces import are_robots, pieces_of
from tf_tree_py.health.checks.structure import late_joiner, qos_mismatch, two_parents
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.edge_record import Edge, Symptoms
from tf_tree_py.health.measures.sample_rows import RecentSamples
from tf_tree_py.reports.switch_status import as_values, DIAGNOSTICS_TOPIC

from .buffer.buffer import Buffer
from .buffer.interface import check_is_ours, check_places
from .messages.convert import as_nanoseconds
from .threads.internal_node import is_running
from .topics.endpoints import endpoints_of
from .topics.qos import TF_STATIC_TOPIC, TF_TOPIC

_SECOND = Duration(seconds=1.0)
# How long the tree may be in pieces while nodes start, nanoseconds.
_PATIENCE = DEAD_SILENCE
# The checks of publishers that the ROS graph shows, as long as those exist.
_OF_PUBLISHERS = (late_joiner, qos_mismatch)

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE)


class TransformDiagnostics(Closable):
    """
    A publisher of the health of a buffer's edges, until ``close()``; it is a context manager.

    It has its own doctor, which records the symptoms of each edge. ``tf_doctor`` judges the whole
    record; here a level describes the present, and lasts as long as the fault.

    There is one status for the whole buffer and one for each edge: the rate and the delay of its
    transforms, how far their stamps are ahead of the clock, the last publisher, and the refused
    transforms. An edge is

    - ERROR when all transforms that arrived were refused, or while two publishers send it,
    - STALE when its next sample is overdue, by the rule of ``core.stamp``,
    - WARN when some were refused or odd, when stamps differ from the clock by more than
      ``max_delay``, behind or ahead, or while one of its sources, which another replaced, has
      not come back.

    The whole buffer is ERROR while the tree is in pieces (but not in its first seconds), while a
    frame alternates between parents, or while a publisher exists whose quality of service matches
    no listener of tf2.

    While it is open, a message costs some additional microseconds for each of its transforms.
    """

    def __init__(self, buffer: Buffer, node: Node, period: Duration = _SECOND,
                 max_delay: Duration = _SECOND) -> None:
        """
        Begin to publish.

        :param buffer: the buffer to report on.
        :param node: its executor publishes, by wall time.
        :param period: the time between two messages.
        :param max_delay: the largest mean delay of transforms, and how far stamps may be ahead of
            the clock; more than that is a warning.
        :raises TypeError: a buffer of another library, such as tf2's.
        """
        check_is_ours(buffer, Buffer, 'TransformDiagnostics')
        check_places('TransformDiagnostics(buffer, node)', node=node)
        buffer.check_receives('TransformDiagnostics(buffer, node)')
        self._buffer = buffer
        self._node = node
        self._period = as_nanoseconds(period)
        self._max_delay = as_nanoseconds(max_delay)
        self._doctor = Doctor()
        self._before = buffer.statistics()
        self._topics = {node.resolve_topic_name(topic): static for topic, static in (
            (TF_TOPIC, False), (TF_STATIC_TOPIC, True))}
        # Since when the tree has been in pieces; None: it is not.
        self._apart: int | None = None
        # For each edge with two publishers, the publishers at the time of the finding.
        self._contested: dict[Edge, Counter[str]] = {}
        # The evidence of frames with several parents at the last report.
        self._fights: dict[tuple[str, ...], Mapping[str, float]] = {}
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS_TOPIC, 10)
        self._timer = node.create_timer(
            as_seconds(self._period), self._publish, MutuallyExclusiveCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME))
        buffer.observers.add(self._doctor)

    def close(self) -> None:
        """Stop publishing; calling it again is harmless."""
        self._buffer.observers.remove(self._doctor)
        self._node.destroy_timer(self._timer)
        self._node.destroy_publisher(self._publisher)

    def report(self) -> DiagnosticArray:
        """Return the present health, and counts since the last report."""
        now = self._buffer.now()
        self._doctor.endpoints = endpoints_of(self._node, self._topics)
        recent = self._doctor.pop_recent()
        signs = {(one.parent, one.child): one for one in self._doctor.signs(now)}
        infos = {(info.parent, info.child): info for info in self._buffer.edges()}
        self._note_contested(recent)
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        broken = [*self._pieces(infos, now), *self._unheard(now), *self._going_on_fights(now)]
        message.status = [self._of_buffer(broken), *(
            self._status(edge, self._of_edge(
                info, signs.get(edge), recent.get(edge, RecentSamples())))
            for edge, info in infos.items())]
        message.status += [
            self._status(edge, _of_absent(arrivals)) for edge, arrivals in recent.items()
            if edge not in infos and all(edge) and arrivals.incidents]
        return message

    def _publish(self) -> None:
        try:
            self._publisher.publish(self.report())
        except InvalidHandle:
            pass  # it was closed while the executor ran this
        except RCLError:
            # Or the context ended.
            if is_running(self._node.context):
                raise

    def _status(self, edge: Edge | None, health: '_Health') -> DiagnosticStatus:
        title = f' {edge[0]} -> {edge[1]}' if edge else ''
        return DiagnosticStatus(
            level=health.level, name=f'{self._node.get_name()}: tf{title}', message=health.message,
            hardware_id=self._node.get_fully_qualified_name(),
            values=[KeyValue(key=key, value=value) for key, value in health.values.items()])

    def _note_contested(self, recent: Mapping[Edge, RecentSamples]) -> None:
        """Update which edges two publishers send; such an edge stays until a publisher leaves."""
        senders = Counter(one.node for one in self._doctor.endpoints if one.publishes)
        self._contested = {edge: then for edge, then in self._contested.items() if then <= senders}
        for edge, arrivals in recent.items():
            if arrivals.incidents[Kind.TWO_PUBLISHERS]:
                self._contested[edge] = senders

    def _unheard(self, now: int) -> list[str]:
        """Return which publishers no listener receives, and why."""
        return [found.summary for found in self._doctor.findings(now, _OF_PUBLISHERS)]

    def _going_on_fights(self, now: int) -> list[str]:
        """Return which frames have alternated between parents since the last report."""
        found = {one.frames: one for one in self._doctor.findings(now, (two_parents,))}
        before, self._fights = self._fights, {
            frames: one.evidence for frames, one in found.items()}
        return [one.summary for frames, one in found.items() if before.get(frames) != one.evidence]

    def _pieces(self, edges: Collection[Edge], now: int) -> list[str]:
        """Return that the tree is in pieces, if it is for longer than nodes take to start."""
        pieces = pieces_of(edges)
        if len(pieces) < 2 or are_robots(pieces):
            self._apart = None
            return []
        self._apart = now if self._apart is None else min(self._apart, now)
        children = {child for _, child in edges}
        roots = dict.fromkeys(parent for parent, _ in edges if parent not in children)
        return [f'in {len(pieces)} pieces, below {listed([*roots])}'
                ] if now - self._apart > _PATIENCE else []

    def _of_buffer(self, broken: Sequence[str]) -> DiagnosticStatus:
        now, before = self._buffer.statistics(), self._before
        self._before = now
        accepted, refused = now.accepted - before.accepted, now.refused - before.refused
        odd = {kind: count for kind, count in now.incidents.items()
               if count > before.incidents[kind]}
        return self._status(None, _Health(
            ERROR if broken else WARN if odd else OK,
            '; '.join([f'{now.frames} frames, {accepted} transforms taken' + (
                f', {refused} refused' if refused else '') + _because(odd), *broken]),
            {'Frames': str(now.frames), 'Taken': str(accepted), 'Refused': str(refused),
             'Taken, in all': str(now.accepted), 'Refused, in all': str(now.refused),
             **{f'{_verb(kind)}, in all: {kind.value}': str(count)
                for kind, count in now.incidents.items() if count}}))

    def _of_edge(self, info: EdgeInfo, sign: Symptoms | None,
                 arrivals: RecentSamples) -> '_Health':
        sources = self._buffer.sources_of(info.child)
        values = _values_of_edge(info, sources, arrivals)
        if info.static:
            return _Health(WARN if arrivals.incidents else OK,
                           f'static, from {info.authority}' + _because(arrivals.incidents), values)
        refused = arrivals.refused
        if refused and refused >= arrivals.count:
            return _Health(ERROR, f'all {refused} refused' + _because(arrivals.incidents), values)
        if sign is not None and sign.stale:
            return _Health(STALE, f'silent for {format_span(sign.silence or 0)}; the last sample '
                           f'came from {info.authority}', values)
        wrong = [*self._wrong(arrivals), *_made_way(sources)]
        level = WARN if wrong else OK
        if (info.parent, info.child) in self._contested:
            level = ERROR
            wrong.append('two publishers send it')
        return _Health(level, '; '.join([
            f'{values["Rate (Hz)"]} Hz, from {info.authority}', *wrong]), values)

    def _wrong(self, arrivals: RecentSamples) -> list[str]:
        """Return the reasons for a warning."""
        wrong = []
        if arrivals.refused:
            wrong.append(f'{arrivals.refused} of {arrivals.count} refused'
                         + _because(arrivals.incidents))
        elif odd := arrivals.incidents.keys() - {Kind.TWO_PUBLISHERS}:
            wrong.append('odd' + _because(odd))
        if arrivals.mean_delay > self._max_delay:
            wrong.append(f'{format_span(round(arrivals.mean_delay))} late')
        if arrivals.ahead > self._max_delay:
            wrong.append(f'stamps are {format_span(round(arrivals.ahead))} ahead of the clock')
        return wrong


class _Health(NamedTuple):
    """A status without its name."""

    level: bytes
    message: str
    values: dict[str, str]


def _values_of_edge(info: EdgeInfo, sources: Iterable[EdgeSource], arrivals: RecentSamples
                    ) -> dict[str, str]:
    values = {'Authority': info.authority, 'Samples': str(info.samples), **as_values(sources)}
    if info.static:
        return values | _counts(arrivals)
    values |= {
        'Rate (Hz)': f'{info.rate_hz:.3f}',
        'Newest stamp (s)': format_stamp(info.latest),
        'Arrived': str(arrivals.count),
        **_counts(arrivals),
    }
    if arrivals.timed:
        values |= {
            'Delay, mean (s)': f'{arrivals.mean_delay / 1e9:.6f}',
            'Delay, worst (s)': f'{arrivals.longest_delay / 1e9:.6f}',
            'Skew (s)': f'{arrivals.ahead / 1e9:.6f}',
        }
    return values


def _of_absent(arrivals: RecentSamples) -> _Health:
    """Return the health of an edge that is not in the tree, or is no longer."""
    values = {'Arrived': str(arrivals.count), **_counts(arrivals)}
    if not arrivals.refused:
        return _Health(WARN, 'not in the tree any more' + _because(arrivals.incidents), values)
    return _Health(ERROR, f'not in the tree: {arrivals.refused} refused'
                   + _because(arrivals.incidents), values)


def _counts(arrivals: RecentSamples) -> dict[str, str]:
    return {f'{_verb(kind)}: {kind.value}': str(count)
            for kind, count in arrivals.incidents.items()}


def _made_way(sources: Iterable[EdgeSource]) -> list[str]:
    return [f'{source.name!r} was replaced ({source.made_way.kind.value})'
            for source in sources if source.made_way]


def _verb(kind: Kind) -> str:
    return 'Odd' if kind in REMARKS else 'Refused'


def _because(kinds: Iterable[Kind]) -> str:
    names = ', '.join(sorted(kind.value for kind in kinds))
    return f' ({names})' if names else ''
