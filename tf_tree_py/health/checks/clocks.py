# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks that recognise wrong or different clocks by the stamps."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from tf_tree_py.core.messages.incidents import is_ambiguous
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds, is_dead
from tf_tree_py.core.text import listed

from .case import Case, Delays, is_always_frozen, is_frozen, is_frozen_now, timing_of
from .finding import check, of_edge, of_edges, Remark, Severity, times
from ..measures.edge_record import EdgeRecord, MovingEdge
from ..measures.grouping import grouped

# Two clocks that chrony synchronises may differ by this much.
_AHEAD = from_seconds(0.05)
# A computation takes less time than the first, or its time varies by more than the others.
_BEHIND, _STEADY, _STEADY_PART = from_seconds(0.1), from_seconds(0.01), 0.05
# The delays of other edges show how much those of the recorder and the network vary.
_FAR_BEHIND, _AS_STEADY = from_seconds(0.2), 1.5
# Vision takes less time than this.
_COMPUTED = from_seconds(0.5)
_WAIT = 'lookups for the stamps of data need a timeout of this delay'
# A node post-dates by at most the first, and by a constant within the others. AMCL post-dates by
# one second unless its user changes it.
_POST_DATED, _NEARLY, _NEARLY_PART, _BURST = from_seconds(2.0), from_seconds(0.2), 0.5, 3.0
# All moving edges are recorded twice for at most this long after the clock was set back.
_TWICE = from_seconds(10.0)
# The offsets of edges from one computer differ by less than this.
_ALIKE = from_seconds(0.05)
# One stamp that is further ahead than a buffer's window makes all good data too old.
_POISON = from_seconds(10.0)
# The edges of one clock step within this time of each other.
_TOGETHER = from_seconds(2.0)
# With fewer samples than this, a constant delay may be chance.
_SEVERAL = 20
# If the stamps of all edges go back by more than this, a recording was restarted.
_PASS = from_seconds(1.0)

_Late = tuple[EdgeRecord, Delays]


@check(Severity.ERROR,
       catches='stamps of two clocks in one tree: the system clock and a simulated one',
       cause='some nodes run with use_sim_time and others without it; or the clock of one '
             'computer is far off',
       fix='set use_sim_time for all nodes or for none; synchronise several computers with '
           'chrony')
def clock_mixture(case: Case) -> Iterator[Remark]:
    """Find edges whose stamps come from a different clock than those of most edges."""
    if not case.clocks:
        return
    # Of as many edges on each clock, those that agree with the arrivals are right.
    usual, *others = sorted(case.clocks, key=lambda clock: (-len(clock.edges), abs(clock.delay)))
    for clock in others:
        apart = clock.delay - usual.delay
        beside = str(usual.edges[0]) if len(usual.edges) == 1 else f'{len(usual.edges)} others'
        yield _of_clock(
            clock.edges, f'stamped {format_span(abs(round(apart)))} '
            f'{"behind" if apart > 0 else "ahead of"} {beside}',
            {'edges': len(clock.edges), 'apart_s': apart / 1e9})


@check(Severity.WARNING,
       explains=('gap', 'jump_back', 'skew'),
       catches='a clock that was set while its edges continued to arrive',
       cause='NTP or chrony set the clock of the computer that stamps these edges, or of the one '
             'that records, in one step',
       fix='set the clock before the nodes start, and let chrony slew it afterwards (makestep '
           'only at boot): lookups across the step use two different times')
