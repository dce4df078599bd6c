# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The turns of an edge are those of a version in plain Python, however its samples come."""

import math
import random

from memory import bytes_of
from naive_turns import NaiveTurns, rows_of, SECOND
import numpy as np
import pytest
from tf_tree_py.health.measures.sample_rows import Steps, TAIL
from tf_tree_py.health.measures.turns import Turns

MS = 1_000_000
REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def turns_of(samples, *lengths):
    """Return the turns of samples that come in blocks of these lengths, again and again."""
    rows, turns, begin, number = rows_of(samples), Turns(), 0, 0
    while begin + TAIL < len(rows):
        end = begin + TAIL + (lengths[number % len(lengths)] if lengths else len(rows))
        turns.add(Steps(rows[begin:end]))
        begin, number = end - TAIL, number + 1
    return turns


def check(samples, *ways):
    """Compare the results, for each of several ways to form blocks; return the intervals."""
    naive = NaiveTurns(samples)
    for lengths in ways or [()]:
        turns = turns_of(samples, *lengths)
        assert (turns.all, turns.first, turns.last) == (naive.all, naive.first, naive.last)
        assert turns.sizes.count == naive.all
        if naive.all:
            assert (turns.sizes.least, turns.sizes.most, turns.sizes.mean) == pytest.approx(
                (min(naive.sizes), max(naive.sizes), sum(naive.sizes) / naive.all), rel=1e-9)
        assert turns.intervals == naive.intervals
    return naive.intervals


def turned(angle, x=0.0, y=0.0, sign=1.0):
    return (x, y, 0.0, 0.0, 0.0, sign * math.sin(angle / 2), sign * math.cos(angle / 2))


def regular(poses, begin=100 * SECOND, interval=10 * MS):
    return [(begin + number * interval, begin + number * interval + MS, pose)
            for number, pose in enumerate(poses)]


# --- which samples turn

def test_samples_of_random_walks_turn_as_in_plain_python():
    chance = random.Random(1)
    for _ in range(100):
        stamp, samples = 100 * SECOND, []
        angles = chance.choice([[0.0], [0.0, 0.004, 0.006, 0.3, 1.5, 1.6, 3.0, 4.5]])
        places = chance.choice([[0.0], [0.0, 0.005, 0.00499, 0.0051, -0.0051, -1.0, 1.0],
                                [0.0, 1.0, -0.3, 1.25, 0.25]])
        for number in range(30):
            stamp += chance.choice([10, 10, 10, 20, 30, 0, -10]) * MS
            samples.append((stamp, 100 * SECOND + number * MS, turned(
                chance.choice(angles), chance.choice(places), chance.choice([0.0, places[-1]]),
                chance.choice([-1.0, 1.0]))))
        check(samples, [chance.randint(1, 9) for _ in range(5)])


def test_samples_beside_a_line_turn_as_in_plain_python():
    """The distances from it are whole or half metres, some exactly at a limit."""
    chance = random.Random(2)
    for number in range(100):
        aside = chance.choice([[-10.0, -7.5, -7.0, -8.0, 10.0, 7.0, 7.5, 5.0, 3.0],
                               [-10.0, 10.0, 10.0, 0.0], [0.005, -0.005, 0.0051, -0.0051]])
        before, here, path = 0.0, 0.0, []
        for _ in range(40):
            path.append((here, *REST[1:]))
            before, here = here, 2.0 * here - before - 2.0 * chance.choice(aside)
        check(regular(path), [1 + number])


@pytest.mark.parametrize('poses, count', [
    # Where the edge is, where one sample is, and where the next ones are.
    ([0.0, 1.0, 0.23], 1), ([0.0, 1.0, 0.24], 0), ([0.0, 1.0, -0.3], 0), ([0.0, 1.0, -0.29], 1),
    ([0.0, 0.005, 0.0], 0), ([0.0, 0.0051, 0.0], 1), ([0.0, 1.0, 1.0], 0)])
