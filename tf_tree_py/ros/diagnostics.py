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

"""The health of every edge on ``/diagnostics``, where robots look for what is wrong with them."""

from collections.abc import Iterable
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.action.server import RCLError
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from tf_tree_py.core.arrivals.incidents import Kind, REMARKS
from tf_tree_py.core.arrivals.meters import Arrivals, Meter
from tf_tree_py.core.stamp import as_seconds, format_span, format_stamp
from tf_tree_py.core.telling.diagnosis import diagnose, EdgeDiagnosis
from tf_tree_py.core.telling.made_way import as_values, DIAGNOSTICS_TOPIC
from tf_tree_py.core.tree.sources import Source

from .buffer.buffer import Buffer
from .buffer.wrong_arguments import check_is_ours, check_places
from .messages.convert import as_nanoseconds

_SECOND = Duration(seconds=1.0)
# An edge that is silent for so many of its usual intervals is stale.
_MISSED = 3

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.STALE)


class TransformDiagnostics:
    """
    Publishes how the edges of a buffer are, until ``close()``; it is a context manager.

    One status for the whole buffer and one for each edge: how often and how late its
    transforms come, how far their stamps are ahead of the clock, who sent the last one,
    what was refused. An edge is

    - ERROR when all that came was refused,
    - STALE when it has been silent for three of its usual intervals,
    - WARN when some was refused or odd, when stamps are off the clock by more than
      ``max_delay``, behind or ahead, or as long as one of its sources, which made way to
      another, has not come back.

    While it is open an insertion costs about a microsecond more for each transform.
    """

    def __init__(self, buffer: Buffer, node: Node, period: Duration = _SECOND,
                 max_delay: Duration = _SECOND) -> None:
        """
        Begin to publish.

        :param buffer: whose edges.
        :param node: whose executor publishes, by the wall's time.
        :param period: how often.
        :param max_delay: how late a transform may be, in the mean, and how far ahead of
            the clock; what is further off is a warning.
        :raises TypeError: another buffer than ours, such as tf2's.
        """
        check_is_ours(buffer, Buffer, 'TransformDiagnostics')
        check_places('TransformDiagnostics(buffer, node)', node=node)
        self._buffer = buffer
        self._node = node
        self._period = as_nanoseconds(period)
        self._max_delay = as_nanoseconds(max_delay)
        self._meter = Meter(buffer.now)
        self._heard: dict[tuple[str, str], int] = {}
        self._before = buffer.statistics()
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS_TOPIC, 10)
        self._timer = node.create_timer(
            as_seconds(self._period), self._publish, MutuallyExclusiveCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME))
        buffer.observers.add(self._meter)

    def close(self) -> None:
        """Stop publishing; calling it again is harmless."""
        self._buffer.observers.remove(self._meter)
        self._node.destroy_timer(self._timer)
        self._node.destroy_publisher(self._publisher)

    def __enter__(self) -> 'TransformDiagnostics':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def report(self) -> DiagnosticArray:
        """Return how things are, and what has come since the last report."""
        arrived = self._meter.take()
        found = diagnose(self._buffer, arrived)
        now = self._buffer.now()
        heard = {names: now if names in arrived else min(now, self._heard.get(names, now))
                 for names in map(_names, found.edges)}
        self._heard = heard
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.status = [self._of_buffer(), *(
            self._status(_title(edge), self._of_edge(edge, now - heard[_names(edge)]))
            for edge in found.edges)]
        message.status += [
            self._status(_title(edge), _of_absent(edge.arrivals))
            for edge in found.absent if all(_names(edge)) and edge.arrivals.incidents]
        return message

    def _publish(self) -> None:
        try:
            self._publisher.publish(self.report())
        except InvalidHandle:
            pass  # somebody closed it while the executor was just here
        except RCLError:
            # Or the context ended.
            if self._node.context.ok():
                raise

    def _status(self, name: str, health: '_Health') -> DiagnosticStatus:
        return DiagnosticStatus(
            level=health.level, name=f'{self._node.get_name()}: tf{name}', message=health.message,
            hardware_id=self._node.get_fully_qualified_name(),
            values=[KeyValue(key=key, value=value) for key, value in health.values.items()])

    def _of_buffer(self) -> DiagnosticStatus:
        now, before = self._buffer.statistics(), self._before
        self._before = now
        accepted, refused = now.accepted - before.accepted, now.refused - before.refused
        odd = {kind: count for kind, count in now.incidents.items()
               if count > before.incidents[kind]}
        return self._status('', _Health(
            WARN if odd else OK,
            f'{now.frames} frames, {accepted} transforms taken' + (
                f', {refused} refused' if refused else '') + _because(odd),
            {'Frames': str(now.frames), 'Taken': str(accepted), 'Refused': str(refused),
             'Taken, in all': str(now.accepted), 'Refused, in all': str(now.refused),
             **{f'{_verb(kind)}, in all: {kind.value}': str(count)
                for kind, count in now.incidents.items() if count}}))

    def _of_edge(self, edge: EdgeDiagnosis, silent: int) -> '_Health':
        info, arrivals = edge.info, edge.arrivals
        sources = self._buffer.sources_of(info.child)
        values = {'Authority': info.authority, 'Samples': str(info.samples), **as_values(sources)}
        if info.static:
            values |= _counts(arrivals)
            return _Health(WARN if arrivals.incidents else OK,
                           f'static, from {info.authority}' + _because(arrivals.incidents), values)
        values |= {
            'Rate (Hz)': f'{edge.rate_hz:.3f}',
            'Newest stamp (s)': format_stamp(info.latest),
            'Arrived': str(arrivals.count),
            **_counts(arrivals),
        }
        if arrivals.timed:
            values |= {
                'Delay, mean (s)': f'{arrivals.mean_delay / 1e9:.6f}',
                'Delay, worst (s)': f'{arrivals.longest_delay / 1e9:.6f}',
                'Skew (s)': f'{edge.ahead / 1e9:.6f}',
            }
        refused = arrivals.refused
        if refused and refused >= arrivals.count:
            return _Health(ERROR, f'all {refused} refused' + _because(arrivals.incidents), values)
        if silent > max(self._period, _MISSED * edge.interval):
            return _Health(STALE, f'silent for {format_span(silent)}; the last one came from '
                           f'{info.authority}', values)
        wrong = [*self._wrong(arrivals, edge.ahead), *_made_way(sources)]
        return _Health(WARN if wrong else OK, '; '.join([
            f'{values["Rate (Hz)"]} Hz, from {info.authority}', *wrong]), values)

    def _wrong(self, arrivals: Arrivals, ahead: int) -> list[str]:
        """Return what to warn of."""
        wrong = []
        if arrivals.refused:
            wrong.append(f'{arrivals.refused} of {arrivals.count} refused'
                         + _because(arrivals.incidents))
        elif arrivals.incidents:
            wrong.append('odd' + _because(arrivals.incidents))
        if arrivals.mean_delay > self._max_delay:
            wrong.append(f'{format_span(round(arrivals.mean_delay))} late')
        if ahead > self._max_delay:
            wrong.append(f'stamps are {format_span(ahead)} ahead of the clock')
        return wrong