def clock_step(case: Case) -> Iterator[Remark]:
    """Find steps that all edges of one publisher make at one moment."""
    if case.arrival_step is not None:
        return  # recorder_clock reports it
    moving = [*case.moving()]
    set_at = sorted(((edge, step) for edge, steps in case.clock_steps.items() for step in steps),
                    key=lambda each: each[1].received)
    for steps in grouped(set_at, lambda group, each: (
            each[1].received - group[0][1].received <= _TOGETHER)):
        edges = list({edge.frames: edge for edge, _ in steps}.values())
        _, largest = max(steps, key=lambda each: abs(each[1].step))
        if len(edges) == len(moving) and largest.step < -_PASS:
            continue  # a restarted recording or simulation: jump_back reports it
        yield _of_clock(
            edges, f'stamped by a clock that was set {"forward" if largest.step > 0 else "back"} '
            f'by {format_span(abs(largest.step))}, at {format_stamp(largest.received)} s, while '
            'their messages continued to arrive',
            {'edges': len(edges), 'step_s': largest.step / 1e9,
             'received_s': largest.received / 1e9})
    if twice := overlap([each for _, each in moving]):
        edges = [edge for edge, each in moving if each.motion.turns.all]
        yield _of_clock(
            edges, f'recorded twice for {format_span(twice)}: the clock of the sender and of '
            'the recorder was set back by as much', {'edges': len(edges),
                                                     'step_s': -twice / 1e9})


def overlap(edges: Iterable[MovingEdge]) -> int:
    """Return how long all moving edges seem to have had two publishers, if it was short."""
    moving = [edge for edge in edges if edge.motion.moved]
    turning = [edge for edge in moving if edge.motion.turns.intervals]
    if len(turning) < max(2, 0.5 * len(moving)) or not all(map(was_short, turning)):
        return 0
    begin = min(edge.motion.turns.first for edge in turning)
    end = max(edge.motion.turns.last for edge in turning)
    return end - begin if end - begin < _TWICE else 0


def was_short(moving: MovingEdge) -> bool:
    """Return whether an edge alternated only once, for a small part of its time."""
    turns, timing = moving.motion.turns, moving.timing
    # During that time only, samples arrived twice as often.
    twice = turns.last - turns.first
    return 0 < twice < 0.15 * timing.span and turns.all * timing.interval > 0.5 * twice


@check(Severity.WARNING,
       explains=('duplicate_stamps', 'static_republished'),
       catches='a stamp that does not change while messages continue to arrive',
       cause='a node that publishes its last data on a timer, with the old stamp, such as a SLAM '
             'node without scans',
       fix='find out why the node has no new data: lookups for later times fail')
def frozen_stamp(case: Case) -> Iterator[Remark]:
    """Find edges that repeat one stamp for long; if they do so to the end, it is an error."""
    for edge, moving in case.moving():
        if not is_frozen(moving):
            continue
        run, timing = moving.timing.frozen, moving.timing
        always = is_always_frozen(moving)
        dead = is_frozen_now(moving) and is_dead(run.span, timing.interval)
        yield of_edge(
            edge, f'came {times(run.samples)} in {format_span(run.span)} with the stamp '
            f'{format_stamp(run.stamp)} s' + (', and with no other' if always else ''),
            {'count': run.samples, 'span_s': run.span / 1e9, 'stamp_s': run.stamp / 1e9},
            severity=Severity.ERROR if dead else None,
            fix='' if moving.motion.moved else
            'find out why the node has no new data: lookups for later times fail. If the edge is '
            'fixed, send it once on /tf_static')


@check(Severity.WARNING,
       explains=('duplicate_stamps', 'delayed', 'clock_offset', 'skew', 'irregular_rate'),
       catches='stamps that are whole seconds, although the edge is sent more often',
       cause='a driver that sets sec but not nanosec',
       fix='set both: a buffer uses only the last sample of each second')
def whole_seconds(case: Case) -> Iterator[Remark]:
    """Find edges whose stamps all lack a fraction, and repeat."""
    for edge, moving in case.moving():
        timing = moving.timing
        if (timing.timed >= _SEVERAL and timing.whole_seconds == timing.timed
                and timing.intervals.count and timing.is_coarse):
            yield of_edge(edge, f'has {timing.timed} stamps, all of them whole seconds',
                          {'count': timing.timed, 'rate_hz': timing.rate_hz})


