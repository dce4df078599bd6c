# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Samples as arrays, the steps between them, and their gathering, sample by sample."""

import math
import random

from naive_turns import apart, aside_of, points_of, rows_of
import numpy as np
import pytest
from tf_tree_py.core import Kind
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.measures.sample_rows import (
    ENOUGH,
    MessageColumns,
    NO_ROWS,
    OF_EACH,
    RecentSamples,
    Rows,
    Steps,
)

REST = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def plain(rows):
    return [(int(received), int(stamp), tuple(pose)) for received, stamp, pose in zip(
        rows.received, rows.stamps, rows.poses.T.tolist(), strict=True)]


def numbered(*numbers):
    return Rows(np.array(numbers) + 100, np.array(numbers),
                np.array([[10.0 * number + place for place in range(7)] for number in numbers]).T)


# --- rows

def test_parts_of_rows():
    rows = numbered(1, 2, 3, 4)
    assert len(rows) == 4 and len(NO_ROWS) == 0
    assert plain(rows[1:3]) == plain(numbered(2, 3))
    assert plain(rows[np.array([3, 0])]) == plain(numbered(4, 1))
    assert plain(rows.last(2)) == plain(numbered(3, 4))
    assert plain(rows.last(9)) == plain(rows)
    assert plain(rows.after(numbered(8, 9))) == plain(numbered(8, 9, 1, 2, 3, 4))
    assert plain(rows.after(NO_ROWS)) == plain(rows)
    assert rows.where(np.ones(4, bool)) is rows
    assert plain(rows.where(np.array([True, False, False, True]))) == plain(numbered(1, 4))
    assert not len(rows.where(np.zeros(4, bool)))


def test_last_rows_keep_no_others_in_memory():
    last = numbered(1, 2, 3).last(1)
    assert [array.base for array in (last.received, last.stamps, last.poses)] == [None] * 3


def test_rows_of_use():
    rows = rows_of([(0, 0, REST)] * 6)
    assert rows.of_use() is rows
    rows.poses[3:, 1] = 0.0, 0.0, 1.0, 0.0
    rows.poses[3:, 2] = 0.0
    rows.poses[2, 2] = 1.0
    rows.poses[0, 3] = math.nan
    rows.poses[6, 4] = math.inf
    rows.poses[3:, 5] = 1.0, 0.0, 0.0, 0.0
    rows.stamps[:] = range(6)
    assert rows.of_use().stamps.tolist() == [0, 1, 5]
    assert rows[:3].of_use().stamps.tolist() == [0, 1]


# --- steps

@pytest.mark.parametrize('seed', range(3))
def test_steps_of_random_samples_are_as_in_plain_python(seed):
    chance = random.Random(seed)
    for _ in range(40):
        stamp, samples = 1000, []
        for number in range(12):
            stamp += chance.choice([0, 1, 1, 2, 3, -1])
            q = np.array([chance.gauss(0.0, 1.0) for _ in range(4)])
            place = [chance.choice([0.0, 1.0, chance.random()]) for _ in range(3)]
            samples.append((stamp, 5000 + number * number, (*place, *q / np.linalg.norm(q))))
            if chance.random() < 0.3:
                samples.append((stamp + 1, 5001 + number * number, samples[-1][2]))
        steps = Steps(rows_of(samples))
        pairs = [*zip(samples, samples[1:], strict=False)]
        assert steps.stamps.tolist() == [a[0] for a, _ in pairs]
        assert steps.received.tolist() == [a[1] for a, _ in pairs]
        assert steps.time.tolist() == [b[0] - a[0] for a, b in pairs]
        assert steps.waited.tolist() == [b[1] - a[1] for a, b in pairs]
        expected = np.array([apart(a[2], b[2]) for a, b in pairs]).T
        near = {'rel': 1e-9, 'abs': 1e-9}
        assert np.array(steps.sizes) == pytest.approx(expected, **near)
        assert np.array([steps.gone, steps.turned]) == pytest.approx(expected, **near)
        assert steps.size == pytest.approx(expected.sum(axis=0), **near)
        assert np.array(steps.sizes_of_two) == pytest.approx(np.array([
            apart(a[2], b[2]) for a, b in zip(samples, samples[2:], strict=False)]).T, **near)
        points = points_of(samples)
        assert steps.points == pytest.approx(np.array(points).T, **near)
        aside = [aside_of(steps.time[place], steps.time[place + 1], points[place:place + 3])
                 for place in range(len(samples) - 2)]
        assert steps.aside == pytest.approx(np.array(aside).T, **near)


@pytest.mark.parametrize('times, x, aside', [
    ((1, 1), 0.5, 0.0), ((1, 3), 0.25, 0.0), ((1, 3), 0.5, 0.0), ((3, 1), 0.75, 0.0),
    ((0, 1), 0.125, 0.125), ((1, 0), 0.875, -0.125), ((0, 0), 0.875, 0.375),
    ((0, 0), 0.0, -0.5), ((-1, 3), 0.125, -0.375), ((3, -1), 0.125, -0.375),
    ((0, 1), 0.25, -0.25), ((1, 0), 0.75, 0.25), ((-1, 1), 0.125, -0.375), ((0, 2), 0.0, 0.0),
    ((1, 3), 0.375, -0.125)])
