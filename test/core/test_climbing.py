# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Climbs in a small tree in whole results: where they meet, what blocks, and which loops close."""

import pytest
from tf_tree_py.core import ConnectivityException, NoDataException, PastExtrapolationException
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.stamp import FOREVER
from tf_tree_py.core.tree.climb import (
    blockers,
    Branches,
    Cleared,
    Climb,
    climb,
    climb_both,
    edges_to_clear,
    find_loop,
    Loop,
)

ANY = ((None, 0),)


def moving(child, *samples, cache_time=100):
    history = Samples(child, cache_time)
    for stamp, parent in samples:
        history.insert(stamp, parent, se3.IDENTITY)
    return history


def static(child, parent):
    return StaticHistory(child, parent, se3.IDENTITY)


def by_child(*histories):
    return {history.child: history for history in histories}


def robot():
    """Return map -> odom -> base -> arm -> hand, and base -> lens; hand changed from base."""
    return by_child(
        moving('odom', (0, 'map'), (40, 'map')), moving('base', (10, 'odom'), (30, 'odom')),
        static('arm', 'base'), moving('hand', (10, 'base'), (20, 'arm'), (30, 'arm')),
        static('lens', 'base'))


# --- climbing


@pytest.mark.parametrize(('frame', 'stamp', 'stop', 'frames'), [
    ('hand', None, (), 'hand arm base odom map'), ('hand', 20, (), 'hand arm base odom map'),
    ('hand', 15, (), 'hand base odom map'), ('hand', 31, (), 'hand'),
    ('arm', 31, (), 'arm base'), ('arm', 9, (), 'arm base'), ('hand', 15, ('base',), 'hand base'),
    ('hand', None, {'hand'}, 'hand'), ('hand', None, {'odom', 'arm'}, 'hand arm'),
    ('map', None, (), 'map'), ('unknown', 5, (), 'unknown')])
def test_climb_goes_up_as_far_as_there_is_data(frame, stamp, stop, frames):
    histories, frames = robot(), frames.split()
    found = climb(histories, frame, stamp, stop)
    assert found == Climb([histories[each] for each in frames[:-1]], frames)
    assert found.top == frames[-1]


def test_climb_ends_at_an_edge_that_has_ended_or_has_no_samples():
    histories = by_child(moving('a', (1, 'r')), moving('b', (1, 'a')), moving('c'))
    histories['a'].end()
    assert climb(histories, 'b', None).frames == ['b', 'a']
    assert climb(histories, 'b', 1).frames == ['b', 'a', 'r']
    assert climb(histories, 'c', None) == climb(histories, 'c', 1) == Climb([], ['c'])


@pytest.mark.parametrize(('target', 'source', 'stamp', 'up', 'down', 'frames'), [
    ('lens', 'hand', None, 'hand arm', 'lens', 'hand arm base lens'),
    ('lens', 'hand', 10, 'hand', 'lens', 'hand base lens'),
    ('hand', 'lens', None, 'lens', 'hand arm', 'lens base arm hand'),
    ('map', 'arm', None, 'arm base odom', '', 'arm base odom map'),
    ('arm', 'map', None, '', 'arm base odom', 'map odom base arm'),
    ('base', 'base', None, '', '', 'base')])
def test_two_climbs_meet_at_the_lowest_common_ancestor(target, source, stamp, up, down, frames):
    histories = robot()
    found = climb_both(histories, target, source, stamp)
    assert found.meet
    assert found.edges() == ([histories[each] for each in up.split()],
                             [histories[each] for each in down.split()])
    frames = frames.split()
    assert found.frames() == frames
    height = len(up.split())
    assert found.links() == [
        (frames[i + 1], histories[frames[i]]) if i < height
        else (frames[i], histories[frames[i + 1]])
        for i in range(len(frames) - 1)]


