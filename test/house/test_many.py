# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Many stamps, all frames and snapshots, compared with single lookups."""

import itertools
import threading

from hypothesis import given, strategies as st
import numpy as np
import pytest
from strategies import random_pose
from tf_tree_py import BufferCore, many_stamps
from tf_tree_py.core import (
    ConnectivityException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LATEST,
    LookupException,
    PastExtrapolationException,
    Pose,
    TransformException,
)
from tf_tree_py.core.geometry import se3

SECOND = 1_000_000_000
PARENTS = {'odom': 'map', 'base': 'odom', 'arm': 'base', 'tool': 'arm', 'head': 'base'}


def smooth_pose(rng_seed, time_s, rate=1.0):
    """Return a pose of a smooth motion, a different one for every seed."""
    rng = np.random.default_rng(rng_seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    phase = rng.uniform(0.0, 6.0)
    return Pose.from_rotation_vector(
        axis * (rate * np.sin(time_s + phase)), np.sin(time_s * np.array([1.0, 0.7, 0.4]) + phase))


@pytest.fixture
def robot():
    """Return a buffer with five moving edges, each with its own stamps, and two static ones."""
    buffer = BufferCore()
    for number, (child, parent) in enumerate(PARENTS.items()):
        period = SECOND // (20 + 7 * number)
        for stamp in range(10 * SECOND + number, 13 * SECOND, period):
            buffer.insert(parent, child, stamp, smooth_pose(number, stamp / SECOND))
    buffer.insert('head', 'camera', 0, smooth_pose(90, 0.0), static=True)
    buffer.insert('base', 'lidar', 0, smooth_pose(91, 0.0), static=True)
    return buffer


def one_by_one(buffer, target, source, stamps):
    return np.array([buffer.lookup_at(target, source, stamp) for stamp in stamps.tolist()])


def assert_same_poses(actual, expected, tolerance=1e-12):
    assert actual[:, :3] == pytest.approx(expected[:, :3], abs=tolerance)
    assert_same_rotations(actual, expected, tolerance)


def assert_same_rotations(actual, expected, tolerance=1e-12):
    flips = np.sign(np.sum(actual[:, 3:] * expected[:, 3:], axis=1, keepdims=True))
    assert actual[:, 3:] * flips == pytest.approx(expected[:, 3:], abs=tolerance)


@pytest.mark.parametrize(('target', 'source'), [
    ('map', 'odom'), ('map', 'tool'), ('tool', 'map'), ('camera', 'tool'), ('lidar', 'camera'),
    ('head', 'camera'), ('camera', 'head'), ('map', 'map'),
])
@pytest.mark.parametrize('count', [1, 50, 20_000])
def test_many_stamps_are_answered_as_one_by_one(robot, target, source, count):
    rng = np.random.default_rng(count)
    stamps = rng.integers(10.1 * SECOND, 12.9 * SECOND, count)
    poses = robot.lookup_many(target, source, stamps)
    assert poses.shape == (count, 7)
    some = rng.integers(0, count, 200)
    assert_same_poses(poses[some], one_by_one(robot, target, source, stamps[some]))


def all_at_once_and_directly(buffer, target, source, stamps):
    """Return poses at many stamps, and at so few at once that each edge is interpolated."""
    return buffer.lookup_many(target, source, stamps), np.concatenate([
        buffer.lookup_many(target, source, few) for few in np.split(stamps, len(stamps) // 100)])


def test_both_ways_to_many_poses_agree(robot):
    stamps = np.random.default_rng(0).integers(10.1 * SECOND, 12.9 * SECOND, 30_000)
    poses, directly = all_at_once_and_directly(robot, 'map', 'tool', stamps)
    assert (poses != directly).any(), 'not rounded alike: by polynomials'
    assert_same_poses(poses, directly)


def test_fast_rotation_is_left_to_the_direct_way():
    buffer = BufferCore()
    for step in range(20):
        pose = Pose.from_rotation_vector((0.0, 0.0, 2.0 * step))
        buffer.insert('map', 'fan', SECOND + step * SECOND // 10, pose)
    stamps = np.random.default_rng(0).integers(SECOND, int(2.9 * SECOND), 20_000)
    poses, directly = all_at_once_and_directly(buffer, 'map', 'fan', stamps)
    assert (poses == directly).all()
    assert_same_poses(poses[:300], one_by_one(buffer, 'map', 'fan', stamps[:300]))


def test_stamps_of_samples_give_the_samples(robot):
    history = robot.intake.tree.histories['odom']
    stamps = np.array(history.stamps)
    poses = np.array(history.poses).reshape(-1, 7)
    assert_same_poses(robot.lookup_many('map', 'odom', stamps), poses, 1e-15)


def test_repeated_and_unsorted_stamps_keep_their_places(robot):
    stamps = np.array([12, 11, 12, 11, 11]) * SECOND
    poses = robot.lookup_many('map', 'tool', stamps)
    assert (poses[[0, 2]] == poses[0]).all()
    assert (poses[[1, 3, 4]] == poses[1]).all()
    assert (poses[0] != poses[1]).any()


@pytest.mark.parametrize('stamps', [[], np.array([], dtype=int), np.array([])])
def test_no_stamps_give_no_poses(robot, stamps):
    assert robot.lookup_many('map', 'tool', stamps).shape == (0, 7)


def test_one_sample_answers_at_its_own_stamp_alone():
    buffer = BufferCore()
    buffer.insert('map', 'odom', SECOND, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    poses, valid = buffer.lookup_many(
        'map', 'odom', [SECOND - 1, SECOND, SECOND + 1, SECOND], outside='mask')
    assert valid.tolist() == [False, True, False, True]
    assert poses[valid][:, 0].tolist() == [1.0, 1.0]


def test_stamps_outside_are_counted_and_the_first_is_named(robot):
    stamps = np.array([11, 5, 12, 99, 4]) * SECOND
    with pytest.raises(PastExtrapolationException, match=r'3 of 5 stamps .* stamps\[1\] = 5\.0'):
        robot.lookup_many('map', 'tool', stamps)
    with pytest.raises(FutureExtrapolationException, match=r'2 of 2 stamps .* stamps\[0\] = 99'):
        robot.lookup_many('map', 'tool', stamps[3:4].repeat(2))


def test_mask_tells_which_stamps_have_an_answer(robot):
    stamps = np.array([11, 5, 12, 99]) * SECOND
    poses, valid = robot.lookup_many('map', 'tool', stamps, outside='mask')
    assert valid.tolist() == [True, False, True, False]
    assert np.isnan(poses[~valid]).all()
    assert_same_poses(poses[valid], one_by_one(robot, 'map', 'tool', stamps[valid]))


@pytest.mark.parametrize(('stamps', 'wrong'), [
    ([1.5], 'float64'), ([np.nan], 'float64'), (['a'], '<U1'), ([True], 'bool'),
    ([[1, 2]], r'\(1, 2\)'), (7, r'\(\)'),
])
def test_what_is_no_row_of_integers_is_named(robot, stamps, wrong):
    with pytest.raises(InvalidArgumentException, match=f'stamps (are|must be) .*{wrong}'):
        robot.lookup_many('map', 'tool', stamps)


def test_unknown_policy_is_named(robot):
    with pytest.raises(
            InvalidArgumentException, match="outside must be 'raise' or 'mask', not 'drop'"):
        robot.lookup_many('map', 'tool', [11 * SECOND], outside='drop')


def test_errors_are_those_of_a_single_lookup(robot):
    with pytest.raises(LookupException, match='nowhere'):
        robot.lookup_many('map', 'nowhere', [11 * SECOND])
    robot.insert('moon', 'flag', SECOND, Pose())
    with pytest.raises(ConnectivityException, match='not part of the same tree'):
        robot.lookup_many('map', 'flag', [SECOND])
    with pytest.raises(LookupException, match='The buffer is empty'):
        BufferCore().lookup_many('map', 'tool', [SECOND])


def test_frames_that_change_parents_are_answered_at_every_stamp():
    buffer = BufferCore()
    rng = np.random.default_rng(3)
    for second, hand in enumerate(['left', 'left', 'right', 'right', 'left'], 1):
        for each in ('left', 'right'):
            buffer.insert('map', each, second * SECOND, random_pose(rng))
        buffer.insert(hand, 'cup', second * SECOND, random_pose(rng))
    stamps = rng.integers(SECOND, 5 * SECOND, 300)
    poses = buffer.lookup_many('map', 'cup', stamps)
    assert_same_poses(poses, one_by_one(buffer, 'map', 'cup', stamps))


@given(st.lists(st.integers(0, 60), min_size=1, max_size=30, unique=True),
       st.lists(st.integers(0, 60), min_size=1, max_size=40), st.integers(0, 2**32))
def test_any_samples_and_any_stamps_agree_with_single_lookups(samples, stamps, seed):
    rng = np.random.default_rng(seed)
    buffer = BufferCore()
    for number in samples:
        buffer.insert('map', 'odom', SECOND + number, random_pose(rng))
        buffer.insert('odom', 'base', SECOND + 2 * number, random_pose(rng))
    asked = np.array(stamps) + SECOND
    poses, valid = buffer.lookup_many('base', 'map', asked, outside='mask')
    for stamp, pose, is_valid in zip(asked.tolist(), poses, valid, strict=True):
        try:
            single = buffer.lookup('base', 'map', stamp)
        except TransformException:
            assert not is_valid
            continue
        assert is_valid
        assert_same_poses(pose[None], np.array([single]))


def test_direct_way_works_block_by_block(robot, monkeypatch):
    monkeypatch.setattr(many_stamps, 'BLOCK', 7)
    stamps = np.random.default_rng(0).integers(10.1 * SECOND, 12.9 * SECOND, 50)
    assert_same_poses(robot.lookup_many('map', 'tool', stamps),
                      one_by_one(robot, 'map', 'tool', stamps))


# --- all frames


@pytest.mark.parametrize('target', ['map', 'tool', 'camera', 'base'])
@pytest.mark.parametrize('stamp', [11 * SECOND + 12345, LATEST])
def test_all_frames_are_those_of_single_lookups(robot, target, stamp):
    poses = robot.lookup_tree(target, stamp)
    assert set(poses) == set(robot.frames())
    if stamp == LATEST:
        stamp = min(edge.latest for edge in robot.edges() if not edge.static)
    for frame, pose in poses.items():
        assert_same_poses(np.array([pose]), np.array([robot.lookup(target, frame, stamp)]))


def test_frames_that_have_no_answer_are_left_out(robot):
    robot.insert('base', 'late', 20 * SECOND, Pose())
    robot.insert('late', 'behind', 0, Pose(), static=True)
    robot.insert('moon', 'flag', 11 * SECOND, Pose())
    frames = robot.lookup_tree('map', 11 * SECOND)
    assert set(frames) == {'map', *PARENTS, 'camera', 'lidar'}


def test_all_frames_follow_a_change_of_parent():
    buffer = BufferCore()
    for stamp, parent in ((1, 'left'), (2, 'right'), (3, 'right')):
        buffer.insert('map', 'left', stamp * SECOND, Pose(x=1.0))
        buffer.insert('map', 'right', stamp * SECOND, Pose(x=-1.0))
        buffer.insert(parent, 'cup', stamp * SECOND, Pose())
    assert buffer.lookup_tree('map', SECOND)['cup'].x == 1.0
    assert buffer.lookup_tree('map', 3 * SECOND)['cup'].x == -1.0


def test_all_frames_of_an_unknown_target_is_an_error(robot):
    with pytest.raises(LookupException, match='nowhere'):
        robot.lookup_tree('nowhere')


# --- snapshots


def test_snapshot_stays_as_it_was(robot):
    before = robot.snapshot()
    then = before.lookup('map', 'tool')
    robot.insert('map', 'odom', 14 * SECOND, Pose(x=9.0))
    robot.insert('base', 'lidar', 0, Pose(x=7.0), static=True)
    robot.clear()
    assert before.lookup('map', 'tool') == then
    assert before.lookup('base', 'lidar').x != 7.0
    assert robot.lookup('base', 'lidar').x == 7.0


def test_snapshot_answers_all_that_a_buffer_does(robot):
    still = robot.snapshot()
    stamps = np.array([11, 12]) * SECOND
    assert still.frames() == robot.frames()
    assert still.edges() == robot.edges()
    assert still.lookup_tree('map') == robot.lookup_tree('map')
    assert (still.lookup_many('map', 'tool', stamps)
            == robot.lookup_many('map', 'tool', stamps)).all()


def test_lookups_of_one_snapshot_agree_under_a_storm_of_writers(robot):
    stop = threading.Event()
    # So close together that no writer leaves the window of another.
    stamps = itertools.count(13 * SECOND, 1_000)

    def write(child, parent, seed):
        rng = np.random.default_rng(seed)
        while not stop.is_set():
            robot.insert(parent, child, next(stamps), random_pose(rng))

    writers = [threading.Thread(target=write, args=(child, parent, seed))
               for seed, (child, parent) in enumerate(PARENTS.items())]
    for writer in writers:
        writer.start()
    try:
        for _ in range(100):
            still = robot.snapshot()
            # One stamp at which all have data, whatever the writers have done since.
            stamp = min(edge.latest for edge in still.edges() if not edge.static)
            map_T_tool, tool_T_camera, camera_T_map = (
                still.lookup(target, source, stamp)
                for target, source in (('map', 'tool'), ('tool', 'camera'), ('camera', 'map')))
            loop = np.array(se3.compose_chain([map_T_tool, tool_T_camera, camera_T_map]))
            assert_same_poses(loop[None], np.array([se3.IDENTITY]))
    finally:
        stop.set()
        for writer in writers:
            writer.join()


# --- guarantees


def test_last_stamp_that_was_sent_twice_has_the_last_pose():
    """A correction of the newest sample counts, with few stamps and with many."""
    buffer = BufferCore()
    for stamp in range(11):
        buffer.insert('a', 'b', 100 * stamp, Pose.from_xyz_rpy(x=float(stamp), yaw=0.1 * stamp))
    buffer.insert('a', 'b', 1000, Pose.from_xyz_rpy(x=-5.0, yaw=1.5))
    buffer.insert('b', 'c', 1000, Pose.from_xyz_rpy(y=1.0, roll=0.3))
    buffer.insert('b', 'c', 0, Pose.from_xyz_rpy(y=1.0, roll=0.3))
    for count in (1, 5000):
        stamps = np.full(count, 1000)
        stamps[:count // 2] = np.arange(count // 2) % 1001
        poses = buffer.lookup_many('a', 'c', stamps)
        assert poses[-1] == pytest.approx(buffer.lookup('a', 'c', 1000), abs=1e-12)
        assert_same_poses(poses[::50], one_by_one(buffer, 'a', 'c', stamps[::50]))


@pytest.mark.parametrize('rate_hz', [1, 20, 1000])
@pytest.mark.parametrize('turn_per_s', [7.292e-5, 1e-7, 3e-8, 2e-8, 0.3])
def test_slow_turn_and_long_arm_of_an_earth_frame_are_those_of_one_lookup(rate_hz, turn_per_s):
    """The guarantee: 1e-14 of the longest edge, 64 nanometres for the earth's radius."""
    buffer = BufferCore()
    radius = 6.371e6
    axis = np.array([0.3, -0.5, 0.81]) / np.linalg.norm([0.3, -0.5, 0.81])
    for step in range(2 * rate_hz + 1):
        buffer.insert('eci', 'earth', step * SECOND // rate_hz, Pose.from_rotation_vector(
            axis * (1.0 + turn_per_s * step / rate_hz)))
        buffer.insert('earth', 'robot', step * SECOND // rate_hz, Pose.from_xyz_rpy(
            x=radius, y=1.0 * step / rate_hz, roll=0.7))
    stamps = np.random.default_rng(5).integers(0, 2 * SECOND, 30_000)
    for frames in (('eci', 'robot'), ('robot', 'eci')):
        poses = buffer.lookup_many(*frames, stamps)
        expected = one_by_one(buffer, *frames, stamps[::300])
        assert poses[::300, :3] == pytest.approx(expected[:, :3], abs=1e-14 * radius)
        assert_same_rotations(poses[::300], expected)


def test_stamps_that_do_not_fit_or_are_masked_have_no_answer(robot):
    with pytest.raises(InvalidArgumentException, match='64 bits'):
        robot.lookup_many('map', 'tool', np.array([2**63 + 12 * SECOND], dtype=np.uint64))
    stamps = np.ma.array([12, 12, 5], mask=[False, True, False]) * SECOND
    poses, valid = robot.lookup_many('map', 'tool', stamps, outside='mask')
    assert valid.tolist() == [True, False, False]
    assert np.isnan(poses[1:]).all()
    with pytest.raises(InvalidArgumentException, match=r'stamps\[1\], which is masked'):
        robot.lookup_many('map', 'tool', stamps)


def test_error_says_which_frames_why_and_how_many(robot):
    with pytest.raises(PastExtrapolationException) as raised:
        robot.lookup_many('map', 'tool', [12 * SECOND, 12, 13])
    error = raised.value
    assert (error.target_frame, error.source_frame) == ('map', 'tool')
    assert 'The buffer keeps' in error.hint or 'began later' in error.hint
    assert '2 of 3 stamps have no answer, the first is stamps[1]' in error.hint


@pytest.mark.parametrize('ask', [
    lambda buffer, *frames: buffer.lookup_many(*frames, [12]),
    lambda buffer, *frames: buffer.lookup_at(*frames, 12),
    lambda buffer, *frames: buffer.lookup_full(frames[0], 12, frames[1], 12, 'map'),
    lambda buffer, *frames: buffer.frames_between(*frames),
    lambda buffer, *frames: buffer.edges_between(*frames),
    lambda buffer, *frames: buffer.latest_common_time(*frames),
])
@pytest.mark.parametrize('frames', [('map', 'nowhere'), ('nowhere', 'map'), ('map', 'island')])
def test_every_error_names_the_frames_that_were_asked_for(robot, ask, frames):
    robot.insert('sea', 'island', 0, Pose(), static=True)
    with pytest.raises(TransformException) as raised:
        ask(robot, *frames)
    assert (raised.value.target_frame, raised.value.source_frame) == frames
    with pytest.raises(TransformException) as raised:
        robot.lookup_tree('nowhere')
    assert raised.value.target_frame == 'nowhere'
