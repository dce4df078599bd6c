# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The values that several checks share: the shape of the tree, and which edges correct others."""

from clock_scenes import BEGIN, case_of, edge_of, MS, regular, roaming, SECOND, standing
import numpy as np
import pytest
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.health.checks.case import is_always_frozen, is_frozen, is_frozen_now, Trouble
from tf_tree_py.health.measures.edge_record import MovingEdge
from tf_tree_py.health.measures.spread import Spread
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.measures.timing import Run

TIMES = regular(10)


def edges_of(*names, **how):
    return [edge_of(name, TIMES, **how) for name in names]


def names(edges):
    return ' '.join('>'.join(edge.frames) for edge in edges)


# --- edges

def test_edges_without_two_different_names_are_left_out():
    case = case_of(*edges_of('a>b', '>b', 'a>', 'a>a', 'b>c'))
    assert names(case.edges) == 'a>b b>c'
    assert case.frames == ['a', 'b', 'c']


@pytest.mark.parametrize(('kind', 'count', 'static', 'expected'), [
    (Kind.LOOP, 9, 0, 'a>b b>c'), (Kind.LOOP, 10, 0, 'b>c'), (Kind.LOOP, 11, 0, 'b>c'),
    (Kind.LOOP, 10, 1, 'a>b b>c'), (Kind.LOOP, 11, 1, 'b>c'), (Kind.OLD_DATA, 10, 0, 'a>b b>c')])
def test_edge_of_which_every_sample_is_refused_as_a_loop_does_not_move(
        kind, count, static, expected):
    edges = edges_of('a>b', 'b>c')
    if static:
        edges[0].fixed = edge_of('a>b', [0], static=True).fixed
    case = case_of(*edges, *edges_of('c>d', static=True), troubles={
        (kind, 'a', 'b'): Trouble(count)})
    assert names(edge for edge, _ in case.moving()) == expected
    assert [moving for _, moving in case.moving()] == [
        edge.moving for edge, _ in case.moving()]
    assert ('b' in case.above) is ('a>b' in expected)


def test_static_edge_that_is_refused_is_not_above_its_child():
    troubles = {(Kind.LOOP, 'a', 'b'): Trouble(10)}
    assert case_of(*edges_of('a>b', static=True), troubles=troubles).above == {}
    assert [*case_of(*edges_of('b>a', static=True), troubles=troubles).above] == ['a']


def test_incidents_of_some_kinds():
    troubles = {(Kind.LOOP, 'a', 'b'): Trouble(1), (Kind.BAD_NAME, 'c', 'd'): Trouble(2),
                (Kind.OLD_DATA, 'e', 'f'): Trouble(3)}
    case = case_of(troubles=troubles)
    assert [*case.of_kind(Kind.OLD_DATA, Kind.LOOP)] == [
        (('a', 'b'), Trouble(1)), (('e', 'f'), Trouble(3))]


def test_first_arrival_of_each_frame():
    edges = [edge_of('b>c', TIMES + SECOND), edge_of('a>b', TIMES + 3 * SECOND),
             edge_of('c>d', TIMES), edge_of('d>e', TIMES, static=True)]
    silent = edge_of('e>f', TIMES, clock=-10 * SECOND)
    arrived = case_of(*edges, silent).first_arrivals
    assert {frame: (when - BEGIN - 4 * MS) // SECOND for frame, when in arrived.items()} == {
        'a': 3, 'b': 1, 'c': 0, 'd': 0}


# --- the tree

def test_shape_of_a_tree():
    case = case_of(*edges_of('b>c', 'a>b', 'x>y', 'b>d', 'z>c', 'd>e'))
    assert {child: names(edges) for child, edges in case.above.items()} == {
        'c': 'b>c z>c', 'b': 'a>b', 'y': 'x>y', 'd': 'b>d', 'e': 'd>e'}
    assert [*case.roots] == ['a', 'x', 'z']
    assert names(case.downward) == 'a>b x>y b>c b>d d>e'
    assert [sorted(tree) for tree in case.trees] == [['a', 'b', 'c', 'd', 'e', 'z'], ['x', 'y']]