def test_target_in_the_middle_of_the_climb_cuts_what_is_above():
    edges = [static('c', 'b'), static('b', 'a')]
    branches = Branches(Climb(edges, ['c', 'b', 'a']), Climb([], ['b']))
    assert branches.meet
    assert (branches.edges(), branches.frames(), branches.links()) == (
        (edges[:1], []), ['c', 'b'], [('b', edges[0])])


def test_climbs_without_data_do_not_meet():
    histories = robot()
    found = climb_both(histories, 'map', 'hand', 35)
    assert not found.meet
    assert found == Branches(Climb([], ['hand']), Climb([], ['map']))
    assert not climb_both(histories, 'elsewhere', 'hand', None).meet


# --- what may change the answer


def test_edges_that_may_decide_are_all_that_either_side_may_climb():
    histories = by_child(
        moving('base', (50, 'odom'), (60, 'odom')), static('odom', 'map'),
        moving('hand', (50, 'base'), (60, 'arm')), moving('arm', (50, 'base')),
        moving('other', (50, 'base')), moving('new'))
    # At 65, the parent of the hand may be the base or the arm, each of which awaits a sample.
    assert set(blockers(histories, 'map', 'hand', 65)) == {('hand', 65), ('arm', 65), ('base', 65)}
    # At 55, hand and base have data until they leave the window.
    assert set(blockers(histories, 'map', 'hand', 55)) == {('hand', 151), ('base', 151)}
    assert set(blockers(histories, 'other', 'odom', 70)) == {('other', 70), ('base', 70)}
    assert set(blockers(histories, 'new', 'base', 65)) == {('new', FOREVER), ('base', 65)}
    # Without a moving edge, only another structure can help.
    assert blockers(histories, 'map', 'odom', 65) == ANY
    assert blockers(histories, 'map', 'unknown', 65) == ANY


def test_edges_that_can_never_meet_are_not_waited_for():
    histories = by_child(
        moving('old', (500, 'map')), moving('late', (395, 'map'), (500, 'map')),
        moving('base', (350, 'map'), (500, 'map')), moving('loose', (350, 'island')))
    # The window of an edge begins at 400: before that, no sample may arrive.
    assert blockers(histories, 'map', 'old', 399) is None
    assert blockers(histories, 'old', 'map', 399) is None
    assert blockers(histories, 'old', 'old', 399) == (('old', FOREVER),)
    assert blockers(histories, 'map', 'old', 400) == (('old', 501),)
    # Both sides have data, and end at frames without an edge, which may get one.
    assert set(blockers(histories, 'base', 'loose', 350)) == {('base', 500), ('loose', 451)}
    # One side is lost, and the other is not.
    assert blockers(histories, 'loose', 'old', 350) is None
    assert blockers(histories, 'old', 'loose', 350) is None


# --- loops


@pytest.mark.parametrize(('begin', 'end', 'closes'), [
    (0, 10, False), (0, 11, True), (19, 20, True), (20, 30, False), (20, 31, True),
    (30, 31, True), (40, 41, True), (41, 60, False), (5, 10, False), (10, 10, False)])
def test_loop_closes_only_while_the_child_is_above_the_parent(begin, end, closes):
    # c is below b from 10 to 19, below x from 20 to 29, and then below b until it ends at 40.
    histories = by_child(moving('c', (10, 'b'), (20, 'x'), (30, 'b'), (40, 'b')),
                         static('b', 'a'))
    histories['c'].end()
    expected = Loop([histories['c'], histories['b']], ['b', 'a']) if closes else None
    assert find_loop(histories, 'c', 'a', begin, end) == expected


def test_loop_must_close_along_the_whole_way_at_one_time():
    histories = by_child(
        moving('c', (10, 'b'), (20, 'x'), (90, 'x')), moving('b', (0, 'y'), (20, 'a'), (90, 'a')),
        moving('x', (0, 'a'), (30, 'y'), (90, 'y')))
    # b is below a only when c is no longer below b; x is below a from 20 to 29.
    assert find_loop(histories, 'c', 'a', 0, 20) is None
    assert find_loop(histories, 'c', 'a', 30, FOREVER) is None
    loop = Loop([histories['c'], histories['x']], ['x', 'a'])
    assert find_loop(histories, 'c', 'a', 0, 21) == loop
    assert find_loop(histories, 'c', 'a', 29, 99) == loop
    assert find_loop(histories, 'b', 'a', 0, 20) is None
    assert find_loop(histories, 'b', 'a', 0, 21) == Loop([histories['b']], ['a'])


