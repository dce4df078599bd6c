# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the rates of edges, and of their age when they are used."""

from collections.abc import Iterator, Mapping, Sequence
import math

import numpy as np
from tf_tree_py.core.stamp import (
    DEAD_SILENCE,
    format_span,
    format_stamp,
    from_seconds,
    is_dead,
    is_silent,
    mean_interval,
    MISSED,
    SILENCE,
    silence_allowed,
)

from .case import Case, is_frozen, timing_of
from .finding import check, of_edge, of_edges, Remark, Severity, times
from ..measures.edge_record import EdgeRecord, is_stale, MovingEdge, silence_of
from ..measures.spread import median, quantiles
from ..measures.timing import Timing

# How old an edge's newest sample may be, nanoseconds, and the edge.
_Aged = tuple[float, EdgeRecord]

# With fewer intervals than this, regularity is not judged.
_SEVERAL = 20
# With fewer samples than this, nobody knows that the next one is overdue.
_FEW = 8
# What was silent for nearly as long before, continued then.
_NO_LONGER = 1.2
# That many edges of one frame do not end alone, one after another, unless they show objects.
_SEVERAL_LEFT = 2
# The nodes of a robot that is stopped end this long after each other.
_SHORT = from_seconds(0.2)
# The rate is measured in parts of this many samples; it changed if it differs by this factor, and
# by as much as this part of the factor between the intervals.
_PART, _CHANGED, _AS_MUCH = 8, 2.0, 0.6
# A computer is not silent for longer than this: a month.
_LONG = from_seconds(30 * 86_400.0)
# Of a gap in the stamps, at least this part is without messages.
_SILENT_PART = 0.5
# The middle 80 % of a regular edge's intervals span less than this part of the usual or the mean
# interval, whichever is shorter.
_JITTER = 1.2
# An excess of this, divided by the root of the number of intervals, may be chance.
_CHANCE = 2.5


@check(Severity.WARNING,
       explains=('interpolated_jump', 'irregular_rate', 'skew'),
       catches='an edge that was silent for long and then continued',
       cause='its node hung, crashed or was restarted, the network broke, or what it measures was '
             'out of view',
       fix='check the log of its publisher at that time: lookups in the gap are interpolated '
           'across it')
def gap(case: Case) -> Iterator[Remark]:
    """Find the longest gap of each edge, if it is too long for the edge's rate."""
    silent = [(edge, moving) for edge, moving in case.moving()
              if _is_gap(case, moving)
              # Its messages went on, with a stamp that was frozen.
              and not (is_frozen(moving) and moving.timing.longest == moving.timing.frozen.stamp)]
    at_once = _at_once(case, silent)
    if at_once and len(silent) > 1:
        yield _of_all([edge for edge, _ in silent], silent[0][1].timing, _may_pause(case))
        return
    for edge, moving in silent:
        timing = moving.timing
        end = timing.longest + timing.intervals.most
        yield of_edge(
            edge, f'was silent for {format_span(round(timing.intervals.most))} after '
            f'{format_stamp(timing.longest)} s; usually it comes every '
            f'{format_span(round(timing.interval))}',
            {'longest_s': timing.intervals.most / 1e9, 'usual_s': timing.interval / 1e9,
             'after_stamp_s': timing.longest / 1e9},
            **(_PAUSED if at_once and _may_pause(case)
               else _out_of_view(case, edge, 1, timing.longest, end)))
    for edge, moving in case.moving():
        if moving.timing.is_coarse and not any(edge is other for other, _ in silent):
            yield from _by_arrival(edge, moving.timing)


def _by_arrival(edge: EdgeRecord, timing: Timing) -> Iterator[Remark]:
    """Find the gap of an edge whose stamps are too coarse to show it."""
    longest, usual = timing.waits.most, timing.waits.median
    if timing.waits.count >= _FEW and is_silent(longest, usual):
        yield of_edge(
            edge, f'was silent for {format_span(round(longest))} after it arrived at '
            f'{format_stamp(timing.longest_wait)} s; usually it arrives every '
            f'{format_span(round(usual))}', {'longest_s': longest / 1e9, 'usual_s': usual / 1e9})


