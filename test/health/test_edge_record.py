# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The records of one edge and of one child: exact numbers of small recordings."""

import math
import random

import numpy as np
import pytest
from tf_tree_py.health.measures.edge_record import (
    EdgeRecord,
    FixedEdge,
    is_stale,
    MovingEdge,
    Parents,
    silence_of,
    Symptoms,
    symptoms_of,
)
from tf_tree_py.health.measures.grouping import grouped
from tf_tree_py.health.measures.sample_rows import MessageColumn, Rows
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.measures.timebase import Timebase

SECOND, MS = 10**9, 10**6
BEGIN = 100 * SECOND
EDGE = ('map', 'base')


def rows_of(received, stamps, xs=0.0, angles=0.0):
    received, stamps = np.array(received, np.int64), np.array(stamps, np.int64)
    poses = np.zeros((7, len(stamps)))
    poses[0], angles = xs, np.asarray(angles)
    poses[5], poses[6] = np.sin(angles / 2), np.cos(angles / 2)
    return Rows(received, stamps, poses)


def column_of(rows, edge=EDGE, static=False, order=None, authorities=(), beside=None):
    order = np.arange(len(rows)) if order is None else np.array(order, np.int64)
    return MessageColumn(edge, static, rows, order, [edge] if beside is None else beside,
                         frozenset(authorities))


# --- groups

def test_groups_of_successive_items():
    seen = []

    def belongs(group, item):
        seen.append(([*group], item))
        return item - group[-1] < 3

    assert grouped([1, 2, 4, 9, 10, 20], belongs) == [[1, 2, 4], [9, 10], [20]]
    assert seen == [([1], 2), ([1, 2], 4), ([1, 2, 4], 9), ([9], 10), ([9, 10], 20)]
    assert grouped([], belongs) == []


# --- static edges

def test_static_edge_without_samples():
    edge = FixedEdge()
    assert facts(edge) == (0, 0, 0, 0, 0, 0.0, 0.0)


def facts(edge):
    return edge.count, edge.first, edge.last, edge.changes, edge.at_once, edge.gone, edge.turned


def test_arrivals_of_a_static_edge_are_those_after_the_clock_began():
    edge = FixedEdge()
    edge.add(rows_of([0, 0], [0, 0]))
    assert facts(edge) == (2, 0, 0, 0, 0, 0.0, 0.0)
    edge.add(rows_of([0, 1, 7], [0, 0, 0]))
    assert facts(edge) == (5, 1, 7, 0, 0, 0.0, 0.0)
    edge.add(rows_of([9, 8, 0], [0, 0, 0]))
    assert facts(edge) == (8, 1, 8, 0, 0, 0.0, 0.0)


def test_changes_of_a_static_edge():
    received = [0, 1, SECOND, 2 * SECOND, 3 * SECOND, 3 * SECOND + 1, 5 * SECOND]
    xs = [0.0, 1.0, 1.0, 1.5, 1.5, 3.0, 3.0]
    angles = [0.0, 0.0, 0.0, 0.5, 0.25, 0.25, 0.25]
    # The first of four came at an unknown time, two a second later, and one at once.
    expected = (7, 1, 5 * SECOND, 4, 1, 1.5, pytest.approx(0.5))
    for parts in ([7], [1] * 7, [3, 4], [2, 2, 3]):
        edge, begin = FixedEdge(), 0
        rows = rows_of(received, [0] * 7, xs, angles)
        for count in parts:
            edge.add(rows[begin:begin + count])
            begin += count
        assert facts(edge) == expected, parts
    edge.add(rows_of([5 * SECOND + 1], [0], 2.0, 0.25))
    assert facts(edge) == (8, 1, 5 * SECOND + 1, 5, 2, 1.5, pytest.approx(0.5))


def test_poses_of_no_use_are_left_out_of_the_changes():
    edge = FixedEdge()
    rows = rows_of([1, 2, 3], [0, 0, 0], [1.0, math.nan, 1.0])
    edge.add(rows[1:2])
    edge.add(rows)
    assert facts(edge) == (4, 2, 3, 0, 0, 0.0, 0.0)