# --- offsets

@check(Severity.WARNING,
       explains=('delayed', 'clock_offset', 'future_stamps', 'post_dated', 'skew'),
       catches='stamps that fall behind or run ahead more and more',
       cause='the clock of the computer that stamps these edges is slow or fast; or their node '
             'falls behind because it takes too long for each sample, or catches up again',
       fix='synchronise the clocks with chrony; if they are synchronised, find out what delays '
           'the node')
def clock_drift(case: Case) -> Iterator[Remark]:
    """Find edges whose delay changes steadily, and much more than it varies."""
    for behind in (True, False):
        edges = [(edge, drift) for edge, drift in case.drifts.items()
                 if (drift.slope > 0) is behind]
        if edges:
            _, worst = max(edges, key=lambda each: abs(each[1].total))
            yield _of_clock(
                [edge for edge, _ in edges],
                f'stamped more and more {"behind" if behind else "ahead"}: by '
                f'{abs(worst.slope):.2%} of the time, {format_span(abs(round(worst.total)))} so '
                'far',
                {'edges': len(edges), 'drift_s': worst.total / 1e9,
                 'drift_percent': 100.0 * worst.slope})


@check(Severity.WARNING,
       explains=('delayed', 'skew'),
       catches='a delay that is constant, or that varies only as those of the other edges do',
       cause='the clock of the computer that stamps these edges is behind that of the one that '
             'receives them; or their node sets the stamps too early by a constant, or takes that '
             'long to compute each sample',
       fix='if both are one computer, it is the node. If not, compare their clocks: chronyc '
           'tracking prints the offsets; synchronise them with chrony. If they agree, lookups for '
           'the stamps of data need a timeout of this delay',
       recorded_fix='synchronise the clocks of both computers with chrony before the next '
                    'recording. In this one, shift the stamps of these edges by the offset, if '
                    'the clock was the cause')
def clock_offset(case: Case) -> Iterator[Remark]:
    """Find edges with a constant delay; the delay of a computation varies."""
    for edges in _alike(case, lambda edge, delays: _is_behind(case, edge, delays)):
        usual, spread, middle = edges[0][1].usual, edges[0][1].spread, edges[0][1].middle
        others = case.delays_beside(edges[0][0])
        beside = f'; most other edges after {round(others.usual / 1e6)} ms' if others else ''
        # A few delays may be far from the others.
        part, differ = (90, spread) if spread <= 2.0 * middle else (50, middle)
        yield _of_clock(
            [edge for edge, _ in edges], f'received {usual / 1e6:.0f} ms after the stamp, and '
            f'{part} of 100 of those delays differ by {differ / 1e6:.1f} ms at most{beside}',
            {'edges': len(edges), 'p50_delay_s': usual / 1e9, 'spread_s': spread / 1e9},
            **_of_computation(case, edges))
    for edges in _leading(case):
        behind = [edge for edge, delays in case.delays.items()
                  if delays.usual > edges[-1][1].usual + _AHEAD]
        # A fit of the clocks, and messages in bursts, are inaccurate by less than this.
        far = -edges[0][1].usual > _FAR_BEHIND
        if case.timebase.differs and behind and far and not _is_post_dated(case, edges):
            yield _of_groups(edges, behind)


def _of_computation(case: Case, edges: Sequence[_Late]) -> dict[str, object]:
    """Return what differs if the computation of each sample may take that long."""
    senders = {name for edge, _ in edges for name in edge.authorities}
    in_time = [edge for edge, delays in case.delays.items()
               if {*edge.authorities} == senders and abs(delays.usual) < _AHEAD]
    if in_time and len(senders) == 1 and not any(map(is_ambiguous, senders)):
        return {'cause': f'their node sets these stamps too early by a constant, or takes that '
                         f'long to compute each sample. Its clock is right: it sends {in_time[0]} '
                         'in time',
                'fix': _WAIT}
    if edges[-1][1].usual < _COMPUTED and all(
            case.is_sighting(edge) and not case.is_fixed(edge.parent) for edge, _ in edges):
        return {'severity': Severity.NOTE,
                'cause': 'each sample takes that long to compute, as vision usually does; or the '
                         'clock of the computer that stamps these edges is behind',
                'fix': f'{_WAIT}. If they are stamped on another computer, compare the clocks: '
                       'chronyc tracking prints their offsets'}
    return {}