def _is_gap(case: Case, moving: MovingEdge) -> bool:
    timing = moving.timing
    usual = timing.interval
    if timing.intervals.count >= _FEW:
        # Late stamps make single intervals longer; but of a few intervals, one may be the gap.
        usual = max(usual, *timing.intervals.at(0.75))
    # Where the clock of the arrivals was set back, stamps alternate by as much.
    of_clock = case.arrival_step is not None and abs(
        timing.intervals.most + case.arrival_step.step) < MISSED * usual
    # Its messages went on: only the stamps have a gap.
    went_on = (not case.timebase.differs and timing.waits.count >= _FEW
               and timing.waits.most < _SILENT_PART * timing.intervals.most)
    return is_silent(timing.intervals.most, usual) and not of_clock and not went_on


# The other edges are too slow to show whether they were silent, too.
_PAUSED = {
    'severity': Severity.NOTE,
    'cause': 'its node hung, crashed or was restarted; or the recording or the simulation was '
             'paused, because the other edges did not come either',
    'fix': 'check the log of its publisher at that time, if nothing was paused: lookups in the '
           'gap are interpolated across it'}


def _may_pause(case: Case) -> bool:
    """Return whether a pause of everything is ordinary: in simulations and recordings."""
    return case.timebase.differs or case.recorded


def _out_of_view(case: Case, edge: EdgeRecord, column: int, begin: float,
                 end: float) -> dict[str, object]:
    """
    Return what differs if only this edge's tag was out of view, from one time to another.

    :param column: of the times: 0 arrivals, 1 stamps.
    """
    others = [other for other in case.still_seen(edge) if np.any(
        (begin < timing_of(other).pairs.kept[:, column])
        & (timing_of(other).pairs.kept[:, column] < end))]
    if not others:
        return {}
    return {'severity': Severity.NOTE,
            'cause': f'{edge.child} was out of view: its publisher went on with {others[0]}'
                     + (f' and {len(others) - 1} more' if len(others) > 1 else ''),
            'fix': 'nothing to do, if it can leave the view; lookups of it have to expect that'}


def _at_once(case: Case, silent: Sequence[tuple[EdgeRecord, MovingEdge]]) -> bool:
    """Return whether all edges were silent at the same time, and there are several."""
    if not silent or len([*case.moving()]) == 1:
        return False
    begins = [_on_arrival(case, edge, moving.timing.longest) for edge, moving in silent]
    usual = max(moving.timing.interval for _, moving in silent)
    end = min(begin + moving.timing.intervals.most for begin, (_, moving) in zip(
        begins, silent, strict=True))
    those = {edge.frames for edge, _ in silent}
    # Stamps that are rounded, and messages that come in bursts, are some intervals old.
    near = min(2.0 * usual, (end - max(begins)) / 3.0)
    return max(begins) - min(begins) <= max(SILENCE, 2.0 * usual) and not any(
        _came(case, edge, moving, max(begins) + near, end - near) for edge, moving in case.moving()
        if edge.frames not in those)


def _came(case: Case, edge: EdgeRecord, moving: MovingEdge, begin: float, end: float) -> bool:
    """Return whether an edge had samples between two times of arrival."""
    received, stamps = moving.timing.pairs.kept.T
    came = [_on_arrival(case, edge, stamp) for stamp in stamps] if case.timebase.differs else (
        received)
    return any(begin < time < end for time in came)


def _on_arrival(case: Case, edge: EdgeRecord, stamp: float) -> float:
    """Return when a stamp usually arrives: an edge may be post-dated, or late."""
    delays = case.delays.get(edge)
    return stamp + delays.usual if delays else stamp


def _of_all(edges: Sequence[EdgeRecord], timing: Timing, may_pause: bool) -> Remark:
    return of_edges(
        edges, f'all {len(edges)} edges that move were silent at once, {edges[0]} for '
        f'{format_span(round(timing.intervals.most))} after {format_stamp(timing.longest)} s',
        {'edges': len(edges), 'longest_s': timing.intervals.most / 1e9,
         'usual_s': timing.interval / 1e9, 'after_stamp_s': timing.longest / 1e9},
        severity=Severity.NOTE if may_pause else None,
        cause='the clock of the computer was set, from its start (often 1970) to the present'
        if timing.intervals.most > _LONG else
        'the recording or the simulation was paused, what sends all of them or its network '
        'stopped, the computer was suspended, or its clock was set forward',
        fix='if other topics went on at that time, find out what stopped the senders of these '
            'edges; lookups in the gap are interpolated across it')


@check(Severity.WARNING,
       catches='an edge that is silent: its next sample is overdue',
       cause='its node hangs, has crashed or was stopped, or the network is broken',
       fix='check the log of its publisher: lookups for a later time fail')
