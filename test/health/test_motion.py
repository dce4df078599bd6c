# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The motion of an edge: exact numbers of small recordings, and the same as in plain Python."""

from dataclasses import astuple
import math
import random

import numpy as np
import pytest
from tf_tree_py.health.measures.motion import Jump, Motion
from tf_tree_py.health.measures.sample_rows import Rows, Steps
from tf_tree_py.health.measures.thresholds import Thresholds

SECOND, MS = 10**9, 10**6
LIMITS = Thresholds()
NO_JUMP = (0, 0, 0, 0.0, 0.0)


def rows_at(stamps, xs=(), angles=()):
    """Return rows on the axis x, or turned about the axis z."""
    stamps = np.array(stamps, np.int64)
    poses = np.zeros((7, len(stamps)))
    poses[6] = 1.0
    if len(xs):
        poses[0] = xs
    if len(angles):
        poses[5], poses[6] = np.sin(np.array(angles) / 2), np.cos(np.array(angles) / 2)
    return Rows(stamps + MS, stamps, poses)


def moved_by(rows, limits=LIMITS):
    motion = Motion(limits)
    motion.add(rows)
    with np.errstate(all='raise'):
        motion.add_steps(Steps(rows))
    return motion


# --- each sample alone

def test_edge_without_samples():
    motion = Motion(LIMITS)
    assert (motion.moved, motion.planar, motion.tilt, motion.travelled, motion.off_length,
            motion.worst_length, motion.steps, motion.speeds.count, motion.turn_rates.count) == (
        False, True, 0.0, 0.0, 0, 1.0, 0, 0, 0)
    assert {astuple(jump) for jump in (motion.fast, motion.slow, motion.outliers, motion.lone)
            } == {NO_JUMP}
    assert motion.turns.all == 0


def test_distance_travelled_is_the_largest_from_the_first_position_along_an_axis():
    motion = Motion(LIMITS)
    rows = rows_at(range(3), [1.0, 1.5, -1.0])
    rows.poses[2] = [0.0, 0.0, 1.75]
    motion.add(rows[:1])
    assert not motion.moved and motion.travelled == 0.0
    motion.add(rows[1:2])
    assert motion.moved and motion.travelled == 0.5
    motion.add(rows)
    assert motion.travelled == 2.0
    motion.add(rows[:1])
    assert motion.moved and motion.travelled == 2.0


@pytest.mark.parametrize('coordinate', range(7))
def test_any_other_coordinate_is_a_motion(coordinate):
    rows = rows_at(range(4))
    rows.poses[coordinate, 2] += 0.125
    motion = Motion(LIMITS)
    motion.add(rows)
    assert motion.moved
    assert motion.travelled == (0.125 if coordinate < 3 else 0.0)
    assert motion.planar is (coordinate not in (3, 4))


def test_lengths_of_quaternions():
    motion = Motion(LIMITS)
    rows = rows_at(range(6))
    rows.poses[6] = 1.0, 1.00099, 0.9, 1.05, 0.9991, 1.0011
    motion.add(rows)
    assert (motion.off_length, motion.worst_length) == (3, 0.9)
    motion.add(rows[3:])
    assert (motion.off_length, motion.worst_length) == (5, 0.9)
    rows.poses[3:, 0] = 0.3, 0.4, 1.2, 0.0
    motion.add(rows)
    assert motion.off_length == 9
    assert motion.worst_length == pytest.approx(1.3)


def test_tilt_is_the_largest_angle_to_the_vertical():
    motion = Motion(LIMITS)
    motion.add(rows_at(range(3), angles=[0.0, 1.0, -2.0]))
    assert motion.planar and motion.tilt == 0.0
    # About x by 0.4 and y by 0.3 radians at once, of length two; upside down is rounded.
    half = 0.25
    q = np.array([math.sin(half) * 0.8, math.sin(half) * 0.6, 0.0, math.cos(half)])
    rows = rows_at(range(2))
    rows.poses[3:, 1] = 2.0 * q
    motion.add(rows)
    assert not motion.planar
    assert motion.tilt == pytest.approx(0.5)
    motion.add(rows_at(range(2), angles=[1.0, 2.0]))
    assert not motion.planar and motion.tilt == pytest.approx(0.5)
    rows.poses[3:, 1] = 1.0, 1e-9, 0.0, 0.0
    motion.add(rows)
    assert motion.tilt == pytest.approx(math.pi)


