# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the arrivals: the clock that they are compared with, and how late they are."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tf_tree_py.core.stamp import format_span, format_stamp, SILENCE
from tf_tree_py.core.text import listed

from .case import Case, Delays, timing_of
from .check import check, of_edge, of_edges, Remark
from .finding import Severity
from ..measures.edge_record import EdgeRecord
from ..measures.grouping import grouped


@check(Severity.WARNING,
       explains=('jump_back', 'out_of_order', 'irregular_rate', 'interpolated_jump', 'pose_jump',
                 'outlier', 'skew'),
       catches='a clock of the receiving computer that was set while it received',
       cause='NTP or chrony set the clock of the computer that recorded or listened in one step',
       fix='set the clock before the nodes start, and let chrony slew it afterwards (makestep '
           'only at boot). The stamps are good, only the receive times are not',
       recorded_fix='nothing to do here, if you go by the stamps: only the receive times are '
                    'wrong, and the order of the messages where they overlap. Before the next '
                    'recording, set the clock, and let chrony slew it afterwards')
def recorder_clock(case: Case) -> Iterator[Remark]:
    """Find a step of all receive times that the stamps did not make."""
    step = case.arrival_step
    if step is not None:
        edges = [edge for edge, _ in case.moving()]
        certain = step.step < 0 or step.corrects
        jump = (f'{"forward" if step.step > 0 else "back"} by {format_span(abs(step.step))} at '
                f'{format_stamp(step.received)} s')
        those = 'that edge' if len(edges) == 1 else f'all {len(edges)} edges that move'
        yield of_edges(
            edges, f'the clock of the {"recorder" if case.recorded else "receiving computer"} was '
            f'set {jump}: the receive times of {those} jump by as much, and their stamps do not'
            if certain else
            f'the receive times of {those} jump {jump}, and their stamps do not',
            {'edges': len(edges), 'step_s': step.step / 1e9, 'received_s': step.received / 1e9},
            cause='' if certain else
            'NTP or chrony set the clock of the computer that recorded or listened in one step; '
            'or all messages took longer by as much from then on, such as on another network')


# With fewer samples than this, a delay is not judged; with fewer than the second, a fit of the
# clocks is a guess.
_FEW, _SEVERAL = 3, 20
# What was kept back arrives within this part of its longest delay.
_AT_ONCE = 0.5


class _Backlog(NamedTuple):
    """
    Late samples of one edge that arrived at once, nanoseconds by the clock of the arrivals.

    :ivar begin: when the first of them arrived.
    :ivar end: when the last of them arrived.
    :ivar longest: the longest of their delays.
    """

    edge: EdgeRecord
    begin: float
    end: float
    longest: float


@check(Severity.WARNING, textbook=True,
       explains=('skew',),
       catches='transforms that arrive long after their stamp',
       cause='a slow node, a queue that is always full, a busy computer or network; or the clock '
             'of its computer is behind',
       fix='find the cause of the delay; until then a lookup for the stamp of data needs a longer '
           'timeout than this',
       recorded_fix='find the cause of the delay before the next recording. In this one the late '
                    'samples are there too: only lookups at its end fail, and stamps_at_rate '
                    'returns stamps for which all edges have data. If the clock was behind, shift '
                    'the stamps of this edge')
def delayed(case: Case) -> Iterator[Remark]:
    """Find edges of which 5 % of the samples arrive later than the limit."""
    late = list(_late_edges(case))
    backlogs = [found for edge, delays in late
                if (found := _backlog_of(case, edge, delays)) is not None]
    for group in grouped(sorted(backlogs, key=lambda each: each.begin), _arrived_with):
        yield _kept_back(group)
    for edge, delays in late:
        if not any(edge is backlog.edge for backlog in backlogs):
            yield of_edge(
                edge, f'arrives {delays.late / 1e6:.0f} ms after its stamp (95 of 100 are '
                f'earlier; usually {delays.usual / 1e6:.0f} ms)',
                {'p50_delay_s': delays.usual / 1e9, 'p95_delay_s': delays.late / 1e9,
                 'count': timing_of(edge).delays.count})


def _late_edges(case: Case) -> Iterator[tuple[EdgeRecord, Delays]]:
    # If the clocks differ, the fit between them is too inaccurate for the late quantile, and few
    # samples cannot show a pause of a simulation.
    differs = case.timebase.differs
    for edge, delays in case.delays.items():
        if (timing_of(edge).delays.count >= (_SEVERAL if differs else _FEW)
                and (delays.usual if differs else delays.late) > case.limits.max_delay):
            yield edge, delays


def _backlog_of(case: Case, edge: EdgeRecord, delays: Delays) -> _Backlog | None:
    """Return the late samples of an edge if they arrived at once; None: they did not."""
    if delays.usual > case.limits.max_delay:
        return None
    received, delay = case.timebase.delays(timing_of(edge))
    late = delay > case.limits.max_delay
    if not late.any():
        return None
    begin, end, longest = received[late].min(), received[late].max(), delay[late].max()
    if end - begin > _AT_ONCE * longest:
        return None
    return _Backlog(edge, float(begin), float(end), float(longest))


def _arrived_with(group: Sequence[_Backlog], backlog: _Backlog) -> bool:
    """Return whether a backlog arrived together with others, which began before it."""
    return backlog.begin <= max(each.end for each in group) + SILENCE


def _kept_back(group: Sequence[_Backlog]) -> Remark:
    edges = [backlog.edge for backlog in group]
    longest = max(backlog.longest for backlog in group)
    return of_edges(
        edges, f'{listed([str(edge) for edge in edges])}: samples up to '
        f'{format_span(round(longest))} old arrived together, at '
        f'{format_stamp(round(group[0].begin))} s; the others arrive in time',
        {'edges': len(edges), 'longest_s': longest / 1e9, 'received_s': group[0].begin / 1e9},
        cause='the network, or a computer or a queue on the way, held them back and then '
              'delivered all at once' + (
                  '' if len(edges) == 1 else ': what these edges have in common'))