def stale(case: Case) -> Iterator[Remark]:
    """Find silent edges; one that has been silent for long is an error."""
    stopped, ended = _stopped(case), _ended(case)
    for edge, moving in case.moving():
        timing = moving.timing
        silence = silence_of(edge, case.now, case.timebase)
        if not is_stale(edge, case.now, case.timebase):
            continue
        usual = f'it came every {format_span(round(timing.interval))}' if timing.interval else (
            f'it came {times(timing.count)}')
        # Stamps of whole seconds arrive more often than they change.
        interval = min(timing.interval, mean_interval(timing.span, timing.count))
        if _is_irregular(moving):
            interval = max(interval, *timing.intervals.at(0.9))
        dead = (timing.count >= _FEW and is_dead(silence, interval)
                and silence > _NO_LONGER * timing.intervals.most)
        unseen = _out_of_view(
            case, edge, 0, timing.last + silence_allowed(timing.interval), math.inf)
        if timing.count == 1 and silence > case.limits.cache_time and not case.still_seen(edge):
            continue  # slow_for_window reports it, with the same condition
        yield of_edge(
            edge, f'has been silent for {format_span(round(silence))}; {usual}',
            {'silent_s': silence / 1e9, 'usual_s': timing.interval / 1e9, 'samples': timing.count},
            **{'severity': Severity.ERROR if dead else None, **(
                unseen or (_STOPPED if stopped and not dead else {})
                or (_LEFT if _may_have_left(case, edge, ended) else {}))})


_STOPPED = {
    'severity': Severity.NOTE,
    'cause': 'the robot was stopped before the recorder: its nodes ended one after another',
    'fix': 'nothing to do, if it was stopped then; if not, check the log of the node that ended '
           'first'}
_LEFT = {
    'severity': Severity.WARNING,
    'cause': 'what it shows, such as a tag, a person or an object, left the view of its sensor; '
             'or its node hangs, has crashed or was stopped, or the network is broken',
    'fix': 'if it should still be there, check the log of its publisher: lookups for a later '
           'time fail'}


def _ended(case: Case) -> dict[str, list[EdgeRecord]]:
    """Return the silent edges without children, by parent."""
    found: dict[str, list[EdgeRecord]] = {}
    for edge, _ in case.moving():
        if case.has_no_children(edge) and is_stale(edge, case.now, case.timebase):
            found.setdefault(edge.parent, []).append(edge)
    return found


def _may_have_left(case: Case, edge: EdgeRecord, ended: Mapping[str, list[EdgeRecord]]) -> bool:
    """Return whether an edge may show a tag or an object that left while its node went on."""
    beside, timing = ended.get(edge.parent, []), timing_of(edge)
    together = [other for other in beside if abs(timing_of(other).last - timing.last)
                < silence_allowed(timing.interval)]
    # On a robot, a sensor sees it; or several left one after another, such as on a belt.
    seen = case.is_sighting(edge) and not case.is_fixed(edge.parent)
    return together == [edge] and (seen or len(beside) > _SEVERAL_LEFT)


def _stopped(case: Case) -> bool:
    """Return whether edges ended one after another shortly before the end of a recording."""
    silences = [(silence_of(edge, case.now, case.timebase), moving.timing.interval)
                for edge, moving in case.moving()]
    ended = [silence for silence, interval in silences
             if _SHORT + MISSED * interval < silence <= DEAD_SILENCE]
    return case.recorded and len(ended) > 1 and max(ended) - min(ended) > _SHORT


@check(Severity.WARNING,
       catches='an edge whose samples arrive at very irregular intervals',
       cause='a timer that is starved, a driver that sends in bursts, or one that uses the time '
             'of sending as the stamp instead of the time of the measurement',
       fix='stamp with the time of the measurement, and publish from a timer that is not blocked')
def irregular_rate(case: Case) -> Iterator[Remark]:
    """Find edges whose intervals vary widely."""
    for edge, moving in case.moving():
        if _is_irregular(moving):
            short, usual, long = moving.timing.intervals.at(0.1, 0.5, 0.9)
            changes = _changes_rate(moving)
            yield of_edge(
                edge, f'{"changes its rate" if changes else "comes irregularly"}: 80 of 100 '
                f'intervals are between {format_span(round(short))} and '
                f'{format_span(round(long))}',
                {'p10_interval_s': short / 1e9, 'p50_interval_s': usual / 1e9,
                 'p90_interval_s': long / 1e9}, **_ANOTHER_RATE if changes else {})