# --- steps

def test_steps_of_an_edge_at_rest_are_only_counted():
    motion = moved_by(rows_at(range(10)))
    assert (motion.steps, motion.speeds.count, motion.turn_rates.count) == (6, 0, 0)


def test_speeds_of_the_judged_steps_with_a_newer_stamp():
    stamps = [0, 1, 2, 4, 4, 3, 5, 6]
    motion = moved_by(rows_at([stamp * SECOND for stamp in stamps],
                              [0.0, 9.0, 10.0, 14.0, 15.0, 16.0, 17.0, 99.0]))
    # Those from 1 s to 2 s, and to 4 s; two have no newer stamp.
    assert (motion.steps, motion.speeds.count) == (4, 2)
    assert (motion.speeds.least, motion.speeds.most) == (1.0, 2.0)
    assert moved_by(rows_at([1, 2, 3, 4, 5], [0.0, 0.0, 3.0, 3.0, 3.0])).speeds.most == 3e9
    turning = moved_by(rows_at([stamp * SECOND for stamp in stamps],
                               angles=[0.0, 0.4, 0.5, 0.7, 0.7, 0.7, 0.7, 0.0]))
    assert turning.turn_rates.count == 2
    assert (turning.turn_rates.least, turning.turn_rates.most) == pytest.approx((0.1, 0.1))


def test_lone_steps_are_those_that_are_not_zero():
    motion = moved_by(rows_at([number * SECOND for number in range(9)],
                              [0.0, 0.0, 1e-6, 2.5e-6, 2.5e-6, 2.5e-6, 9.0, 9.0, 9.0]))
    assert astuple(motion.lone) == pytest.approx((2, 5 * SECOND, SECOND, 9.0 - 2.5e-6, 0.0))


def test_largest_jump_of_all_blocks_is_kept():
    jump = Jump()
    steps = Steps(rows_at([0, 1, 2, 4, 5, 6], [0.0, 0.0, 1.0, 3.0, 3.0, 3.0]))
    jump.add(steps, np.array([False, False]))
    assert astuple(jump) == NO_JUMP
    jump.add(steps, np.array([True, True]))
    assert astuple(jump) == (2, 2, 2, 2.0, 0.0)
    jump.add(steps, np.array([True, False]))
    assert astuple(jump) == (3, 2, 2, 2.0, 0.0)
    jump.add(Steps(rows_at([9, 10, 11, 12, 13], [0.0, 0.0, 2.0, 2.0, 2.0])), np.array([True]))
    assert astuple(jump) == (4, 2, 2, 2.0, 0.0), 'the first of two'
    turned = rows_at([9, 10, 13, 14, 15], [0.0, 0.0, 1.5, 1.5, 1.5], [0.0, 0.0, 1.0, 1.0, 1.0])
    jump.add(Steps(turned), np.array([True]))
    assert astuple(jump) == pytest.approx((5, 10, 3, 1.5, 1.0))
    jump.add(Steps(rows_at([1, 2, 3, 4, 5], [0.0, 0.0, 2.25, 2.25, 2.25])), np.array([True]))
    assert astuple(jump) == pytest.approx((6, 10, 3, 1.5, 1.0)), 'less than both together'


# --- jumps

def sizes_of(part, rows):
    return [*Steps(rows).sizes[part]]


def naive_jumps(rows, part, limit):
    """Return the judged steps that are fast, large, or outliers, one by one."""
    sizes = sizes_of(part, rows)
    seconds = [max(int(b) - int(a), 1) / 1e9
               for a, b in zip(rows.stamps, rows.stamps[1:], strict=False)]
    onward = [b > a for a, b in zip(rows.stamps, rows.stamps[1:], strict=False)]
    two = Steps(rows).sizes_of_two[part]
    rates = [size / time for size, time in zip(sizes, seconds, strict=True)]

    def is_fast(place):
        return sizes[place] > limit * max(
            seconds[place], 0.25 * (seconds[place - 1] + seconds[place + 1]))

    found = []
    for here in range(1, len(sizes) - 2):
        alone = all(numbers[here] > 10.0 * max(numbers[here - 1], numbers[here + 1])
                    for numbers in (sizes, rates))
        pair = all(min(numbers[here], numbers[here + 1]) > 10.0 * max(
            numbers[here - 1], numbers[here + 2]) for numbers in (sizes, rates))
        found.append((
            alone and is_fast(here) and sizes[here] > 1e-3 and onward[here],
            alone and sizes[here] > 0.2 and onward[here]
            and rows.stamps[here + 1] - rows.stamps[here] > 90 * MS,
            pair and is_fast(here) and is_fast(here + 1) and sizes[here] > 1e-3
            and two[here] < 0.3 * min(sizes[here], sizes[here + 1])
            and onward[here] and onward[here + 1]))
    return found


