# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Paths between frames, and the edges as data, in whole results worked out by hand.

``test_oracle`` and ``test_rehanging`` compare the poses of random trees.
"""

import gc
import math

import numpy as np
from policies import HoldNewest
import pytest
from strategies import assert_same_pose
from tf_tree_py.core import (
    ConnectivityException,
    EdgeInfo,
    ExtrapolationException,
    FutureExtrapolationException,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    PlainBuffer,
    Pose,
)
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.stamp import BEGINNING, FOREVER
from tf_tree_py.core.tree.edge_info import (
    counted,
    info_at,
    info_of,
    samples_around,
    stamps_of,
    summary,
)
from tf_tree_py.core.tree.path import edge_to_blame, latest_common, Path, Step

ANY = ((None, 0),)


def place(number):
    return (float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def moving(child, *stamps, parent='p', cache_time=100, holds_for=0):
    """Return a history whose poses are as many metres along x as their stamps."""
    history = Samples(child, cache_time, f'of {child}')
    if holds_for:
        history.interpolate_by(HoldNewest(holds_for))
    for stamp in stamps:
        history.insert(stamp, parent, place(stamp))
    return history


def rehung():
    """Return a history that was at p, q, and p again, and ended at 50."""
    history = Samples('c', 1000, 'node')
    for stamp, parent in ((10, 'p'), (20, 'p'), (30, 'q'), (40, 'p'), (50, 'p')):
        history.insert(stamp, parent, place(stamp))
    history.end()
    return history


STATIC = StaticHistory('lens', 'camera', place(7), 'calibration')


# --- edges as data


def test_stamps_of_each_kind_of_edge():
    for history, stamps in ((None, []), (STATIC, []), (Samples('c', 5), []),
                            (moving('c', 5), [5]), (moving('c', 1, 5, 9, cache_time=3), [5, 9])):
        found = stamps_of(history)
        assert (found.tolist(), found.dtype) == (stamps, np.int64)


def test_samples_around_a_stamp_have_their_own_stamps():
    history = moving('c', 10, 20, 20, 30)
    for stamp, around in ((-5, [10]), (9, [10]), (10, [10]), (11, [10, 20]), (20, [20]),
                          (25, [20, 30]), (29, [20, 30]), (30, [30]), (31, [30])):
        found = samples_around(history, stamp)
        assert found == [(knot, Pose(*place(knot))) for knot in around]
        assert all(type(pose) is Pose for _, pose in found)
    for history in (None, STATIC, Samples('c', 5)):
        assert samples_around(history, 5) == []

    class Wide(Samples):
        """Another kind of edge, whose tracks are longer than they need be."""

        def track(self, first, last):
            return super().track(self.oldest_stamp, self.newest_stamp)

    history = Wide('c', 100)
    for stamp in (10, 20, 30, 40):
        history.insert(stamp, 'p', place(stamp))
    for stamp, around in ((20, [20]), (21, [20, 30]), (29, [20, 30]), (30, [30]), (50, [40])):
        assert [knot for knot, _ in samples_around(history, stamp)] == around


def test_edge_as_data():
    assert info_of('p', moving('c', 1, 5, 9)) == EdgeInfo('p', 'c', 'of c', False, 3, 1, 9)
    assert info_of('x', Samples('c', 5)) == EdgeInfo('x', 'c', '', False, 0, 0, 0)
    assert info_of('camera', STATIC) == EdgeInfo('camera', 'lens', 'calibration', True, 1, 0, 0)
    info = EdgeInfo('p', 'c', '', False, 5, 100, 2_000_000_100)
    assert (info.span, info.interval, info.rate_hz) == (2_000_000_000, 5e8, 2.0)
    info = EdgeInfo('p', 'c', '', False, 1, 100, 100)
    assert (info.span, info.interval, info.rate_hz) == (0, 0.0, 0.0)


def test_edge_at_a_moment_has_the_interval_with_that_parent():
    history = rehung()
    for moments, parent, oldest, latest in (
            ((10, 19, 20, 29), 'p', 10, 20), ((30, 39), 'q', 30, 30), ((40, 50), 'p', 40, 50)):
        for moment in moments:
            assert info_at(parent, history, moment) == EdgeInfo(
                parent, 'c', 'node', False, 5, oldest, latest)
    assert info_at('camera', STATIC, 15) == info_of('camera', STATIC)
    for moment in (None, 15):
        assert info_at('p', moving('c', 10, 20), moment).oldest == 10
    assert info_at('p', history, None) == EdgeInfo('p', 'c', 'node', False, 5, 10, 50)


def test_tree_in_one_line():
    still = EdgeInfo('a', 'b', '', True, 1, 0, 0)
    one = EdgeInfo('b', 'c', '', False, 2, 3_000_000_000, 4_500_000_000)
    two = EdgeInfo('b', 'd', '', False, 2, 1_000_000_000, 2_000_000_000)
    for frames, edges, text in (
            (0, [], 'empty'), (1, [], '1 frame, 0 edges (0 static)'),
            (2, [still], '2 frames, 1 edge (1 static)'),
            (4, [one, still, two],
             '4 frames, 3 edges (1 static), 1.000000000 to 4.500000000 s')):
        assert summary(frames, edges) == text
    assert [counted(number, 'edge') for number in range(3)] == ['0 edges', '1 edge', '2 edges']


# --- paths


def test_path_has_the_steps_from_the_target_to_the_source():
    up, down = [moving('a', 1, 9), STATIC], [moving('t', 2, 8, parent='x')]
    path = Path(up, down)
    steps = [Step('x', down[0], True), Step('camera', STATIC, False), Step('p', up[0], False)]
    assert path.steps() == steps
    assert path.steps() is path.steps()
    assert (path.span(), path.latest_common_time()) == ((2, 8), 8)
    assert path.slowest_edges() == down
    assert path.without_data(5) == []
    assert path.without_data(9) == down
    assert path.without_data(0) == [up[0], *down]
    assert path.pose_at(5) == pytest.approx(place(7 + 5 - 5))


def test_tracks_of_a_path_have_the_samples_around_two_stamps():
    path = Path([moving('a', *range(0, 100, 10))], [moving('b', *range(5, 100, 20)), STATIC])
    down, up = path.tracks(22, 38)
    assert [track.knots.tolist() for track in (*down, *up)] == [[20, 30, 40], [], [5, 25, 45]]


def test_path_is_fixed_if_no_edge_changes_its_parent():
    fixed, changing = moving('a', 1, 2), rehung()
    for source, target, above, expected in (
            ([fixed], [STATIC], [], (True, True)), ([changing], [], [], (False, False)),
            ([], [changing], [], (False, False)), ([], [fixed], [changing], (True, False)),
            ([], [fixed], [fixed, changing], (True, False)), ([fixed], [], [STATIC], (True, True)),
            ([], [], [], (True, True)), ([fixed, changing], [], [], (False, False))):
        path = Path(source, target, above)
        assert (path.fixed, path.for_good) == expected
    assert Path([fixed], []).for_good


def test_path_of_static_edges_is_valid_at_all_times():
    path = Path([STATIC], [])
    assert (path.span(), path.latest_common_time(), path.slowest_edges()) == (
        (BEGINNING, FOREVER - 1), 0, [])
    assert Path([], []).pose_at(5) == se3.IDENTITY


def edges_down(kinds):
    """Return edges from the leaf up: static ones (s) and moving ones (m), each 1, 10, 100 m."""
    return [StaticHistory(f'f{i}', f'f{i + 1}', place(10 ** i)) if kind == 's' else constant(i)
            for i, kind in enumerate(kinds)]


def constant(i):
    history = Samples(f'f{i}', 100)
    for stamp in (0, 9):
        history.insert(stamp, f'f{i + 1}', place(10 ** i))
    return history


@pytest.mark.parametrize('source', ['', 's', 'm', 'ss', 'sms', 'mssm', 'ssmss'])
@pytest.mark.parametrize('target', ['', 'm', 'ss', 'ssm', 'mss'])
def test_samples_along_a_path_are_those_of_each_step(source, target):
    up, down = edges_down(source), edges_down(target)
    path = Path(up, down)
    below, above, poses = path.samples_at(5)
    assert poses == [place(10 ** i) for i in (*range(len(down)), *reversed(range(len(up))))]
    assert poses == [step.history.sample(5) for step in path.steps()]
    for parts, edges in ((below, up), (above, down)):
        kinds = target if edges is down else source
        # Successive static edges are one.
        assert len(parts) == kinds.count('m') + sum(len(run) > 0 for run in kinds.split('m'))
        assert math.fsum(pose[0] for pose in parts) == sum(10 ** i for i in range(len(edges)))
    assert path.pose_at(5)[0] == sum(10 ** i for i in range(len(up))) - sum(
        10 ** i for i in range(len(down)))
    tracks = path.tracks(2, 7)
    assert [[track.at(np.array([5])).ravel().tolist() for track in branch] for branch in tracks] \
        == [[list(pose) for pose in branch] for branch in (below, above)]


def test_static_edges_are_composed_in_their_order():
    quarter = math.sqrt(0.5)
    turn = (1.0, 0.0, 0.0, 0.0, 0.0, quarter, quarter)
    path = Path([StaticHistory('c', 'b', place(1)), StaticHistory('b', 'a', turn)], [])
    assert path.pose_at(0) == pytest.approx((1.0, 1.0, 0.0, 0.0, 0.0, quarter, quarter))


def test_latest_common_stamp():
    a, b, held, longer = (moving('a', 1, 9), moving('b', 1, 5), moving('h', 1, 3, holds_for=4),
                          moving('l', 1, 2, holds_for=30))
    for edges, common in (
            ([], 0), ([Samples('c', 5)], 0), ([a], 9), ([a, b], 5), ([b, a], 5),
            ([a, Samples('c', 5)], 9), ([held], 3), ([held, b], 5), ([held, a], 7),
            ([a, held, Samples('c', 5)], 7), ([held, longer], 3), ([longer, a], 9),
            ([Samples('c', 5), held, longer], 3)):
        assert latest_common(edges) == common
    assert Path([a, held], []).slowest_edges() == [held]
    assert Path([held, longer], []).slowest_edges() == [held]
    assert Path([longer, a], []).slowest_edges() == [a]


def test_edge_to_blame_is_the_one_that_is_lost_then_the_one_that_is_late():
    lost, older = moving('lost', 150, 300), moving('older', 120, 210)
    fresh = moving('fresh', 170, 180)
    young, empty = moving('young', 110, 115), Samples('empty', 100)
    late, later = moving('late', 50, 90), moving('later', 50, 80)
    for edges, stamp, blamed in (
            ([lost, older, young], 100, lost), ([young, older, lost], 100, lost),
            ([older, lost], 90, lost),  # both are lost; of that, the first sample is newer
            ([young, empty], 100, young), ([empty, young], 100, young),
            ([late, later], 100, later), ([later, late], 100, later), ([late, empty], 100, empty),
            ([fresh, lost], 90, lost), ([lost, fresh], 90, lost),
            ([young, later], 100, young), ([later, young, older], 100, older)):
        assert edge_to_blame(edges, stamp) is blamed


def test_failure_names_the_worst_edge_and_all_that_may_help():
    a, b = moving('a', 100, 200), moving('b', 100, 150)
    path = Path([a], [b])
    for stamp, cls, child, blocked in (
            (210, FutureExtrapolationException, 'b', (('a', 210), ('b', 210))),
            (160, FutureExtrapolationException, 'b', (('a', 201), ('b', 160))),
            # Both have no sample so old, but b may still get one.
            (99, PastExtrapolationException, 'a', None)):
        for given in (a, b):
            error = given.extrapolation(stamp)
            found = path.failure(stamp, error)
            assert (type(found), found.child, found.blocked_on) == (cls, child, blocked)
            assert (found is error) == (given.child == child)


# --- finding them


def chain(buffer, *frames, stamps=(10, 20), static=False):
    for parent, child in zip(frames, frames[1:]):
        for stamp in stamps:
            assert not buffer.insert(parent, child, stamp, Pose(1.0), static=static)


def error_of(query, *arguments):
    with pytest.raises(Exception) as caught:  # noqa: PT011
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
    text = ("Could not find a connection between 'base' and 'tree' because they are not part of the "
            "same tree: the root of 'base' is 'map', that of 'tree' is 'island'")
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
