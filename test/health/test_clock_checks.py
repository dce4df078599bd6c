# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The checks of clocks report small scenes in full, and nothing just below each limit."""

from clock_scenes import (
    BEGIN,
    case_of,
    driving,
    edge_of,
    found,
    late,
    MS,
    regular,
    SECOND,
    standing,
)
import numpy as np
import pytest
from tf_tree_py.health.checks.clocks import overlap, was_short
from tf_tree_py.health.measures.edge_record import MovingEdge
from tf_tree_py.health.measures.sample_rows import Rows
from tf_tree_py.health.measures.thresholds import Thresholds

TIMES = regular()


# --- several clocks

def by(name, seconds):
    """Return an edge whose clock is this far ahead."""
    return edge_of(name, TIMES, lead=seconds * SECOND)


def test_no_clock_and_one_clock_are_no_mixture():
    assert found('clock_mixture', case_of()) == []
    assert found('clock_mixture', case_of(by('a>b', 0), by('b>c', 29))) == []


def test_each_other_clock_is_compared_with_that_of_most_edges():
    edges = [by('x>y', -100), by('d>e', 3600), by('a>b', 0), by('x>z', -100), by('b>c', 0),
             by('e>f', 3600), by('y>w', -100), by('c>d', 0), by('f>g', 0), by('g>h', 60)]
    assert found('clock_mixture', case_of(*edges)) == [
        ('error', 'x>y x>z y>w', 'x -> y and 2 more edges are stamped 100.000 s behind 4 others',
         'edges=3, apart_s=100'),
        ('error', 'd>e e>f', 'd -> e and 1 more edge are stamped 3600.000 s ahead of 4 others',
         'edges=2, apart_s=-3600'),
        ('error', 'g>h', 'g -> h is stamped 60.000 s ahead of 4 others', 'edges=1, apart_s=-60')]


@pytest.mark.parametrize(('seconds', 'words'), [(100, '100.000 s ahead of'),
                                                (-100, '100.000 s behind')])
def test_of_two_clocks_that_of_the_arrivals_is_right(seconds, words):
    edges = [by('a>b', 0), by('b>c', seconds)]
    for ordered in (edges, edges[::-1]):
        assert found('clock_mixture', case_of(*ordered)) == [
            ('error', 'b>c', f'b -> c is stamped {words} a -> b', f'edges=1, apart_s={-seconds}')]


# --- steps

def set_by(name, step, at=5.0, **how):
    """Return an edge whose clock is set by these milliseconds after some seconds."""
    later = regular() > round(at * SECOND)
    return edge_of(name, TIMES, lead=round(step * MS) * later, **how)


@pytest.mark.parametrize(('step', 'words'), [
    (499, 'forward by 499 ms'), (-499, 'back by 499 ms'), (-1000, 'back by 1.000 s'),
    (-1001, 'back by 1.001 s'), (1001, 'forward by 1.001 s')])
def test_step_of_one_or_all_clocks(step, words):
    rest = ('at 1700000005.004000000 s, while their messages continued to arrive',
            f'step_s={step / 1000:g}, received_s=1700000005.004')
    one = ('warning', 'a>b', f'a -> b is stamped by a clock that was set {words}, {rest[0]}',
           f'edges=1, {rest[1]}')
    both = ('warning', 'a>b b>c',
            f'a -> b and 1 more edge are stamped by a clock that was set {words}, {rest[0]}',
            f'edges=2, {rest[1]}')
    assert found('clock_step', case_of(set_by('a>b', step), edge_of('b>c', TIMES))) == [one]
    # Where all stamps go back by more than a second, a recording was restarted.
    assert found('clock_step', case_of(set_by('a>b', step), set_by('b>c', step))) == (
        [both] if step >= -1000 else [])


@pytest.mark.parametrize(('later', 'groups'), [
    (1.9, [('a>b c>d b>c', -0.9)]), (2.0, [('a>b c>d b>c', -0.9)]),
    (2.1, [('a>b c>d', 0.7), ('b>c', -0.9)])])
