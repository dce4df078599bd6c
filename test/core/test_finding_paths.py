# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finding the paths between frames, and the poses of all frames, in whole results."""

import gc
import itertools

from policies import HoldNewest
import pytest
from strategies import assert_same_pose
from tf_tree_py.core import (
    ConnectivityException,
    ExtrapolationException,
    FutureExtrapolationException,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    PlainBuffer,
    Pose,
)
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.tree.path import Path

ANY = ((None, 0),)


def place(number):
    return (float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def chain(buffer, *frames, stamps=(10, 20), static=False):
    for parent, child in itertools.pairwise(frames):
        for stamp in stamps:
            assert not buffer.insert(parent, child, stamp, Pose(1.0), static=static)


def error_of(query, *arguments):
    with pytest.raises(Exception) as caught:
        query(*arguments)
    return caught.value


def test_names_in_a_query_are_checked():
    buffer = PlainBuffer()
    error = error_of(buffer.lookup, 'map', 'base')
    assert (type(error), error.hint, error.blocked_on) == (
        LookupException, 'The buffer is empty', ANY)
    chain(buffer, 'map', 'base')
    for arguments, text in (
            (('', 'base'), "Invalid argument target_frame '': a frame name in a query must be a "
                           'string that is not empty and has no leading slash'),
            (('map', '/base'), "Invalid argument source_frame '/base': a frame name in"),
            ((None, 'base'), 'Invalid argument target_frame None: a frame'),
            (('map', ['base']), r"Invalid argument source_frame ['base']: a frame"),
            (('mop', 'base'), '"mop" passed to lookupTransform argument target_frame does not'),
            (('map', 'bose'), '"bose" passed to lookupTransform argument source_frame does not')):
        for query in (buffer.lookup, buffer.frames_between, buffer.edges_between):
            error = error_of(query, *arguments)
            assert str(error).startswith(text)
            assert isinstance(error, TypeError) == (None in arguments or ['base'] in arguments)
            unknown = isinstance(error, LookupException)
            assert unknown == ('passed to' in text)
            assert error.blocked_on == (ANY if unknown else None)
    error = error_of(buffer.latest_common_time, 'map', 'bose')
    assert str(error).startswith(
        '"bose" passed to get_latest_common_time argument source_frame does not exist')


def test_live_buffer_without_frames_says_what_its_owner_knows():
    buffer = PlainBuffer(now=lambda: 5)
    assert error_of(buffer.lookup, 'map', 'base').hint == 'Nothing has been received yet'
    buffer.intake.tree.paths.when_empty = lambda: 'It sleeps'
    assert error_of(buffer.lookup, 'map', 'base').hint == 'It sleeps'
    chain(buffer, 'map', 'base')
    assert 'It sleeps' not in error_of(buffer.lookup, 'map', 'bose').hint


def test_frames_that_are_not_joined_are_named_with_their_roots():
    buffer = PlainBuffer()
    chain(buffer, 'map', 'odom', 'base')
    chain(buffer, 'island', 'tree')
    text = ("Could not find a connection between 'base' and 'tree' because they are not part of "
            "the same tree: the root of 'base' is 'map', that of 'tree' is 'island'")
    for stamp, blocked in ((0, ANY), (15, {('odom', 10_000_000_011), ('base', 10_000_000_011),
                                           ('tree', 10_000_000_011)})):
        error = error_of(buffer.lookup, 'base', 'tree', stamp)
        assert type(error) is ConnectivityException
        assert error.describe() == text
        assert error.hint.startswith('Tf has two or more unconnected trees')
        assert set(error.blocked_on) == set(blocked)
        assert (error.target_frame, error.source_frame) == ('base', 'tree')
    # Without data for the stamp, an edge is named: it may join them.
    error = error_of(buffer.lookup, 'base', 'tree', 25)
    assert (type(error), error.child) == (FutureExtrapolationException, 'tree')
    assert set(error.blocked_on) == {('base', 25), ('odom', 25), ('tree', 25)}


def test_error_names_an_edge_between_the_frames_and_none_above_them():
    buffer = PlainBuffer(100)
    chain(buffer, 'map', 'odom', stamps=(5, 40))
    chain(buffer, 'odom', 'a', stamps=(0, 30))
    chain(buffer, 'odom', 'b', stamps=(0, 50))
    chain(buffer, 'x', 'b', stamps=(60, 70))  # b has changed its parent, so no path is cached
    chain(buffer, 'odom', 'b', stamps=(80,))
    error = error_of(buffer.lookup, 'a', 'b', 45)
    assert (type(error), error.child) == (FutureExtrapolationException, 'a')
    error = error_of(buffer.lookup, 'b', 'a', 65)
    assert (type(error), error.child) == (FutureExtrapolationException, 'a')
    assert set(error.blocked_on) == {('a', 65), ('b', 161), ('odom', 65)}


def test_latest_lookup_that_fails_waits_for_newer_data_too():
    buffer = PlainBuffer(10)
    chain(buffer, 'r', 'a', stamps=(100,))
    chain(buffer, 'a', 'b', stamps=(50,))
    error = error_of(buffer.lookup, 'r', 'b')
    assert (type(error), error.child, error.requested) == (PastExtrapolationException, 'a', 50)
    assert error.blocked_on == (('b', 51),)
    # Here a late sample of a may help, too.
    buffer = PlainBuffer(100)
    chain(buffer, 'r', 'a', stamps=(100,))
    chain(buffer, 'a', 'b', stamps=(50,))
    error = error_of(buffer.lookup, 'b', 'r')
    assert error.blocked_on == (('a', 50 + 101), ('b', 50 + 101), ('b', 51))
    buffer.intake.tree.histories['b'].end()
    buffer.intake.tree.interpolate('r', HoldNewest(3))
    assert type(error_of(buffer.lookup, 'b', 'a')) is ConnectivityException
    assert type(error_of(buffer.lookup, 'b', 'a', 20)) is PastExtrapolationException


def test_path_of_now_is_found_beside_another_of_then():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'a', stamps=(10, 90))
    chain(buffer, 'map', 'top', stamps=(10, 20))
    finder = buffer.intake.tree.paths
    assert not finder.has_changed_parent
    buffer.insert('other', 'top', 30, Pose(5.0))
    chain(buffer, 'top', 'b', stamps=(10, 40))
    assert finder.has_changed_parent
    buffer.remove_frame('top')
    assert not finder.has_changed_parent
    chain(buffer, 'map', 'top', stamps=(10, 20))
    buffer.insert('other', 'top', 30, Pose(5.0))
    assert finder.has_changed_parent
    path = finder.fixed_path('top', 'b')
    assert (path.fixed, path.for_good) == (True, False)
    assert finder.fixed_path('top', 'b') is path
    assert finder.fixed_path('a', 'b') is None
    assert finder.fixed_path('map', 'a').for_good
    assert buffer.lookup('map', 'b', 15)[0] == 2.0
    assert error_of(buffer.lookup, 'top', 'b', 45).child == 'b'
    assert type(error_of(finder.newest_path, 'a', 'b')) is ConnectivityException
    assert not finder.newest_path('other', 'b').fixed
    finder.forget()
    assert finder.fixed_path('top', 'b') is not path