def test_edges_may_be_treated_as_ended():
    histories = by_child(moving('c', (10, 'b')), moving('b', (10, 'a')))
    assert find_loop(histories, 'c', 'a', 10, 20).frames == ['b', 'a']
    for edge in histories.values():
        assert find_loop(histories, 'c', 'a', 10, 20, [edge]) is None
    assert find_loop(histories, 'c', 'unknown', 10, 20) is None


# --- what was cleared

FORGOT_FOR_THAT_TIME = 'The buffer had data of this edge for that time, and forgot it: why'
FORGOT = 'The buffer forgot the data of this edge, and has received none since: why'
BETWEEN = 'The buffer forgot an edge between them, and has received none since: why'


@pytest.mark.parametrize(('cls', 'child', 'requested', 'hint'), [
    (PastExtrapolationException, 'a', 9, 'before'),
    (PastExtrapolationException, 'a', 10, FORGOT_FOR_THAT_TIME),
    (PastExtrapolationException, 'a', 30, FORGOT_FOR_THAT_TIME),
    (PastExtrapolationException, 'a', 31, 'before'),
    (PastExtrapolationException, 'a', None, 'before'),
    (NoDataException, 'a', 10, FORGOT_FOR_THAT_TIME), (NoDataException, 'a', 9, FORGOT),
    (NoDataException, 'a', 31, FORGOT), (NoDataException, 'a', None, FORGOT),
    (NoDataException, 'b', 10, 'before'), (NoDataException, None, 10, 'before'),
    (NoDataException, 'new', 10, 'before'), (NoDataException, 'fixed', 0, 'before'),
    (NoDataException, 'empty', 0, 'before')])
def test_error_of_an_edge_says_what_the_buffer_forgot(cls, child, requested, hint):
    cleared = Cleared('why', edges_to_clear(by_child(
        moving('a', (10, 'r'), (30, 'r')), static('fixed', 'r'), moving('empty'))))
    error = cls(child=child, requested=requested, hint='before')
    cleared.explain(error, {})
    assert error.hint == hint


@pytest.mark.parametrize(('target', 'source', 'hint'), [
    ('a', 'b', BETWEEN), ('b', 'a', BETWEEN), ('c', 'a', BETWEEN), ('r', 'c', BETWEEN),
    ('c', 'b', BETWEEN), ('a', 'd', 'before'), ('a', 'moved', 'before'), ('e', 'x', BETWEEN),
    ('moved', 'x', BETWEEN), ('a', None, 'before'), ('ended', 'r', 'before')])
def test_error_of_two_frames_says_that_an_edge_between_them_is_gone(target, source, hint):
    ended = moving('ended', (10, 'r'))
    ended.end()
    cleared = Cleared('why', edges_to_clear(by_child(
        moving('a', (10, 'r')), moving('b', (10, 'r')), moving('moved', (10, 'r')),
        moving('e', (10, 'moved')), ended)))
    # c hangs on b since then, and the frame that was moved, on another.
    now = by_child(moving('c', (40, 'b')), moving('moved', (40, 'x')), moving('a'))
    error = ConnectivityException('', target_frame=target, source_frame=source, hint='before')
    cleared.explain(error, now)
    assert error.hint == hint


def test_loop_of_edges_of_now_and_then_ends():
    cleared = Cleared('why', edges_to_clear(by_child(moving('a', (10, 'b')))))
    error = ConnectivityException('', target_frame='a', source_frame='r', hint='before')
    cleared.explain(error, by_child(moving('b', (40, 'a'))))
    assert error.hint == 'before'
