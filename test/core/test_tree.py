# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One parent per frame, no cycles, and the reports to the publishers."""

import itertools

from effort import examples
from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ConnectivityException,
    ExtrapolationException,
    Kind,
    LATEST,
    LookupException,
    Pose,
    TransformException,
)
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory

SECOND = 1_000_000_000


def place(number):
    return Pose(float(number))


def chain(buffer, frames, stamp=1, static=False, authority='builder'):
    """Insert first -> second -> third ..., each the parent of the next."""
    for parent, child in itertools.pairwise(frames):
        assert not buffer.insert(
            parent, child, stamp, place(1), authority=authority, static=static)


def answers(buffer, stamps=(LATEST, 1)):
    """Return the result for every pair of frames; errors as their classes."""
    found = {}
    for target, source in itertools.permutations(buffer.frames(), 2):
        for stamp in stamps:
            try:
                found[target, source, stamp] = buffer.lookup_stamped(target, source, stamp)
            except TransformException as error:
                found[target, source, stamp] = type(error)
    return found


# --- loops


@pytest.mark.parametrize('static_edge', [True, False])
@pytest.mark.parametrize('static_tree', [True, False])
@pytest.mark.parametrize('frames', ['ab', 'abc', 'abcdefg'])
def test_edge_that_closes_a_loop_is_refused(frames, static_tree, static_edge):
    buffer = BufferCore()
    chain(buffer, frames, static=static_tree)
    chain(buffer, ['a', 'side'])
    before = answers(buffer)
    (incident,) = buffer.insert(frames[-1], 'a', 1, place(5), authority='intruder',
                                static=static_edge)
    assert incident.kind is Kind.LOOP
    assert incident.refused
    # The tree is unchanged: every earlier result is the same.
    assert answers(buffer) == before
    assert 'a' not in {edge.child for edge in buffer.edges()}


def test_loop_below_the_root_is_refused_too():
    buffer = BufferCore()
    chain(buffer, 'rabc')
    before = answers(buffer)
    (incident,) = buffer.insert('c', 'a', 1, place(5))
    assert incident.kind is Kind.LOOP
    assert answers(buffer) == before


def test_loop_that_is_part_static_and_part_moving_is_refused():
    buffer = BufferCore()
    chain(buffer, 'ab', static=True)
    chain(buffer, 'bc')
    chain(buffer, 'cd', static=True)
    assert buffer.insert('d', 'a', 1, place(5), static=True)[0].kind is Kind.LOOP
    assert buffer.insert('d', 'a', 1, place(5))[0].kind is Kind.LOOP


def test_self_edge_is_refused():
    buffer = BufferCore()
    for parent, child in (('a', 'a'), ('/a', 'a'), ('a', '/a')):
        assert buffer.insert(parent, child, 1, place(1))[0].kind is Kind.SELF_EDGE
    assert buffer.frames() == []


def test_refused_loop_is_told_frame_by_frame_with_both_publishers():
    buffer = BufferCore()
    chain(buffer, ['map', 'odom', 'base_link'], authority='localiser')
    (incident,) = buffer.insert('base_link', 'map', 2, place(1), authority='tracker')
    text = str(incident)
    assert 'map -> base_link -> odom -> map is a loop' in text
    assert "'odom' -> 'base_link' from 'localiser'" in text
    assert "'map' -> 'odom' from 'localiser'" in text
    assert "from 'tracker'" in text
    assert 'stop one of the publishers' in text
    assert text.startswith("Refused transform 'base_link' -> 'map'")


@pytest.mark.parametrize('static', [True, False])
def test_new_frame_is_hung_below_a_long_chain_without_climbing_it(monkeypatch, static):
    cls = StaticHistory if static else Samples
    climbed = []
    parents_between = cls.parents_between
    monkeypatch.setattr(cls, 'parents_between', lambda history, begin, end: (
        climbed.append(history) or parents_between(history, begin, end)))
    buffer = BufferCore()
    chain(buffer, [f'f{number}' for number in range(300)], static=static)
    assert not climbed
    # The probe works: this insertion must climb.
    assert buffer.insert('f299', 'f0', 1, place(1))[0].kind is Kind.LOOP
    assert climbed


def test_refused_frame_of_a_loop_may_hang_elsewhere():
    buffer = BufferCore()
    chain(buffer, 'ab')
    buffer.insert('b', 'a', 1, place(1))
    assert not buffer.insert('c', 'a', 1, place(1))
    assert buffer.lookup('c', 'b') == place(2)


