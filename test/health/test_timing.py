# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The measures of stamps and arrivals are those of a loop over samples, in blocks of any size."""

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.health.measures.edge_record import MovingEdge
from tf_tree_py.health.measures.sample_rows import Rows, Steps
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.measures.timing import clock_steps, ClockStep, Run, Timing

MS, SECOND = 10**6, 10**9
# How far the stamps advance: regularly, little, back by the limits of what is alike and of a jump.
ADVANCES = [20 * MS, 20 * MS, 20 * MS, 0, 1, -1, -5 * MS, -10 * MS, -10 * MS - 1, 500 * MS,
            500 * MS - 1, -SECOND, -SECOND - 1, 1 - SECOND, 2 * SECOND, 2 * SECOND + 1,
            -4 * SECOND, -4 * SECOND - 1, 4 * SECOND]
WAITS = [20 * MS, 20 * MS, 20 * MS, 0, 1, 300 * MS, 500 * MS, -100 * MS]


def rows_of(received, stamps):
    """Return rows that all have another pose, so that none is a repeat."""
    poses = np.zeros((7, len(stamps)))
    poses[0], poses[6] = np.arange(len(stamps)) * 1e-3, 1.0
    return Rows(np.array(received, np.int64), np.array(stamps, np.int64), poses)


def naive_runs(received, stamps):
    """Return the longest run without a newer stamp, and the present one."""
    longest, run, begin = Run(), Run(), 0
    for place, (arrival, stamp) in enumerate(zip(received, stamps, strict=True)):
        back = place and stamp < stamps[place - 1] - 10 * MS
        if run.samples and stamp <= run.stamp and not back:
            run = Run(run.samples + 1, arrival - begin, run.stamp)
        else:
            begin, run = arrival, Run(1, 0, stamp)
        if run.span >= max(longest.span, 1):
            longest = run
    return longest, run


