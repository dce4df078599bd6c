# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import itertools
import math

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from strategies import assert_same_pose, length, poses, random_pose
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ConnectivityException,
    EdgeInfo,
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    Kind,
    LATEST,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    Pose,
    Sample,
    TransformException,
)
from tf_tree_py.core.buffer.waiting import Inquiry
from tf_tree_py.core.geometry import se3

SECOND = 1_000_000_000
QUARTER = math.pi / 2


def at(x=0.0, y=0.0, z=0.0, yaw=0.0):
    return Pose.from_xyz_rpy(x, y, z, yaw=yaw)


@pytest.fixture
def robot():
    """Return a robot that drives along x and rotates, and a lamp that is not connected to it."""
    buffer = BufferCore(10 * SECOND)
    for tick in range(5):
        assert not buffer.insert(
            'odom', 'base_link', (10 + tick) * SECOND, at(x=tick, yaw=tick * QUARTER / 4))
    for tick in range(3):
        assert not buffer.insert('map', 'odom', (11 + tick) * SECOND, at(y=10.0 * tick))
    assert not buffer.insert('base_link', 'camera', 0, at(x=0.5, z=1.0), static=True)
    assert not buffer.insert('base_link', 'gripper', 0, at(y=1.0, yaw=QUARTER), static=True)
    assert not buffer.insert('camera', 'lens', 0, at(x=0.1), static=True)
    assert not buffer.insert('ceiling', 'lamp', 0, at(z=-1.0), static=True)
    assert not buffer.insert('odom', 'ball', 12 * SECOND, at(x=7.0))
    return buffer


# --- poses by frames and stamp: the table

TURNED = math.sqrt(0.5)

TABLE = [
    # target, source, time (s), the result: (x, y, z, yaw) or an error
    ('base_link', 'camera', 0, (0.5, 0, 1, 0)),
    ('base_link', 'camera', 99, (0.5, 0, 1, 0)),
    ('base_link', 'lens', 12.34, (0.6, 0, 1, 0)),
    ('lens', 'base_link', 1, (-0.6, 0, -1, 0)),
    ('gripper', 'base_link', 5, (-1, 0, 0, -QUARTER)),
    ('camera', 'gripper', 5, (-0.5, 1, -1, QUARTER)),
    ('odom', 'base_link', 10, (0, 0, 0, 0)),
    ('odom', 'base_link', 10.5, (0.5, 0, 0, QUARTER / 8)),
    ('odom', 'base_link', 14, (4, 0, 0, QUARTER)),
    ('odom', 'base_link', 0, (4, 0, 0, QUARTER)),
    ('odom', 'gripper', 14, (3, 0, 0, 2 * QUARTER)),
    ('odom', 'camera', 14, (4, 0.5, 1, QUARTER)),
    ('camera', 'odom', 14, (-0.5, 4, -1, -QUARTER)),
    ('map', 'odom', 11.5, (0, 5, 0, 0)),
    ('map', 'base_link', 12, (2, 10, 0, QUARTER / 2)),
    # The newest stamp of both edges is 13 s.
    ('map', 'base_link', 0, (3, 20, 0, QUARTER * 3 / 4)),
    ('ball', 'base_link', 0, (-5, 0, 0, QUARTER / 2)),
    ('ball', 'map', 0, (-7, -10, 0, 0)),
    ('ceiling', 'lamp', 3, (0, 0, -1, 0)),
    ('map', 'base_link', 13.000000001, FutureExtrapolationException),
    ('map', 'base_link', 14, FutureExtrapolationException),
    ('map', 'base_link', 10.999999999, PastExtrapolationException),
    ('map', 'odom', 10, PastExtrapolationException),
    ('odom', 'ball', 11.999999999, PastExtrapolationException),
    ('odom', 'ball', 12.000000001, FutureExtrapolationException),
    ('map', 'lamp', 0, ConnectivityException),
    ('lamp', 'base_link', 12, ConnectivityException),
    # tf2 raises this if an edge on the path has no data, whatever else is wrong.
    ('lamp', 'base_link', 20, ExtrapolationException),
    ('map', 'nowhere', 0, LookupException),
    ('nowhere', 'map', 12, LookupException),
    ('', 'map', 0, InvalidArgumentException),
    ('map', '', 0, InvalidArgumentException),
    ('/map', 'base_link', 0, InvalidArgumentException),
    ('map', '/base_link', 12, InvalidArgumentException),
    # The same frame twice is the identity, without any check.
    ('camera', 'camera', 99, (0, 0, 0, 0)),
    ('nowhere', 'nowhere', 3, (0, 0, 0, 0)),
    ('/x', '/x', 0, (0, 0, 0, 0)),
    ('', '', 0, (0, 0, 0, 0)),
]