def test_edge_goes_on_after_a_refused_loop():
    buffer = BufferCore()
    chain(buffer, 'ab')
    buffer.insert('b', 'a', 2, place(1), authority='intruder')
    assert not buffer.insert('a', 'b', 3, place(3))
    assert buffer.lookup('a', 'b') == place(3)


def test_silent_edge_gives_way_to_one_that_turns_it_round():
    buffer = BufferCore(10 * SECOND)
    for tenth in range(11):
        buffer.insert('a', 'b', SECOND * tenth // 10, place(tenth), authority='old')
    # One second is not yet silence.
    (incident,) = buffer.insert('b', 'a', 2 * SECOND, place(-20), authority='new')
    assert incident.kind is Kind.LOOP
    (incident,) = buffer.insert('b', 'a', 2 * SECOND + 1, place(-20), authority='new')
    assert incident.kind is Kind.SILENT_EDGE_ENDED
    assert not incident.refused
    assert "'a' -> 'b' from 'old', whose newest sample is 1.000 s older" in incident.detail
    assert buffer.lookup('b', 'a') == place(-20)
    # Now the old one causes the loop.
    (incident,) = buffer.insert('a', 'b', 3 * SECOND, place(1), authority='old')
    assert incident.kind is Kind.LOOP


def test_past_of_an_edge_that_was_turned_round_can_be_asked_for():
    buffer = BufferCore(10 * SECOND)
    buffer.insert('r', 'a', 0, place(100), static=False)
    for tenth in range(11):
        buffer.insert('a', 'b', SECOND * tenth // 10, place(tenth))
        buffer.insert('b', 'c', SECOND * tenth // 10, place(1000))
    buffer.insert('b', 'a', 4 * SECOND, place(-40))
    for frames, pose in ((('a', 'b'), place(5)), (('b', 'a'), place(-5)),
                         (('a', 'c'), place(1005)), (('c', 'a'), place(-1005))):
        assert buffer.lookup(*frames, SECOND // 2) == pytest.approx(pose)
        poses, valid = buffer.lookup_many(
            *frames, [SECOND // 2, 2 * SECOND, 4 * SECOND], outside='mask')
        assert poses[0] == pytest.approx(pose)
        assert valid.tolist() == [True, False, 'c' not in frames]
        assert buffer.lookup_tree(frames[0], SECOND // 2)[frames[1]] == pytest.approx(pose)
    assert buffer.lookup('b', 'a', 4 * SECOND) == place(-40)
    assert buffer.lookup_tree('b', 4 * SECOND)['a'] == place(-40)
    with pytest.raises(ExtrapolationException):
        buffer.lookup('a', 'b', 2 * SECOND)


def test_publishers_that_disagree_are_refused_however_long_they_do():
    buffer = BufferCore(10 * SECOND)
    kinds = []
    for tenth in range(100):
        for edge in (('a', 'b'), ('b', 'a')):
            kinds += [incident.kind for incident in buffer.insert(
                *edge, SECOND * tenth // 10, place(tenth))]
    assert kinds == [Kind.LOOP] * 100
    assert buffer.lookup('a', 'b') == place(99)


def test_static_edge_is_never_stale():
    buffer = BufferCore(SECOND)
    buffer.insert('a', 'b', 0, place(1), static=True)
    (incident,) = buffer.insert('b', 'a', 10 ** 6 * SECOND, place(2))
    assert incident.kind is Kind.LOOP


def test_static_edge_does_not_drop_a_stale_one():
    buffer = BufferCore(SECOND)
    buffer.insert('a', 'b', 1, place(1))
    (incident,) = buffer.insert('b', 'a', 10 ** 6 * SECOND, place(2), static=True)
    assert incident.kind is Kind.LOOP
    assert buffer.lookup('a', 'b') == place(1)


def test_silent_edge_stays_if_its_reverse_is_too_old():
    buffer = BufferCore(10)
    buffer.insert('a', 'b', 1, place(1), authority='first')
    buffer.insert('r', 'a', 100, place(1), authority='root')
    assert buffer.lookup('a', 'b', 1) == place(1)
    # 50 is 49 newer than a -> b, but 50 older than r -> a.
    (incident,) = buffer.insert('b', 'a', 50, place(2), authority='late')
    assert incident.kind is Kind.OLD_DATA
    assert buffer.lookup('a', 'b', 1) == place(1)


FRAMES = st.sampled_from('abcdef')
EDGES = st.tuples(FRAMES, FRAMES).filter(lambda edge: edge[0] != edge[1])


def says_loop(buffer, stamps):
    return [str(error) for error in lookup_errors(buffer, stamps) if 'loop' in str(error)]


def lookup_errors(buffer, stamps):
    for target, source in itertools.permutations(buffer.frames(), 2):
        for stamp in stamps:
            try:
                buffer.lookup(target, source, stamp)
            except TransformException as error:
                yield error


@given(st.lists(st.tuples(EDGES, st.integers(1, 40), st.booleans()), max_size=25))
def test_no_lookup_meets_a_loop_while_frames_keep_their_parents(arrivals):
    buffer = BufferCore(10)
    parents = {}
    for (parent, child), stamp, static in arrivals:
        if parents.setdefault(child, parent) == parent:
            buffer.insert(parent, child, stamp, place(1), static=static)
    assert not says_loop(buffer, (LATEST, *range(1, 41, 3)))


@given(st.lists(st.tuples(EDGES, st.integers(1, 25), st.booleans()), max_size=25))
@examples(3)
def test_latest_never_meets_a_loop_even_where_frames_change_parents(arrivals):
    buffer = BufferCore(10)
    for (parent, child), stamp, static in arrivals:
        buffer.insert(parent, child, stamp, place(1), static=static)
        parents = {edge.child: edge.parent for edge in buffer.edges()}
        for frame in parents:
            seen = [frame]
            while seen[-1] in parents:
                seen.append(parents[seen[-1]])
                assert len(seen) <= len(parents) + 1, f'{" -> ".join(seen)} is a loop'


@given(st.lists(st.tuples(EDGES, st.integers(1, 25)), max_size=25))
def test_lookup_among_changing_parents_ends(arrivals):
    """Between two samples, the tree may have a loop, which raises an error and does not hang."""
    buffer = BufferCore(20)
    for (parent, child), stamp in arrivals:
        buffer.insert(parent, child, stamp, place(1))
    for error in lookup_errors(buffer, range(1, 26)):
        assert 'loop' not in str(error) or (
            isinstance(error, LookupException)
            and str(error).startswith('The tf tree is invalid because it contains a loop'))


def test_late_sample_that_would_close_a_loop_now_is_refused():
    buffer = BufferCore(100)
    buffer.insert('r', 'c', 1, place(1))
    buffer.insert('r', 'p', 1, place(1))
    buffer.insert('c', 'p', 10, place(1))
    before = answers(buffer, (LATEST, 1, 10))
    # At 5, the parent of p was r, but from 10 on it is c, and this would be c's newest sample.
    (incident,) = buffer.insert('p', 'c', 5, place(1))
    assert incident.kind is Kind.LOOP
    assert answers(buffer, (LATEST, 1, 10)) == before


def test_two_frames_may_swap_who_carries_whom():
    buffer = BufferCore(100)
    buffer.insert('room', 'cart', 1, place(10))
    buffer.insert('cart', 'robot', 1, place(1))
    # The robot gets off, and takes the cart along.
    assert not buffer.insert('room', 'robot', 5, place(20))
    assert not buffer.insert('robot', 'cart', 5, place(2))
    buffer.insert('room', 'robot', 9, place(20))
    buffer.insert('robot', 'cart', 9, place(2))
    assert buffer.lookup('room', 'robot', 1) == place(11)
    assert buffer.lookup('room', 'cart', 7) == place(22)
    assert buffer.lookup('cart', 'robot', 1) == place(1)
    assert buffer.lookup('robot', 'cart') == place(2)


# --- conflicting publishers and changes of kind


def test_two_publishers_with_two_parents_are_reported_once():
    buffer = BufferCore()
    chain(buffer, ['table', 'box'], authority='vision')
    incidents = []
    for stamp in range(2, 50):
        incidents += buffer.insert('gripper', 'box', stamp, place(1), authority='gripper_node')
        incidents += buffer.insert('table', 'box', stamp, place(1), authority='vision')
    (incident,) = incidents
    assert incident.kind is Kind.SECOND_PARENT
    assert not incident.refused
    assert "'vision' says that its parent is 'table'" in incident.detail
    assert incident.authority == 'gripper_node'
    assert buffer.statistics().incidents[Kind.SECOND_PARENT] == 1
    assert buffer.statistics().accepted == 97


def test_one_publisher_may_change_the_parent_without_a_word():
    buffer = BufferCore()
    chain(buffer, ['table', 'box'], authority='tracker')
    assert not buffer.insert('gripper', 'box', 2, place(1), authority='tracker')
    assert buffer.lookup('gripper', 'box') == place(1)


def test_frame_with_alternating_parents_is_reported_once():
    buffer = BufferCore()
    chain(buffer, ['table', 'box'], authority='one of /slam, /vision')
    told = [buffer.insert(parent, 'box', 2 + number, place(1), authority='one of /slam, /vision')
            for number, parent in enumerate(['gripper', 'table', 'gripper', 'table'])]
    assert [len(incidents) for incidents in told] == [0, 1, 0, 0]
    assert told[1][0].kind is Kind.SECOND_PARENT
    assert "'one of /slam, /vision' says that its parent is 'gripper'" in str(told[1][0])


def test_one_publisher_may_hand_a_frame_back_and_forth_without_a_word():
    buffer = BufferCore()
    chain(buffer, ['table', 'box'], authority='tracker')
    for number, parent in enumerate(['gripper', 'table', 'gripper', 'table']):
        assert not buffer.insert(parent, 'box', 2 + number, place(1), authority='tracker')


def test_refused_old_sample_is_no_second_parent():
    buffer = BufferCore(10)
    buffer.insert('table', 'box', 100, place(1), authority='vision')
    (incident,) = buffer.insert('gripper', 'box', 1, place(1), authority='gripper_node')
    assert incident.kind is Kind.OLD_DATA
    assert buffer.statistics().incidents[Kind.SECOND_PARENT] == 0


@pytest.mark.parametrize('static', [True, False])
def test_change_of_kind_drops_the_history_and_is_told(static):
    buffer = BufferCore()
    buffer.insert('a', 'b', 5, place(1), authority='first', static=not static)
    (incident,) = buffer.insert('a', 'b', 9, place(2), authority='second', static=static)
    assert incident.kind is Kind.KIND_CHANGE
    assert not incident.refused
    before, now = ('dynamic', 'static') if static else ('static', 'dynamic')
    assert f"it was {before} from 'first' and is now {now}" in incident.detail
    assert buffer.lookup('a', 'b', 9) == place(2)
    if static:
        assert buffer.lookup('a', 'b', 5) == place(2)
    else:
        with pytest.raises(TransformException, match='extrapolation'):
            buffer.lookup('a', 'b', 5)


def test_static_edge_to_another_parent_replaces_the_first():
    buffer = BufferCore()
    buffer.insert('a', 'b', 0, place(1), authority='first', static=True)
    (incident,) = buffer.insert('c', 'b', 0, place(2), authority='second', static=True)
    assert incident.kind is Kind.SECOND_PARENT
    assert buffer.lookup('c', 'b') == place(2)
    with pytest.raises(ConnectivityException):
        buffer.lookup('a', 'b')


def test_old_data_names_the_publisher_that_was_heard_last():
    buffer = BufferCore(10)
    buffer.insert('a', 'b', 100, place(1), authority='good')
    (incident,) = buffer.insert('a', 'b', 1, place(1), authority='late')
    assert incident.kind is Kind.OLD_DATA
    assert incident.authority == 'late'
    assert "the last publisher was 'good'" in incident.detail
    assert '99 ns older than the newest' in incident.detail
    # A publisher that was refused does not publish the edge.
    assert buffer.edges()[0].authority == 'good'


# --- the limit on names


def test_new_frames_beyond_the_limit_are_refused():
    buffer = BufferCore(max_frames=3)
    chain(buffer, 'abc')
    (incident,) = buffer.insert('c', 'd', 1, place(1), authority='flood')
    assert incident.kind is Kind.TOO_MANY_FRAMES
    assert 'knows 3 frames' in incident.detail
    assert buffer.frames() == ['b', 'a', 'c']
    assert not buffer.insert('b', 'c', 2, place(2))
    assert not buffer.insert('a', 'c', 3, place(2))
    assert buffer.lookup('a', 'c') == place(2)


def test_limit_counts_both_new_names_of_an_edge():
    buffer = BufferCore(max_frames=3)
    chain(buffer, 'ab')
    assert buffer.insert('x', 'y', 1, place(1))[0].kind is Kind.TOO_MANY_FRAMES
    assert not buffer.insert('b', 'x', 1, place(1))


def test_flood_of_names_leaves_the_buffer_as_it_was():
    buffer = BufferCore(max_frames=100)
    chain(buffer, 'ab')
    for number in range(1000):
        buffer.insert(f'p{number}', f'c{number}', 1, place(1), authority=f'n{number}')
    statistics = buffer.statistics()
    assert statistics.frames == 100
    assert (statistics.accepted, statistics.refused) == (50, 951)
    assert buffer.lookup('a', 'b') == place(1)


def test_removed_frame_makes_room():
    buffer = BufferCore(max_frames=3)
    chain(buffer, 'abc')
    buffer.remove_frame('c')
    assert not buffer.insert('b', 'd', 1, place(1))
