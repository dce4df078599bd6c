# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Each query of a buffer and of its snapshot in whole results, and what observers see of it."""

import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py.core import (
    ConnectivityException,
    EdgeInfo,
    FutureExtrapolationException,
    InvalidArgumentException,
    Linear,
    LookupException,
    PastExtrapolationException,
    PlainBuffer,
    PlainSnapshot,
    Pose,
)
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.messages.observers import Observer

WINDOW = 100
FUTURE, PAST = FutureExtrapolationException, PastExtrapolationException


def robot():
    """Return map -> odom -> base -> lens (static), map -> mark, and island -> tree."""
    made = PlainBuffer(WINDOW)
    for stamp in (10, 20, 30):
        made.insert('map', 'odom', stamp, Pose(0.01 * stamp), authority='slam')
    for stamp in (15, 25):
        made.insert('odom', 'base', stamp, Pose(0.0, 0.01 * stamp))
    made.insert('base', 'lens', 0, Pose(0.0, 0.0, 5.0), static=True)
    made.insert('map', 'mark', 40, Pose(1.0))
    made.insert('island', 'tree', 10, Pose(2.0))
    return made


def both(buffer):
    return buffer, buffer.snapshot()


def near(x, y=0.0, z=0.0):
    return pytest.approx((x, y, z, 0.0, 0.0, 0.0, 1.0))


def test_lookups_of_one_pose():
    buffer = robot()
    for tree in both(buffer):
        assert tree.cache_time == WINDOW
        for arguments, stamp, pose in (
                (('map', 'lens'), 25, near(0.25, 0.25, 5.0)), (('map', 'lens', 0), 25, near(
                    0.25, 0.25, 5.0)), (('map', 'lens', 18), 18, near(0.18, 0.18, 5.0)),
                (('base', 'map', 18), 18, near(-0.18, -0.18)),
                (('base', 'lens'), 0, near(0, 0, 5)),
                (('base', 'lens', 7), 7, near(0, 0, 5)), (('map', 'odom'), 30, near(0.3)),
                (('odom', 'odom'), 30, near(0)), (('odom', 'odom', 7), 7, near(0)),
                (('lens', 'lens'), 0, near(0)), (('map', 'map'), 0, near(0)),
                (('nowhere', 'nowhere'), 0, near(0)), (('x', 'x', 5), 5, near(0))):
            assert tree.lookup_stamped(*arguments) == (stamp, pose)
            found = tree.lookup(*arguments)
            assert (type(found), found) == (Pose, pose)
            assert tree.lookup_stamped(*arguments[:2], np.int64((arguments + (0,))[2])) == (
                stamp, pose)


def test_stamp_zero_is_ordinary_in_lookup_at():
    buffer = PlainBuffer(WINDOW)
    for stamp in (-10, 0, 10):
        buffer.insert('map', 'base', stamp, Pose(stamp))
    for tree in both(buffer):
        assert [tree.lookup_at('map', 'base', stamp)[0] for stamp in (-5, 0, 5)] == [-5, 0, 5]
        assert tree.lookup('map', 'base', 0)[0] == 10
        assert type(tree.lookup_at('map', 'base', 0)) is Pose
        found = tree.lookup_at('base', 'base', 0)
        assert (type(found), found) == (Pose, Pose())
        assert tree.lookup_at('x', 'x', 5) == Pose()


def test_lookups_through_a_fixed_frame():
    buffer = robot()
    for tree in both(buffer):
        for arguments, stamp, pose in (
                (('base', 25, 'base', 15, 'map'), 25, near(-0.1, -0.1)),
                (('base', 0, 'base', 15, 'map'), 25, near(-0.1, -0.1)),
                (('base', 15, 'lens', 0, 'map'), 15, near(0.1, 0.1, 5.0)),
                (('lens', 5, 'base', 20, 'base'), 5, near(0, 0, -5.0)),
                (('map', 5, 'odom', 20, 'map'), 5, near(0.2))):
            assert tree.lookup_full_stamped(*arguments) == (stamp, pose)
            found = tree.lookup_full(*arguments)
            assert (type(found), found) == (Pose, pose)


