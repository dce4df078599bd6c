# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measurements of the stamps and the arrivals of one edge: steps of its clock, and lone stamps.

A lone stamp is that of a single sample, far from all others by the order of arrival. A gap in both
stamps and arrivals is a pause. Many samples on both sides of a step are two runs, or two clocks.
Neither has lone stamps.
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds, mean_interval, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps

from .sample_rows import JUDGED, Mask, Places, Rows, Steps
from .spread import median, Sampled, Spread

# A smaller step, or one of fewer usual intervals, may be a late timer.
_SMALLEST = from_seconds(0.1)
_INTERVALS = 4.0


class ClockStep(NamedTuple):
    """
    One step of a clock.

    :ivar received: when the last sample before it arrived, nanoseconds.
    :ivar step: how much further the stamps advanced than the arrivals, nanoseconds.
    """

    received: int
    step: int


def clock_steps(steps: Steps, interval: float) -> list[ClockStep]:
    """
    Return the steps of a clock among the steps that are judged.

    :param interval: the usual interval between stamps, nanoseconds.
    """
    least = max(_SMALLEST, _INTERVALS * interval)
    if not interval or np.abs(steps.time[JUDGED] - interval).max() <= least:
        return []
    waited = median(steps.waited)
    # Convert to the clock of the stamps, whose pace may differ from that of the arrivals.
    pace = interval / waited if waited > 0.0 else 1.0
    lead = (steps.time - interval) - (steps.waited - waited) * pace
    here, size = lead[JUDGED], np.abs(lead[JUDGED])
    # The step to or from a single wrong stamp is reversed by the next or the previous step.
    stays = (np.minimum(np.abs(here + lead[:-3]), np.abs(here + lead[2:-1])) > 0.5 * size)
    arrives = ((np.abs(steps.waited[JUDGED] - waited) * pace < 0.5 * size)
               & (steps.received[JUDGED] > 0))
    found = np.flatnonzero((size > least) & stays & arrives) + 1
    return [ClockStep(int(steps.received[place]), round(float(lead[place]))) for place in found]


# --- stamps and arrivals

JUMP = from_seconds(1.0)
"""A stamp that goes back by more has jumped to another time; by less, it is out of order."""

# Two publishers that each repeat a stamp send stamps that differ by less than this.
_ALIKE = from_seconds(0.01)
# With fewer intervals than this, their mean is used, too.
_FEW = 8
# At most this many steps of one publisher's clock are kept.
_MAX_STEPS = 100


class Run(NamedTuple):
    """
    Successive samples without a newer stamp.

    :ivar samples: their number.
    :ivar span: from the arrival of the first to that of the last, nanoseconds.
    :ivar stamp: the newest of them, nanoseconds.
    """

    samples: int = 0
    span: int = 0
    stamp: int = 0


