# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Frame names that do not match are refused, and matching names are propagated."""

import dataclasses

from hypothesis import given
import numpy as np
import pytest
from strategies import poses
from tf_tree_py import BufferCore, FramedPoints, FramedPose, FrameMismatchError
from tf_tree_py.core import Pose

SECOND = 1_000_000_000


@pytest.fixture
def buffer():
    buffer = BufferCore()
    for stamp in (SECOND, 2 * SECOND):
        buffer.insert('map', 'base', stamp, Pose.from_xyz_rpy(1e-9 * stamp, yaw=0.5))
    buffer.insert('base', 'camera', 0, Pose.from_xyz_rpy(0.2, z=0.8, pitch=0.3), static=True)
    return buffer


def test_framed_lookup_is_the_lookup_with_its_names_and_stamp(buffer):
    found = buffer.lookup_framed('map', 'camera', SECOND + 5)
    assert found.pose == buffer.lookup('map', 'camera', SECOND + 5)
    assert (found.target_frame, found.source_frame, found.stamp) == ('map', 'camera', SECOND + 5)
    assert buffer.lookup_framed('map', 'camera').stamp == 2 * SECOND
    assert buffer.snapshot().lookup_framed('map', 'camera', SECOND + 5) == found


def test_names_that_meet_cancel(buffer):
    map_T_base = buffer.lookup_framed('map', 'base', SECOND)
    base_T_camera = buffer.lookup_framed('base', 'camera', SECOND)
    map_T_camera = map_T_base @ base_T_camera
    assert map_T_camera.name == 'map_T_camera' and map_T_camera.stamp == SECOND
    assert map_T_camera.pose == pytest.approx(buffer.lookup('map', 'camera', SECOND))


@pytest.mark.parametrize(('left', 'right', 'sentence'), [
    (('map', 'base'), ('map', 'camera'),
     "map_T_base @ map_T_camera: 'base' is not 'map'; did you mean the inverse of the left one?"),
    (('map', 'base'), ('camera', 'base'),
     "map_T_base @ camera_T_base: 'base' is not 'camera'; did you mean the inverse of the right "
     'one?'),
    (('base', 'camera'), ('map', 'base'),
     "base_T_camera @ map_T_base: 'camera' is not 'map'; did you mean the opposite "
     'order?'),
    (('map', 'base'), ('odom', 'camera'), "map_T_base @ odom_T_camera: 'base' is not 'odom'"),
])
def test_names_that_do_not_meet_are_refused_with_what_was_meant(left, right, sentence):
    with pytest.raises(FrameMismatchError) as raised:
        FramedPose(*left, Pose()) @ FramedPose(*right, Pose())
    assert str(raised.value) == sentence


@given(poses)
def test_inverse_swaps_the_names(pose):
    framed = FramedPose('map', 'base', Pose(*pose), 7)
    assert framed.inverse() == FramedPose('base', 'map', Pose(*pose).inverse(), 7)
    assert (framed @ framed.inverse()).name == 'map_T_map'


def test_points_may_carry_their_frame(buffer):
    map_T_camera = buffer.lookup_framed('map', 'camera', SECOND)
    points = np.arange(6.0).reshape(2, 3)
    moved = map_T_camera @ FramedPoints('camera', points)
    assert moved.frame == 'map'
    assert np.array_equal(moved.points, map_T_camera.pose @ points)
    assert np.array_equal(np.asarray(moved), map_T_camera @ points)
    with pytest.raises(FrameMismatchError, match="takes points in 'camera', and these are in "
                                                 "'base'"):
        map_T_camera @ FramedPoints('base', points)


def test_pose_without_names_is_not_taken(buffer):
    map_T_base = buffer.lookup_framed('map', 'base', SECOND)
    with pytest.raises(FrameMismatchError, match='without names cannot be checked'):
        map_T_base @ Pose()
    for plain in (Pose(), np.eye(4)):
        with pytest.raises((TypeError, ValueError)):
            plain @ map_T_base


def test_poses_of_two_moments_have_no_stamp(buffer):
    both = (buffer.lookup_framed('map', 'base', SECOND)
            @ buffer.lookup_framed('base', 'map', 2 * SECOND))
    assert both.stamp is None
    with pytest.raises(FrameMismatchError, match='different stamps'):
        both.as_message()


def test_message_has_names_and_stamp(buffer):
    pytest.importorskip('rclpy')
    message = buffer.lookup_framed('map', 'base', SECOND).as_message()
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'base')
    assert (message.header.stamp.sec, message.transform.translation.x) == (1, 1.0)
    later = dataclasses.replace(buffer.lookup_framed('map', 'base', SECOND), stamp=7)
    assert later.as_message().header.stamp.nanosec == 7
