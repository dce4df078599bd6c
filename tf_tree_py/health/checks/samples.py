# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the samples of an edge: their values, the order of their stamps, their arrivals."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.stamp import format_span, format_stamp, SILENCE
from tf_tree_py.core.text import listed

from .case import Case, Delays, timing_of
from .finding import check, of_edge, of_edges, of_trouble, Remark, Severity, times
from ..measures.edge_record import EdgeRecord
from ..measures.grouping import grouped


@check(Severity.ERROR,
       catches='NaN or infinity in a transform',
       cause='a division by zero, or a filter that has diverged, in the node that sends it',
       fix='fix the publisher; every buffer refuses such a transform, so the edge does not move')
def not_finite(case: Case) -> Iterator[Remark]:
    """Find transforms that the buffer refused because of NaN or infinity."""
    for edge, trouble in case.of_kind(Kind.NOT_FINITE):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} was NaN or infinite '
                         f'{times(trouble.count)}', trouble)


@check(Severity.WARNING,
       catches='quaternions whose length is not one',
       cause='averaging or integrating quaternions without normalising them; or Euler angles in '
             'the fields of a quaternion',
       fix='normalise before sending: each buffer does so too, but not every consumer')
def not_normalised(case: Case) -> Iterator[Remark]:
    """Find quaternions whose length is not one; the buffer refuses those of length zero."""
    for edge, moving in case.moving():
        motion = moving.motion
        if motion.off_length:
            yield of_edge(
                edge, f'has quaternions of length {motion.worst_length:.4g}, {motion.off_length} '
                f'of {moving.timing.count}',
                {'count': motion.off_length, 'samples': moving.timing.count,
                 'worst_length': motion.worst_length})
    for frames, trouble in case.of_kind(Kind.ZERO_ROTATION):
        yield of_trouble(
            frames, f'{frames[0]} -> {frames[1]} has an all-zero quaternion, and was refused '
            f'{times(trouble.count)}', trouble, evidence={'worst_length': 0.0},
            severity=Severity.ERROR, cause='a message whose rotation was not set',
            fix='for no rotation send x 0, y 0, z 0, w 1')


@check(Severity.ERROR,
       catches='messages that cannot be read, and invalid frame names',
       cause='a different message type on the topic, a damaged recording, or a name from '
             'uninitialised memory',
       fix='check the publisher that the evidence names, and the messages that it sends')
def unreadable(case: Case) -> Iterator[Remark]:
    """Find messages and names that the buffer refused."""
    for frames, trouble in case.of_kind(Kind.MALFORMED, Kind.BAD_NAME, Kind.TOO_MANY_FRAMES):
        yield of_trouble(tuple(filter(None, frames)),
                         f'refused {times(trouble.count)}: {trouble.detail}', trouble)


@check(Severity.ERROR,
       explains=('gap', 'irregular_rate'),
       catches='a stamp whose nanosec is a second or more',
       cause='a driver that computes nanosec wrongly: it subtracts below zero, or puts all '
             'microseconds since 1970 there; both wrap at 2^32',
       fix='fix the publisher: nanosec has the part below a second, from 0 to 999999999. A buffer '
           'of this package refuses such a transform; tf2 inserts it up to four seconds away')
def impossible_stamp(case: Case) -> Iterator[Remark]:
    """Find moving transforms that the buffer refused because of their nanosec."""
    for edge, trouble in case.of_kind(Kind.IMPOSSIBLE_STAMP):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} has an impossible stamp '
                         f'{times(trouble.count)}; the first: {trouble.detail}', trouble)


# --- the order of stamps

# Fewer cases than this are not reported.
_FEW = 3
_SELDOM = 0.01
# Of stamps that are late and rounded, up to a quarter are usually repeated; that does no harm.
_LOST = 0.4


@check(Severity.ERROR,
       catches='moving transforms whose stamp is zero',
       cause='a message whose header.stamp was not set, or a node with use_sim_time before the '
             'first /clock',
       fix='stamp it with the time of the data that it comes from')