def test_sample_turns_if_the_next_reverses_it(poses, count):
    path = [poses[0]] * 4 + [poses[1]] + [poses[2]] * 4
    turns = turns_of(regular([(x, *REST[1:]) for x in path]))
    assert turns.all == count
    received = 100 * SECOND + 41 * MS
    assert (turns.first, turns.last) == ((received, received) if count else (0, 0))


@pytest.mark.parametrize('place, count', [(1, 0), (2, 1), (5, 1), (6, 0)])
def test_two_samples_at_each_end_are_not_judged(place, count):
    poses = [REST] * 8
    poses[place] = (1.0, *REST[1:])
    assert turns_of(regular(poses)).all == count


@pytest.mark.parametrize('angle, x, count', [
    (1.5, 0.0, 1), (1.6, 0.0, 0), (1.6, 0.004, 0), (1.6, 0.0051, 1), (3.0, 1.0, 1)])
def test_rotation_by_more_than_a_quarter_turns_only_with_a_translation(angle, x, count):
    assert turns_of(regular([REST] * 4 + [turned(angle, x)] + [REST] * 4)).all == count


# --- two publishers

def test_samples_that_shake_alternate_where_they_are_farther_aside_than_their_neighbours():
    chance, found = random.Random(4), 0
    for number in range(100):
        before, here, path = 0.0, 0.0, []
        for place in range(chance.randint(19, 30)):
            path.append((here, *REST[1:]))
            before, here = here, 2.0 * here - before + (-1) ** place * chance.choice(
                [20.0] * 6 + [15.0])
        found += check(regular(path), [1 + number]) is not None
    assert 10 < found < 90


def publisher(begin, interval, count, pose, jitter=0):
    chance = random.Random(begin)
    return [(stamp, stamp, pose(number)) for number, stamp in enumerate(
        begin + number * interval + chance.randint(0, jitter) for number in range(count))]


def at(x, step=0.0):
    return lambda number: (x + step * number, *REST[1:])


def both(one, other):
    return sorted([*one, *other], key=lambda sample: sample[1])


BEGIN = 100 * SECOND


def test_intervals_of_two_publishers_are_found():
    samples = both(publisher(BEGIN, 20 * MS, 60, at(0.0)),
                   publisher(BEGIN + 7 * MS, 50 * MS, 24, at(1.0)))
    assert check(samples) == (20 * MS, 50 * MS)