def test_path_is_not_for_good_if_a_frame_far_above_was_elsewhere():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'mid', 'top', 'b', stamps=(10, 20))
    finder = buffer.intake.tree.paths
    assert finder.fixed_path('top', 'b').for_good
    buffer.insert('other', 'mid', 30, Pose(5.0))
    assert not finder.fixed_path('top', 'b').for_good
    buffer.remove_frame('mid')
    assert finder.fixed_path('top', 'b').for_good
    # An edge that ended hangs on nothing now.
    buffer.intake.tree.histories['top'].end()
    finder.forget()
    assert not finder.fixed_path('top', 'b').for_good


def test_finder_refuses_unknown_frames_also_twice_the_same():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'base')
    finder = buffer.intake.tree.paths
    for query in (finder.fixed_path, finder.newest_path, finder.newest_pose):
        for arguments in (('nowhere', 'nowhere'), ('base', 'nowhere'), ('nowhere', 'map')):
            assert type(error_of(query, *arguments)) is LookupException
    assert finder.fixed_path(['base'], 'map') is None
    assert finder.newest_pose('map', 'base') == (20, place(1))
    assert finder.newest_pose('base', 'base') == (0, se3.IDENTITY)


def test_blockers_of_two_frames_are_those_of_their_climbs():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'base', stamps=(10, 2000))
    chain(buffer, 'map', 'lens', static=True)
    finder = buffer.intake.tree.paths
    assert finder.blockers('map', 'base', 3000) == (('base', 3000),)
    assert finder.blockers('base', 'map', 1500) == (('base', 2000),)
    assert finder.blockers('base', 'lens', 5) == ()  # older than the window
    assert finder.blockers('map', 'lens', 5) == ANY


def test_kept_paths_are_limited():
    count = 142
    buffer = PlainBuffer()
    for number in range(count):
        buffer.insert('map', str(number), 0, Pose(), static=True)
    finder = buffer.intake.tree.paths
    pairs = [(str(a), str(b)) for a in range(count) for b in range(count) if a != b][:20_001]
    for pair in pairs[:-1]:
        finder.fixed_path(*pair)

    def kept():
        return sum(isinstance(each, Path) for each in gc.get_objects())

    before = kept()
    finder.fixed_path(*pairs[-1])
    assert kept() == before - 20_000 + 1