def zero_stamps(case: Case) -> Iterator[Remark]:
    """Find moving edges with zero stamps; the stamps of static edges have no meaning."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.zeros:
            yield of_edge(edge, f'has {timing.zeros} of {timing.count} stamps that are zero',
                          {'count': timing.zeros, 'samples': timing.count})


@check(Severity.WARNING,
       explains=('gap', 'jump_back', 'out_of_order', 'delayed', 'skew'),
       catches='single samples with a stamp that is far older than those around it',
       cause='a message that was stamped before the clock of its computer was set, or with a '
             'variable that was not',
       fix='let its publisher stamp it with the time of the data: a buffer that has no newer data '
           'of the edge interpolates from that stamp on',
       recorded_fix='leave it out: open_bag lists it among its oddities, with the options that do '
                    'so. Lookups between it and the others are interpolated over that time')
def lone_stamp(case: Case) -> Iterator[Remark]:
    """Find edges with a few samples whose stamps are at least a minute too old."""
    for edge, moving in case.moving():
        if moving.first_lone is None:
            continue
        received, stamps = moving.first_lone.received, moving.first_lone.stamps
        behind = int(stamps[1] - stamps[0])
        yield of_edge(
            edge, f'has {moving.lone} of {moving.timing.count} samples with a stamp far older '
            f'than the others, first {format_stamp(int(stamps[0]))} s, received at '
            f'{format_stamp(int(received[0]))} s: {format_span(behind)} before the next stamp',
            {'count': moving.lone, 'samples': moving.timing.count, 'stamp_s': stamps[0] / 1e9,
             'received_s': received[0] / 1e9, 'behind_s': behind / 1e9})


@check(Severity.WARNING,
       catches='stamps that jump back and continue from there',
       cause='a recording that is played in a loop, a simulation that was restarted, or a clock '
             'that was set back',
       fix='publish /clock and set use_sim_time; or, if all edges jumped back, pass '
           'Buffer(clear_on_jump_back=...). With neither, all later data is refused as too old')
def jump_back(case: Case) -> Iterator[Remark]:
    """Find stamps that went back by more than a second and continued from there."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.jumps:
            yield of_edge(edge, f'jumped back {times(timing.jumps)}, by up to '
                          f'{format_span(timing.back)}',
                          {'count': timing.jumps, 'back_s': timing.back / 1e9})


@check(Severity.WARNING,
       catches='several transforms of one edge with the same stamp',
       cause='a node that publishes its last data at a fixed rate, with the stamp of the data; or '
             'a relay that forwards everything twice',
       fix='send each stamp once; a buffer uses the last of several')
def duplicate_stamps(case: Case) -> Iterator[Remark]:
    """Find edges with many repeated stamps."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.duplicates >= _FEW and timing.duplicates > _SELDOM * timing.count:
            yield of_edge(
                edge, f'repeats {timing.duplicates} of {timing.count} stamps, '
                f'{timing.differing} of them with another pose',
                {'count': timing.duplicates, 'differing': timing.differing,
                 'samples': timing.count},
                severity=None if timing.differing > _LOST * timing.count else Severity.NOTE)


@check(Severity.WARNING,
       explains=('irregular_rate',),
       catches='stamps that are older than the one before',
       cause='a node with several threads that publish, a relay over a network that reorders, or '
             'two publishers whose clocks differ',
       fix='publish one edge from one thread, in order: otherwise lookups of the latest transform '
           'may go back in time')
def out_of_order(case: Case) -> Iterator[Remark]:
    """Find edges with many stamps that are older than the one before."""
    for edge, moving in case.moving():
        timing = moving.timing
        if timing.disorders >= _FEW and timing.disorders > _SELDOM * timing.count:
            yield of_edge(edge, f'has {timing.disorders} of {timing.count} stamps that are older '
                          'than the one before',
                          {'count': timing.disorders, 'samples': timing.count})


# --- arrivals

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
_FEW_DELAYS, _SEVERAL = 3, 20
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
                edge, f'arrives {round(delays.late / 1e6)} ms after its stamp (95 of 100 are '
                f'earlier; usually {round(delays.usual / 1e6)} ms)',
                {'p50_delay_s': delays.usual / 1e9, 'p95_delay_s': delays.late / 1e9,
                 'count': timing_of(edge).delays.count})


def _late_edges(case: Case) -> Iterator[tuple[EdgeRecord, Delays]]:
    # If the clocks differ, the fit between them is too inaccurate for the late quantile, and few
    # samples cannot show a pause of a simulation.
    differs = case.timebase.differs
    for edge, delays in case.delays.items():
        if (timing_of(edge).delays.count >= (_SEVERAL if differs else _FEW_DELAYS)
                and (delays.usual if differs else delays.late) > case.limits.max_delay):
            yield edge, delays


def _backlog_of(case: Case, edge: EdgeRecord, delays: Delays) -> _Backlog | None:
    """Return the late samples of an edge if they arrived at once; None: they did not."""
    if delays.usual > case.limits.max_delay:
        return None
    received, delay = case.timebase.delays(timing_of(edge))
    late = delay > case.limits.max_delay
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