@pytest.mark.parametrize('far, step, changed', [
    (0.0, 1e-6, 0), (0.0, 1.1e-6, 1), (0.0, -1.1e-6, 1), (100.0, 1.25e-5, 0), (100.0, 1.5e-5, 1),
    (-100.0, 1.25e-5, 0), (-100.0, 1.5e-5, 1)])
def test_change_is_more_than_the_precision_of_a_message(far, step, changed):
    for coordinate in range(3):
        rows = rows_of([1, 2], [0, 0])
        rows.poses[coordinate] = far, far + step
        edge = FixedEdge()
        edge.add(rows)
        assert edge.changes == edge.at_once == changed
        assert edge.gone == pytest.approx(abs(step) * changed)


def test_coordinates_of_a_rotation_do_not_allow_for_more():
    rows = rows_of([1, 2], [0, 0], [0.0, 1.05e-6])
    rows.poses[3:] = [[0.6], [0.0], [0.0], [0.8]]
    edge = FixedEdge()
    edge.add(rows)
    assert edge.changes == 1


def test_rotation_and_translation_together_are_a_change():
    for x, angle, changed in ((6e-7, 6e-7, 1), (4e-7, 4e-7, 0), (0.0, 1.2e-6, 1)):
        edge = FixedEdge()
        edge.add(rows_of([1, 2], [0, 0], [0.0, x], [0.0, angle]))
        assert edge.changes == changed, (x, angle)


# --- moving edges

def repeats_of(stamps, xs, *parts):
    edge, begin = MovingEdge(Thresholds()), 0
    rows = rows_of(BEGIN + np.arange(len(stamps)) * 10 * MS, BEGIN + np.array(stamps) * MS, xs)
    for count in parts or [len(rows)]:
        edge.add(rows[begin:begin + count], [EDGE])
        begin += count
    return edge


