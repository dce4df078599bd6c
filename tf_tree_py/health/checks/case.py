# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""All measurements of a tree, and the values that several checks compute from them."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.stamp import from_seconds, silence_allowed

from .pieces import pieces_of
from ..measures.edge_record import Edge, EdgeRecord, MovingEdge, Parents
from ..measures.spread import median, quantiles
from ..measures.thresholds import Thresholds
from ..measures.timebase import arrival_step, ArrivalStep, Timebase
from ..measures.timing import ClockStep, Timing
from ..ros_graph import NO_GRAPH, RosGraph

# The number of samples before and after a step that are compared.
_AROUND = 20
# With fewer samples, a drift may be chance; a smaller drift is that of any quartz, or of a fit.
_SEVERAL, _DRIFTS, _LEAST_DRIFT = 20, 0.003, from_seconds(0.1)
# What was seen less often does not show how it moves.
_GLIMPSES = 8
# Metres, and radians per second: what is seen by a camera moves more, a joint about its axis less.
_FREELY = 1e-3
# Metres, or radians, per second: what corrects or stands moves no faster.
_SLOWLY = 0.05
# Of more edges than this, one more hardly changes the median.
_MANY = 30
# A frozen stamp may be this old.
_DAY = from_seconds(86_400.0)
# 2001, in nanoseconds: the clock of a simulation usually begins at zero.
_EPOCH = 10**18
# A stamp is frozen only if it was received at least this often.
_FROZEN_SAMPLES = 5


@dataclass
class Trouble:
    """
    The incidents of one kind and one edge.

    :ivar count: their number.
    :ivar authorities: the possible publishers.
    :ivar detail: the detail of the first one.
    """

    count: int = 0
    authorities: dict[str, None] = field(default_factory=dict)
    detail: str = ''


class Clock(NamedTuple):
    """
    Edges whose stamps come from one clock.

    :ivar edges: moving edges only.
    :ivar delay: how far that clock is behind the clock of the arrivals, nanoseconds.
    """

    edges: Sequence[EdgeRecord]
    delay: float


class Delays(NamedTuple):
    """
    The delays from an edge's stamps to their arrivals, nanoseconds by the clock of the stamps.

    If that clock differs from the clock of the arrivals, the usual delay of most edges is 0.

    :ivar early: 5 % are shorter.
    :ivar usual: half are shorter.
    :ivar late: 95 % are shorter.
    :ivar middle: the width of the interval that contains the middle half of them.
    """

    early: float
    usual: float
    late: float
    middle: float

    @property
    def spread(self) -> float:
        """Return the width of the interval that contains 90 % of the delays."""
        return self.late - self.early

    @property
    def width(self) -> float:
        """Return the same, unless a few delays are far from the others: then a smaller width."""
        return min(self.spread, 2.0 * self.middle)


class Drift(NamedTuple):
    """
    A steady change of the delays of an edge.

    :ivar slope: how much they grow per nanosecond of arrivals.
    :ivar total: how much they grew, nanoseconds.
    """

    slope: float
    total: float


def _delays_of(delays: Array) -> Delays:
    early, quarter, usual, three_quarters, late = quantiles(
        np.sort(delays) + 0.0, (0.05, 0.25, 0.5, 0.75, 0.95))  # + 0.0: zero has no sign
    return Delays(early, usual, late, three_quarters - quarter)


def _medians(delays: Sequence[Delays]) -> Delays:
    return Delays(*(median(column) for column in zip(*delays, strict=True)))


def _drift_of(received: Array, delays: Array, interval: float) -> Drift | None:
    """
    Return the drift of an edge; None if it is not significant.

    :param received: (N,) arrivals, nanoseconds; ``delays`` (N,) likewise.
    :param interval: between the stamps, nanoseconds. A node that sends its last data at nearly the
        rate of the data delays it by up to one interval, more and more, and again from zero.
    """
    half = len(received) // 2
    if 2 * half < _SEVERAL:
        return None
    slope = median((delays[half:] - delays[:-half]) / np.maximum(
        received[half:] - received[:-half], 1.0))
    total = slope * float(np.ptp(received))
    significant = abs(slope) > _DRIFTS and abs(total) > max(
        _LEAST_DRIFT, 1.5 * interval, 3.0 * _delays_of(delays - slope * received).width)
    return Drift(slope, total) if significant else None