def expected_jump(rows, marks):
    steps = Steps(rows)
    found = [place for place, mark in enumerate(marks, start=1) if mark]
    if not found:
        return NO_JUMP
    worst = max(found, key=lambda place: steps.size[place])
    return (len(found), rows.stamps[worst], rows.stamps[worst + 1] - rows.stamps[worst],
            steps.gone[worst], steps.turned[worst])


def check(rows, limits=LIMITS):
    motion = moved_by(rows, limits)
    both = [naive_jumps(rows, 0, limits.max_speed), naive_jumps(rows, 1, limits.max_turn_rate)]
    kinds = [[any(marks) for marks in zip(*of_step, strict=True)]
             for of_step in zip(*both, strict=True)]
    for name, marks in zip(('fast', 'slow', 'outliers'), zip(*kinds, strict=True), strict=True):
        assert astuple(getattr(motion, name)) == pytest.approx(expected_jump(rows, marks)), name
    return [motion.fast.count, motion.slow.count, motion.outliers.count]


@pytest.mark.parametrize('seed', range(4))
def test_jumps_of_random_recordings_are_as_in_plain_python(seed):
    chance, found = random.Random(seed), np.zeros(3)
    for _ in range(150):
        stamp, stamps, xs, angles = 100 * SECOND, [], [], []
        unit = chance.choice([MS, MS, 1])
        limits = Thresholds(max_speed=chance.choice([1.0, 10.0]), max_turn_rate=chance.choice(
            [5.0, 30.0]))
        for _ in range(24):
            stamp += chance.choice([10, 10, 10, 10, 20, 100, 91, 0, -5, 1]) * unit
            stamps.append(stamp)
            xs.append(chance.choice([0.0] * 9 + [0.001, 0.0011, 0.15, 0.25, 3.0, 1.0]))
            angles.append(chance.choice([0.0] * 9 + [0.0012, 0.15, 0.25, 1.0, 3.0]))
        if chance.random() < 0.5:
            xs, angles = np.cumsum(xs), np.cumsum(angles)
        which = chance.randrange(3)
        found += check(rows_at(stamps, xs if which != 1 else (), angles if which else ()), limits)
    assert (found > 20).all()


# The sizes of the steps around one of a metre, which takes as long as each of them.
@pytest.mark.parametrize('before, after, counts', [
    (0.0, 0.0, [1, 1, 0]), (0.125, 0.0, [0, 0, 0]), (0.0, 0.125, [0, 0, 0]),
    (0.0625, 0.0625, [1, 1, 0])])
def test_jump_is_ten_times_as_large_as_its_neighbours(before, after, counts):
    xs = np.cumsum([0.0, 0.0, before, 1.0, after, 0.0, 0.0])
    assert check(rows_at(np.arange(7) * 98 * MS, xs)) == counts


@pytest.mark.parametrize('size, limits, counts', [
    # In 0.125 s, at eight times its size a second: just at, and above, each limit.
    (10.0, Thresholds(max_speed=1.0), [0, 0, 0]), (10.5, Thresholds(max_speed=1.0), [1, 1, 0])])
def test_jump_is_more_than_ten_times_as_large(size, limits, counts):
    xs = np.cumsum([0.0, 0.0, 1.0, size, 1.0, 0.0, 0.0])
    assert check(rows_at(np.arange(7) * 125 * MS, xs), limits) == counts


@pytest.mark.parametrize('size, counts', [
    (1.25, [0, 1, 0]), (1.26, [1, 1, 0]), (0.2, [0, 0, 0]), (0.21, [0, 1, 0])])