@for_each(row=TABLE)
def test_table_of_lookups(robot, row):
    target, source, seconds, expected = row
    stamp = round(seconds * SECOND)
    if isinstance(expected, tuple):
        assert_same_pose(robot.lookup(target, source, stamp), at(*expected[:3], expected[3]))
    else:
        with pytest.raises(expected):
            robot.lookup(target, source, stamp)


@pytest.mark.parametrize(('target', 'source'), [
    ('map', 'lens'), ('lens', 'map'), ('lens', 'odom'), ('odom', 'odom')])
def test_edges_between_two_frames_are_those_of_the_listing_in_order(robot, target, source):
    edges, frames = robot.edges_between(target, source), robot.frames_between(target, source)
    assert [{edge.parent, edge.child} for edge in edges] == [
        set(pair) for pair in itertools.pairwise(frames)]
    assert set(edges) <= set(robot.edges())


@pytest.mark.parametrize(('target', 'source', 'seconds', 'expected'), [
    ('map', 'base_link', 0, 13), ('map', 'base_link', 12, 12), ('base_link', 'lens', 0, 0),
    ('base_link', 'lens', 5, 5), ('odom', 'odom', 0, 13), ('odom', 'odom', 3, 3),
    ('map', 'map', 0, 0), ('camera', 'camera', 0, 0), ('nowhere', 'nowhere', 0, 0),
])
def test_stamp_that_comes_back_is_what_latest_came_to(robot, target, source, seconds, expected):
    stamp, _ = robot.lookup_stamped(target, source, seconds * SECOND)
    assert stamp == expected * SECOND


# --- latest common time


@pytest.mark.parametrize(('target', 'source', 'expected'), [
    ('odom', 'base_link', 14), ('map', 'lens', 13), ('ball', 'map', 12), ('ball', 'ball', 12),
    ('camera', 'gripper', 0), ('camera', 'camera', 0), ('map', 'map', 0),
    ('base_link', 'odom', 14),
])
def test_latest_common_time_is_the_oldest_of_the_newest(robot, target, source, expected):
    assert robot.latest_common_time(target, source) == expected * SECOND


@pytest.mark.parametrize(('target', 'source', 'error'), [
    ('map', 'nowhere', LookupException), ('nowhere', 'nowhere', LookupException),
    ('map', 'lamp', ConnectivityException), ('', 'map', InvalidArgumentException),
    ('/map', '/map', InvalidArgumentException),
])
def test_latest_common_time_of_what_is_not_joined_is_an_error(robot, target, source, error):
    with pytest.raises(error):
        robot.latest_common_time(target, source)


# --- through a fixed frame


def test_lookup_full_goes_through_the_fixed_frame(robot):
    # For the robot at 14 s, the place of an object that its camera detected at 10 s.
    then, now = 10 * SECOND, 14 * SECOND
    base_T_camera = robot.lookup_full('base_link', now, 'camera', then, 'odom')
    expected = robot.lookup('base_link', 'odom', now) @ robot.lookup('odom', 'camera', then)
    assert base_T_camera == expected
    # Since then, 4 m ahead and 90 degrees to the left: 0.5 m ahead is now 3.5 m to the left.
    assert_same_pose(base_T_camera, at(0.0, 3.5, 1.0, -QUARTER))