def test_repeated_stamps_are_counted_and_repeated_samples_left_out():
    stamps = [0, 0, 10, 20, 20, 20, 30, 40, 50, 50, 60, 70, 80, 80]
    xs = [0.0, 0.0, 1.0, 2.0, 2.0, 2.5, 3.0, 4.0, 5.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    for parts in ([14], [1] * 14, [2] * 7, [4, 10], [5, 9], [10, 4], [9, 5]):
        edge = repeats_of(stamps, xs, *parts)
        assert (edge.timing.duplicates, edge.timing.differing) == (5, 2), parts
        # Eleven rows remain, of whose ten steps seven are judged.
        assert (edge.motion.steps, edge.timing.intervals.count) == (7, 6), parts
        assert edge.motion.travelled == 9.0


@pytest.mark.parametrize('coordinate', range(7))
def test_repeated_stamp_with_any_other_coordinate_differs(coordinate):
    edge, rows = MovingEdge(Thresholds()), rows_of([BEGIN] * 3, [BEGIN] * 3)
    rows.poses[coordinate, 2] += 0.5
    edge.add(rows, ())
    assert (edge.timing.duplicates, edge.timing.differing) == (2, 1)


@pytest.mark.parametrize('seed', range(3))
def test_repeats_of_random_recordings_are_as_in_plain_python(seed):
    chance = random.Random(seed)
    for _ in range(60):
        stamps = np.cumsum([chance.choice([0, 10, 10]) for _ in range(25)]).tolist()
        xs = [chance.choice([0.0, 1.0]) for _ in stamps]
        # A repeat of both is compared with the row that remains: the same.
        pairs = [*zip(stamps, xs, strict=True)]
        same = [a[0] == b[0] for a, b in zip(pairs, pairs[1:], strict=False)]
        both = sum(a == b for a, b in zip(pairs, pairs[1:], strict=False))
        parts = []
        while sum(parts) < 25:
            parts.append(min(chance.randint(1, 9), 25 - sum(parts)))
        edge = repeats_of(stamps, xs, *parts)
        assert edge.timing.duplicates == sum(same)
        assert edge.timing.differing == sum(same) - both
        assert edge.motion.steps == max(25 - both - 4, 0)


def test_samples_of_no_use_are_only_counted():
    edge = MovingEdge(Thresholds())
    rows = rows_of(BEGIN + np.arange(9) * 10 * MS, BEGIN + np.arange(9) * 10 * MS)
    rows.poses[0, 1:3] = math.nan
    rows.stamps[4] = 0
    edge.add(rows[1:3], ())
    assert (edge.timing.count, edge.motion.steps, edge.motion.moved) == (2, 0, False)
    edge.add(rows, ())
    assert (edge.timing.count, edge.timing.zeros, edge.motion.steps) == (11, 1, 2)


def test_only_samples_with_the_stamp_zero_are_left_out():
    for stamps in ([-1, 0, 0, 1, 2, 3, 4], [0, 0], [0, 0, -1, 1, 2, 3, 4]):
        edge = MovingEdge(Thresholds())
        edge.add(rows_of(BEGIN + np.arange(len(stamps)), stamps, np.arange(len(stamps))), ())
        assert edge.motion.steps == max(len(stamps) - 6, 0)
    edge.add(rows_of(BEGIN + 10 + np.arange(5), [5, 5, 6, 7, 8], [9, 8, 7, 6, 5]), ())
    assert (edge.timing.duplicates, edge.timing.differing, edge.motion.steps) == (1, 1, 6)


def test_edges_beside_an_edge_are_kept_up_to_a_number_and_a_length():
    edge, rows = MovingEdge(Thresholds()), rows_of([1], [1])
    long = [('a' * 100, 'b' * 100), ('a' * 101, 'b' * 100), ('a' * 100, 'b' * 101)]
    edge.add(rows, [EDGE, *long])
    assert edge.beside == {EDGE, long[0]}
    others = [('map', str(number)) for number in range(70)]
    edge.add(rows, others[:61])
    assert len(edge.beside) == 63
    edge.add(rows, others)
    assert edge.beside == {EDGE, long[0], *others[:64]}
    edge.add(rows, [('x', 'y')])
    assert ('x', 'y') not in edge.beside
    full = MovingEdge(Thresholds())
    full.add(rows, others[:64])
    full.add(rows, [('x', 'y')])
    assert full.beside == {*others[:64]}


# --- lone stamps

def lone_of(places, bad, parts):
    edge, begin = MovingEdge(Thresholds()), 0
    stamps = BEGIN + 10_000 * SECOND + np.arange(100) * 100 * MS
    rows = rows_of(stamps + MS, stamps, np.arange(100.0))
    rows.stamps[places] += bad
    for count in parts:
        edge.add(rows[begin:begin + count], ())
        begin += count
    return edge, rows


@pytest.mark.parametrize('parts', [[100], [30, 70], [60, 3, 37]])
@pytest.mark.parametrize('places', [[0], [50], [98], [0, 50], [20, 40], []])
def test_lone_samples_that_are_too_old_are_left_out(places, parts):
    edge, rows = lone_of(places, -5000 * SECOND, parts)
    assert edge.lone == len(places)
    assert edge.motion.steps == 96 - len(places)
    if places:
        first = edge.first_lone
        assert first.stamps.tolist() == rows.stamps[places[0]:places[0] + 2].tolist()
        assert first.received.tolist() == rows.received[places[0]:places[0] + 2].tolist()
        assert first.poses[0].tolist() == [places[0], places[0] + 1]
        assert (edge.timing.jumps, edge.timing.disorders) == (0, 0)
    else:
        assert edge.first_lone is None


@pytest.mark.parametrize('places', [[0], [50], [99]])
def test_lone_samples_that_are_too_new_are_kept(places):
    edge, _ = lone_of(places, 5000 * SECOND, [100])
    assert (edge.lone, edge.first_lone, edge.motion.steps) == (0, None, 96)


def test_first_sample_that_is_too_new_is_kept_even_if_the_last_one_is_newer():
    stamps = BEGIN + np.arange(100) * 10 * SECOND
    rows = rows_of(stamps, stamps)
    rows.stamps[0] += 300 * SECOND
    edge = MovingEdge(Thresholds())
    edge.add(rows, ())
    assert (edge.lone, edge.motion.steps) == (0, 96)


@pytest.mark.parametrize('parts', [[100], [4, 96], [1, 3, 96], [5, 95]])
def test_first_sample_is_judged_by_the_four_after_it(parts):
    edge, rows = lone_of([0, 4], -5000 * SECOND, parts)
    assert edge.lone == 1 and edge.first_lone.stamps[0] == rows.stamps[4]


def test_first_sample_of_a_later_block_is_judged_like_those_between():
    """Only the first sample of all has none before it."""
    edge, _ = lone_of(slice(0, 47), -5000 * SECOND, [50, 50])
    assert (edge.lone, edge.first_lone, edge.motion.steps) == (0, None, 96)


# --- publishers

def test_edge_and_its_publishers():
    edge, rows = EdgeRecord('map', 'base'), rows_of([1], [1])
    assert (edge.frames, str(edge), edge.moving, edge.fixed, edge.authorities) == (
        EDGE, 'map -> base', None, None, {})
    edge.add(column_of(rows, authorities=['/b', '/a']), Thresholds())
    assert [*edge.authorities] == ['/a', '/b'] and edge.fixed is None
    assert edge.moving.timing.count == 1 and edge.moving.beside == {EDGE}
    moving = edge.moving
    edge.add(column_of(rows, static=True, authorities=['/a', '/c']), Thresholds())
    edge.add(column_of(rows, static=True), Thresholds())
    edge.add(column_of(rows), Thresholds())
    assert edge.moving is moving and moving.timing.count == edge.fixed.count == 2
    assert [*edge.authorities] == ['/a', '/b', '/c']
    edge.add(column_of(rows, authorities=map(str, range(9))), Thresholds())
    assert [*edge.authorities] == ['/a', '/b', '/c', *'01234']


def test_long_names_are_shortened_in_the_text_of_an_edge():
    assert str(EdgeRecord('a' * 80, 'b' * 80)) == 'a' * 80 + ' -> ' + 'b' * 80
    assert str(EdgeRecord('a' * 82, 'b' * 81)) == (
        'a' * 40 + '... (82 characters) ...' + 'a' * 40 + ' -> '
        + 'b' * 40 + '... (81 characters) ...' + 'b' * 40)


@pytest.mark.parametrize('blocks, expected', [
    ([['one of /a, /b'], ['/a']], ['/a']), ([['/a'], ['one of /a, /b']], ['one of /a, /b']),
    ([['/a', 'one of /a, /b']], ['one of /a, /b']), ([['one of /a, /b'], ['/c']],
                                                     ['one of /a, /b', '/c']),
    ([['one of /a, /b'], ['one of /b, /c']], ['one of /a, /b', 'one of /b, /c']),
    ([['/a', '/b', '/c'], ['one of /a, /b']], ['/c', 'one of /a, /b']), ([['/b'], ['/a'], ['/b']],
                                                                         ['/b', '/a'])])
def test_ambiguous_publisher_replaces_or_is_replaced(blocks, expected):
    edge, rows = EdgeRecord('map', 'base'), rows_of([1], [1])
    for authorities in blocks:
        edge.add(column_of(rows, authorities=authorities), Thresholds())
    assert [*edge.authorities] == expected


@pytest.mark.parametrize('static', [False, True])
def test_huge_numbers_of_a_pose_do_not_warn(static):
    edge = EdgeRecord('map', 'base')
    with np.errstate(all='raise'):
        edge.add(column_of(rows_of(range(1, 9), range(1, 9), [1e200, -1e308] * 4), static=static),
                 Thresholds())
    assert (edge.fixed if static else edge.moving.timing).count == 8


# --- parents

def test_changes_of_a_parent():
    def column(parent, order):
        return column_of(rows_of([1000 + 10 * number for number in order], order),
                         (parent, 'base'), order=order)

    parents = Parents()
    assert (parents.switches, parents.first, parents.last) == (0, 0, 0)
    parents.add([column('map', [0, 1])])
    parents.add([column('map', [2, 3])])
    assert (parents.switches, parents.first, parents.last) == (0, 0, 0)
    parents.add([column('odom', [4, 5])])
    assert (parents.switches, parents.first, parents.last) == (1, 1040, 1040)
    parents.add([column('odom', [7, 8, 11]), column('map', [6, 9, 10])])
    assert (parents.switches, parents.first, parents.last) == (5, 1040, 1110)
    parents.add([column('odom', [12]), column('map', [13])])
    assert (parents.switches, parents.last) == (6, 1130)
    parents.add([column('odom', [15]), column('map', [14])])
    assert (parents.switches, parents.last) == (7, 1150)
    parents.add([column('odom', [16, 17]), column('map', [18])])
    parents.add([column('map', [19])])
    assert (parents.switches, parents.first, parents.last) == (8, 1040, 1180)


def test_first_parent_is_no_change():
    parents = Parents()
    parents.add([column_of(rows_of([5, 7], [1, 2]), ('a', 'base'), order=[1, 3]),
                 column_of(rows_of([4, 6], [1, 2]), ('b', 'base'), order=[0, 2])])
    assert (parents.switches, parents.first, parents.last) == (3, 5, 7)


# --- the summary

def test_symptoms_of_a_moving_edge():
    edge, timebase = EdgeRecord('map', 'base'), Timebase([], None)
    received = BEGIN + np.array([0, 10, 20, 30, 40, 70, 80, 90, 100, 110]) * MS
    delays = np.array([1, 2, 3, 4, 9, 5, 6, 7, 8, 10]) * MS
    edge.add(column_of(rows_of(received, received - delays), authorities=['/a', '/b']),
             Thresholds())
    now = BEGIN + 130 * MS
    expected = Symptoms('map', 'base', False, 10, 9 / 0.11, 5 * MS, 10 * MS, 34 * MS, 20 * MS,
                        False, ('/a', '/b'), 3)
    assert symptoms_of(edge, 3, now, timebase) == expected
    assert expected.as_dict() == {
        'parent': 'map', 'child': 'base', 'static': False, 'count': 10, 'rate_hz': 9 / 0.11,
        'delay_p50': 5 * MS, 'delay_p95': 10 * MS, 'longest_gap': 34 * MS, 'silence': 20 * MS,
        'stale': False, 'publishers': ['/a', '/b'], 'refused': 3}
    assert symptoms_of(edge, 0, BEGIN, timebase).silence == 0
    late = symptoms_of(edge, 0, BEGIN + 100 * SECOND, timebase)
    assert (late.silence, late.stale) == (100 * SECOND - 110 * MS, True)
    edge.add(column_of(rows_of([received[-1]], [0]), static=True), Thresholds())
    both = symptoms_of(edge, 0, BEGIN + 100 * SECOND, timebase)
    assert (both.static, both.count, both.stale) == (False, 11, False)


def test_symptoms_of_a_static_edge_and_of_one_without_a_clock():
    timebase = Timebase([], None)
    edge = EdgeRecord('map', 'base')
    edge.add(column_of(rows_of([5, 6], [0, 0]), static=True, authorities=['/a']), Thresholds())
    assert symptoms_of(edge, 1, BEGIN, timebase) == Symptoms(
        'map', 'base', True, 2, 0.0, None, None, None, None, False, ('/a',), 1)
    assert silence_of(edge, BEGIN, timebase) == 0.0 and not is_stale(edge, BEGIN, timebase)
    edge = EdgeRecord('map', 'base')
    edge.add(column_of(rows_of([0], [5])), Thresholds())
    assert symptoms_of(edge, 0, BEGIN, timebase) == Symptoms(
        'map', 'base', False, 1, 0.0, None, None, None, None, False, (), 0)
    assert silence_of(edge, BEGIN, timebase) == 0.0
    edge = EdgeRecord('map', 'base')
    edge.add(column_of(rows_of([6], [5])), Thresholds())
    assert symptoms_of(edge, 0, 7, timebase) == Symptoms(
        'map', 'base', False, 1, 0.0, 1, 1, None, 1, False, (), 0)
    assert silence_of(edge, 9, timebase) == 3.0
    assert silence_of(edge, 5, timebase) == 0.0
    edge = EdgeRecord('map', 'base')
    edge.add(column_of(rows_of(range(6, 11), range(5, 10))), Thresholds())
    assert symptoms_of(edge, 0, 11, timebase).longest_gap == 1


@pytest.mark.parametrize('offset, stale', [(-1, True), (0, False), (1, False)])
def test_edge_that_became_static_is_not_stale(offset, stale):
    edge = EdgeRecord('map', 'base')
    stamps = BEGIN + np.arange(10) * 10 * MS
    edge.add(column_of(rows_of(stamps, stamps)), Thresholds())
    edge.add(column_of(rows_of([stamps[-1] + offset], [0]), static=True), Thresholds())
    assert is_stale(edge, BEGIN + 100 * SECOND, Timebase([], None)) is stale
    assert not is_stale(edge, BEGIN + 100 * MS, Timebase([], None))