@pytest.mark.parametrize('seed', range(5))
def test_intervals_of_random_publishers_are_as_in_plain_python(seed):
    """Whole milliseconds, so that many are exactly at a limit."""
    chance = random.Random(seed)
    found = 0
    for number in range(60):
        period, other = chance.choice([(10, 10), (10, 10), (20, 20), (10, 12), (10, 20), (4, 4)])
        unit = chance.choice([MS, MS, 10_000])
        jitter, step = chance.choice([0, 1, 3]), chance.choice([0.0, 0.0001, 0.001, 0.2])
        away = chance.choice([1.0, 0.011, 0.3])
        count = chance.choice([9, 16, 20, 40])
        one = publisher(BEGIN, period * unit, count, at(0.0, chance.choice([0.0, step])),
                        jitter * unit)
        two = publisher(BEGIN + chance.randint(1, period) * unit, other * unit, count,
                        at(away, step), chance.choice([0, jitter]) * unit)
        samples = both(one, two)
        if chance.random() < 0.3:
            # Coarse stamps, or messages out of order.
            coarse = chance.choice([10, 25, 100]) * unit
            samples = [(stamp // coarse * coarse, received, pose)
                       for stamp, received, pose in samples]
        if chance.random() < 0.2:
            lost = chance.randint(2, 9)
            samples = [sample for place, sample in enumerate(samples) if place % lost]
        found += check(samples, [7, 30, 2, 1 + number]) is not None
    assert found > 10


def rotation(chance, away):
    """Return a quaternion, turned by about this many radians."""
    q = np.array([chance.gauss(0.0, away / 4) for _ in range(3)] + [1.0])
    return tuple(chance.choice([-1.0, 1.0]) * q / np.linalg.norm(q))


@pytest.mark.parametrize('turned_apart', [False, True])
def test_tracks_near_two_poses_are_as_in_plain_python(turned_apart):
    """Two poses are apart by a metre and noise turns them, or the other way round."""
    chance, found = random.Random(5), set()
    for noise in (0.05, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5) * 3:
        away = np.zeros(6)
        away[chance.choice([3, 4, 5] if turned_apart else [0, 1, 2])] = 1.0

        def pose(number, which, away=away, noise=noise):
            there = which * away
            there[slice(0, 3) if turned_apart else slice(3, 6)] += [
                chance.gauss(0.0, noise) for _ in range(3)]
            q = np.array([*there[3:] / 2, 1.0])
            return (*there[:3], *chance.choice([-1.0, 1.0]) * q / np.linalg.norm(q))

        samples = both(publisher(BEGIN, 200 * MS, 40, lambda number: pose(number, 0)),
                       publisher(BEGIN + 70 * MS, 200 * MS, 40, lambda number: pose(number, 1)))
        found.add(check(samples))
    assert found == {None, (200 * MS, 200 * MS)}


@pytest.mark.parametrize('zero', [REST, (0.5, -0.2, 0.1, *REST[3:]),
                                  (0.0, 0.0, 0.1, 0.96, 0.0, 0.0, 0.28)])
def test_pose_that_one_publisher_always_sends_is_found_as_in_plain_python(zero):
    chance, found = random.Random(6), 0
    for noise in (0.0, 0.0004, 0.002) * 3:
        one = publisher(BEGIN, 20 * MS, 60, lambda number, noise=noise: (
            zero[0] + chance.uniform(0.0, noise), *zero[1:3],
            *chance.choice([-1.0, 1.0]) * np.array(zero[3:])))
        two = publisher(BEGIN + 3 * MS, 13 * MS, 92, lambda number: (
            *(chance.uniform(-3.0, 3.0) for _ in range(3)), *rotation(chance, 1.0)))
        found += check(both(one, two)) is not None
    assert found == 6


@pytest.mark.parametrize('still, gone, turned_by', [
    (still, 0.03, 0.0) for still in (0.0, 0.0005, 0.001, 0.0011)] + [
    (0.0, gone, 0.0) for gone in (0.0, 0.0199, 0.02, 0.0201, 0.03)] + [
    (0.0, 0.0, angle) for angle in (0.015, 0.025, 3.0)])
def test_two_that_alternate_differ_if_one_stands_still_and_the_other_moves(still, gone, turned_by):
    """Their stamps together are as regular as those of one."""
    samples = regular([pose for number in range(21) for pose in (
        (0.0, still if number < 10 else 0.0, *REST[2:]),
        turned(turned_by * number / 20, 0.03, 0.0 if number < 10 else gone,
               sign=(-1) ** number))], interval=20 * MS)
    found = check(samples, [9])
    assert (found is not None) == (still < 0.001 and max(gone, turned_by) > 0.02)


@pytest.mark.parametrize('interval', [9_000_000, 10_000_000, 20_000_000, 200_000_000])
@pytest.mark.parametrize('part', [0.9, 1.1])
def test_edge_that_would_be_shaken_too_much_has_two_publishers(interval, part):
    away = part * 2.0 * 3000.0 * (interval / 1e9 / math.pi) ** 2
    drift = 0.001 * away
    samples = regular([(away * (number % 2) + drift * number, *REST[1:]) for number in range(40)],
                      interval=interval)
    assert check(samples) == ((2 * interval, 2 * interval) if part > 1.0 else None)


@pytest.mark.parametrize('count', [7, 8, 9])
@pytest.mark.parametrize('begin', [23, 103])
def test_second_publisher_has_at_least_eight_samples(count, begin):
    """The other vibrates, and that alone is often enough."""
    vibrating = publisher(BEGIN, 20 * MS, 50, lambda number: (
        0.0, 0.05 * (number % 2), 0.001 * number, *REST[3:]))
    other = publisher(BEGIN + begin * MS, 50 * MS, count, at(5.0))
    assert check(both(vibrating, other)) == ((20 * MS, 50 * MS) if count >= 8 else None)


@pytest.mark.parametrize('count', range(6, 14))
def test_at_least_sixteen_samples_turn(count):
    two = both(publisher(BEGIN, 20 * MS, 40, at(0.0)),
               publisher(BEGIN + 105 * MS, 20 * MS, count, at(1.0)))
    assert check(two) == ((20 * MS, 20 * MS) if 2 * count - 1 >= 16 else None)


@pytest.mark.parametrize('repeats', range(4))
@pytest.mark.parametrize('backs', range(4))
def test_arrivals_count_if_more_than_a_twentieth_of_the_stamps_are_wrong(repeats, backs):
    # By their arrivals two, by their stamps one. Each wrong pair of samples is of one place.
    samples = [[BEGIN + number * 100 * MS, BEGIN + (number * 100 + 30 * (number % 2)) * MS,
                (1.0 * (number % 2) + 0.01 * number, *REST[1:])] for number in range(44)]
    for number in range(repeats):
        samples[5 + 2 * number][0] = samples[4 + 2 * number][0]
    for number in range(backs):
        samples[24 + 2 * number][0] = samples[23 + 2 * number][0] - 1
    found = check(samples)
    assert found == ((200 * MS, 200 * MS) if repeats + backs > 2 else None)


@pytest.mark.parametrize('offset', [4, 5, 6])
def test_stamps_of_two_vary_by_more_than_a_tenth_of_their_interval(offset):
    one = publisher(BEGIN, 200 * MS, 30, at(0.0, 0.01))
    two = publisher(BEGIN + 100 * MS, 200 * MS, 30, at(1.0, 0.01))
    two = [(stamp + offset * MS * (number % 2), received, pose)
           for number, (stamp, received, pose) in enumerate(two)]
    assert check(both(one, two)) == ((200 * MS, (200 - offset) * MS) if offset > 5 else None)


# --- many samples

@pytest.mark.parametrize('quiet_s, begin', [(0.0, 2.0), (0.3, 2.0), (0.3, 0.0), (3.0, 100.0)])
def test_of_many_samples_some_are_examined_together(quiet_s, begin):
    """Of the blocks that begin within a second after the last one that was examined, none is."""
    begin = round(begin * SECOND)
    first = begin + round(quiet_s * SECOND)
    lone = regular([REST] * 3 + [(1.0, *REST[1:])] + [REST] * 3, begin, MS)
    quiet = regular([REST] * 500, begin + 10 * MS, round(quiet_s * SECOND) // 500 or 1)
    two = both(publisher(first + 20 * MS, 2 * MS, 200, at(0.0)),
               publisher(first + 21 * MS, 5 * MS, 80, at(1.0)))
    after = regular([REST] * 500, first + SECOND, 5 * MS)
    for samples in (lone + quiet + two + after, two + after, lone + quiet + two):
        check(samples, [1000], [50], [256], [255, 3], [1, 700])


def test_blocks_are_examined_a_second_after_the_end_of_the_last():
    """A block begins at every 256th sample from the first turn on."""
    for pause in (999_999_999, SECOND, SECOND + 1):
        lone = regular([REST] * 3 + [(1.0, *REST[1:])] + [REST] * 255, BEGIN)
        # The third sample after it turns, and so on: the last of the block is the 258th.
        end = lone[3 + 255][0]
        two = both(publisher(end + pause, 2 * MS, 200, at(0.0)),
                   publisher(end + pause + MS, 5 * MS, 80, at(1.0)))
        late = [(stamp, received + 50 * MS, pose) for stamp, received, pose in two]
        found = check(lone + late + regular([REST] * 300, end + 3 * SECOND), [40])
        assert (found is not None) == (pause > SECOND), pause


def test_intervals_that_were_found_stay_and_take_no_memory():
    two = both(publisher(BEGIN, 2 * MS, 200, at(0.0)), publisher(BEGIN + MS, 5 * MS, 80, at(1.0)))
    turns = turns_of(two + regular([REST] * 2000, BEGIN + 2 * SECOND), 100)
    assert turns.intervals == (2 * MS, 5 * MS)
    assert bytes_of(turns) < 20_000