def test_stamp_of_lookup_full_is_that_of_the_target(robot):
    stamp, _ = robot.lookup_full_stamped('odom', LATEST, 'camera', 11 * SECOND, 'map')
    assert stamp == 13 * SECOND
    stamp, _ = robot.lookup_full_stamped('camera', 12 * SECOND, 'odom', LATEST, 'map')
    assert stamp == 12 * SECOND


@pytest.mark.parametrize(('target', 'source', 'fixed', 'error'), [
    ('nowhere', 'camera', 'odom', LookupException),
    ('camera', 'nowhere', 'odom', LookupException),
    ('camera', 'camera', 'nowhere', LookupException),
    ('/camera', 'camera', 'odom', InvalidArgumentException),
    ('camera', '', 'odom', InvalidArgumentException),
    ('camera', 'gripper', '/odom', InvalidArgumentException),
    ('camera', 'gripper', 'lamp', ConnectivityException),
    ('ball', 'gripper', 'odom', ExtrapolationException),
])
def test_lookup_full_checks_all_three_frames(robot, target, source, fixed, error):
    with pytest.raises(error) as raised:
        robot.lookup_full(target, 13 * SECOND, source, 13 * SECOND, fixed)
    assert (raised.value.target_frame, raised.value.source_frame) == (target, source)


# --- invalid stamps


@pytest.mark.parametrize('stamp', [12.0, '12', None, np.float64(12e9)])
def test_stamp_that_is_no_integer_is_named(robot, stamp):
    with pytest.raises(InvalidArgumentException, match='stamp .* integer nanoseconds'):
        robot.lookup('map', 'base_link', stamp)
    with pytest.raises(InvalidArgumentException, match='stamp .* integer nanoseconds'):
        robot.lookup_tree('map', stamp)
    with pytest.raises(InvalidArgumentException, match='stamp .* integer nanoseconds'):
        robot.frames_between('map', 'base_link', stamp)
    with pytest.raises(InvalidArgumentException, match='stamp .* integer nanoseconds'):
        robot.insert('map', 'new', stamp, Pose())
    assert 'new' not in robot.frames()


def test_stamp_that_no_sample_can_hold_changes_nothing(robot):
    edges = robot.edges()
    for child in ('camera', 'base_link', 'new'):
        for stamp in (2**63, -2**63 - 1):
            with pytest.raises(InvalidArgumentException, match='64 bits'):
                robot.insert('map', child, stamp, Pose())
            with pytest.raises(InvalidArgumentException, match='64 bits'):
                robot.insert_many([Sample('map', 'base_link', 14 * SECOND, Pose()),
                                   Sample('map', child, stamp, Pose())])
    assert robot.edges() == edges
    assert robot.lookup('base_link', 'camera') == robot.lookup('base_link', 'camera', 12 * SECOND)


def test_insert_many_takes_no_sample_if_one_has_no_pose(robot):
    edges = robot.edges()
    for pose in ((1.0, 2.0), np.eye(3), None):
        with pytest.raises(InvalidArgumentException, match='pose'):
            robot.insert_many([Sample('map', 'base_link', 14 * SECOND, Pose()),
                               Sample('map', 'base_link', 15 * SECOND, pose)])
    assert robot.edges() == edges


@pytest.mark.parametrize('pose', [
    (1, 0, 0, 0, 0, 0, 1), np.array([1, 0, 0, 0, 0, 0, 1], np.float32), Pose(x=1),
    np.array([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])])
def test_samples_with_poses_of_any_kind_are_found_as_floats(robot, pose):
    for stamp in range(20, 23):
        robot.insert_many([Sample('map', 'new', stamp, pose), Sample('new', 'tip', stamp, pose)])
        for child, distance in (('new', 1.0), ('tip', 2.0)):
            found = robot.lookup('map', child)
            assert found == Pose(x=distance)
            assert all(type(number) is float for number in found)