def caught(query, *arguments):
    with pytest.raises(TransformException) as found:
        query(*arguments)
    return found.value


@pytest.mark.parametrize(('arguments', 'cls', 'child', 'blocked', 'cause'), [
    # One half fails: the other may lose its data meanwhile, unless it is the latest.
    (('map', 50, 'base', 20, 'map'), FUTURE, 'base', None, None),
    (('base', 50, 'odom', 20, 'map'), FUTURE, 'base',
     {('odom', 121), ('base', 50), ('odom', 50)}, None),
    (('base', 50, 'odom', 0, 'map'), FUTURE, 'base', {('base', 50), ('odom', 50)}, None),
    (('odom', 12, 'base', 50, 'map'), FUTURE, 'base',
     {('odom', 111), ('base', 50), ('odom', 50)}, None),
    # Both fail: the first is raised, and it waits for both.
    (('base', 50, 'odom', 60, 'map'), FUTURE, 'odom',
     {('odom', 60), ('base', 50), ('odom', 50)}, None),
    # Never: then there is no wait, whichever half it is.
    (('base', 50, 'odom', -500, 'map'), PAST, 'odom', None, None),
    (('base', -500, 'odom', 60, 'map'), FUTURE, 'odom', None, PAST),
    (('base', -500, 'odom', 20, 'map'), PAST, 'base', None, None),
    (('tree', 10, 'odom', 20, 'map'), ConnectivityException, None, {
        ('odom', 121), ('tree', 111)}, None)])
def test_errors_of_lookups_through_a_fixed_frame(arguments, cls, child, blocked, cause):
    buffer = robot()
    if arguments == ('map', 50, 'base', 20, 'map'):
        buffer.lookup_full(*arguments)
        return
    for tree in both(buffer):
        for query in (tree.lookup_full, tree.lookup_full_stamped):
            error = caught(query, *arguments)
            assert (type(error), error.child) == (cls, child)
            assert (error.target_frame, error.source_frame) == arguments[0::2][:2]
            assert (None if error.blocked_on is None else set(error.blocked_on)) == blocked
            assert (None if error.__cause__ is None else type(error.__cause__)) == cause


def test_all_three_frames_of_a_lookup_through_a_fixed_one_are_checked():
    buffer = robot()
    for place, name in ((0, 'target'), (2, 'source'), (4, 'fixed')):
        arguments = ['map', 20, 'map', 20, 'map']
        arguments[place] = 'nowhere'
        error = caught(buffer.lookup_full, *arguments)
        assert type(error) is LookupException
        assert str(error).startswith(f'"nowhere" passed to lookupTransform argument {name}_frame')

    for target, source, fixed, name in (('x', 'y', 'map', 'target'), ('x', 'map', 'x', 'target'),
                                        ('map', 'x', 'x', 'source'), ('map', 'x', 'y', 'source')):
        error = caught(buffer.lookup_full, target, 20, source, 20, fixed)
        assert f'argument {name}_frame does not exist' in str(error)


def test_rotations_along_the_way_through_a_fixed_frame():
    buffer = PlainBuffer(WINDOW)
    for stamp in (10, 20):
        buffer.insert('map', 'base', stamp, Pose.from_xyz_rpy(
            0.1 * stamp, 2.0, 0.0, 0.3, 0.2, 1.0))
        buffer.insert('map', 'arm', stamp, Pose.from_xyz_rpy(
            1.0, 0.1 * stamp, 3.0, 0.0, 0.5, 2.0))
    for target, source in (('base', 'arm'), ('arm', 'base'), ('base', 'base')):
        found = buffer.lookup_full(target, 20, source, 10, 'map')
        expected = buffer.lookup(target, 'map', 20) @ buffer.lookup('map', source, 10)
        assert_same_pose(found, expected, reach=5.0)