def timing_of(edge: EdgeRecord) -> Timing:
    """Return the timing of a moving edge."""
    assert edge.moving is not None
    return edge.moving.timing


def _may_correct(moving: MovingEdge, below: Iterable[MovingEdge]) -> bool:
    """Return whether an edge moves no faster than one below it, and does not turn in place."""
    motion = moving.motion
    if motion.moved and motion.travelled <= _FREELY:
        return False
    rests = max(motion.speeds.median, motion.turn_rates.median) <= _FREELY
    # A localiser may correct by large steps, but seldom.
    speed, turn_rate = motion.speeds.at(0.75)[0], motion.turn_rates.at(0.75)[0]
    return any(speed <= max(other.motion.speeds.at(0.75)[0], _SLOWLY)
               and turn_rate <= max(other.motion.turn_rates.at(0.75)[0], _SLOWLY)
               or rests and not other.motion.moved for other in below)


def is_frozen(moving: MovingEdge) -> bool:
    """Return whether an edge repeated one stamp for as long as would count as silence."""
    timing = moving.timing
    # Measured by the clock of the arrivals: a slow simulation repeats stamps for longer.
    several = timing.intervals.count >= _FROZEN_SAMPLES
    between = timing.span / timing.intervals.count if several else 1.0
    return (timing.frozen.samples >= _FROZEN_SAMPLES
            and timing.frozen.span > silence_allowed(max(timing.interval, between)))


def is_always_frozen(moving: MovingEdge) -> bool:
    """Return whether an edge has repeated one stamp from the beginning."""
    timing = moving.timing
    return is_frozen(moving) and timing.frozen.samples == timing.timed


def is_frozen_now(moving: MovingEdge) -> bool:
    """Return whether an edge still repeats one stamp, and has for long."""
    return is_frozen(moving) and moving.timing.run.stamp == moving.timing.frozen.stamp