def test_integers_of_numpy_are_stamps(robot):
    stamp = np.array([12 * SECOND])[0]
    assert robot.lookup('map', 'base_link', stamp) == robot.lookup(
        'map', 'base_link', 12 * SECOND)
    robot.insert('map', 'new', stamp, Pose())
    assert type(robot.edges()[-1].latest) is int


@pytest.mark.parametrize('broken', [
    Sample('map', 'odd', 11, (1.0, 2.0)), Sample('map', 'odd', 11, (0.0,) * 6 + ('w',)),
    Sample('map', 'odd', 11, None)])
@pytest.mark.parametrize('static', [False, True])
def test_what_was_taken_before_something_broke_is_counted_and_wakes(broken, static):
    """Whatever the exception, the samples stored before it are counted and wake waiters."""
    buffer = BufferCore()
    buffer.insert('map', 'base', 10, Pose())
    woken = []
    Inquiry(buffer.waiting, lambda: buffer.lookup('map', 'base', 11),
            lambda: woken.append(True)).ask()
    before = buffer.statistics().accepted
    with pytest.raises((TypeError, ValueError)):
        buffer.intake.insert([Sample('map', 'base', 11, Pose()), broken], 'test', static)
    assert buffer.statistics().accepted == before + 1
    assert woken == [True]


# --- inserting


def test_pose_comes_back_as_it_was_put_in():
    buffer = BufferCore()
    pose = (1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8)
    buffer.insert('a', 'b', 1, pose)
    buffer.insert('a', 'c', 1, pose, static=True)
    for child in 'bc':
        found = buffer.lookup('a', child, 1)
        assert type(found) is Pose
        assert found == pose


@pytest.mark.parametrize('static', [True, False])
def test_callers_array_is_copied(static):
    buffer = BufferCore()
    pose = np.array(Pose(1.0))
    buffer.insert('a', 'b', 1, pose, static=static)
    pose[0] = 99.0
    found = buffer.lookup('a', 'b', 1)
    assert found == Pose(1.0)
    assert {type(value) for value in found} == {float}


def test_insert_tells_what_was_refused():
    buffer = BufferCore()
    (incident,) = buffer.insert('a', 'a', 5, Pose(), authority='somebody')
    assert incident.kind is Kind.SELF_EDGE
    assert incident.refused
    assert (incident.parent, incident.child, incident.stamp, incident.authority) == (
        'a', 'a', 5, 'somebody')
    assert buffer.frames() == []


def test_sound_transforms_of_a_message_are_taken_beside_bad_ones():
    buffer = BufferCore()
    incidents = buffer.insert_many([
        Sample('a', 'b', 1, Pose(1.0)),
        Sample('a', '', 1, Pose()),
        Sample('a', 'bad', 1, Pose(math.nan)),
        Sample('a', 'long', 1, (0.0, 0.0, 0.0, 1e308, 1e308, 1e308, 1e308)),
        Sample('b', 'a', 1, Pose()),
        Sample('a', 'c', 1, Pose(2.0)),
    ], 'somebody')
    assert [incident.kind for incident in incidents] == [
        Kind.EMPTY_FRAME, Kind.NOT_FINITE, Kind.NOT_FINITE, Kind.LOOP]
    assert sorted(buffer.frames()) == ['a', 'b', 'c']
    assert buffer.lookup('b', 'c') == Pose(1.0)


def test_refused_frames_are_not_registered():
    buffer = BufferCore()
    buffer.insert('nan', 'frame', 1, Pose(math.nan))
    with pytest.raises(LookupException):
        buffer.lookup('nan', 'frame')
    assert buffer.frames() == []


