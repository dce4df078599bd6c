# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A step of the clock of the arrivals is the one that loops over the samples find."""

from itertools import pairwise

from edge_clocks import at, BEGIN, edge_at, mid, MS, SECOND, timing_of
from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
from tf_tree_py.health.measures.timebase import arrival_step, ArrivalStep


def naive_arrival_step(timings):
    """Return the step, by loops over the samples."""
    edges = [sorted(timing.pairs.kept.tolist(), key=lambda pair: pair[1]) for timing in timings]
    edges = [pairs for pairs in edges if len(pairs) >= 10]
    found = []
    for pairs in edges:
        delays = [received - stamp for received, stamp in pairs]
        changes = [abs(after - before) for before, after in pairwise(delays)]
        place = changes.index(max(changes)) + 1
        change, varies = naive_change(delays, place)
        nearer = [abs(mid(part)) for part in (delays[:place], delays[place:])]
        if abs(change) >= max(100 * MS, 4 * varies) and min(nearer) <= 30 * SECOND:
            found.append(ArrivalStep(pairs[place - 1][1],
                                     max(received for received, _ in pairs[:place]),
                                     round(change), nearer[1] < nearer[0]))
    step = max(found, key=lambda each: each.stamp, default=None)
    if step is None or not any(naive_moves(timing, step.step) for timing in timings):
        return None
    for pairs in edges:
        place = sum(stamp <= step.stamp for _, stamp in pairs)
        if 5 <= place <= len(pairs) - 5:
            change, varies = naive_change([received - stamp for received, stamp in pairs], place)
            if abs(change - step.step) >= max(0.2 * abs(step.step), varies):
                return None
    return step


def naive_change(delays, place):
    before, after = delays[:place], delays[place:]
    if min(len(before), len(after)) < 5:
        return 0, 0
    return mid(after) - mid(before), max(at(part, 0.95) - at(part, 0.05)
                                         for part in (before, after))


def naive_moves(timing, step):
    if timing.waits.most > abs(step) / 2:
        return step > 0 or timing.jumps > 0
    return step < 0 and (timing.disorders > 0 or timing.waits.least < 0)


def step_of(*timings):
    found = arrival_step(timings)
    assert found == naive_arrival_step(timings)
    return found


def moved(count=20, place=10, step=3.0, *, lead=0.0, late=0.0, late_at=slice(1, None, 2),
          period=0.1, gap=0.0, sort=False):
    """Return an edge whose arrivals make a step after some samples; some are late."""
    seconds = period * np.arange(count) + gap * (np.arange(count) >= place)
    stamps = seconds + lead
    received = seconds + 0.01 + step * (np.arange(count) >= place)
    received[late_at] += late
    order = np.argsort(received, kind='stable') if sort else slice(None)
    return timing_of((BEGIN + np.round(received * 1e9))[order],
                     (BEGIN + np.round(stamps * 1e9))[order])


@given(st.integers(0, 2**32))
def test_step_of_the_arrivals_is_that_of_loops(seed):
    rng = np.random.default_rng(seed)
    for _ in range(8):
        step = rng.choice([3.0, -3.0, 0.1, 0.11, -0.3, 100.0])
        step_of(*(moved(
            rng.choice([9, 10, 14, 20, 60]), rng.choice([4, 5, 9, 10, 20]),
            step * rng.choice([1.0, 1.0, 1.19, 0.81, 1.3]), late=rng.choice([0.0, 0.0, 0.02, 0.8]),
            lead=rng.choice([0.0, 0.0, -3.0, 3.0, 50.0]), sort=bool(rng.integers(2)))
            for _ in range(rng.choice([0, 1, 1, 2, 3]))))


@for_each(case=[(3.0, 0.0, False), (3.0, 2.0, True), (3.0, 1.51, False),
                (-3.0, 0.0, False), (-3.0, -2.0, True)])
