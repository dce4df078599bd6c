# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The clocks of the stamps of a tree's edges, relative to the clock of the arrivals.

The clock of the arrivals is that of the recorder, or of the listener; it may make a step.

The pace of a simulation's stamps differs from that of the recorder's clock, and varies. So if
the two clocks differ, the stamps of most edges at the moment of an arrival define its time by
the clock of the stamps.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import ANOTHER_CLOCK, from_seconds
from tf_tree_py.core.times import Stamps

from .grouping import grouped
from .spread import median, quantiles
from .timing import Timing

# A smaller step, or one that is not this many times as large as the delays vary, may be a delay.
_SMALLEST, _TIMES = from_seconds(0.1), 4.0
# The changes of the delays of all edges differ by less than this part of the step.
_ALIKE = 0.2
# An edge shows the step by this many samples before and after it.
_BESIDE = 5


class ArrivalStep(NamedTuple):
    """
    A step of the clock of the arrivals.

    :ivar stamp: of the last sample before it, nanoseconds.
    :ivar received: when that arrived, by the clock before the step, nanoseconds.
    :ivar step: how far the clock was set forward, nanoseconds; negative: back.
    :ivar corrects: whether the clock agrees with the stamps after the step rather than before.
    """

    stamp: int
    received: int
    step: int
    corrects: bool

    def correct(self, received: Stamps, stamps: Stamps) -> Stamps:
        """Return the arrivals (N,) by the clock that agrees with the stamps (N,)."""
        later = stamps > self.stamp
        return received + self.step * ~later if self.corrects else received - self.step * later


def arrival_step(timings: Sequence[Timing]) -> ArrivalStep | None:
    """
    Return the step that the clock of the arrivals made, if there was one.

    In order of their stamps, the delays of all edges change at one moment by the same amount, for
    good, and the arrivals jump or overlap, not the stamps. The clock of a sender would move its
    stamps instead. In a simulation, a pause looks the same, so at least one part needs stamps of
    the same clock.
    """
    pairs = [_in_order(timing) for timing in timings if timing.pairs.count]
    found = [step for received, stamps in pairs
             if (step := _step_of(received, stamps)) is not None]
    if not found:
        return None
    step = max(found, key=lambda each: each.stamp)
    moved = any(_moves_arrivals(timing, step.step) for timing in timings)
    return step if moved and all(_shows(step, *each) for each in pairs) else None


def _moves_arrivals(timing: Timing, step: int) -> bool:
    """Return whether arrivals jumped forward, or stamps overlap in order of arrival."""
    forward = step == abs(step)
    if timing.waits.most > 0.5 * abs(step):
        return forward or timing.jumps > 0
    return not forward and (timing.disorders > 0 or timing.waits.least < 0.0)


def _in_order(timing: Timing) -> tuple[Stamps, Stamps]:
    """Return arrivals and stamps in order of the stamps."""
    kept = timing.pairs.kept
    ordered = kept[np.argsort(kept[:, 1], kind='stable')]
    return ordered[:, 0], ordered[:, 1]


def _step_of(received: Stamps, stamps: Stamps) -> ArrivalStep | None:
    """Return where the delays of one edge change most, if they are steady before and after."""
    delays = received - stamps
    place = int(np.abs(np.diff(delays, prepend=delays[:1])).argmax())
    step, varies = _change(delays, place)
    if abs(step) < max(_SMALLEST, _TIMES * varies):
        return None
    before, after = (abs(median(part)) for part in np.split(delays, [place]))
    if min(before, after) > ANOTHER_CLOCK:
        return None
    return ArrivalStep(int(stamps[place - 1]), int(received[:place].max()), round(step),
                       after < before)


def _change(delays: Stamps, place: int) -> tuple[float, float]:
    """Return by how much delays change at a place, and how much they vary beside it."""
    if not _BESIDE <= place <= len(delays) - _BESIDE:
        return 0.0, 0.0
    parts: list[Array] = [np.sort(part) for part in np.split(delays.astype(float), [place])]
    (low, usual, high), (later_low, later, later_high) = (
        quantiles(part, (0.05, 0.5, 0.95)) for part in parts)
    return later - usual, max(high - low, later_high - later_low)