def _of_groups(leading: Sequence[_Late], behind: Sequence[EdgeRecord]) -> Remark:
    """Return a remark on two groups of edges, if no clock shows which of them is right."""
    ahead = [edge for edge, _ in leading]
    apart = -leading[0][1].usual
    return of_edges(
        [*ahead, *behind], f'the edges fall into two groups, whose stamps are '
        f'{apart / 1e6:.0f} ms apart: ahead {_are(ahead)}; behind {_are(behind)}',
        {'ahead': len(ahead), 'behind': len(behind), 'apart_s': apart / 1e9},
        cause='two clocks, or a node that stamps too early or too late by a constant. The stamps '
              'are of another clock than the arrivals, so they do not show which group is right',
        fix='compare both with the clock: ros2 topic delay TOPIC --use-sim-time prints the delay '
            'of a sensor, which has the clock of its computer')


def _are(edges: Sequence[EdgeRecord]) -> str:
    return f'{"is" if len(edges) == 1 else "are"} {listed([str(edge) for edge in edges])}'


@check(Severity.WARNING,
       catches='stamps that are ahead of the clock',
       cause="the clock of the sender's computer is ahead, or that of this one is behind (chrony "
             'or NTP set it); or a node post-dates by more than two seconds, which no localiser '
             'does by default',
       fix='synchronise the clocks; Buffer(max_future=...) refuses stamps that are further ahead '
           'than that')
def future_stamps(case: Case) -> Iterator[Remark]:
    """Find edges whose stamps are usually ahead, and single stamps that are far ahead."""
    poisoned = {edge: furthest for edge, moving in case.moving()
                if (furthest := _furthest(case, edge, moving)) > _POISON}
    for edge, furthest in poisoned.items():
        yield of_edge(
            edge, f'has stamps up to {furthest / 1e9:.1f} s ahead of the clock: its good '
            'data is refused until the clock reaches them',
            {'furthest_s': furthest / 1e9}, severity=Severity.ERROR)
    for edges in _leading(case):
        edges = [each for each in edges if each[0] not in poisoned]
        if edges and not case.timebase.differs and not _is_post_dated(case, edges):
            lead = -edges[0][1].usual
            yield _of_clock([edge for edge, _ in edges],
                            f'stamped {lead / 1e6:.0f} ms ahead of the clock',
                            {'edges': len(edges), 'usually_s': lead / 1e9,
                             'furthest_s': -min(delays.early for _, delays in edges) / 1e9},
                            **_of_simulation(case, len(edges)))


def _of_simulation(case: Case, edges: int) -> dict[str, object]:
    """Return what differs if the clock of the arrivals is a simulation's."""
    if not case.recorded_in_simulation:
        return {}
    if edges < len(case.delays):
        return {'cause': 'a node that stamps by another clock than the simulation, or post-dates',
                'fix': 'set use_sim_time for the node, or reduce its tolerance'}
    return {'severity': Severity.NOTE,
            'cause': 'the clock that they are compared with is simulated: it stands still from '
                     'one message of /clock to the next, which may arrive late',
            'fix': 'nothing to do; with a faster /clock the lead becomes shorter'}


@check(Severity.NOTE,
       catches='one edge whose stamps are ahead of all others by a constant',
       cause='a node that post-dates on purpose, so that lookups do not wait for it: '
             'transform_tolerance of AMCL, transform_timeout of slam_toolbox, '
             'transform_time_offset of robot_localization',
       fix='nothing to do; but max_future, if it is used, has to be greater than this. If it does '
           'not post-date on purpose, it is ahead, or the others are behind by as much')