def test_step_of_the_arrivals(case):
    """The clock agrees with the stamps before the step, or after it."""
    step, lead, corrects = case
    found = step_of(moved(step=step, lead=lead))
    assert found == ArrivalStep(BEGIN + round((0.9 + lead) * 1e9), BEGIN + 910 * MS,
                                round(step * 1e9), corrects)
    stamps = BEGIN + np.round((np.array([0.8, 0.9, 1.0]) + lead) * 1e9).astype(np.int64)
    received = np.array([SECOND, 2 * SECOND, 9 * SECOND])
    change = round(step * 1e9) * np.array([1, 1, 0] if corrects else [0, 0, -1])
    assert found.correct(received, stamps).tolist() == (received + change).tolist()


@for_each(case=[
    # (keywords, whether a step is found)
    ({}, True), ({'count': 9, 'place': 5}, False), ({'count': 10, 'place': 5}, True),
    ({'place': 4}, False), ({'place': 5}, True), ({'place': 15}, True), ({'place': 16}, False),
    ({'step': 0.099}, False), ({'step': 0.1}, True), ({'step': -0.099}, False),
    ({'step': -0.2}, True), ({'step': -0.0999}, False),
    ({'step': 0.4, 'late': 0.1}, True), ({'step': 0.4, 'late': 0.101}, False),
    ({'lead': 33.01}, True), ({'lead': 33.02}, False), ({'lead': -30.0}, False),
    ({'lead': -29.99}, True),
    # A change of the delays without a gap of the arrivals is none.
    ({'step': 3.0, 'period': 7.0}, True), ({'step': -0.2, 'sort': True}, True),
    ({'step': -0.3, 'gap': 0.2}, False), ({'step': -0.3, 'gap': 0.199}, True),
    ({'step': -3.0, 'period': 7.0}, False)])
def test_step_of_the_arrivals_at_each_limit(case):
    keywords, is_found = case
    assert (step_of(moved(**keywords)) is not None) is is_found


@for_each(late=[-0.101, -0.1, 0.1, 0.101], late_at=[3, 15])
def test_delays_vary_little_before_and_after_a_step_of_the_arrivals(late, late_at):
    found = step_of(moved(step=0.4, late=late, late_at=late_at))
    assert (found is not None) is (abs(late) <= 0.1)


def test_stamps_overlap_where_the_arrivals_go_back():
    for timing, counter in ((moved(step=-3.0, period=7.0), 'jumps'),
                            (moved(step=-0.3, gap=0.2), 'disorders')):
        assert step_of(timing) is None
        setattr(timing, counter, 1)
        assert step_of(timing) is not None


@for_each(case=[(1.0, 3.0, True), (1.19, 3.0, True), (0.81, 3.0, True), (1.2, 3.0, False),
                (0.8, 3.0, False), (0.0, 3.0, False), (-1.0, 3.0, False)], sign=[1, -1])
def test_step_of_the_arrivals_is_that_of_all_edges(case, sign):
    part, step, is_found = case
    found = step_of(moved(step=sign * step),
                    moved(step=sign * step * part, place=10, lead=-0.0005))
    assert (found is not None) is is_found


def test_step_is_after_the_last_sample_of_any_edge_before_it():
    late, soon = moved(), moved(lead=-0.05)
    found = step_of(late, soon)
    assert found == step_of(soon, late) == step_of(late)
    assert found.stamp == BEGIN + 900 * MS and step_of(soon).stamp == BEGIN + 850 * MS


@for_each(samples=[(0, 14, True), (0, 15, False), (5, 30, False), (6, 30, True)])
def test_edge_with_few_samples_on_one_side_says_nothing_of_the_step(samples):
    begin, end, is_found = samples
    steady = edge_at(0.1 * np.arange(begin, end))
    assert step_of(steady) is None
    assert step_of(moved(40), steady) == (step_of(moved(40)) if is_found else None)
    assert step_of(moved(40)) is not None
