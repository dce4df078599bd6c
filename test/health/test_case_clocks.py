# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The clocks, delays, steps and drifts of the edges, which several checks compare."""

from clock_scenes import BEGIN, case_of, edge_of, late, mixed, MS, regular, SECOND
import numpy as np
import pytest
from tf_tree_py.health.checks.case import Delays, Drift
from tf_tree_py.health.measures.timing import ClockStep

TIMES = regular()
DAY = 86_400 * SECOND


def names(edges):
    return ' '.join('>'.join(edge.frames) for edge in edges)


# --- clocks

def test_edges_are_grouped_by_clock():
    edges = [edge_of('x>y', TIMES, lead=-100 * SECOND), edge_of('a>b', TIMES),
             edge_of('b>c', TIMES, 10 * MS), edge_of('c>lidar', TIMES, static=True),
             edge_of('c>d', TIMES, clock=-10 * SECOND)]
    case = case_of(*edges)
    assert [(names(clock.edges), clock.delay / MS) for clock in case.clocks] == [
        ('b>c a>b', 10.0), ('x>y', 100_004.0)]
    assert names(filter(case.goes_by_main_clock, case.edges)) == 'a>b b>c'
    assert names(case.delays) == 'a>b b>c'


def test_tree_without_moving_edges_has_no_clock():
    edge = edge_of('c>lidar', TIMES, static=True)
    case = case_of(edge)
    assert (case.clocks, case.delays, case.drifts, case.clock_steps) == ([], {}, {}, {})
    assert not case.goes_by_main_clock(edge)
    assert not case_of().recorded_in_simulation or case_of().now == 0


@pytest.mark.parametrize(('older', 'expected'), [
    (-1, True), (0, True), (1, False), (DAY - 1, False), (DAY, True)])
def test_stamp_that_was_repeated_from_the_beginning_shows_no_clock(older, expected):
    """Its usual delay is that of half of the time: 5 s."""
    repeats = edge_of('x>y', TIMES, lead=5 * SECOND - TIMES - older)
    case = case_of(repeats, edge_of('a>b', TIMES), edge_of('b>c', TIMES))
    assert any(repeats in clock.edges for clock in case.clocks) is expected


def test_edges_that_repeat_a_stamp_do_not_show_what_is_usual():
    frozen = [edge_of(f'x>{number}', TIMES, lead=4 * SECOND - TIMES) for number in range(3)]
    case = case_of(*frozen, edge_of('a>b', TIMES))
    assert [names(clock.edges) for clock in case.clocks] == ['a>b']


# --- delays

def test_delays_of_an_edge_in_quantiles():
    edge = late('a>b', 200, 1.0)
    delays = case_of(edge).delays[edge]
    assert delays == Delays(155 * MS, 200 * MS, 244 * MS, 49 * MS)
    assert (delays.spread, delays.width) == (89 * MS, 89 * MS)
    assert delays._replace(late=254 * MS).width == 98 * MS