def test_sample_is_aside_of_the_middle_or_of_the_point_that_its_stamp_implies(times, x, aside):
    """In the middle of both, the middle counts."""
    stamps = np.cumsum([10, *times])
    steps = Steps(rows_of([(stamp, 0, (place, *REST[1:])) for stamp, place in zip(
        stamps, (0.0, x, 1.0), strict=True)]))
    assert steps.aside.T.tolist() == [[aside, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


def test_poses_with_other_lengths_are_normalised():
    steps = Steps(rows_of([(0, 0, (0, 0, 0, 0, 0, 0, 2)), (1, 0, (0, 0, 0, 0, 0, -3, 0))]))
    assert steps.turned == pytest.approx([math.pi])
    assert steps.points[3:].T.tolist() == [[0, 0, 0, 2], [0, 0, -2, 0]]


# --- recent samples

def test_counts_and_delays_since_the_last_call():
    recent = RecentSamples()
    assert (recent.count, recent.timed, recent.mean_delay, recent.longest_delay,
            recent.shortest_delay, recent.refused, recent.ahead) == (
        0, 0, 0.0, -math.inf, math.inf, 0, 0.0)
    recent.add(Rows(np.array([0, 1, 9]), np.array([5, 3, 5]), np.zeros((7, 3))))
    assert (recent.count, recent.timed, recent.mean_delay, recent.longest_delay,
            recent.shortest_delay, recent.ahead) == (3, 2, 1.0, 4.0, -2.0, 2.0)
    recent.add(Rows(np.array([0]), np.array([5]), np.zeros((7, 1))))
    recent.add(Rows(np.array([20, 20]), np.array([10, 11]), np.zeros((7, 2))))
    assert (recent.count, recent.timed, recent.mean_delay, recent.longest_delay,
            recent.shortest_delay, recent.ahead) == (6, 4, 5.25, 10.0, -2.0, 2.0)
    recent.incidents.update({Kind.OLD_DATA: 2, Kind.LOOP: 1})
    assert recent.refused == 3


# --- gathering

def message(edges, stamps, received=7, topic='/tf', static=False, authority=''):
    return ReceivedMessage(Batch(edges, stamps, [pack_pose(stamp, *REST[1:]) for stamp in stamps]),
                           received, topic, static, authority)


A, B, C = ('map', 'a'), ('map', 'b'), ('map', 'c')


def test_columns_have_the_samples_of_each_edge_in_order_of_arrival():
    columns = MessageColumns()
    for arrival in (
            message([A, B], [1, 2], 10, authority='/x'), message([B, C], [3, 4], 11),
            message([A, B], [5, 6], 12, authority='/y'), message([B], [7], 13, '/tf_static', True),
            message([A, B], [8, 9], 14, '/other', authority='/z'),
            message([B, C], [10, 11], 15, authority='/w')):
        assert columns.add(arrival) is False
    found = {(column.edge, column.static): (
        [(received, stamp, pose[0]) for received, stamp, pose in plain(column.rows)],
        column.order.tolist(), [*column.beside], column.authorities) for column in columns.pop()}
    assert found == {
        (A, False): ([(10, 1, 1.0), (12, 5, 5.0), (14, 8, 8.0)], [0, 2, 4], [A, B],
                     {'/x', '/y', '/z'}),
        (B, False): ([(10, 2, 2.0), (11, 3, 3.0), (12, 6, 6.0), (14, 9, 9.0), (15, 10, 10.0)],
                     [0, 1, 2, 4, 5], [A, B, C], {'/x', '/y', '/z', '/w'}),
        (C, False): ([(11, 4, 4.0), (15, 11, 11.0)], [1, 5], [B, C], {'/w'}),
        (B, True): ([(13, 7, 7.0)], [3], [B], set())}
    assert columns.pop() == []
    columns.add(message([A], [1]))
    (column,) = columns.pop()
    assert column.order.tolist() == [0] and column.authorities == frozenset()


def until_enough(columns, messages):
    return next(number for number, each in enumerate(messages, start=1) if columns.add(each))


@pytest.mark.parametrize('edges, cost, new', [
    ([A], 2, 6), ([], 1, 6), ([A, B, C], 4, 7), ([('m' * 50, 'n' * 49)], 2, 15),
    ([('m' * 50, 'n' * 50)], 2, 16)])
def test_enough_is_a_number_of_transforms_and_messages(edges, cost, new):
    """A message costs one, and so do each of its transforms and ten letters of new names."""
    columns, same = MessageColumns(), message(edges, [1] * len(edges))
    for _ in range(2):
        count = until_enough(columns, (same for _ in range(ENOUGH + 1)))
        assert count == math.ceil((ENOUGH - new) / cost)
        columns.pop()


def test_messages_of_a_kind_of_their_own_cost_more():
    columns = MessageColumns()
    topics = (message([A], [1], topic=str(number)) for number in range(ENOUGH))
    assert until_enough(columns, topics) == math.ceil(ENOUGH / 8)


@pytest.mark.parametrize('edges, enough', [(1, ENOUGH), (300, ENOUGH), (301, 30_100),
                                           (1000, 100_000), (1001, 100_000)])
def test_of_many_edges_more_is_gathered(edges, enough):
    assert (ENOUGH, OF_EACH) == (30_000, 100)
    columns, empty = MessageColumns(), message([], [])
    columns.add(message([('', str(number)) for number in range(edges)], [1] * edges))
    assert len(columns.pop()) == edges
    assert until_enough(columns, (empty for _ in range(enough))) == enough - 6