def test_frame_whose_edge_has_no_samples_yet_has_no_stamp():
    buffer = PlainBuffer(WINDOW)
    buffer.set_interpolation('later', Linear())
    assert buffer.lookup_stamped('later', 'later') == (0, Pose())


def test_latest_common_times():
    buffer = robot()
    for tree in both(buffer):
        for target, source, stamp in (
                ('map', 'lens', 25), ('odom', 'map', 30), ('mark', 'odom', 30),
                ('base', 'lens', 0), ('base', 'base', 25), ('lens', 'lens', 0), ('map', 'map', 0)):
            assert tree.latest_common_time(target, source) == stamp
        for frames, cls in ((('map', 'tree'), ConnectivityException),
                            (('map', 'nowhere'), LookupException),
                            (('x', 'x'), LookupException)):
            error = caught(tree.latest_common_time, *frames)
            assert (type(error), error.target_frame, error.source_frame) == (cls, *frames)


def test_frames_and_edges_between_two_frames():
    buffer = robot()
    buffer.insert('mark', 'base', 35, Pose())
    map_odom = EdgeInfo('map', 'odom', 'slam', False, 3, 10, 30)
    lens = EdgeInfo('base', 'lens', 'default_authority', True, 1, 0, 0)
    mark = EdgeInfo('map', 'mark', 'default_authority', False, 1, 40, 40)
    base = EdgeInfo('odom', 'base', 'default_authority', False, 3, 15, 25)
    base_now = base._replace(parent='mark', latest=35)
    for tree in both(buffer):
        for arguments, frames, edges in (
                (('odom', 'lens'), ['lens', 'base', 'mark', 'map', 'odom'],
                 [lens, base_now, mark, map_odom]),
                (('map', 'lens', 20), ['lens', 'base', 'odom', 'map'], [lens, base, map_odom]),
                (('lens', 'odom', 20), ['odom', 'base', 'lens'], [base, lens]),
                (('base', 'base'), ['base'], []), (('x', 'x', 5), ['x'], [])):
            assert tree.frames_between(*arguments) == frames
            assert tree.edges_between(*arguments) == edges
        for query in (tree.frames_between, tree.edges_between):
            error = caught(query, 'odom', 'lens', 12)
            assert (type(error), error.child, error.target_frame, error.source_frame) == (
                PastExtrapolationException, 'mark', 'odom', 'lens')


def test_all_frames_at_once():
    buffer = robot()
    for tree in both(buffer):
        found = tree.lookup_tree('base', 20)
        assert found == {'base': near(0), 'odom': near(0, -0.2), 'map': near(-0.2, -0.2),
                         'lens': near(0, 0, 5)}
        assert all(type(pose) is Pose for pose in found.values())
        assert tree.lookup_tree('base') == {
            'base': near(0), 'odom': near(0, -0.25), 'map': near(-0.25, -0.25),
            'lens': near(0, 0, 5)}
        error = caught(tree.lookup_tree, 'nowhere')
        assert (type(error), error.target_frame, error.source_frame) == (
            LookupException, 'nowhere', None)