def test_buffer_without_history_keeps_the_newest_stamp():
    buffer = BufferCore(0)
    for stamp in (5, 6, 7):
        assert not buffer.insert('a', 'b', stamp, Pose(float(stamp)))
    assert buffer.insert('a', 'b', 6, Pose())[0].kind is Kind.OLD_DATA
    assert buffer.lookup('a', 'b') == Pose(7.0)


def test_window_cannot_be_negative():
    with pytest.raises(ValueError, match='cache_time is -1 ns'):
        BufferCore(-1)


def test_window_is_ten_seconds_unless_given():
    assert BufferCore().cache_time == 10 * SECOND
    assert BufferCore(5).cache_time == 5


# --- static edges


def test_newer_static_edge_replaces_the_older(robot):
    assert not robot.insert('base_link', 'camera', 0, at(x=3.0), static=True)
    assert robot.lookup('base_link', 'lens') == pytest.approx(at(x=3.1))


def test_static_edge_has_no_history(robot):
    (camera,) = (edge for edge in robot.edges() if edge.child == 'camera')
    assert camera == EdgeInfo('base_link', 'camera', 'default_authority', True, 1, 0, 0)


# --- group laws of the poses


def random_robot(seed):
    rng = np.random.default_rng(seed)
    buffer = BufferCore()
    for parent, child in ('ab', 'bc', 'ad', 'de'):
        for stamp in (10, 20, 30):
            buffer.insert(parent, child, stamp, random_pose(rng, 10.0))
    return buffer


frames = st.sampled_from('abcde')
stamps = st.one_of(st.just(LATEST), st.integers(10, 30))


@given(st.integers(0, 20), frames, frames, stamps)
def test_lookup_the_other_way_is_the_inverse(seed, a, b, stamp):
    buffer = random_robot(seed)
    a_T_b, b_T_a = buffer.lookup(a, b, stamp), buffer.lookup(b, a, stamp)
    assert_same_pose(a_T_b @ b_T_a, se3.IDENTITY, 1e-13)
    assert_same_pose(b_T_a, a_T_b.inverse(), 1e-13)


@given(st.integers(0, 20), frames, frames, frames, stamps)
def test_lookups_compose(seed, a, b, c, stamp):
    buffer = random_robot(seed)
    a_T_c = buffer.lookup(a, b, stamp) @ buffer.lookup(b, c, stamp)
    assert_same_pose(a_T_c, buffer.lookup(a, c, stamp), 1e-13)


@given(poses)
def test_inverse_is_not_the_transpose_of_the_matrix(pose):
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, pose)
    b_T_a = buffer.lookup('b', 'a', 1).as_matrix()
    assert b_T_a[3].tolist() == [0.0, 0.0, 0.0, 1.0]
    product = b_T_a @ se3.as_matrix(pose)
    assert np.abs(product - np.eye(4)).max() <= 1e-14 * max(1.0, length(pose))


# --- changes over time


def carried_box():
    """Return a box on a table that a gripper takes at 20 s, and puts down at 30 s."""
    buffer = BufferCore(100 * SECOND)
    buffer.insert('room', 'table', 0, at(x=5.0), static=True)
    for seconds in (0, 10, 20, 30, 40):
        buffer.insert('room', 'gripper', seconds * SECOND + 1, at(y=seconds))
        buffer.insert('room', 'gripper', seconds * SECOND, at(y=seconds))
    buffer.insert('table', 'box', 10 * SECOND, at(z=1.0))
    buffer.insert('gripper', 'box', 20 * SECOND, at(z=-1.0))
    buffer.insert('table', 'box', 30 * SECOND, at(z=2.0))
    buffer.insert('table', 'box', 40 * SECOND, at(z=4.0))
    return buffer