def test_steps_within_two_seconds_are_of_one_clock(later, groups):
    edges = [set_by('b>c', -900, 2.0 + later), set_by('a>b', 700, 2.0), set_by('c>d', 600, 2.0),
             edge_of('d>e', TIMES)]
    steps = found('clock_step', case_of(*edges))
    assert [(one[1], float(one[3].split('step_s=')[1].split(',')[0])) for one in steps] == groups
    assert steps[0][3].endswith(f'received_s={1_700_000_002.004 + later * (len(groups) < 2)}')


def test_steps_that_follow_each_other_are_grouped_from_the_first():
    edges = [set_by('b>c', 700, 2.0), set_by('a>b', 800, 3.5), set_by('c>d', 600, 5.0),
             edge_of('d>e', TIMES)]
    assert [one[1] for one in found('clock_step', case_of(*edges))] == ['b>c a>b', 'c>d']


def test_edge_whose_clock_is_set_twice_is_listed_once():
    times = regular(500, 50.0)
    lead = 700 * MS * (times > 5 * SECOND) - 800 * MS * (times > 6.5 * SECOND)
    step, = found('clock_step', case_of(edge_of('a>b', times, lead=lead), edge_of('b>c', TIMES)))
    assert step[1] == 'a>b'
    assert step[3] == 'edges=1, step_s=-0.8, received_s=1700000006.504'


def test_step_before_one_of_the_recorders_clock_is_left_to_that():
    jump = np.where(TIMES > 7 * SECOND, 4 * MS + 3 * SECOND, 4 * MS)
    own = edge_of('b>c', TIMES[:60], lead=np.where(TIMES[:60] > 3 * SECOND, 700 * MS, 0))
    case = case_of(edge_of('a>b', TIMES, jump), own)
    assert case.arrival_step.step == 3 * SECOND
    assert [step.step for step in case.clock_steps[own]] == [700 * MS]
    assert found('clock_step', case) == []


# --- a time that is recorded twice

def twice(name, seconds=(), times=TIMES):
    """Return an edge that has a second publisher from one second to another."""
    poses = driving(len(times))
    poses[0] = 0.0
    order = np.arange(len(times))
    if seconds:
        begin, end = np.searchsorted(times, np.asarray(seconds) * SECOND)
        again = np.arange(begin, end)
        order = np.sort(np.concatenate([order, again]), kind='stable')
        second = np.flatnonzero(np.diff(order) == 0) + 1
        poses = np.array(poses[:, order])
        poses[0, second] = 0.5
        times = times[order].copy()
        times[second] += 2 * MS
    else:
        poses[0] = 0.01 * order
    return edge_of(name, times, 4 * MS, poses=lambda _: poses)


LONG = regular(1000, 50.0)


@pytest.mark.parametrize(('edges', 'expected'), [
    ([('a>b', True), ('b>c', True), ('c>d', False)], 'a>b b>c'),
    ([('a>b', True), ('c>d', False)], None),
    ([('a>b', True), ('b>c', True), ('c>d', False), ('d>e', False)], 'a>b b>c'),
    ([('a>b', True), ('b>c', True), ('c>d', False), ('d>e', False), ('e>f', False)], None)])
def test_half_of_the_moving_edges_have_to_come_twice(edges, expected):
    made = [twice(name, (5, 7) if again else (), LONG) for name, again in edges]
    made.append(edge_of('base>lidar', LONG, poses=standing))
    steps = found('clock_step', case_of(*made))
    assert steps == ([] if expected is None else [(
        'warning', expected, 'a -> b and 1 more edge are recorded twice for 1.980 s: the clock '
        'of the sender and of the recorder was set back by as much', 'edges=2, step_s=-1.98')])


@pytest.fixture(name='pair')
def pair_of_edges_that_come_twice():
    return [twice(name, (5, 7), LONG).moving for name in ('a>b', 'b>c')]