def _shows(step: ArrivalStep, received: Stamps, stamps: Stamps) -> bool:
    """Return whether the delays of an edge change by a step, as far as it shows them."""
    place = int(np.count_nonzero(stamps <= step.stamp))
    if not _BESIDE <= place <= len(stamps) - _BESIDE:
        return True  # it began later, or ended before
    change, varies = _change(received - stamps, place)
    return abs(change - step.step) < max(_ALIKE * abs(step.step), varies)


# The pace of an edge's clock needs this many samples, over this part of the time. Those of all
# edges of another clock together are at least as many as the last.
_SEVERAL, _PART, _A_FEW = 16, 0.25, 3
# The paces of synchronised clocks differ by less than this part.
_SAME_PACE = 0.02
# A drift smaller than this, nanoseconds, or than twice the variation of the delays, is ignored.
_NO_DRIFT = from_seconds(0.25)
# At most this many straight pieces, of at least this many samples each, describe the change of
# the pace.
_PIECES, _SAMPLES = 64, 16


class _Line:
    """
    The stamps of one edge as a function of their arrival times.

    :ivar pace: of its stamps relative to the arrivals; None: there are too few samples.
    """

    def __init__(self, timing: Timing, begin: int, step: ArrivalStep | None) -> None:
        self.timing = timing
        # A stamp that is repeated was up to date when it arrived first.
        received, stamps = timing.pairs.kept[
            np.unique(timing.pairs.kept[:, 1], return_index=True)[1]].T
        if step is not None:
            received = step.correct(received, stamps)
        order = np.argsort(received, kind='stable')
        self.received: Array = (received[order] - begin).astype(float)
        # How far stamps are ahead, nanoseconds: small numbers, which avoid rounding errors.
        self.lead: Array = (stamps - received)[order].astype(float)
        self.pace: float | None = None

    def measure(self, span: float) -> None:
        """Measure the pace, if the samples cover a large enough part of a span."""
        if len(self.received) >= _SEVERAL and np.ptp(self.received) >= _PART * span:
            self.pace = 1.0 + median(self.slopes())

    def slopes(self) -> Array:
        """Return how fast the lead grew, between pairs of samples."""
        lag = max(1, len(self.received) // 8)
        waited = self.received[lag:] - self.received[:-lag]
        gone = self.lead[lag:] - self.lead[:-lag]
        known = waited > 0.0
        slopes: Array = gone[known] / waited[known]
        return slopes

    def lead_at(self, moment: float, pace: float) -> float:
        """Return how far its stamps were ahead of the arrivals at a moment, for a given pace."""
        return median(self.lead + (pace - 1.0) * (moment - self.received))


def _pace_of(lines: Sequence[_Line]) -> float:
    """Return the pace of most edges; in a short recording, that of all samples together."""
    paces = sorted(line.pace for line in lines if line.pace is not None)
    if paces:
        # Of two edges, the one whose clock is neither slow nor fast.
        return min(paces[(len(paces) - 1) // 2], paces[len(paces) // 2],
                   key=lambda pace: abs(pace - 1.0))
    slopes = np.concatenate([line.slopes() for line in lines])
    # Of another clock, a guess by a few samples is better than that it goes as fast as this one.
    other = any(abs(line.lead[0]) > ANOTHER_CLOCK for line in lines)
    return 1.0 + median(slopes) if len(slopes) >= (_A_FEW if other else _SEVERAL) else 1.0


class Timebase:
    """
    The clocks of a tree's stamps.

    :ivar clocks: for each clock, the edges, as indices of the argument, and how far their
        stamps are behind the time of the arrivals; the clock of most edges comes first.
    :ivar differs: whether the clock of most edges differs from that of the arrivals.
    :ivar pace: of the stamps, if the clocks differ.
    """

    def __init__(self, timings: Sequence[Timing], step: ArrivalStep | None) -> None:
        """
        Compare the stamps with the arrivals.

        :param timings: of edges with both.
        :param step: of the clock of the arrivals; None: it made none.
        """
        self._step = step
        self.clocks: list[tuple[list[int], float]] = []
        self.differs, self.pace = False, 1.0
        self._begin = min((timing.first for timing in timings), default=0)
        lines = [_Line(timing, self._begin, step) for timing in timings]
        self._knots = self._shape = np.zeros(1)
        if not lines:
            return
        times = np.concatenate([line.received for line in lines])
        for line in lines:
            line.measure(float(np.ptp(times)))
        self._sort(lines, median(times))
        alike = [lines[place] for place in self.clocks[0][0]]
        # A clock that was set does not show the pace of time, nor the time, unless most were set.
        unset = [line for line in alike if not line.timing.steps]
        if 2 * len(unset) < len(alike):
            unset = alike
        self._fit(unset)
        if self.differs:
            own = [median(line.lead - self._leads(line.received)) for line in unset]
            # An edge that leads is post-dated; so of two, the one behind shows the time.
            self._shape = self._shape + sorted(own)[(len(own) - 1) // 2]

    def _sort(self, lines: Sequence[_Line], moment: float) -> None:
        """Group the edges by clock: by what their stamps would have been at one moment."""
        foreign = [line.pace for line in lines if line.pace is not None
                   and abs(line.lead_at(moment, line.pace)) > ANOTHER_CLOCK]
        usual = median(foreign) if foreign else 1.0
        leads = []
        for line in lines:
            own = line.lead_at(moment, 1.0)
            pace = line.pace if line.pace is not None else (
                usual if abs(own) > ANOTHER_CLOCK else 1.0)
            leads.append(line.lead_at(moment, pace))
        groups = grouped(np.argsort(leads, kind='stable').tolist(), lambda group, place: (
            leads[place] - leads[group[-1]] <= ANOTHER_CLOCK))
        self.clocks = [(group, -median([leads[place] for place in group]))
                       for group in sorted(groups, key=len, reverse=True)]

    def _fit(self, lines: Sequence[_Line]) -> None:
        """Fit the clock of some edges to that of the arrivals."""
        self.pace = _pace_of(lines)
        rests = [line.lead - (self.pace - 1.0) * line.received for line in lines]
        if abs(self.clocks[0][1]) <= ANOTHER_CLOCK and not self._drifts(lines, rests):
            self.pace = 1.0
            return
        self.differs = True
        for _ in range(3):
            own = [median(rest - self._bend(line.received))
                   for line, rest in zip(lines, rests, strict=True)]
            self._bow(np.concatenate([line.received for line in lines]), np.concatenate(
                [rest - mean for rest, mean in zip(rests, own, strict=True)]))

    def _drifts(self, lines: Sequence[_Line], rests: Sequence[Array]) -> bool:
        drift = abs(self.pace - 1.0) * float(np.ptp(np.concatenate(
            [line.received for line in lines])))
        noise = median([high - low for low, high in (
            quantiles(np.sort(rest), (0.05, 0.95)) for rest in rests)])
        return abs(self.pace - 1.0) > _SAME_PACE and drift > max(_NO_DRIFT, 2.0 * noise)

    def _bow(self, times: Array, rests: Array) -> None:
        """Model the changes of the pace by the medians of the remainder over time."""
        order = np.argsort(times, kind='stable')
        pieces = np.array_split(order, min(_PIECES, max(1, len(order) // _SAMPLES)))
        self._knots = np.array([median(times[piece]) for piece in pieces])
        self._shape = np.array([median(rests[piece]) for piece in pieces])

    def _bend(self, times: Array) -> Array:
        bend: Array = np.interp(times, self._knots, self._shape)
        return bend

    def delays(self, timing: Timing) -> tuple[Array, Array]:
        """
        Return the delays from an edge's stamps to their first arrivals.

        :return: the arrivals, nanoseconds, and the delays by the clock of the stamps.
        """
        line = _Line(timing, self._begin, self._step)
        received: Array = line.received + self._begin
        if not self.differs:
            return received, -line.lead
        return received, self._leads(line.received) - line.lead

    def elapsed(self, begin: int, end: int) -> float:
        """Return the time between two arrivals, by the clock of the stamps."""
        if not self.differs:
            return float(end - begin)
        times = np.array([begin - self._begin, end - self._begin], float)
        return float(np.diff(times + self._leads(times))[0])

    def _leads(self, times: Array) -> Array:
        leads: Array = (self.pace - 1.0) * times + self._bend(times)
        return leads
