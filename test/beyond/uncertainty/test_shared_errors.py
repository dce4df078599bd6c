# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Covariances of poses that share uncertain edges or have an edge at two stamps, by draws."""

from inputs import for_each
import numpy as np
import pytest
from strategies import random_pose
from tf_tree_py import BufferCore
from tf_tree_py.core import ExtrapolationException, Pose, se3
from tf_tree_py.core.errors import InvalidArgumentException
from uncertain_trees import (
    assert_explained,
    drawn_poses,
    DRAWS,
    errors_of,
    moved,
    random_covariance,
    RandomTree,
)

SECOND = 1_000_000_000
ENDS = 0, 3 * SECOND
STAMPS = SECOND, 2 * SECOND


class Drive:
    """
    A robot at two stamps: map -> odom (one covariance) -> base (moves) -> camera, and a head.

    :ivar drawn: ``parent_T_child`` of each edge by (child, stamp), (DRAWS, 7); a static edge is
        the same at all stamps.
    """

    def __init__(self, seed, degrees, at=ENDS, *, wheels=True, alike=False):
        rng = self.rng = np.random.default_rng(seed)
        self.buffer, self.drawn = BufferCore(), {}
        self._static('odom', 'map', degrees)
        poses = [random_pose(rng, 2.0) for _ in at]
        covariance = random_covariance(rng, 0.03, np.radians(degrees))
        first = rng.multivariate_normal(np.zeros(6), covariance, DRAWS)
        drawn = []
        for stamp, pose in zip(at, poses, strict=True):
            self.buffer.insert('odom', 'base', stamp, pose,
                               covariance=covariance if wheels else None)
            errors = first if alike else rng.multivariate_normal(np.zeros(6), covariance, DRAWS)
            many = np.tile(pose, (DRAWS, 1))
            drawn.append(moved(many, errors) if wheels else many)
        for stamp in (*at, *STAMPS):
            part = (stamp - at[0]) / (at[1] - at[0])
            self.drawn['base', stamp] = se3.interpolate_many(
                drawn[0], drawn[1], np.full(DRAWS, part))
        self._static('head', 'base', degrees)
        self._static('camera', 'head', degrees)
        self._static('lidar', 'base', degrees)

    def _static(self, child, parent, degrees):
        pose = random_pose(self.rng, 2.0)
        covariance = random_covariance(self.rng, 0.03, np.radians(degrees))
        self.buffer.insert(parent, child, 0, pose, static=True, covariance=covariance)
        poses = drawn_poses(self.rng, pose, covariance)
        self.drawn.update({(child, stamp): poses for stamp in (*ENDS, *STAMPS)})

    def pose_of(self, frame, stamp):
        """Return ``map_T_frame`` (DRAWS, 7)."""
        parents = {'odom': 'map', 'base': 'odom', 'head': 'base', 'camera': 'head',
                   'lidar': 'base'}
        poses = np.tile(se3.IDENTITY, (DRAWS, 1))
        while frame != 'map':
            poses = se3.compose_many(self.drawn[frame, stamp], poses)
            frame = parents[frame]
        return poses

    def between(self, target, source, stamps=STAMPS):
        """Return ``target_T_source`` (DRAWS, 7) between two stamps, through the map."""
        return se3.compose_many(se3.inverse_many(self.pose_of(target, stamps[0])),
                                self.pose_of(source, stamps[1]))


@pytest.mark.parametrize('degrees', [0.2, 3.0, 12.0])
@pytest.mark.parametrize('frames', [('camera', 'camera'), ('camera', 'lidar')])
def test_between_two_stamps_every_entry_is_what_draws_say(degrees, frames):
    drive = Drive(3, degrees, STAMPS)
    pose, covariance = drive.buffer.lookup_uncertain_full(
        frames[0], STAMPS[0], frames[1], STAMPS[1], 'map', independent=True)
    assert pose == drive.buffer.lookup_full(frames[0], STAMPS[0], frames[1], STAMPS[1], 'map')
    assert_explained(covariance, errors_of(drive.between(*frames), pose))