def test_contents():
    buffer = robot()
    buffer.insert('x', 'gone', 1, Pose())
    buffer.intake.tree.histories['gone'].end()
    buffer.insert('mark', 'base', 35, Pose())
    for tree in both(buffer):
        assert tree.frames() == [
            'odom', 'map', 'base', 'lens', 'mark', 'tree', 'island', 'gone', 'x']
        assert tree.edges() == [
            EdgeInfo('map', 'odom', 'slam', False, 3, 10, 30),
            EdgeInfo('mark', 'base', 'default_authority', False, 3, 15, 35),
            EdgeInfo('base', 'lens', 'default_authority', True, 1, 0, 0),
            EdgeInfo('map', 'mark', 'default_authority', False, 1, 40, 40),
            EdgeInfo('island', 'tree', 'default_authority', False, 1, 10, 10)]
        for stamp, parents in ((20, {'odom': 'map', 'base': 'odom', 'lens': 'base'}),
                               (35, {'base': 'mark', 'lens': 'base'}), (0, {'lens': 'base'}),
                               (1, {'lens': 'base', 'gone': 'x'})):
            assert tree.parents_at(stamp) == parents
        assert tree.stamps_of('odom').tolist() == [10, 20, 30]
        assert tree.stamps_of('nowhere').tolist() == tree.stamps_of('lens').tolist() == []
        around = tree.samples_around('odom', 12)
        assert around == [(10, near(0.1)), (20, near(0.2))]
        assert tree.samples_around('nowhere', 12) == []
        assert repr(tree) == (f'<{type(tree).__name__}: 9 frames, 5 edges (1 static), '
                              '0.000000010 to 0.000000040 s>')


def test_snapshot_stays_as_it_was():
    buffer = robot()
    still = buffer.snapshot()
    assert type(still) is PlainSnapshot
    assert still.snapshot() is still
    buffer.insert('map', 'odom', 90, Pose(9.0))
    assert (still.lookup_stamped('map', 'odom'), buffer.lookup('map', 'odom')) == (
        (30, near(0.3)), near(9.0))
    # A sample that would have arrived in it does not: its errors do not suggest to wait.
    assert 'timeout' not in caught(still.lookup, 'map', 'odom', 95).hint


@pytest.mark.parametrize('stamp', [1.5, None, '12', 2 ** 63])
def test_each_query_checks_its_stamp(stamp):
    buffer = robot()
    for query, *arguments in (
            (buffer.lookup, 'map', 'base', stamp), (buffer.lookup_stamped, 'map', 'base', stamp),
            (buffer.lookup_at, 'map', 'base', stamp),
            (buffer.lookup_full, 'map', stamp, 'base', 20, 'map'),
            (buffer.lookup_full, 'map', 20, 'base', stamp, 'map'),
            (buffer.frames_between, 'map', 'base', stamp),
            (buffer.edges_between, 'map', 'base', stamp), (buffer.lookup_tree, 'map', stamp),
            (buffer.parents_at, stamp), (buffer.samples_around, 'odom', stamp)):
        if stamp == 2 ** 63 and type(stamp) is int and query in (
                buffer.lookup, buffer.lookup_stamped):
            continue  # the common case: an int that no sample has
        assert isinstance(caught(query, *arguments), InvalidArgumentException)


class Watching(Observer):
    """Notes lookups, and how they end."""

    def __init__(self):
        self.seen = []

    def asked(self, target, source, stamp):
        self.seen.append((target, source, stamp))
        return lambda error: self.seen.append(type(error))


def test_observers_see_each_lookup_once():
    buffer = robot()
    none = type(None)
    for query, arguments, seen in (
            (buffer.lookup, ('map', 'base', 20), [('map', 'base', 20), none]),
            (buffer.lookup_stamped, ('map', 'base'), [('map', 'base', None), none]),
            (buffer.lookup_at, ('map', 'base', 20), [('map', 'base', 20), none]),
            (buffer.lookup, ('map', 'base', 90), [('map', 'base', 90), FUTURE]),
            (buffer.lookup_full, ('base', 25, 'odom', 15, 'map'), [
                ('map', 'odom', 15), ('base', 'map', 25), none, none])):
        watching = Watching()
        buffer.observers.add(watching)
        try:
            query(*arguments)
        except TransformException as error:
            assert (error.target_frame, error.source_frame) == arguments[:2]
        buffer.observers.remove(watching)
        assert sorted(map(str, watching.seen)) == sorted(map(str, seen))
        assert watching.seen[0] in seen