_ANOTHER_RATE = {
    'severity': Severity.NOTE,
    'cause': 'its node sends faster in one mode than in another; or the node, or its computer, '
             'became slower',
    'fix': 'nothing to do, if it is meant to change its rate'}


def _changes_rate(moving: MovingEdge) -> bool:
    """Return whether the intervals are alike for a while, and others later."""
    parts = np.sort(np.diff(np.sort(moving.timing.pairs.kept[:, 1])[::_PART]))
    (fast, slow), (short, long) = (
        quantiles(parts, (0.05, 0.95)), moving.timing.intervals.at(0.1, 0.9))
    return slow > max(_CHANGED, _AS_MUCH * long / short) * fast


def _is_irregular(moving: MovingEdge) -> bool:
    intervals = moving.timing.intervals
    if intervals.count < _SEVERAL:
        return False
    short, usual, long = intervals.at(0.1, 0.5, 0.9)
    limit = _JITTER + _CHANCE / math.sqrt(intervals.kept)
    # The step of stamps that are rounded is no longer than the shortest interval.
    return long - short > limit * min(usual, intervals.mean) + intervals.least


@check(Severity.WARNING,
       explains=('skew',),
       catches='an edge so slow that a buffer never holds two samples of it',
       cause='its rate is too low for the time that buffers keep',
       fix='send it more often, or, if it never changes, once on /tf_static; or give buffers a '
           'longer cache_time')
def slow_for_window(case: Case) -> Iterator[Remark]:
    """Find edges that are sent less often than once per window."""
    window = case.limits.cache_time
    for edge, moving in case.moving():
        timing = moving.timing
        stamps = np.unique(timing.pairs.kept[:, 1])
        # The mean would contain gaps, and the years that the clock of a computer is set by.
        interval = (median(np.diff(stamps)) if len(stamps) > 1
                    else case.timebase.elapsed(timing.last, case.now))
        if timing.intervals.count >= _FEW:
            interval = timing.intervals.median
        if interval > window and not (timing.count < _FEW and case.still_seen(edge)):
            came = f'came once, {interval / 1e9:.1f} s ago,' if timing.count == 1 else (
                f'comes every {interval / 1e9:.1f} s,')
            yield of_edge(
                edge, f'{came} and buffers keep {window / 1e9:.1f} s: '
                'only lookups at the exact stamps succeed',
                {'interval_s': interval / 1e9, 'window_s': window / 1e9})


@check(Severity.WARNING,
       catches='an edge whose newest sample is much older than that of another edge on its path',
       cause='one of them is sent rarely, and the latest common time is as old as its last sample',
       fix='send the slow one more often; lookups for a stamp have to wait for it',
       recorded_fix='send the slow one more often in the next recording. In this one, look up at '
                    'the stamps of the slow edge, as tf_export does without --rate and --at')
def skew(case: Case) -> Iterator[Remark]:
    """Find edges that are much older than another edge above or below them."""
    reported = set()
    # The oldest and the freshest of the edges above each frame, with their ages.
    extremes: dict[str, tuple[_Aged, _Aged]] = {}
    for edge in case.downward:
        found = extremes.get(edge.parent)
        if edge in case.delays:
            own = _age(case, edge), edge
            found = (own, own) if found is None else (
                max(found[0], own, key=_first), min(found[1], own, key=_first))
        if found is None:
            continue
        extremes[edge.child] = found
        (age, oldest), (least, freshest) = found
        if age - least > case.limits.max_skew and oldest.frames not in reported:
            reported.add(oldest.frames)
            yield _older(oldest, freshest, age - least)


def _first(aged: _Aged) -> float:
    return aged[0]


def _age(case: Case, edge: EdgeRecord) -> float:
    """Return the usual age of the newest sample just before the next; 0 if post-dated."""
    timing = timing_of(edge)
    # Of a few irregular intervals, half may be much too long, and the mean contains gaps.
    interval = min(*timing.intervals.at(0.25), mean_interval(
        case.timebase.elapsed(timing.first, timing.last), timing.timed))
    return max(0.0, case.delays[edge].usual + interval)


def _older(edge: EdgeRecord, other: EdgeRecord, apart: float) -> Remark:
    return of_edge(edge, f'is up to {apart / 1e9:.2f} s older than {other}, on the same path: '
                   'the latest transform through both is that old', {'apart_s': apart / 1e9})