def test_two_stamps_between_the_same_samples_share_the_errors_of_both():
    drive = Drive(4, 0.2)
    pose, covariance = drive.buffer.lookup_uncertain_full(
        'camera', STAMPS[0], 'camera', STAMPS[1], 'map', independent=True)
    assert_explained(covariance, errors_of(drive.between('camera', 'camera'), pose))


@for_each(alike=[True, False], at=[ENDS, STAMPS])
def test_bound_holds_whatever_a_moving_edge_has_in_common_at_two_stamps(alike, at):
    drive = Drive(5, 0.2, at, alike=alike)
    pose, bound = drive.buffer.lookup_uncertain_full(
        'camera', STAMPS[0], 'lidar', STAMPS[1], 'map')
    errors = errors_of(drive.between('camera', 'lidar'), pose)
    scale = 1.0 / np.sqrt(bound.diagonal())
    excess = np.linalg.eigvalsh((bound - errors.T @ errors / DRAWS) * np.outer(scale, scale))
    assert excess.min() > -0.02


def test_what_both_stamps_share_cancels():
    """The error of map -> odom does not affect the motion of a robot between two stamps."""
    drive = Drive(6, 0.2, wheels=False)
    args = 'base', STAMPS[0], 'base', STAMPS[1]
    np.testing.assert_allclose(
        drive.buffer.lookup_uncertain_full(*args, 'odom')[1], 0.0, atol=1e-18)
    np.testing.assert_allclose(
        drive.buffer.lookup_uncertain_full(*args, 'map')[1], 0.0, atol=1e-15)
    apart = sum(np.trace(drive.buffer.lookup_uncertain('map', 'base', stamp)[1])
                for stamp in STAMPS)
    assert apart > 1e-6
    # A camera that moved without rotation keeps its mounting error at both stamps.
    buffer = BufferCore()
    for number, stamp in enumerate(STAMPS):
        buffer.insert('odom', 'base', stamp, Pose(x=number))
    buffer.insert('base', 'camera', 0, Pose(z=1.0), static=True, covariance=1e-6 * np.eye(6))
    covariance = buffer.lookup_uncertain_full(
        'camera', STAMPS[0], 'camera', STAMPS[1], 'odom')[1]
    np.testing.assert_allclose(np.diag(covariance), [0.0, 1e-6, 1e-6, 0.0, 0.0, 0.0], atol=1e-15)


@for_each(independent=[False, True], ends=[('camera', 'lidar'), ('map', 'camera'),
                                           ('lidar', 'map')])
def test_at_one_stamp_it_is_that_of_one_lookup(independent, ends):
    buffer = Drive(7, 0.2).buffer
    expected = buffer.lookup_uncertain(*ends, STAMPS[0], independent=independent)[1]
    for fixed in ('map', 'odom', 'base'):
        covariance = buffer.lookup_uncertain_full(
            ends[0], STAMPS[0], ends[1], STAMPS[0], fixed, independent=independent)[1]
        np.testing.assert_allclose(covariance, expected, rtol=1e-6, atol=1e-9)


def test_latest_is_that_of_each_half():
    buffer = Drive(8, 0.2).buffer
    buffer.insert('map', 'dock', 2 * SECOND, Pose(x=1.0), covariance=1e-4 * np.eye(6))
    for found, known in (((0, 0), (2 * SECOND, ENDS[1])),):
        args = ('dock', found[0], 'camera', found[1], 'map')
        pose, covariance = buffer.lookup_uncertain_full(*args)
        expected = buffer.lookup_uncertain_full('dock', known[0], 'camera', known[1], 'map')
        assert pose == expected[0] == buffer.lookup_full(*args)
        np.testing.assert_array_equal(covariance, expected[1])