@pytest.mark.parametrize(('seconds', 'where'), [
    (10, (5, 0, 1)), (15, (5, 0, 1)), (20, (0, 20, -1)), (25, (0, 25, -1)), (30, (5, 0, 2)),
    (35, (5, 0, 3)), (40, (5, 0, 4)), (0, (5, 0, 4)),
])
def test_frame_that_changes_parents_is_where_it_was_then(seconds, where):
    found = carried_box().lookup('room', 'box', seconds * SECOND)
    assert found == pytest.approx(at(*where), abs=1e-6)


def test_latest_goes_the_way_that_was_right_at_the_common_time():
    buffer = BufferCore()
    buffer.insert('room', 'table', 0, at(x=5.0), static=True)
    buffer.insert('table', 'box', 10, at(z=1.0))
    buffer.insert('gripper', 'box', 30, at(z=-1.0))
    for stamp in (10, 25):
        buffer.insert('room', 'gripper', stamp, at(y=7.0))
    # In the newest samples, the box is in the gripper, known until 25; at 25, it was not.
    assert buffer.lookup_stamped('room', 'box') == (25, at(x=5.0, z=1.0))


def test_path_is_found_anew_for_every_stamp_of_a_changing_tree():
    buffer = carried_box()
    for seconds, parent in ((15, 'table'), (25, 'gripper'), (15, 'table'), (35, 'table')):
        direct = buffer.lookup(parent, 'box', seconds * SECOND)
        assert direct.translation[:2] == pytest.approx((0.0, 0.0), abs=1e-6)


def test_kept_path_does_not_outlive_the_structure():
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, at(x=1.0), static=True)
    buffer.insert('b', 'c', 1, at(x=1.0), static=True)
    assert buffer.lookup('a', 'c') == at(x=2.0)
    buffer.insert('a', 'c', 1, at(x=7.0), static=True)
    assert buffer.lookup('a', 'c') == at(x=7.0)
    buffer.insert('b', 'c', 5, at(x=3.0))
    assert buffer.lookup('a', 'c') == at(x=4.0)
    buffer.clear()
    with pytest.raises(TransformException):
        buffer.lookup('a', 'c')


def test_path_is_kept_though_it_never_had_an_answer():
    buffer = BufferCore()
    buffer.insert('a', 'b', 10, at(x=1.0))
    with pytest.raises(FutureExtrapolationException) as never:
        buffer.lookup('a', 'b', 11)
    kept = buffer.intake.tree.paths.newest_path('a', 'b')
    assert kept is buffer.intake.tree.paths.newest_path('a', 'b')
    buffer.insert('a', 'b', 20, at(x=3.0))
    assert buffer.lookup('a', 'b', 15) == at(x=2.0)
    with pytest.raises(FutureExtrapolationException) as again:
        buffer.lookup('a', 'b', 21)
    assert (never.value.blocked_on, again.value.blocked_on) == ((('b', 11),), (('b', 21),))


def test_earlier_path_through_a_new_ancestor_is_found():
    buffer = BufferCore()
    buffer.insert('a', 'b', 1, at(x=1.0))
    buffer.insert('b', 'a', 5 * SECOND, at(x=9.0), strict=False)  # reverses the silent edge
    with pytest.raises(PastExtrapolationException):
        buffer.lookup('b', 'a', 2)
    assert buffer.lookup('b', 'a', 1) == at(x=-1.0)
    buffer.insert('b', 'c', 5 * SECOND, at())
    for _ in range(2):
        assert buffer.lookup('a', 'c') == at(x=-9.0)
        with pytest.raises(PastExtrapolationException, match='b -> c'):
            buffer.lookup('a', 'c', 1)


# --- forgetting


def test_clear_keeps_names_and_static_edges(robot):
    frames_before = robot.frames()
    robot.clear()
    assert robot.frames() == frames_before
    assert robot.lookup('base_link', 'lens', 12 * SECOND) == pytest.approx(at(x=0.6, z=1.0))
    with pytest.raises(NoDataException):
        robot.lookup('odom', 'base_link', 12 * SECOND)
    with pytest.raises(ConnectivityException):
        robot.lookup('odom', 'base_link')
    assert [edge.child for edge in robot.edges()] == ['camera', 'gripper', 'lens', 'lamp']
    # An older time may now begin.
    assert not robot.insert('odom', 'base_link', 1, Pose(1.0))
    assert robot.lookup('odom', 'base_link') == Pose(1.0)