class _Health(NamedTuple):
    """A status without its name."""

    level: bytes
    message: str
    values: dict[str, str]


def _names(edge: EdgeDiagnosis) -> tuple[str, str]:
    return edge.info.parent, edge.info.child


def _title(edge: EdgeDiagnosis) -> str:
    return f' {edge.info.parent} -> {edge.info.child}'


def _of_absent(arrivals: Arrivals) -> _Health:
    """Return the health of an edge that is not in the tree, or is no longer."""
    values = {'Arrived': str(arrivals.count), **_counts(arrivals)}
    if not arrivals.refused:
        return _Health(WARN, 'not in the tree any more' + _because(arrivals.incidents), values)
    return _Health(ERROR, f'not in the tree: {arrivals.refused} refused'
                   + _because(arrivals.incidents), values)


def _counts(arrivals: Arrivals) -> dict[str, str]:
    return {f'{_verb(kind)}: {kind.value}': str(count)
            for kind, count in arrivals.incidents.items()}


def _made_way(sources: Iterable[Source]) -> list[str]:
    return [f'{source.name!r} made way ({source.made_way.kind.value})'
            for source in sources if source.made_way]


def _verb(kind: Kind) -> str:
    return 'Odd' if kind in REMARKS else 'Refused'


def _because(kinds: Iterable[Kind]) -> str:
    names = ', '.join(sorted(kind.value for kind in kinds))
    return f' ({names})' if names else ''