def test_loop_has_no_root():
    case = case_of(*edges_of('a>b', 'b>a', 'c>d'))
    assert [*case.roots] == ['c']
    assert names(case.downward) == 'c>d'


# --- corrections

def moved_by(name, speeds=(), turn_rates=(), travelled=1.0, moved=True, count=10, **how):
    """Return an edge with these measurements of its motion."""
    edge = edge_of(name, regular(count), **how)
    motion = edge.moving.motion
    motion.speeds, motion.turn_rates = Spread(), Spread()
    motion.speeds.add(np.array(speeds, float))
    motion.turn_rates.add(np.array(turn_rates, float))
    motion.travelled, motion.moved = travelled, moved
    return edge


MOVES = ([1.0], [1.0])


@pytest.mark.parametrize(('above', 'below', 'expected'), [
    # As fast as the edge below it, or slow.
    (([1.0], [1.0]), MOVES, True), (([1.01], [1.0]), MOVES, False),
    (([1.0], [1.01]), MOVES, False), (([0.0], [0.0]), MOVES, True),
    (([0.05], [0.05]), ([0.0], [0.0]), True), (([0.051], [0.05]), ([0.0], [0.0]), False),
    (([0.05], [0.051]), ([0.0], [0.0]), False),
    (([0.06], [0.2]), ([0.06], [0.2]), True), (([0.06], [0.21]), ([0.06], [0.2]), False),
    # The fastest quarter does not count.
    (([1, 1, 1, 9], [1, 1, 1, 9]), MOVES, True), (([1, 1, 9, 9], [0]), MOVES, False),
    (([0], [1, 1, 9, 9]), MOVES, False), (([8], [8]), ([1, 1, 9, 9], [1, 1, 9, 9]), True),
    (([8], [8]), ([1, 1, 1, 9], [9]), False), (([8], [8]), ([9], [1, 1, 1, 9]), False),
    # It turns in place.
    (([0.0], [0.0], 0.001), MOVES, False), (([0.0], [0.0], 0.0011), MOVES, True),
    (([0.0], [0.0], 0.001, False), MOVES, True),
    # It rests for half of the time above one that does not move.
    (([0.001, 0.001, 9], [0.001, 0.001, 9]), ([], [], 0, False), True),
    (([0.0011, 0.0011, 9], [0, 0, 9]), ([], [], 0, False), False),
    (([0, 0, 9], [0.0011, 0.0011, 9]), ([], [], 0, False), False),
    (([0, 0, 9], [0, 0, 9]), ([0.0], [0.0], 1.0, True), False)])
def test_correction_moves_no_faster_than_an_edge_below_it(above, below, expected):
    upper, lower = moved_by('map>odom', *above), moved_by('odom>base', *below)
    for case in (case_of(upper, lower), case_of(lower, upper)):
        assert case.is_correction(upper) is expected
        assert case.is_fixed('odom') is expected
        assert case.is_fixed('map') and not case.is_fixed('base')
        assert not case.is_correction(lower)


def test_one_of_the_edges_below_suffices_and_none_does_not():
    upper, slow, fast = (moved_by('map>odom', [1.0], [1.0]),
                         moved_by('odom>slow', [0.1], [0.1]), moved_by('odom>fast', *MOVES))
    assert case_of(upper, slow, fast).is_correction(upper)
    assert not case_of(upper, slow).is_correction(upper)
    assert not case_of(upper).is_correction(upper)
    assert not case_of(upper, *edges_of('odom>slow', static=True)).is_correction(upper)


def test_only_corrections_and_static_edges_are_above_a_fixed_frame():
    edges = [*edges_of('world>earth', static=True), moved_by('earth>map', [0.0], [0.0]),
             moved_by('map>odom', [1.0], [1.0]), moved_by('odom>base', *MOVES),
             moved_by('base>arm', [0.1], [0.1]), moved_by('arm>tool', *MOVES),
             *edges_of('base>lidar', static=True)]
    case = case_of(*edges)
    assert [frame for frame in case.frames if case.is_fixed(frame)] == [
        'world', 'earth', 'map', 'odom']
    assert names(edge for edge in case.edges if case.is_correction(edge)) == (
        'earth>map map>odom')