class Case:
    """
    The measurements of a doctor at one moment; they no longer change.

    :ivar edges: every received edge with valid names.
    :ivar parents: the changes of parent, by child.
    :ivar troubles: the buffer's refusals and remarks, by kind, parent and child.
    :ivar slashed: the names that were received with a leading slash.
    :ivar endpoints: the publishers and subscriptions.
    :ivar now: the time by the clock of the arrivals, nanoseconds.
    :ivar recorded: whether they are of a recording, to which nothing is added.
    :ivar graph: what else the ROS graph shows.
    """

    def __init__(self, edges: Collection[EdgeRecord], parents: Mapping[str, Parents],
                 troubles: Mapping[tuple[Kind, str, str], Trouble], slashed: Collection[str],
                 endpoints: Sequence[Endpoint], limits: Thresholds, now: int,
                 recorded: bool = False, graph: RosGraph = NO_GRAPH) -> None:
        self.edges = [edge for edge in edges
                      if edge.parent and edge.child and edge.parent != edge.child]
        self.parents = parents
        self.troubles = troubles
        self.slashed = slashed
        self.endpoints = endpoints
        self.limits = limits
        self.now = now
        self.recorded = recorded
        self.graph = graph

    # --- edges

    def moving(self) -> Iterator[tuple[EdgeRecord, MovingEdge]]:
        """Yield the edges that arrived on topics of moving transforms, if any was accepted."""
        for edge in self.edges:
            if edge.moving is not None and not self._is_refused(edge):
                yield edge, edge.moving

    def _is_refused(self, edge: EdgeRecord) -> bool:
        """Return whether every sample of an edge would have closed a loop."""
        loop = self.troubles.get((Kind.LOOP, *edge.frames))
        samples = ((edge.moving.timing.count if edge.moving else 0)
                   + (edge.fixed.count if edge.fixed else 0))
        return loop is not None and loop.count >= samples

    def of_kind(self, *kinds: Kind) -> Iterator[tuple[Edge, Trouble]]:
        """Yield (parent, child) and the incidents, for some kinds."""
        for (kind, parent, child), trouble in self.troubles.items():
            if kind in kinds:
                yield (parent, child), trouble

    # --- the tree

    @cached_property
    def frames(self) -> list[str]:
        """Return every frame, in order of first appearance."""
        return list(dict.fromkeys(frame for edge in self.edges for frame in edge.frames))

    @cached_property
    def first_arrivals(self) -> dict[str, int]:
        """Return when the first moving edge of each frame arrived, nanoseconds."""
        first: dict[str, int] = {}
        for edge, moving in self.moving():
            for frame in edge.frames if moving.timing.first else ():
                first[frame] = min(first.get(frame, moving.timing.first), moving.timing.first)
        return first

    @cached_property
    def above(self) -> dict[str, list[EdgeRecord]]:
        """Return the edges to each child's parents, without loops: one without a conflict."""
        found: dict[str, list[EdgeRecord]] = {}
        for edge in self.edges:
            if not self._is_refused(edge):
                found.setdefault(edge.child, []).append(edge)
        return found

    @cached_property
    def roots(self) -> dict[str, None]:
        """Return the frames without a parent."""
        return {frame: None for frame in self.frames if frame not in self.above}

    @cached_property
    def downward(self) -> list[EdgeRecord]:
        """Return the edges from the roots down, with the first parent of each child."""
        below: dict[str, list[EdgeRecord]] = {}
        for edges in self.above.values():
            below.setdefault(edges[0].parent, []).append(edges[0])
        found = [edge for root in self.roots for edge in below.get(root, ())]
        for edge in found:  # the list grows
            found += below.get(edge.child, ())
        return found

    @cached_property
    def trees(self) -> list[list[str]]:
        """Return the frames of each connected tree, the largest first."""
        return pieces_of(edge.frames for edge in self.edges)

    def is_correction(self, edge: EdgeRecord) -> bool:
        """
        Return whether an edge is a localiser's correction of a moving edge below it.

        REP 105's map -> odom is one: above it there are only corrections and static edges, and it
        moves no faster than an edge below it.
        """
        return edge.frames in self._corrected[0]

    def is_fixed(self, frame: str) -> bool:
        """Return whether there are only corrections and static edges above a frame, or none."""
        return frame in self._corrected[1]

    @cached_property
    def _corrected(self) -> tuple[set[Edge], set[str]]:
        """Return the corrections, and the frames that are fixed."""
        below: dict[str, list[MovingEdge]] = {}
        for edge, moving in self.moving():
            below.setdefault(edge.parent, []).append(moving)
        corrections, fixed = set[Edge](), {*self.roots}
        for edge in self.downward:
            if edge.parent not in fixed:
                continue
            if edge.moving is None:
                fixed.add(edge.child)
            elif _may_correct(edge.moving, below.get(edge.child, ())):
                corrections.add(edge.frames)
                fixed.add(edge.child)
        return corrections, fixed

    @cached_property
    def _parents(self) -> set[str]:
        return {edge.parent for edge in self.edges}

    def still_seen(self, edge: EdgeRecord) -> list[EdgeRecord]:
        """
        Return the edges that were seen from the same frame by the same node, if it sees things.

        A detector sends a frame for each tag or person in the view of its camera. These frames
        move freely and have no children, unlike the joints of a robot.
        """
        if not self.is_sighting(edge):
            return []
        assert edge.moving is not None
        return [other for other, _ in self.moving()
                if other is not edge and other.parent == edge.parent and self.is_sighting(other)
                and (other.frames in edge.moving.beside or other.authorities == edge.authorities
                     and len(edge.authorities) == 1)]

    def is_sighting(self, edge: EdgeRecord) -> bool:
        """Return whether an edge may be what a sensor sees: freely moving, without children."""
        return edge.moving is not None and self.has_no_children(edge) and (
            edge.moving.timing.count < _GLIMPSES or edge.moving.motion.speeds.median > _FREELY
            and edge.moving.motion.turn_rates.median > _FREELY)

    def has_no_children(self, edge: EdgeRecord) -> bool:
        """Return whether no edge begins where this one ends."""
        return edge.child not in self._parents

    # --- clocks

    @cached_property
    def _timed(self) -> list[EdgeRecord]:
        """Return the moving edges that show a clock: not those that only repeat an old stamp."""
        timed = [(edge, moving.timing.delays.median, is_always_frozen(moving))
                 for edge, moving in self.moving() if moving.timing.delays.count]
        usual = median([delay for _, delay, frozen in timed if not frozen])
        return [edge for edge, delay, frozen in timed
                if not (frozen and 0.0 < delay - usual < _DAY)]

    @cached_property
    def timebase(self) -> Timebase:
        """Return the clocks of the edges' stamps."""
        return Timebase([timing_of(edge) for edge in self._timed], self.arrival_step)

    @cached_property
    def arrival_step(self) -> ArrivalStep | None:
        """Return the step of the clock of the arrivals, if there was one."""
        return arrival_step([moving.timing for _, moving in self.moving()])

    @cached_property
    def clocks(self) -> list[Clock]:
        """Return the moving edges by clock; the clock of most edges comes first."""
        return [Clock([self._timed[place] for place in places], delay)
                for places, delay in self.timebase.clocks]

    @cached_property
    def _main_clock(self) -> set[EdgeRecord]:
        return {*self.clocks[0].edges} if self.clocks else set()

    def goes_by_main_clock(self, edge: EdgeRecord) -> bool:
        """Return whether an edge is stamped by the clock of most edges."""
        return edge in self._main_clock

    @cached_property
    def clock_steps(self) -> dict[EdgeRecord, list[ClockStep]]:
        """
        Return the steps of the publishers' clocks, by edge.

        A step changes all later delays, which were steady before it and are after it. After a
        pause of a simulation, or a few lost messages, the delays are the same as before.
        """
        found = {edge: [step for step in moving.timing.steps if self._shifts(moving.timing, step)]
                 for edge, moving in self.moving()}
        return {edge: steps for edge, steps in found.items() if steps}

    def _shifts(self, timing: Timing, step: ClockStep) -> bool:
        received, delays = self.timebase.delays(timing)
        later = received > step.received
        before, after = delays[~later][-_AROUND:], delays[later][:_AROUND]
        if not (len(before) and len(after)):
            return False
        # A link that stalled delivers all at once, with delays that become shorter and shorter.
        steady = max(float(np.ptp(quantiles(np.sort(part), (0.1, 0.9))))
                     for part in (before, after)) < 0.5 * abs(step.step)
        return steady and bool((np.median(before) - np.median(after)) / step.step > 0.5)

    def delays_beside(self, edge: EdgeRecord) -> Delays | None:
        """Return the medians of the delays of the other edges; None: there are none."""
        if len(self.delays) > _MANY:
            return self._all_delays
        others = [delays for other, delays in self.delays.items() if other is not edge]
        return _medians(others) if others else None

    def earliest_behind(self, edge: EdgeRecord, by: float) -> float:
        """
        Return the shortest of the early delays of edges that are usually later; 0: there are none.

        :param by: how much later at least, nanoseconds.
        """
        usual, early = self._earliest
        place = int(np.searchsorted(usual, self.delays[edge].usual + by, 'right'))
        return float(early[place]) if place < len(early) else 0.0

    @cached_property
    def _earliest(self) -> tuple[Array, Array]:
        """Return the usual delays, sorted, and the shortest early delay of each and all later."""
        ordered = sorted(self.delays.values(), key=lambda delays: delays.usual)
        early = np.array([delays.early for delays in ordered])
        return (np.array([delays.usual for delays in ordered]),
                np.minimum.accumulate(early[::-1])[::-1])

    @cached_property
    def _all_delays(self) -> Delays:
        return _medians([*self.delays.values()])

    @cached_property
    def _unset(self) -> list[EdgeRecord]:
        """Return the edges of the clock of most edges whose own clock was not set meanwhile."""
        return [edge for edge in self._timed
                if self.goes_by_main_clock(edge) and edge not in self.clock_steps]

    @cached_property
    def drifts(self) -> dict[EdgeRecord, Drift]:
        """Return the drifts of edges whose delays grow or shrink steadily."""
        found = {edge: _drift_of(*self.timebase.delays(timing_of(edge)), timing_of(edge).interval)
                 for edge in self._unset}
        return {edge: drift for edge, drift in found.items() if drift is not None}

    @property
    def recorded_in_simulation(self) -> bool:
        """Return whether the clock of the arrivals is a simulation's, which begins at zero."""
        return self.now < _EPOCH

    @cached_property
    def delays(self) -> dict[EdgeRecord, Delays]:
        """
        Return the delays of the edges that are stamped by the clock of most edges.

        Edges whose clock was set meanwhile are omitted: their delays have no meaning.
        """
        return {edge: _delays_of(self.timebase.delays(timing_of(edge))[1])
                for edge in self._unset}