# --- all frames at once


def test_poses_of_all_frames_leave_out_those_without_data():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'odom', 'base', stamps=(10, 20))
    chain(buffer, 'base', 'arm', 'hand', stamps=(10, 15))
    chain(buffer, 'base', 'lens', static=True)
    chain(buffer, 'island', 'tree', stamps=(10, 90))
    spanning = buffer.intake.tree.spanning
    for target, stamp, expected in (
            ('base', 12, {'base': 0, 'odom': -1, 'map': -2, 'lens': 1, 'arm': 1, 'hand': 2}),
            ('base', 17, {'base': 0, 'odom': -1, 'map': -2, 'lens': 1}),
            ('lens', 25, {'lens': 0, 'base': -1}), ('hand', 17, {'hand': 0}),
            ('map', 17, {'map': 0, 'odom': 1, 'base': 2, 'lens': 3}),
            ('tree', 80, {'tree': 0, 'island': -1})):
        for _ in range(2):  # the second time in the order that was kept
            found = spanning.poses_from(target, stamp)
            assert {frame: pose[0] for frame, pose in found.items()} == expected
            assert {frame: pose[0] for frame, pose in buffer.lookup_tree(target, stamp).items()
                    } == expected
    assert [spanning.latest_of_all(each) for each in ('base', 'map', 'tree', 'island')] == [
        15, 15, 90, 90]
    assert {frame: pose[0] for frame, pose in buffer.lookup_tree('base').items()} == {
        'base': 0, 'odom': -1, 'map': -2, 'lens': 1, 'arm': 1, 'hand': 2}
    for query in (spanning.latest_of_all, lambda frame: spanning.poses_from(frame, 5)):
        error = error_of(query, 'nowhere')
        assert str(error).startswith('"nowhere" passed to lookupTransform argument target_frame')


def test_poses_of_all_frames_are_those_of_single_lookups():
    buffer = PlainBuffer()
    for number, (parent, child) in enumerate(('ab', 'bc', 'cd', 'ce', 'af', 'fg')):
        buffer.insert(parent, child, 10, Pose.from_xyz_rpy(
            1.0 + number, 0.5, number, 0.3 * number, 0.2, 1.0))
    for target in 'acg':
        found = buffer.lookup_tree(target, 10)
        assert sorted(found) == [*'abcdefg']
        for frame, pose in found.items():
            assert_same_pose(pose, buffer.lookup(target, frame, 10), 1e-13, reach=10.0)


def test_poses_of_all_frames_follow_parents_that_change():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'a', stamps=(10, 90))
    chain(buffer, 'map', 'b', stamps=(10, 90))
    for stamp, parent in ((10, 'a'), (20, 'b'), (30, 'b')):
        buffer.insert(parent, 'c', stamp, Pose(10.0))
    spanning = buffer.intake.tree.spanning
    for stamp, frames in ((15, 'c a map b'), (25, 'c b map a'), (15, 'c a map b')):
        found = buffer.lookup_tree('c', stamp)
        assert list(found) == frames.split()
        assert [round(pose[0]) for pose in found.values()] == [0, -10, -11, -10]
    assert list(buffer.lookup_tree('c')) == ['c', 'b', 'map', 'a']
    assert spanning.latest_of_all('c') == 30
    # The frames of an edge that was removed are not reached any more.
    fixed = PlainBuffer()
    chain(fixed, 'map', 'a')
    chain(fixed, 'a', 'b')
    assert list(fixed.lookup_tree('map')) == ['map', 'a', 'b']
    fixed.remove_frame('a')
    assert list(fixed.lookup_tree('map')) == ['map']
    assert list(fixed.lookup_tree('b')) == ['b', 'a']


def test_errors_of_poses_without_data_are_those_of_the_edges():
    buffer = PlainBuffer(1000)
    chain(buffer, 'map', 'base', stamps=(10, 20))
    buffer.set_interpolation('later', HoldNewest(5))
    for stamp, cls in ((9, PastExtrapolationException), (21, FutureExtrapolationException)):
        error = error_of(buffer.lookup_at, 'map', 'base', stamp)
        assert (type(error), error.child, error.requested, error.target_frame,
                error.source_frame) == (cls, 'base', stamp, 'map', 'base')
        assert isinstance(error, ExtrapolationException)
    buffer.clear()
    assert type(error_of(buffer.lookup_at, 'map', 'base', 15)) is NoDataException