# --- what is seen

@pytest.mark.parametrize(('speeds', 'rates', 'count', 'expected'), [
    ([0.0011], [0.0011], 8, True), ([0.001], [0.0011], 8, False), ([0.0011], [0.001], 8, False),
    ([0.0, 0.01, 0.01], [0.0, 0.01, 0.01], 8, True), ([0.0], [0.0], 8, False),
    ([0.0], [0.0], 7, True)])
def test_what_is_seen_moves_freely_and_has_no_children(speeds, rates, count, expected):
    tag = moved_by('camera>tag', speeds, rates, count=count)
    case = case_of(tag, *edges_of('base>camera'))
    assert case.is_sighting(tag) is expected and case.has_no_children(tag)
    case = case_of(tag, *edges_of('tag>tip'))
    assert not case.is_sighting(tag) and not case.has_no_children(tag)


def test_static_edge_is_not_seen():
    fixed, = edges_of('camera>tag', static=True)
    assert not case_of(fixed).is_sighting(fixed)
    assert case_of(fixed).still_seen(fixed) == []


def seen(name, *senders):
    return edge_of(name, TIMES, poses=roaming, senders=senders)


def test_other_tags_of_one_detector_are_still_seen():
    tag = seen('camera>tag', '/d')
    alike, beside = seen('camera>alike', '/d'), seen('camera>beside', '/e')
    others = [seen('camera>other', '/e'), seen('camera>several', '/d', '/e'),
              seen('lens>tag_2', '/d'), edge_of('camera>still', TIMES, poses=standing,
                                                senders=['/d'])]
    tag.moving.beside.add(beside.frames)
    case = case_of(*others, alike, tag, beside)
    assert names(case.still_seen(tag)) == 'camera>alike camera>beside'
    assert names(case.still_seen(beside)) == 'camera>other'
    assert case.still_seen(others[-1]) == []
    assert case.still_seen(others[1]) == []


@pytest.mark.parametrize('senders', [(), ('/d', '/e')])
def test_tags_of_several_nodes_or_of_none_are_not_of_one_detector(senders):
    tag, other = seen('camera>tag', *senders), seen('camera>other', *senders)
    assert case_of(tag, other).still_seen(tag) == []


# --- stamps that stand still

def repeating(samples=5, span=1.1, *, intervals=4, between=0.1, watched=10.0, count=100, zeros=0,
              run=1):
    """Return an edge whose longest run of one stamp has so many samples, for so many seconds."""
    moving = MovingEdge(Thresholds())
    timing = moving.timing
    timing.frozen, timing.run = Run(samples, round(span * SECOND), 1), Run(1, 0, run)
    timing.intervals.add(np.full(intervals, between * SECOND))
    timing.first, timing.last = BEGIN, BEGIN + round(watched * SECOND)
    timing.count, timing.zeros = count, zeros
    return moving


@pytest.mark.parametrize(('how', 'expected'), [
    ({'samples': 5}, True), ({'samples': 4}, False), ({'span': 1.0}, False),
    ({'span': 1.5, 'between': 0.5}, False), ({'span': 1.6, 'between': 0.5}, True),
    # Only several intervals show how many samples repeat a stamp anyway.
    ({'span': 3.1, 'intervals': 4}, True), ({'span': 3.1, 'intervals': 5}, False),
    ({'span': 6.0, 'intervals': 5}, False), ({'span': 6.1, 'intervals': 5}, True),
    ({'span': 1.0, 'intervals': 0}, False), ({'span': 1.1, 'intervals': 0}, True)])
def test_frozen_stamp_is_repeated_for_as_long_as_silence(how, expected):
    moving = repeating(**how)
    assert is_frozen(moving) is expected
    assert is_frozen_now(moving) is expected
    assert not is_frozen_now(repeating(**how, run=2))
    assert not is_always_frozen(moving)
    samples = moving.timing.frozen.samples
    assert is_always_frozen(repeating(**how, count=samples + 2, zeros=2)) is expected


def test_edge_without_samples_is_not_frozen():
    assert not is_frozen(MovingEdge(Thresholds()))
