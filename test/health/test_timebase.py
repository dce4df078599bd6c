# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The clocks of stamps are those that loops over the samples find, and at each limit."""

from itertools import pairwise

from edge_clocks import at, BEGIN, edge_at, mid, SECOND, timing_of
from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.health.measures.timebase import ArrivalStep, Timebase


class NaiveLine:
    """The samples of an edge, as pairs of an arrival and a lead, in order of the arrivals."""

    def __init__(self, timing, begin, step):
        first = {}
        for received, stamp in timing.pairs.kept.tolist():
            first.setdefault(stamp, received)
        if step is not None:
            for stamp in first:
                if step.corrects and stamp <= step.stamp:
                    first[stamp] += step.step
                elif not step.corrects and stamp > step.stamp:
                    first[stamp] -= step.step
        self.samples = sorted(((received - begin, stamp - received)
                               for stamp, received in sorted(first.items())),
                              key=lambda sample: sample[0])
        self.times = [time for time, _ in self.samples]
        self.is_set = bool(timing.steps)
        lag = max(1, len(first) // 8)
        self.slopes = [(later[1] - sooner[1]) / (later[0] - sooner[0])
                       for sooner, later in zip(self.samples, self.samples[lag:], strict=False)
                       if later[0] > sooner[0]]
        self.pace = None

    def lead_at(self, moment, pace):
        return mid([lead + (pace - 1) * (moment - time) for time, lead in self.samples])


class NaiveTimebase:
    """What ``Timebase`` says, by loops."""

    def __init__(self, timings, step=None):
        self.begin = min((received for timing in timings
                          for received, _ in timing.pairs.kept.tolist()), default=0)
        self.step, self.differs, self.pace, self.lead, self.clocks = step, False, 1.0, 0.0, []
        self.knots, self.shape = [0.0], [0.0]
        lines = [NaiveLine(timing, self.begin, step) for timing in timings]
        if not lines:
            return
        times = [time for line in lines for time in line.times]
        for line in lines:
            if (len(line.times) >= 16 and line.slopes
                    and line.times[-1] - line.times[0] >= 0.25 * (max(times) - min(times))):
                line.pace = 1.0 + mid(line.slopes)
        self.moment = mid(times)
        self.sort(lines)
        alike = [lines[place] for place in self.clocks[0][0]]
        unset = [line for line in alike if not line.is_set]
        self.fit(unset if 2 * len(unset) >= len(alike) else alike)

    def sort(self, lines):
        foreign = [line.pace for line in lines if line.pace is not None
                   and abs(line.lead_at(self.moment, line.pace)) > 30 * SECOND]
        leads = []
        for line in lines:
            pace = line.pace
            if pace is None:
                other = abs(line.lead_at(self.moment, 1.0)) > 30 * SECOND
                pace = mid(foreign) if other and foreign else 1.0
            leads.append(line.lead_at(self.moment, pace))
        groups = []
        for place in sorted(range(len(lines)), key=lambda place: leads[place]):
            if groups and leads[place] - leads[groups[-1][-1]] <= 30 * SECOND:
                groups[-1].append(place)
            else:
                groups.append([place])
        groups.sort(key=lambda group: -len(group))
        self.clocks = [(group, -mid([leads[place] for place in group])) for group in groups]

    def fit(self, lines):
        paces = sorted(line.pace for line in lines if line.pace is not None)
        slopes = [slope for line in lines for slope in line.slopes]
        needed = 3 if any(abs(line.samples[0][1]) > 30 * SECOND for line in lines) else 16
        if paces:
            low, high = paces[(len(paces) - 1) // 2], paces[len(paces) // 2]
            self.pace = low if abs(low - 1) <= abs(high - 1) else high
        elif len(slopes) >= needed:
            self.pace = 1.0 + mid(slopes)
        rests = [[lead - (self.pace - 1) * (time - self.moment) for time, lead in line.samples]
                 for line in lines]
        times = [time for line in lines for time in line.times]
        noise = mid([at(rest, 0.95) - at(rest, 0.05) for rest in rests])
        drift = abs(self.pace - 1) * (max(times) - min(times))
        drifts = abs(self.pace - 1) > 0.02 and drift > max(0.25 * SECOND, 2 * noise)
        if abs(self.clocks[0][1]) <= 30 * SECOND and not drifts:
            self.pace = 1.0
            return
        self.differs = True
        for _ in range(3):
            left = []
            for line, rest in zip(lines, rests, strict=True):
                own = mid([each - self.bend(time)
                           for time, each in zip(line.times, rest, strict=True)])
                left += [(time, each - own) for time, each in zip(line.times, rest, strict=True)]
            left.sort(key=lambda pair: pair[0])
            count = min(64, max(1, len(left) // 16))
            ends = [sum(len(left) // count + (place < len(left) % count)
                        for place in range(number)) for number in range(count + 1)]
            self.knots = [mid([time for time, _ in left[slice(*each)]]) for each in pairwise(ends)]
            self.shape = [mid([rest for _, rest in left[slice(*each)]]) for each in pairwise(ends)]
        own = sorted(mid([lead - self.lead_of(time) for time, lead in line.samples])
                     for line in lines)
        self.lead = own[(len(own) - 1) // 2]

    def bend(self, time):
        return float(np.interp(time, self.knots, self.shape))

    def lead_of(self, time):
        return self.lead + (self.pace - 1) * (time - self.moment) + self.bend(time)

    def delays(self, timing):
        samples = NaiveLine(timing, self.begin, self.step).samples
        return ([time + self.begin for time, _ in samples],
                [(self.lead_of(time) if self.differs else 0.0) - lead for time, lead in samples])

    def elapsed(self, begin, end):
        if not self.differs:
            return end - begin
        return end - begin + self.lead_of(end - self.begin) - self.lead_of(begin - self.begin)


def near(number):
    return pytest.approx(number, rel=1e-9, abs=1000.0)


def compared(timings, step=None):
    """Return the clocks of some edges, which are those that loops find."""
    found, expected = Timebase(timings, step), NaiveTimebase(timings, step)
    assert [places for places, _ in found.clocks] == [places for places, _ in expected.clocks]
    assert [delay for _, delay in found.clocks] == near([delay for _, delay in expected.clocks])
    assert found.differs is expected.differs
    assert found.pace == pytest.approx(expected.pace, abs=1e-9)
    for timing in timings:
        for numbers, others in zip(found.delays(timing), expected.delays(timing), strict=True):
            assert numbers.tolist() == near(others)
    for begin, end in ((0, 7), (-3, 500), (31, 32), (50, 40)):
        elapsed = found.elapsed(BEGIN + begin * SECOND, BEGIN + end * SECOND)
        assert type(elapsed) is float
        assert elapsed == near(expected.elapsed(BEGIN + begin * SECOND, BEGIN + end * SECOND))
    return found


@given(st.integers(0, 2**32), st.integers(0, 5), st.booleans(), st.booleans())
def test_clocks_are_those_that_loops_find(seed, edges, other, set_back):
    rng = np.random.default_rng(seed)
    usual = rng.choice([1.0, 1.01, 1.03, 0.5, 3.0])
    timings = []
    for _ in range(edges):
        count = rng.choice([1, 2, 4, 15, 16, 40, 120])
        seconds = 5.0 + np.sort(rng.uniform(0.0, rng.choice([0.5, 10.0, 40.0]), count))
        pace = rng.choice([usual, usual, 1.0, 1.5])
        moments = seconds * pace + other * rng.choice([1e6, 1e6, 1e6 + 29, -500, 0])
        moments += np.where(seconds > 20.0, (seconds - 20.0) * rng.choice([0, 0, 0.2]), 0.0)
        moments += np.where(seconds > 25.0, rng.choice([0, 0, 5.0]), 0.0)
        moments = moments.round(rng.choice([3, 3, 0]))
        received = seconds + rng.choice([0.01, 0.3]) * rng.random(count)
        timings.append(timing_of(BEGIN + np.round(received * 1e9),
                                 BEGIN + np.round(moments * 1e9)))
    step = ArrivalStep(BEGIN + 20 * SECOND, BEGIN, 3 * SECOND, bool(rng.integers(2)))
    compared(timings, step if set_back else None)


def test_nothing_has_no_clock():
    nothing = compared([])
    assert (nothing.clocks, nothing.differs, nothing.pace) == ([], False, 1.0)


TEN = np.linspace(0.0, 10.0, 101)


@for_each(apart=[30.0 - 1e-6, 30.0, 30.0 + 1e-6])
def test_clocks_are_more_than_thirty_seconds_apart(apart):
    timings = [edge_at(TEN), edge_at(TEN, lead=apart), edge_at(TEN, lead=2 * apart)]
    clocks = compared(timings).clocks
    assert [places for places, _ in clocks] == (
        [[0, 1, 2]] if apart <= 30.0 else [[0], [1], [2]])
    alone = compared([edge_at(TEN, lead=apart, delay=0.0)])
    assert (alone.differs, alone.clocks) == (apart > 30.0, [([0], near(-apart * 1e9))])


@for_each(pace=[1.0199, 1.0201, 0.9801, 0.9799], seconds=[2.0, 12.4, 12.6, 40.0])
def test_pace_differs_by_two_percent_and_a_quarter_of_a_second(pace, seconds):
    timebase = compared([edge_at(np.linspace(0.0, seconds, 101), pace=pace)])
    assert timebase.differs is (abs(pace - 1.0) > 0.02 and seconds > 12.5)
    assert timebase.pace == pytest.approx(pace if timebase.differs else 1.0)


@for_each(seconds=[4.9, 5.1], pace=[1.05, 0.95])
def test_drift_of_a_quarter_of_a_second(seconds, pace):
    assert compared([edge_at(np.linspace(0.0, seconds, 101), pace=pace)]).differs is (seconds > 5)


@for_each(more=[-4, 0, 4])
def test_drift_of_exactly_a_quarter_of_a_second_is_none(more):
    received = BEGIN + np.arange(17) * (62_500_000 + more)
    stamps = BEGIN + np.arange(17) * (62_500_000 + more) // 4 * 5
    assert compared([timing_of(received, stamps)]).differs is (more > 0)


@for_each(noise_s=[0.2, 0.24, 0.26, 0.4])
def test_drift_is_twice_as_large_as_the_delays_vary(noise_s):
    delays = np.where(np.arange(401) % 10 == 9, noise_s, 0.0)[:200]
    edge = edge_at(np.linspace(0.0, 10.0, 200), pace=1.05, delay=delays)
    assert compared([edge]).differs is (noise_s <= 0.25)


@for_each(count=[2, 3, 4, 15, 16, 17], lead=[0.0, 1000.0])
def test_pace_needs_several_samples_and_fewer_of_another_clock(count, lead):
    edge = edge_at(np.linspace(0.0, 10.0, count), pace=1.5, lead=lead)
    timebase = compared([edge])
    enough = count >= 4 if lead else count >= 16
    assert timebase.pace == pytest.approx(1.5 if enough else 1.0)
    assert timebase.differs is (bool(lead) or enough)


@for_each(part=[0.24, 0.25, 0.26])
def test_pace_is_that_of_edges_over_a_quarter_of_the_time(part):
    """The pace of the short edge would be nearer to one."""
    short, whole = np.linspace(4.0, 4.0 + 10.0 * part, 21), np.linspace(0.0, 10.0, 101)
    timebase = compared([edge_at(short, pace=1.1, lead=1000), edge_at(whole, pace=1.2, lead=1000)])
    assert timebase.pace == pytest.approx(1.2 if part < 0.25 else 1.1)


@for_each(case=[((1.1, 1.2), 1.1), ((0.9, 0.8), 0.9), ((1.1, 0.8), 1.1), ((1.3, 0.8), 0.8),
                ((1.1, 1.2, 1.3), 1.2), ((1.1, 1.2, 1.3, 1.4), 1.2), ((0.6, 0.7, 0.8, 0.9), 0.8)])
def test_pace_of_several_edges_is_the_middle_one_nearer_to_one(case):
    paces, expected = case
    timings = [edge_at(TEN, pace=pace, lead=1000.0) for pace in paces]
    assert compared(timings).pace == pytest.approx(expected)


def test_few_samples_are_compared_by_the_pace_of_the_other_clock():
    """The clock goes at twice the pace, and the two samples are long before the middle."""
    seconds = np.linspace(0.0, 100.0, 101)
    many = edge_at(seconds, pace=2.0, lead=1000.0)
    few = edge_at([0.0, 1.0], pace=2.0, lead=1000.0)
    timebase = compared([many, few])
    (places, delay), = timebase.clocks
    assert (sorted(places), delay) == ([0, 1], near(-1048.99 * 1e9))
    assert np.abs(timebase.delays(few)[1]).max() < 0.02 * SECOND


def test_larger_clock_comes_first_and_shows_the_time():
    timings = [edge_at(TEN, lead=5000.0), edge_at(TEN, lead=0.3), edge_at(TEN, lead=5000.2),
               edge_at(TEN, lead=-900.0), edge_at(TEN, lead=5000.1)]
    timebase = compared(timings)
    assert timebase.clocks == [
        ([0, 4, 2], near(-5000.09 * 1e9)), ([3], near(900.01 * 1e9)), ([1], near(-0.29 * 1e9))]
    # Of three edges, the one in the middle shows the time.
    assert timebase.delays(timings[0])[1] == near(np.full(101, 0.1 * SECOND))
    assert timebase.elapsed(BEGIN, BEGIN + SECOND) == near(SECOND)


def test_of_two_edges_the_one_behind_shows_the_time():
    timings = [edge_at(TEN, lead=5000.5), edge_at(TEN, lead=5000.0)]
    timebase = compared(timings)
    assert timebase.delays(timings[0])[1] == near(np.full(101, -0.5 * SECOND))
    assert timebase.delays(timings[1])[1] == near(np.zeros(101))


@for_each(pace=[1.0, 1.5], lead=[0.0, 1000.0])
def test_samples_that_arrive_together_show_no_pace(pace, lead):
    """As in a file that was written in blocks, or all at once."""
    for ends in (np.repeat([3.0, 6.0, 10.0], [60, 50, 50]), np.full(30, 10.0), np.full(3, 10.0)):
        seconds = np.linspace(0.0, 10.0, len(ends))
        stamps = BEGIN + np.round((seconds * pace + lead) * 1e9)
        compared([timing_of(BEGIN + ends * SECOND, stamps)])


@for_each(lead=[0.0, 30.0, 30.001], pace=[-9.0, 11.0])
def test_first_of_a_few_samples_shows_whether_the_clock_is_another_one(lead, pace):
    timebase = compared([edge_at(np.arange(5.0), pace=pace, lead=lead, delay=0.0)])
    assert timebase.pace == pytest.approx(pace if lead > 30.0 else 1.0)


@for_each(lead=[30.0, -30.0, 30.001, -30.001])
def test_clock_of_a_few_samples_is_another_one_beyond_thirty_seconds(lead):
    """Then it goes as fast as the others that are: here one, which is five times as fast."""
    seconds = np.linspace(0.0, 100.0, 101)
    many = [edge_at(seconds, pace=5.0, lead=1000.0), edge_at(seconds, lead=30.0, delay=0.0),
            edge_at(seconds, lead=-30.0, delay=0.0)]
    few = edge_at([0.0, 1.0, 2.0], lead=lead, delay=0.0)
    places = {place: delay for group, delay in compared([*many, few]).clocks for place in group}
    # The middle of all times is 49 s, and that of the few is 1 s.
    assert places[3] == near(-(lead + (4 * 48.0 if abs(lead) > 30.0 else 0.0)) * 1e9)


@for_each(sets=[0, 1, 2, 3], edges=[2, 3, 4])
def test_clock_that_was_set_does_not_show_the_time_unless_most_were(sets, edges):
    if sets > edges:
        return
    lead = 1000.0 + np.where(TEN > 5.0, 7.0, 0.0)
    timings = [edge_at(TEN, lead=lead if place < sets else 1000.0) for place in range(edges)]
    assert [len(timing.steps) for timing in timings] == [1] * sets + [0] * (edges - sets)
    timebase = compared(timings)
    if 2 * sets <= edges:
        assert timebase.delays(timings[-1])[1] == near(np.zeros(101))


@for_each(edges=[1, 3, 5])
def test_pace_that_changes_is_followed_in_pieces(edges):
    """At most 64 of them, which 1,024 samples of five edges make possible."""
    seconds = np.linspace(0.0, 100.0, 250)
    bend = 3.0 * np.sin(seconds / 8.0) + 1.0 * np.sin(seconds)
    timings = [edge_at(seconds, lead=1000.0 + bend + 0.1 * place) for place in range(edges)]
    timebase = compared(timings)
    delays = np.abs(timebase.delays(timings[0])[1][10:-10])
    assert delays.max() < {1: 2.0, 3: 0.8, 5: 0.8}[edges] * SECOND