def naive_steps(stamps):
    """Return the intervals with the stamps where they begin, and the counts of steps back."""
    times = [stamps[place + 1] - stamps[place] for place in range(len(stamps) - 1)]
    intervals, disorders, jumps, back, ahead = [], 0, 0, 0, 0
    for place in range(1, len(times) - 2):
        before, time, after = times[place - 1:place + 2]
        if time <= -SECOND:
            if after >= -time // 2:
                disorders += 1
            elif before >= -time // 2:
                ahead = max(ahead, -time)
            else:
                jumps, back = jumps + 1, max(back, -time)
        elif time < 0:
            disorders += 1
        elif time > 0 and after > -max(SECOND, -(-time // 2)):
            intervals.append((time, stamps[place]))
    return intervals, disorders, jumps, back, ahead


def first_of_longest(pairs):
    """Return where the longest of the spans begins, and the earliest of several."""
    return max(pairs, key=lambda pair: pair[0])[1] if pairs else 0


def spread_of(numbers):
    if not numbers:
        return (0, np.inf, -np.inf, [0.0, 0.0, 0.0], 0.0)
    ordered = sorted(numbers)
    return (len(numbers), ordered[0], ordered[-1],
            [ordered[round(part * (len(numbers) - 1))] for part in (0.1, 0.5, 0.9)],
            pytest.approx(sum(numbers) / len(numbers), abs=1.0))


def naive(rows):
    """Return the measures of at most 256 samples, computed by loops."""
    pairs = list(zip(rows.received.tolist(), rows.stamps.tolist(), strict=True))
    known = [arrival for arrival, _ in pairs if arrival > 0]
    heard = [(arrival, stamp) for arrival, stamp in pairs if arrival > 0 and stamp]
    waits = [(after - before, before) for before, after in zip(known, known[1:], strict=False)]
    longest, run = naive_runs([pair[0] for pair in heard], [pair[1] for pair in heard])
    intervals, *counts = naive_steps([stamp for _, stamp in pairs if stamp])
    usual = spread_of([time for time, _ in intervals])
    interval, stamps = usual[3][1], [stamp for _, stamp in heard]
    if len(intervals) < 8 and len(stamps) > 1:
        interval = max(interval, (max(stamps) - min(stamps)) / (len(stamps) - 1))
    first, last = (known[0], known[-1]) if known else (0, 0)
    return {
        'count': len(pairs), 'zeros': sum(stamp == 0 for _, stamp in pairs),
        'timed': sum(stamp != 0 for _, stamp in pairs), 'first': first, 'last': last,
        'span': last - first, 'longest_wait': first_of_longest(waits),
        'longest': first_of_longest(intervals),
        'whole_seconds': sum(stamp % SECOND == 0 for _, stamp in heard),
        'frozen': longest, 'run': run, 'interval': pytest.approx(interval, rel=1e-12),
        'rate_hz': pytest.approx((len(pairs) - 1) * 1e9 / (last - first)) if last > first else 0.0,
        'disorders': counts[0], 'jumps': counts[1], 'back': counts[2], 'ahead': counts[3],
        'delays': spread_of([arrival - stamp for arrival, stamp in heard]),
        'waits': spread_of([wait for wait, _ in waits]), 'intervals': usual,
        'pairs': [list(pair) for pair in heard]}


def measured(timing):
    facts = {name: getattr(timing, name) for name in (
        'count', 'zeros', 'timed', 'first', 'last', 'span', 'longest_wait', 'longest', 'rate_hz',
        'whole_seconds', 'frozen', 'run', 'interval', 'disorders', 'jumps', 'back', 'ahead')}
    for name in ('delays', 'waits', 'intervals'):
        spread = getattr(timing, name)
        facts[name] = (spread.count, spread.least, spread.most, spread.at(0.1, 0.5, 0.9),
                       spread.mean)
    return {**facts, 'pairs': timing.pairs.kept.tolist()}


def in_blocks(rows, size):
    edge = MovingEdge(Thresholds())
    for begin in range(0, len(rows), size):
        edge.add(rows[begin:begin + size], ())
    return edge.timing


@given(st.integers(0, 2**32), st.integers(1, len(ADVANCES)),
       st.sampled_from([100 * SECOND, -SECOND // 50, 8 * MS]))
def test_measures_are_those_of_a_loop_over_the_samples(seed, kinds, begin):
    rng = np.random.default_rng(seed)
    for count, sizes, some in ((5, [1, 2, 5], rng.choice(ADVANCES, kinds)),
                               (30, [4, 7, 60], rng.choice(ADVANCES, kinds)),
                               (9, [3, 9], np.array([20 * MS, 20 * MS, 0])),
                               (9, [9], np.array([20 * MS, -1]))):
        stamps = begin + np.cumsum(rng.choice(some, count))
        # The clock of the arrivals goes back only where no stamp is repeated.
        waits = WAITS if (some > 0).all() else WAITS[:-1]
        received = 200 * SECOND + np.cumsum(rng.choice(waits, count))
        stamps[rng.random(count) < rng.choice([0.0, 0.1])] = 0
        received[:rng.choice([0, 0, 3])] = 0
        rows = rows_of(received, stamps)
        expected = naive(rows)
        for size in sizes:
            assert measured(in_blocks(rows, size)) == expected


def test_edge_without_samples_has_no_measures():
    empty = Timing()
    assert measured(empty) == {**naive(rows_of([], [])), 'rate_hz': 0.0}
    assert (empty.duplicates, empty.differing, empty.steps, empty.is_coarse) == (0, 0, [], False)
    empty.add(rows_of([], []))
    assert measured(empty) == naive(rows_of([], []))


@for_each(count=[2, 3, 9, 11, 12])
def test_few_irregular_intervals_are_not_judged_by_their_median(count):
    """Of 11 samples, 7 intervals are judged; of 12, 8."""
    stamps = 100 * SECOND + np.cumsum([20 * MS] * (count - 1) + [SECOND])
    interval = in_blocks(rows_of(stamps + 1, stamps), count).interval
    mean = ((count - 2) * 20 * MS + SECOND) / (count - 1)
    assert interval == pytest.approx(mean if count < 12 else 20 * MS)


def test_rate_of_the_shortest_span():
    timing = Timing()
    timing.add(rows_of([5, 6], [5, 6]))
    assert timing.rate_hz == 1e9


@for_each(zeros=[0, 1], repeats=[4, 5, 6])
def test_stamps_are_coarse_if_most_repeat_the_one_before(zeros, repeats):
    timing = Timing()
    timing.add(rows_of([SECOND] * (10 + zeros), [SECOND] * 10 + [0] * zeros))
    timing.duplicates = repeats
    assert timing.is_coarse is (repeats > 5)


# --- steps of a clock

def naive_clock_steps(received, stamps, interval):
    """Judge each step beside those before and after it."""
    times = np.diff(stamps).tolist()
    waits = np.diff(received).tolist()
    least = max(100 * MS, 4.0 * interval)
    judged = range(1, len(times) - 2)
    if not interval or all(abs(times[place] - interval) <= least for place in judged):
        return []
    waited = sorted(waits)[round(0.5 * (len(waits) - 1))]
    pace = interval / waited if waited > 0 else 1.0
    leads = [time - interval - (wait - waited) * pace
             for time, wait in zip(times, waits, strict=True)]
    return [ClockStep(received[place], round(leads[place])) for place in judged
            if abs(leads[place]) > least and received[place] > 0
            and abs(waits[place] - waited) * pace < 0.5 * abs(leads[place])
            and all(abs(leads[place] + leads[beside]) > 0.5 * abs(leads[place])
                    for beside in (place - 1, place + 1))]


def found_steps(times, waits, interval=20.0 * MS, begin=100 * SECOND):
    received = np.cumsum([begin, *waits])
    stamps = np.cumsum([100 * SECOND, *times])
    found = clock_steps(Steps(rows_of(received, stamps)), interval)
    assert found == naive_clock_steps(received.tolist(), stamps.tolist(), interval)
    return [(step.received, step.step) for step in found]


@given(st.integers(0, 2**32), st.sampled_from([20.0 * MS, 40.0 * MS, 4.0]),
       st.sampled_from([0, 10 * MS, 20 * MS, -20 * MS]))
def test_steps_of_a_clock_are_those_of_a_loop(seed, interval, wait):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        times = rng.choice([20, 20, 20, 20, 120, 121, 320, -280, -80, 170, -10_000, 420], 12) * MS
        waits = np.where(rng.random(12) < 0.8, wait, rng.choice([0, 70, 160, 400, -130], 12) * MS)
        received = np.cumsum([rng.choice([0, SECOND]), *waits])
        stamps = np.cumsum([100 * SECOND, *times])
        assert clock_steps(Steps(rows_of(received, stamps)), interval) == naive_clock_steps(
            received.tolist(), stamps.tolist(), interval)


@for_each(case=[
    # (the step, how long its arrival took, the step found after 19 regular samples), milliseconds
    (120, 20, None), (121, 20, 101), (-80, 20, None), (-81, 20, -101),
    (120, 10, None), (121, 10, 111), (121, 22, None), (130, 20, 110),
    (320, 119, 201), (320, 120, None), (320, 220, None), (-280, -80, None), (-280, -79, -201)])
def test_step_of_a_clock_is_large_and_arrives_in_time(case):
    step, wait, found = case
    times, waits = [20 * MS] * 40, [20 * MS] * 40
    times[19], waits[19] = step * MS, wait * MS
    assert found_steps(times, waits) == (
        [] if found is None else [(100 * SECOND + 19 * 20 * MS, found * MS)])


@for_each(interval_ms=[24, 25, 26, 100], more=[-1, 0, 1])
def test_step_of_a_clock_is_longer_than_four_intervals(interval_ms, more):
    least = max(100, 4 * interval_ms)
    times = [interval_ms * MS] * 20
    times[10] += least * MS + more
    found = found_steps(times, [interval_ms * MS] * 20, float(interval_ms * MS))
    assert found == ([(100 * SECOND + 10 * interval_ms * MS, least * MS + 1)] if more > 0 else [])


@for_each(reversal=[1.0, 0.51, 0.5, 0.49, 0.0, -1.0], beside=[-1, 1])
def test_step_that_the_next_or_the_previous_one_reverses_is_none(reversal, beside):
    times = [20 * MS] * 20
    times[10] += 400 * MS
    times[10 + beside] -= round(reversal * 400) * MS
    places = [received for received, _ in found_steps(times, [20 * MS] * 20)]
    assert (100 * SECOND + 10 * 20 * MS in places) is (reversal < 0.5)


@for_each(place=range(20))
def test_step_is_judged_between_one_step_before_and_two_after_it(place):
    times = [20 * MS] * 20
    times[place] += 400 * MS
    assert found_steps(times, [20 * MS] * 20) == (
        [(100 * SECOND + place * 20 * MS, 400 * MS)] if 1 <= place <= 17 else [])


def test_stamps_of_a_fast_simulation_are_compared_by_its_pace():
    """Ten times as fast: a wait of 12 ms instead of 2 ms explains an interval of 120 ms."""
    times, waits = [20 * MS] * 20, [2 * MS] * 20
    times[10], waits[10] = 220 * MS, 22 * MS
    assert found_steps(times, waits) == []
    waits[10] = 2 * MS
    assert found_steps(times, waits) == [(100 * SECOND + 20 * MS, 200 * MS)]


def test_no_step_is_found_without_an_interval_or_an_arrival():
    times = [20 * MS] * 10 + [520 * MS] + [20 * MS] * 9
    assert found_steps(times, [0] * 20, begin=1) == [(1, 500 * MS)]
    assert found_steps(times, [0] * 20, begin=0) == []
    assert found_steps(times, [20 * MS] * 20, interval=0.0) == []


def test_at_most_a_hundred_steps_are_kept_and_those_of_the_last_block():
    timing = Timing()

    def add(count):
        stamps = 10 * SECOND + np.cumsum(([20 * MS] * 9 + [520 * MS]) * count + [20 * MS] * 4)
        received = 20 * MS * np.arange(1, len(stamps) + 1)
        timing.add(rows_of(received, stamps))
        timing.add_steps(Steps(rows_of(received, stamps)))
        return len(timing.steps)

    assert [add(50), add(49), add(1), add(1), add(60)] == [50, 99, 100, 100, 100]
    assert timing.steps[:2] == [ClockStep(180 * MS, 500 * MS), ClockStep(380 * MS, 500 * MS)]