def measured(moving, first, last, *, count=100_000, span=100 * SECOND):
    """Set when an edge came twice, and for how long it came at all."""
    moving.motion.turns.first, moving.motion.turns.last = BEGIN + first, BEGIN + last
    moving.motion.turns.all = count
    moving.timing.first, moving.timing.last = BEGIN, BEGIN + span


@pytest.mark.parametrize(('last', 'expected'), [
    (10 * SECOND - 1, 10 * SECOND - 1), (10 * SECOND, 0), (1, 1), (0, 0), (-1, 0)])
def test_overlap_is_shorter_than_ten_seconds(pair, last, expected):
    for each in pair:
        measured(each, 0, last)
    assert overlap(pair) == expected


def test_overlap_reaches_from_the_first_to_the_last_of_all(pair):
    measured(pair[0], 2 * SECOND, 5 * SECOND)
    measured(pair[1], 3 * SECOND, 6 * SECOND)
    assert overlap(pair) == 4 * SECOND
    assert overlap(pair[::-1]) == 4 * SECOND
    measured(pair[1], 3 * SECOND, 6 * SECOND, span=10 * SECOND)
    assert overlap(pair) == 0


@pytest.mark.parametrize(('last', 'count', 'expected'), [
    (0, 100, False), (1, 100, True), (15 * SECOND - 1, 1000, True), (15 * SECOND, 1000, False),
    (10 * SECOND, 251, True), (10 * SECOND, 250, False), (-1, 100, False)])
def test_short_time_is_a_small_part_with_twice_the_samples(pair, last, count, expected):
    """The samples come at 50 Hz."""
    moving = pair[0]
    measured(moving, 0, last, count=count)
    moving.timing.intervals.add(np.full(2000, 20 * MS))
    assert was_short(moving) is expected


# --- stamps that stand still

def frozen(name, first, last, times=TIMES, **how):
    """Return an edge whose samples from one to another have the stamp of the first of them."""
    place = np.arange(len(times))
    return edge_of(name, times, lead=np.where(
        (place >= first) & (place <= last), times[first] - times, 0), **how)


@pytest.mark.parametrize(('first', 'last', 'severity', 'count', 'span', 'stamp'), [
    (20, 31, 'warning', 12, 1.1, '2.0'), (20, 90, 'warning', 71, 7.0, '2.0'),
    (49, 99, 'warning', 51, 5.0, '4.9'), (48, 99, 'error', 52, 5.1, '4.8'),
    (0, 98, 'warning', 99, 9.8, '0.0'), (0, 99, 'warning', 100, 9.9, '0.0')])
def test_frozen_stamp_is_an_error_if_it_is_the_last_for_long(
        first, last, severity, count, span, stamp):
    other = ', and with no other' if count == 100 else ''
    assert found('frozen_stamp', case_of(frozen('a>b', first, last), edge_of('b>c', TIMES))) == [(
        severity, 'a>b', f'a -> b came {count} times in {span:.3f} s with the stamp '
        f'170000000{stamp}00000000 s{other}',
        f'count={count}, span_s={span:g}, stamp_s=170000000{stamp}'.removesuffix('.0'))]


def test_stamp_that_is_repeated_for_a_second_is_not_frozen():
    assert found('frozen_stamp', case_of(frozen('a>b', 20, 30), edge_of('b>c', TIMES))) == []


def test_frozen_edge_that_never_moved_may_be_static():
    case = case_of(frozen('a>b', 20, 40, poses=standing), edge_of('b>c', TIMES))
    assert found('frozen_stamp', case) == [
        ('warning', 'a>b',
         'a -> b came 21 times in 2.000 s with the stamp 1700000002.000000000 s',
         'count=21, span_s=2, stamp_s=1700000002',
         'find out why the node has no new data: lookups for later times fail. If the edge is '
         'fixed, send it once on /tf_static')]


# --- whole seconds

def whole(name, count=100, hz=10.0, later=0):
    """Return an edge whose stamps are whole seconds, but for one that is later, nanoseconds."""
    times = regular(count, hz)
    lead = -(times % SECOND)
    lead[5] += later
    return edge_of(name, times, lead=lead)