class Timing:
    """
    Counts and spreads of one edge's stamps; all times are nanoseconds.

    :ivar count: the number of samples.
    :ivar first: when the first one arrived after the clock had begun; 0: none has.
    :ivar last: when the last one arrived.
    :ivar zeros: the number of samples with stamp zero, which are excluded from the rest.
    :ivar delays: from the stamp to the arrival.
    :ivar pairs: (N, 2) arrivals and stamps of samples that are spread evenly over all time.
    :ivar intervals: between successive stamps.
    :ivar waits: between successive arrivals; the longest begins at ``longest_wait``.
    :ivar longest: the stamp at which the longest interval begins.
    :ivar duplicates: samples with the stamp of the one before; ``differing`` of them have another
        pose. The edge counts them.
    :ivar disorders: steps to an older stamp from which the following stamps do not continue.
    :ivar jumps: steps back from which the stamps continue; ``back`` is the longest of these.
    :ivar whole_seconds: the number of stamps without a fraction of a second.
    :ivar frozen: the longest run of samples without a newer stamp; the last of several.
    :ivar ahead: how far one stamp, or a few, were ahead of those before and after, at most.
    :ivar run: the present run.
    :ivar steps: of the publisher's clock.
    """

    def __init__(self) -> None:
        self.count = self.zeros = self.whole_seconds = 0
        self.first = self.last = self.longest = self.longest_wait = self.ahead = 0
        self.delays, self.intervals, self.waits = Spread(), Spread(), Spread()
        self.pairs = Sampled(np.empty((0, 2), np.int64))
        self.duplicates = self.differing = self.disorders = self.jumps = self.back = 0
        self.frozen = Run()
        self.steps: list[ClockStep] = []
        self.run = Run()
        # The arrival of the first sample of the present run, and the stamp of the last.
        self._run_begin: int
        self._stamp: int

    @property
    def timed(self) -> int:
        """Return how many samples have a stamp other than zero."""
        return self.count - self.zeros

    @property
    def is_coarse(self) -> bool:
        """Return whether most stamps repeat the one before, such as whole seconds."""
        return 2 * self.duplicates > self.timed

    @property
    def span(self) -> int:
        """Return the time from the first arrival to the last."""
        return self.last - self.first

    @property
    def interval(self) -> float:
        """Return the usual interval between stamps; 0 with fewer than two samples."""
        stamps = self.pairs.kept[:, 1]
        if self.intervals.count >= _FEW or not len(stamps):
            return self.intervals.median
        # The median of a few irregular intervals is often much too short.
        return max(self.intervals.median, mean_interval(int(np.ptp(stamps)), len(stamps)))

    @property
    def rate_hz(self) -> float:
        """Return the samples per second by arrival; 0 with fewer than two samples."""
        return (self.count - 1) * 1e9 / self.span if self.span > 0 else 0.0

    def add(self, rows: Rows) -> None:
        """Add samples, and measure each without its neighbours."""
        self.count += len(rows)
        self.zeros += len(rows) - int(np.count_nonzero(rows.stamps))
        known = rows.where(rows.received > 0)
        if len(known):
            self._add_waits(known.received)
            self.first = self.first or int(known.received[0])
            self.last = int(known.received[-1])
        heard = known.where(known.stamps != 0)
        received, stamps = heard.received, heard.stamps
        if len(stamps):
            self.delays.add(received - stamps)
            self.pairs.add(np.array([received, stamps]).T)
            self.whole_seconds += int(np.count_nonzero(stamps % NANOSECONDS_PER_SECOND == 0))
            self._add_runs(received, stamps)

    def _add_waits(self, received: Stamps) -> None:
        if self.last:
            received = np.concatenate([[self.last], received])
        waits = np.diff(received)
        if len(waits) and waits.max() > self.waits.most:
            self.longest_wait = int(received[waits.argmax()])
        self.waits.add(waits)

    def _add_runs(self, received: Stamps, stamps: Stamps) -> None:
        """Measure how long no newer stamp came."""
        newest = int(stamps[-1])
        if stamps[0] > self.run.stamp and (stamps[1:] > stamps[:-1]).all():
            # The common case: every stamp is newer than the one before.
            self._run_begin, self._stamp, self.run = int(received[-1]), newest, Run(1, 0, newest)
            return
        if not self.run.samples:
            self._run_begin, self._stamp = int(received[0]), int(stamps[0])
            self.run = Run(stamp=self._stamp)
        # The present run continues, or ends here.
        back = np.flatnonzero(np.diff(stamps, prepend=self._stamp) < -_ALIKE) + 1
        received = np.concatenate([[self._run_begin], received])
        parts = np.split(np.concatenate([[self.run.stamp], stamps]), back)
        stamps = np.concatenate([np.maximum.accumulate(part) for part in parts])
        begins = np.concatenate([[0], np.flatnonzero(np.diff(stamps)) + 1])
        lasts = np.concatenate([begins[1:], [len(stamps)]]) - 1
        counts, spans = lasts - begins + 1, received[lasts] - received[begins]
        counts[0] += self.run.samples - 1
        runs = [Run(int(counts[place]), int(spans[place]), int(stamps[begins[place]]))
                for place in (-1 - spans[::-1].argmax(), -1)]
        if runs[0].span >= max(self.frozen.span, 1):
            self.frozen = runs[0]
        self._run_begin, self._stamp, self.run = int(received[begins[-1]]), newest, runs[1]

    def add_steps(self, steps: Steps) -> None:
        """Add steps; the first and the last two serve only to judge their neighbours."""
        if steps.time.min() > 0:
            # The common case: every stamp is newer than the one before.
            self._add_intervals(steps.stamps[JUDGED], steps.time[JUDGED])
        else:
            self._add_unordered(steps)
        if len(self.steps) < _MAX_STEPS:
            self.steps += clock_steps(steps, self.interval)

    def _add_unordered(self, steps: Steps) -> None:
        before, time, after = steps.time[:-3], steps.time[JUDGED], steps.time[2:-1]
        back = time <= -JUMP
        # The next step after one late stamp is forward; the step before the return from a stamp
        # that is too far ahead was forward, too.
        late, ahead = back & (after >= -time // 2), back & (before >= -time // 2)
        onward = (time > 0) & (after > np.minimum(-JUMP, -time // 2))
        self._add_intervals(steps.stamps[JUDGED][onward], time[onward])
        self.disorders += int(np.count_nonzero((time < 0) & ~back | late))
        self.ahead = -int(time[ahead & ~late].min(initial=-self.ahead))
        jumps = back & ~late & ~ahead
        self.jumps += int(np.count_nonzero(jumps))
        self.back = -int(time[jumps].min(initial=-self.back))

    def _add_intervals(self, stamps: Stamps, intervals: npt.NDArray[np.int64]) -> None:
        if len(intervals) and intervals.max() > self.intervals.most:
            self.longest = int(stamps[intervals.argmax()])
        self.intervals.add(intervals)


# --- lone stamps

Edge = TypeVar('Edge')

# A lone stamp is at least so far from those before and after it, nanoseconds; and so many times as
# far as the arrivals differ, and as the stamps before and after it do.
_FAR, _TIMES = from_seconds(60.0), 10.0
# At the first or last sample, so many steps beside it are small.
_BESIDE = 3
# A larger part of an edge's samples is no exception.
_MOST = 0.05
# Steps that are longer than so many short ones, of this quantile, do not show the pace of a
# simulation.
_LONG, _SHORT = 100.0, 0.2

_NONE = np.empty(0, np.intp)


class FarSteps(NamedTuple):
    """
    What the far steps between the stamps of an edge mean.

    :ivar between: the places of lone stamps between others.
    :ivar ends: the places of the first and the last stamp, if they are far from those beside them.
    :ivar back: whether a step at these ends goes back, as where time begins anew.
    :ivar others: whether there are other far steps, such as from one run to another.
    """

    between: Places = _NONE
    ends: Places = _NONE
    back: bool = False
    others: bool = False


def lone_stamps_of(edges: Mapping[Edge, tuple[Stamps, Stamps]]) -> dict[Edge, Places]:
    """
    Return the places of lone stamps of each edge that has some, sorted.

    Without known arrivals there are none, because a pause looks the same. If time begins anew in
    a recording, the first and last samples of its edges are not judged, because they may be all
    that is left of another run.

    :param edges: for each edge, (N,) when each sample arrived, nanoseconds, 0 if it is not known;
        and (N,) its stamp, nanoseconds, in order of arrival.
    """
    found = {edge: far_steps(*columns) for edge, columns in edges.items()}
    anew = any(steps.others for steps in found.values()) or (
        len(found) > 1 and all(steps.back for steps in found.values()))
    places = {edge: steps.between if anew else np.sort(np.concatenate(
        [steps.between, steps.ends])) for edge, steps in found.items()}
    return {edge: lone for edge, lone in places.items() if len(lone)}


def far_steps(received: Stamps, stamps: Stamps) -> FarSteps:
    """Return what the far steps mean; the parameters are those of an edge."""
    known = np.flatnonzero(received > 0)
    moments = stamps[known].astype(float)
    steps = np.diff(moments)
    if np.abs(steps).max(initial=_FAR) <= _FAR:
        return FarSteps()
    far = _far(steps, np.abs(np.diff(received[known].astype(float))))
    between, ends = _between(moments, far), _ends(far)
    if len(between) + len(ends) > max(1.0, _MOST * len(moments)):
        return FarSteps(others=True)
    # The step at the last place is the one before it.
    back = np.signbit(steps[np.minimum(ends, len(steps) - 1)])
    return FarSteps(known[between], known[ends], bool(back.any()),
                    int(far.sum()) > 2 * len(between) + len(ends))


def _far(steps: Array, waited: Array) -> Mask:
    """Return which steps are far, (N - 1,): also compared with the pace of a simulation."""
    sizes = np.abs(steps)
    usual = sizes <= max(_FAR, _LONG * float(np.quantile(sizes, _SHORT, method='lower')))
    if not waited[usual].any():
        return np.zeros(len(steps), np.bool_)
    pace = max(1.0, float(sizes[usual].sum() / waited[usual].sum()))
    far: Mask = sizes > np.maximum(_FAR, _TIMES * pace * waited)
    return far


def _between(moments: Array, far: Mask) -> Places:
    """Return the places after and before which a far step is, but none beside these."""
    beside = np.concatenate([[False], far, [False]])
    alone = beside[1:-2] & beside[2:-1] & ~beside[:-3] & ~beside[3:]
    apart = np.abs(moments[2:] - moments[:-2])
    size = np.minimum(np.abs(moments[1:-1] - moments[:-2]), np.abs(moments[2:] - moments[1:-1]))
    lone: Places = np.flatnonzero(alone & (_TIMES * apart <= size)) + 1
    return lone


def _ends(far: Mask) -> Places:
    """Return the first and the last place, if only the step at it is far."""
    if len(far) < _BESIDE:
        return _NONE
    first = far[0] and not far[1:1 + _BESIDE].any()
    last = far[-1] and not far[-1 - _BESIDE:-1].any()
    return np.array([0] * bool(first) + [len(far)] * bool(last), np.intp)