def test_what_is_still_to_be_corrected_is_one_error_at_both_stamps():
    buffer = BufferCore()
    for stamp in range(0, 3 * SECOND, SECOND // 10):
        buffer.insert('odom', 'base', stamp, Pose())
        if stamp == SECOND:
            buffer.correct('base', Pose(x=0.4), max_speed=0.1)
    ends = 1_500_000_000, 2_500_000_000
    said = [buffer.lookup_uncertain('odom', 'base', stamp)[1][0, 0] for stamp in ends]
    covariance = buffer.lookup_uncertain_full('base', ends[0], 'base', ends[1], 'odom')[1]
    # The measured motion is the correction between the stamps, which is exactly its error.
    assert covariance[0, 0] == pytest.approx((said[0] ** 0.5 - said[1] ** 0.5) ** 2)
    assert covariance[0, 0] > 1e-3


# --- several frames at one stamp

@pytest.mark.parametrize('degrees', [0.2, 3.0, 12.0])
def test_joint_covariance_is_what_draws_say(degrees):
    drive = Drive(9, degrees, STAMPS)
    frames = ['camera', 'lidar', 'base']
    poses, joint = drive.buffer.lookup_joint('map', frames, STAMPS[0], independent=True)
    errors = np.concatenate([errors_of(drive.pose_of(frame, STAMPS[0]), pose)
                             for frame, pose in zip(frames, poses, strict=True)], axis=1)
    assert_explained(joint, errors)


@for_each(independent=[False, True], seed=range(3))
def test_each_frame_by_itself_is_as_unsure_as_one_lookup_says(independent, seed):
    rng = np.random.default_rng(seed)
    tree = RandomTree(rng, 7, 0.2)
    target, *frames = rng.permutation(['f0', *tree.edges]).tolist()
    poses, joint = tree.buffer.lookup_joint(target, [*frames, target], independent=independent)
    assert joint.shape == (42, 42) and poses.shape == (7, 7)
    assert not joint[36:].any() and not joint[:, 36:].any()
    for number, frame in enumerate(frames):
        block = slice(6 * number, 6 * number + 6)
        pose, covariance = tree.buffer.lookup_uncertain(target, frame, independent=independent)
        np.testing.assert_allclose(poses[number], pose, atol=1e-12)
        np.testing.assert_allclose(joint[block, block], covariance, rtol=1e-9, atol=1e-15)


def test_frames_on_one_uncertain_edge_are_off_together():
    buffer = BufferCore()
    buffer.insert('map', 'base', SECOND, Pose(), covariance=np.diag([1e-4, 0, 0, 0, 0, 0]))
    buffer.insert('base', 'left', 0, Pose(y=1.0), static=True)
    buffer.insert('base', 'right', 0, Pose(y=-1.0), static=True)
    _, joint = buffer.lookup_joint('map', ['left', 'right'])
    assert joint[0, 6] == joint[0, 0] == pytest.approx(1e-4)
    # Seen from the base, they are certain.
    assert not buffer.lookup_joint('base', ['left', 'right'])[1].any()
    assert buffer.lookup_joint('map', [])[1].shape == (0, 0)


def test_latest_of_several_is_the_newest_that_all_have():
    buffer = Drive(10, 0.2).buffer
    buffer.insert('map', 'other', SECOND, Pose(x=1.0))
    buffer.insert('map', 'other', 2 * SECOND, Pose(x=2.0))
    poses, _ = buffer.lookup_joint('map', ['camera', 'other', 'map'])
    np.testing.assert_array_equal(poses[0], buffer.lookup('map', 'camera', 2 * SECOND))
    np.testing.assert_array_equal(poses[1], Pose(x=2.0))


def test_errors_are_those_of_lookup():
    buffer = Drive(11, 0.2).buffer
    with pytest.raises(ExtrapolationException, match='looking up transform'):
        buffer.lookup_joint('map', ['odom', 'camera'], 9 * SECOND)
    with pytest.raises(ExtrapolationException, match='looking up transform'):
        buffer.lookup_uncertain_full('camera', SECOND, 'camera', 9 * SECOND, 'map')
    with pytest.raises(InvalidArgumentException, match='list of frames'):
        buffer.lookup_joint('map', 'camera')