def test_removed_leaf_is_unknown(robot):
    assert robot.remove_frame('lens')
    with pytest.raises(LookupException):
        robot.lookup('camera', 'lens')
    assert not robot.remove_frame('lens')
    assert 'lens' not in robot.frames()


def test_removed_frame_with_children_becomes_a_root(robot):
    assert robot.remove_frame('base_link')
    assert robot.lookup('base_link', 'lens') == pytest.approx(at(x=0.6, z=1.0))
    with pytest.raises(ConnectivityException):
        robot.lookup('odom', 'lens')


def test_removed_frame_may_come_back_anywhere(robot):
    robot.remove_frame('camera')
    assert not robot.insert('gripper', 'camera', 0, at(x=1.0), static=True)
    assert_same_pose(robot.lookup('gripper', 'lens'), at(x=1.1))


# --- inspection


def test_frames_are_listed_in_order_of_appearance(robot):
    assert robot.frames() == [
        'base_link', 'odom', 'map', 'camera', 'gripper', 'lens', 'lamp', 'ceiling', 'ball']


def test_edges_tell_what_is_stored(robot):
    edges = {edge.child: edge for edge in robot.edges()}
    assert edges['base_link'] == EdgeInfo(
        'odom', 'base_link', 'default_authority', False, 5, 10 * SECOND, 14 * SECOND)
    assert 'map' not in edges


def test_statistics_count_each_kind_once(robot):
    before = robot.statistics()
    assert (before.accepted, before.refused, before.frames) == (13, 0, 9)
    robot.insert('a', 'a', 1, Pose())
    robot.insert('map', 'odom', 1, Pose())
    robot.insert('map', 'odom', 14 * SECOND, Pose())
    after = robot.statistics()
    assert (after.accepted, after.refused, after.frames) == (14, 2, 9)
    assert after.incidents[Kind.SELF_EDGE] == after.incidents[Kind.OLD_DATA] == 1
    assert sum(after.incidents.values()) == 2
    # The returned statistics are a copy.
    assert before.refused == 0


def test_what_could_not_be_read_is_counted_too(robot):
    (incident,) = robot.insert('a', 'a', 1, Pose())
    robot.intake.refuse(incident)
    assert robot.statistics().incidents[Kind.SELF_EDGE] == 2


@pytest.mark.parametrize(('old_half', 'raised'), [
    ('target', ConnectivityException), ('source', ExtrapolationException)])
def test_lookup_full_raises_the_error_of_its_first_half_as_in_tf2(
        old_half, raised):
    buffer = BufferCore(cache_time=10 * SECOND)
    for stamp in (1, 30, 31):
        buffer.insert('map', 'base', stamp * SECOND, Pose())
    buffer.insert('elsewhere', 'cup', 0, Pose(), static=True)
    # tf2 looks up fixed <- source first. 1 s has left the window, so that half cannot succeed.
    target, source = {'target': ('base', 'cup'), 'source': ('cup', 'base')}[old_half]
    with pytest.raises(raised) as told:
        buffer.lookup_full(target, 1 * SECOND, source, 1 * SECOND, 'map')
    assert told.value.blocked_on is None, 'nothing to wait for'
    assert (told.value.__cause__ is not None) == (old_half == 'target')


def test_refused_old_sample_leaves_no_name_behind():
    buffer = BufferCore(cache_time=10 * SECOND)
    buffer.insert('map', 'base', 30 * SECOND, Pose())
    buffer.insert('stranger', 'base', 1 * SECOND, Pose(), strict=False)
    assert set(buffer.frames()) == {'map', 'base'}