def test_edge_whose_clock_was_set_has_neither_delays_nor_a_drift():
    was_set = edge_of('b>c', TIMES, 10 * MS + TIMES // 20, lead=700 * MS * (TIMES > 5 * SECOND))
    case = case_of(edge_of('a>b', TIMES), was_set)
    assert case.goes_by_main_clock(was_set) and was_set in case.clock_steps
    assert names(case.delays) == 'a>b' and not case.drifts


def test_delays_beside_an_edge_are_medians_of_the_others():
    first, second, third = late('a>b', 10, 0.1), late('b>c', 20, 0.3), late('c>d', 30, 0.2)
    case = case_of(first, second, third)
    # Of two, the first is the median.
    assert case.delays_beside(first) == Delays(6.5 * MS, 20 * MS, 33_200_000, 9.8 * MS)
    assert case.delays_beside(third).usual == 10 * MS
    assert case.delays_beside(edge_of('x>y', TIMES)) == Delays(
        6.5 * MS, 20 * MS, 33_200_000, 9.8 * MS)
    assert case_of(first).delays_beside(first) is None


@pytest.mark.parametrize(('count', 'expected'), [(30, 20), (31, 20)])
def test_of_many_edges_one_more_is_not_left_out(count, expected):
    """Without the first of 30 edges, the median is that of the others; of 31 it is that of all."""
    usual = [10 if count == 30 else 20] + [10] * (14 if count == 30 else 15) + [20] * 15
    edges = [late(f'a>{number}', each, count=20) for number, each in enumerate(usual)]
    assert len(edges) == count
    assert case_of(*edges).delays_beside(edges[0]).usual == expected * MS


@pytest.mark.parametrize(('by', 'expected'), [
    (-1, 5), (0, 5), (19.9, 5), (20, -20), (49.9, -20), (50, 0.0)])
def test_earliest_of_the_edges_that_are_later(by, expected):
    """Their usual delays are 10, 30 and 60 ms; the shortest ones 10, 5 and -20."""
    edges = [late('b>c', 60, 80 / 45), late('a>b', 10), late('c>d', 30, 25 / 45)]
    case = case_of(*edges)
    expected = {5: -20, -20: -20}.get(expected, expected)
    assert case.earliest_behind(edges[1], round(by * MS)) == pytest.approx(
        expected * MS, abs=100)


def test_earliest_is_the_shortest_delay_of_all_later_edges():
    edges = [late('a>b', 0), late('b>c', 30, 1.0), late('c>d', 60), late('d>e', 90, 2.0)]
    case = case_of(*edges)
    assert [case.earliest_behind(edges[0], by * MS) / MS for by in (-1, 10, 40, 70, 100)] == [
        -15, -15, 0, 0, 0]
    edges[3] = late('d>e', 90)
    case = case_of(*edges)
    assert [case.earliest_behind(edges[0], by * MS) / MS for by in (-1, 10, 40, 70, 90)] == [
        -15, -15, 60, 90, 0]
    assert case.earliest_behind(edges[2], 10 * MS) == 90 * MS


# --- steps

def stepped(before, after, step=1000):
    """Return an edge with delays, milliseconds, before and after a step of its clock."""
    # No two stamps are equal.
    times = TIMES + np.arange(100) * 1000
    delays = np.concatenate([np.resize(before, 50), np.resize(after, 50)])
    edge = edge_of('a>b', times, 0, lead=-np.rint(delays * MS).astype(np.int64))
    edge.moving.timing.steps[:] = [ClockStep(BEGIN + int(times[49]), step * MS)]
    return edge


def shifts(edge):
    """Return the steps of an edge's clock, milliseconds, beside edges without any."""
    others = [edge_of(name, TIMES) for name in ('b>c', 'c>d')]
    steps = case_of(edge, *others).clock_steps
    assert {*steps} <= {edge}
    return [step.step // MS for step in steps.get(edge, ())]


def last(count, value, rest=0.0):
    """Return 50 delays of which the last have another value."""
    return np.concatenate([np.full(50 - count, rest), np.full(count, value)])


@pytest.mark.parametrize(('before', 'after', 'step', 'expected'), [
    # More than half of the step remains.
    ([0.0], [-500.0], 1000, False), ([0.0], [-501.0], 1000, True),
    ([0.0], [500.0], -1000, False), ([0.0], [501.0], -1000, True),
    ([0.0], [1000.0], 1000, False), ([0.0], [0.0], 1000, False),
    # The delays are steady before and after it.
    ([0.0, 249.0], [-700.0], 500, True), ([0.0, 250.0], [-700.0], 500, False),
    ([0.0], [-700.0, -949.0], 500, True), ([0.0], [-700.0, -950.0], 500, False),
    ([0.0, 249.0], [700.0], -500, True), ([0.0, 250.0], [700.0], -500, False),
    # Two samples beside it may be far from the others, of 20.
    (last(2, 400.0), [-900.0], 500, True), (last(3, 400.0), [-900.0], 500, False),
    (last(2, -400.0), [-900.0], 500, True), (last(3, -400.0), [-900.0], 500, False),
    ([0.0], last(2, -500.0, -900.0)[::-1], 500, True),
    ([0.0], last(3, -500.0, -900.0)[::-1], 500, False),
    ([0.0], last(2, -1300.0, -900.0)[::-1], 500, True),
    ([0.0], last(3, -1300.0, -900.0)[::-1], 500, False)])
def test_step_of_a_clock_shifts_all_later_delays(before, after, step, expected):
    assert shifts(stepped(before, after, step)) == ([step] if expected else [])


@pytest.mark.parametrize(('place', 'expected'), [(20, False), (21, True)])
def test_only_twenty_samples_beside_a_step_count(place, expected):
    """Three of twenty are no longer steady."""
    before = last(2, 400.0)
    before[-place] = 400.0
    assert bool(shifts(stepped(before, [-900.0], 500))) is expected
    assert bool(shifts(stepped([0.0], before[::-1] - 900.0, 500))) is expected


def test_medians_beside_a_step_are_those_of_twenty_samples():
    """Of the samples before it, ten are later by half."""
    before = last(10, 0.0, -240.0)
    assert shifts(stepped(before, [-400.0], 500)) == [500]
    before[-20:-10] = -240.0
    assert shifts(stepped(before, [-371.0], 500)) == [500]
    assert shifts(stepped(before, [-369.0], 500)) == []


def test_all_steps_of_a_clock_are_kept():
    edge = stepped([0.0], [-900.0])
    edge.moving.timing.steps *= 2
    assert shifts(edge) == [1000, 1000]
    edge.moving.timing.steps[0] = ClockStep(BEGIN + SECOND, 1000 * MS)
    assert shifts(edge) == [1000]


def test_clock_that_repeats_its_stamps_after_a_step_shows_no_delays_there():
    edge = edge_of('a>b', TIMES, lead=-5 * SECOND * (TIMES >= 5 * SECOND))
    edge.moving.timing.steps[:] = [ClockStep(BEGIN + 5 * SECOND, -5 * SECOND)]
    assert shifts(edge) == []
    edge.moving.timing.steps[:] = [ClockStep(BEGIN - SECOND, -5 * SECOND)]
    assert shifts(edge) == []


# --- drifts

def test_drift_is_the_growth_of_the_delays_by_the_time_of_arrivals():
    times = regular(101)
    edge = edge_of('a>b', times, 400 * MS + times // 20)
    drift = case_of(edge, edge_of('b>c', times), edge_of('c>d', times)).drifts[edge]
    assert drift.slope == pytest.approx(0.05 / 1.05)
    assert drift.total == pytest.approx(0.5 * SECOND)
    assert isinstance(drift, Drift)


def test_drift_is_the_median_of_all_pairs():
    """Some delays are far from the others, in the first and in the second half."""
    times = regular(101)
    delays = 400 * MS + times // 20 + 50 * MS * (mixed(101) < 2)
    edge = edge_of('a>b', times, delays)
    drift = case_of(edge, edge_of('b>c', times), edge_of('c>d', times)).drifts[edge]
    assert drift.slope == pytest.approx(0.05 / 1.05, rel=1e-3)