def test_jump_is_fast_beyond_the_limit_and_slow_beyond_a_size(size, counts):
    xs = [0.0, 0.0, 0.0, size, size, size, size]
    assert check(rows_at(np.arange(7) * 125 * MS, xs)) == counts


@pytest.mark.parametrize('time, counts', [(90 * MS, [0, 0, 0]), (90 * MS + 1, [0, 1, 0])])
def test_slow_jump_takes_a_while(time, counts):
    xs = [0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5]
    stamps = np.cumsum([0, 90 * MS, 90 * MS, time, 90 * MS, 90 * MS, 90 * MS])
    assert check(rows_at(stamps, xs)) == counts


@pytest.mark.parametrize('size, counts', [(0.001, [0, 0, 0]), (0.00101, [1, 0, 0])])
def test_smallest_jump_and_smallest_outlier(size, counts):
    limits = Thresholds(max_speed=0.01)
    assert check(rows_at(np.arange(8) * 10 * MS, [0.0] * 4 + [size] * 4), limits) == counts
    outlier = [0.0] * 4 + [size] + [0.0] * 4
    assert check(rows_at(np.arange(9) * 10 * MS, outlier), limits) == [0, 0, counts[0]]


@pytest.mark.parametrize('rest, count', [(0.0, 1), (0.25, 0), (-0.29, 1), (-0.3, 0), (-0.31, 0)])
def test_outlier_is_reversed_by_the_next_step(rest, count):
    rows = rows_at(np.arange(9) * 10 * MS, [0.0] * 4 + [1.0] + [rest] * 4)
    assert check(rows) == [0, 0, count]
    assert moved_by(rows).turns.all == count


@pytest.mark.parametrize('times, counts', [
    # A step of 1.2 m is at most 10 m/s fast if it takes 0.12 s, or if those beside it do.
    ((200, 10, 200), [1, 0, 0]), ((240, 10, 240), [0, 0, 0]), ((480, 10, 10), [0, 0, 0]),
    ((10, 10, 480), [0, 0, 0]), ((10, 10, 460), [1, 0, 0]), ((460, 10, 10), [1, 0, 0])])
def test_step_counts_as_half_of_the_times_beside_it(times, counts):
    stamps = np.cumsum([0, 100, *times, 100, 100]) * MS
    assert check(rows_at(stamps, [0.0] * 3 + [1.2] * 4)) == counts


# --- how rare a jump is

def test_jump_is_rare_if_it_is_unusually_fast_and_hardly_any_step_is_as_fast():
    motion = Motion(LIMITS)
    motion.speeds.add(np.array([1.0] * 97 + [5.5] * 3))
    motion.turn_rates.add(np.array([1.0] * 200))
    for count, gone, rare in [(1, 5.5, True), (1, 5.0, False), (1, 4.0, False), (1, 6.0, True)]:
        jump = Jump(count, 0, SECOND, gone, 0.0)
        assert motion.is_rare(jump) is rare, (count, gone)
    motion.speeds.add(np.array([5.5]))
    # Four of 101, where one jump is known: at most two, and a hundredth of all.
    for count, rare in [(1, False), (2, True)]:
        assert motion.is_rare(Jump(count, 0, SECOND, 5.5, 0.0)) is rare
    for time, gone, rare in [(SECOND // 2, 2.75, True), (2 * SECOND, 2.75, False), (0, 0.0, False),
                             (0, 1e-8, True), (0, 4e-9, False), (1, 6e-9, True)]:
        assert motion.is_rare(Jump(2, 0, time, gone, 0.0)) is rare, (time, gone)


def test_jump_is_rare_if_only_its_rotation_is():
    motion = Motion(LIMITS)
    motion.speeds.add(np.array([1.0] * 20))
    motion.turn_rates.add(np.array([0.5] * 97 + [3.0] * 3))
    assert motion.is_rare(Jump(1, 0, SECOND, 1.0, 2.75))
    assert not motion.is_rare(Jump(1, 0, SECOND, 1.0, 2.5))
    assert motion.is_rare(Jump(1, 0, SECOND // 2, 0.5, 1.4))
    assert not motion.is_rare(Jump(1, 0, 2 * SECOND, 1.0, 3.0))