def post_dated(case: Case) -> Iterator[Remark]:
    """Find single edges that alone are ahead by a constant."""
    for edges in _leading(case):
        for edge, delays in edges if _is_post_dated(case, edges) else ():
            yield of_edge(edge, f'is stamped {-delays.usual / 1e6:.0f} ms ahead of '
                          f'{"the others" if case.timebase.differs else "its arrival"}',
                          {'usually_s': -delays.usual / 1e9, 'spread_s': delays.spread / 1e9})


def _furthest(case: Case, edge: EdgeRecord, moving: MovingEdge) -> float:
    """Return how far ahead a stamp was at most, of the clock or of the stamps around it."""
    known = edge in case.delays and not case.timebase.differs
    if case.arrival_step is not None:
        # In order of arrival, the stamps before and after the step may alternate; and samples at
        # the step may be on either side of it.
        delays, step = case.timebase.delays(moving.timing)[1], abs(case.arrival_step.step)
        apart = np.abs(np.abs(delays) - step) > 0.5 * step
        return -float(delays[apart].min(initial=0.0)) if known else 0.0
    return max(moving.timing.ahead, -moving.timing.delays.least if known else 0.0)


def _leading(case: Case) -> list[list[_Late]]:
    return _alike(case, lambda edge, delays: delays.usual < -_AHEAD + _freshest(case, edge))


def _freshest(case: Case, edge: EdgeRecord) -> float:
    """
    Return the delay of what is up to date, nanoseconds, at most 0.

    If the clocks differ, the delays are relative to the usual ones of most edges; those that send
    in bursts are usually late.
    """
    return min(0.0, case.earliest_behind(edge, _AHEAD)) if case.timebase.differs else 0.0


def _is_behind(case: Case, edge: EdgeRecord, delays: Delays) -> bool:
    """Return whether delays are constant, or vary only as those of the other edges do."""
    if delays.usual <= _BEHIND:
        return False
    if not case.timebase.differs and delays.width < max(
            _STEADY, _STEADY_PART * delays.usual):
        return True
    others = case.delays_beside(edge)
    return others is not None and (delays.usual - others.usual > _FAR_BEHIND
                                   and delays.spread < _AS_STEADY * others.spread)


def _is_post_dated(case: Case, edges: Sequence[_Late]) -> bool:
    edge, delays = edges[0]
    if case.timebase.differs and not case.is_correction(edge):
        return False  # the others may as well be behind
    # Several localisers and filters may do so alike; but no whole robot does.
    if len(edges) > 1 and (len(edges) == len(case.delays) or not all(
            case.is_fixed(other.parent) for other, _ in edges)):
        return False
    # Of messages that are sent in bursts, some are a few intervals old.
    return -delays.usual < _POST_DATED and delays.middle < max(
        _NEARLY, -_NEARLY_PART * delays.usual, _BURST * timing_of(edge).interval)


def _alike(case: Case, wanted: Callable[[EdgeRecord, Delays], bool]) -> list[list[_Late]]:
    """Return the edges with certain delays, grouped if one clock may explain them."""
    found = sorted(((edge, delays) for edge, delays in case.delays.items()
                    if timing_of(edge).delays.count >= _SEVERAL and wanted(edge, delays)),
                   key=lambda each: each[1].usual)
    return grouped(found, lambda group, each: each[1].usual - group[-1][1].usual <= _ALIKE)


def _of_clock(edges: Sequence[EdgeRecord], summary: str, evidence: dict[str, float],
              **more: object) -> Remark:
    """Return a remark on edges of one clock."""
    besides = len(edges) - 1
    others = f' and {besides} more edge{"s" * (besides > 1)} are' if besides else ' is'
    return of_edges(edges, f'{edges[0]}{others} {summary}', evidence, **more)