@pytest.mark.parametrize(('edge', 'expected'), [
    (whole('a>b', 19), None), (whole('a>b', 20), 'count=20, rate_hz=10'),
    (whole('a>b', 100, later=1), None), (whole('a>b', 100, 1.0), None),
    (whole('a>b', 100, 2.0), None), (whole('a>b', 100, 2.5), 'count=100, rate_hz=2.5'),
    (edge_of('a>b', TIMES, lead=-TIMES), None)],
    ids=['few', 'enough', 'one is not', '1 Hz', '2 Hz', '2.5 Hz', 'one stamp'])
def test_whole_seconds_repeat(edge, expected):
    count = expected and expected[6:expected.index(',')]
    assert found('whole_seconds', case_of(edge)) == ([] if expected is None else [(
        'warning', 'a>b', f'a -> b has {count} stamps, all of them whole seconds', expected)])


# --- drifts

def drifting(name, part, count=100, hz=10.0, base=4):
    """Return an edge whose delays grow by a part of the time, from these milliseconds on."""
    times = regular(count, hz)
    return edge_of(name, times, np.rint(base * MS + part * times).astype(np.int64))


def test_edges_that_fall_behind_and_that_run_ahead_are_two_findings():
    edges = [drifting('a>b', 0.02), drifting('b>c', 0.03), drifting('c>d', -0.04, base=500),
             drifting('d>e', 0.025)]
    edges += [edge_of(f'e>{number}', TIMES) for number in range(6)]
    assert found('clock_drift', case_of(*edges)) == [
        ('warning', 'a>b b>c d>e', 'a -> b and 2 more edges are stamped more and more behind: '
         'by 2.91% of the time, 297 ms so far', 'edges=3, drift_s=0.297, drift_percent=2.91262'),
        ('warning', 'c>d', 'c -> d is stamped more and more ahead: by 4.17% of the time, 396 ms '
         'so far', 'edges=1, drift_s=-0.396, drift_percent=-4.16667')]
    assert [one[1] for one in found('clock_drift', case_of(drifting(
        'a>b', -0.04, base=500), edge_of('b>c', TIMES)))] == ['a>b']


@pytest.mark.parametrize(('part', 'count', 'hz', 'expected'), [
    (0.0030, 1000, 20.0, False), (0.00302, 1000, 20.0, True), (-0.00302, 1000, 20.0, True),
    (-0.00298, 1000, 20.0, False),  # a part of the time
    (0.0099, 200, 20.0, False), (0.0102, 200, 20.0, True),  # 100 ms
    (0.0150, 101, 10.0, False), (0.0152, 101, 10.0, True),  # 1.5 intervals
    (0.5, 19, 10.0, False), (0.5, 20, 10.0, True), (0.5, 21, 10.0, True)])
def test_drift_has_a_least_size(part, count, hz, expected):
    edges = [drifting('a>b', part, count, hz, base=400),
             *(edge_of(f'b>{number}', regular(count, hz)) for number in range(4))]
    assert bool(found('clock_drift', case_of(*edges))) is expected


@pytest.mark.parametrize(('noise', 'expected'), [(2.1, True), (2.2, False)])
def test_drift_is_three_times_as_large_as_the_delays_vary(noise, expected):
    """90 of 100 delays differ by 89 steps, and the drift is 0.6 s."""
    times = regular(100, 10.0)
    noisy = late('a>b', 400, noise).moving.timing.pairs.kept
    delays = noisy[:, 0] - noisy[:, 1] + np.rint(0.06 * times).astype(np.int64)
    edges = [edge_of('a>b', times, delays), edge_of('b>c', times), edge_of('c>d', times)]
    assert bool(found('clock_drift', case_of(*edges))) is expected


def test_edges_that_rest_or_have_few_samples_are_no_overlap():
    resting = MovingEdge(Thresholds())
    resting.add(Rows(BEGIN + TIMES, BEGIN + TIMES, standing(100)), ())
    assert overlap([]) == overlap([resting, resting]) == 0
