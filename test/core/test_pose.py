# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import copy
import math
import pickle

from hypothesis import given
import numpy as np
import pytest
from strategies import assert_same_pose, assert_same_rotation, length, poses, vectors
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3, so3

QUARTER_TURN = so3.from_rpy(0.0, 0.0, math.pi / 2)


def test_pose_of_nothing_is_the_identity():
    assert Pose() == se3.IDENTITY


@given(poses, poses)
def test_matmul_composes_poses(a, b):
    product = Pose(*a) @ Pose(*b)
    assert isinstance(product, Pose)
    assert product == se3.compose(a, b)


def test_matmul_moves_a_point_or_many():
    pose = Pose.from_parts((1.0, 2.0, 3.0), QUARTER_TURN)
    assert pose @ (1.0, 0.0, 0.0) == pytest.approx([1.0, 3.0, 3.0])
    assert pose @ [0.0, 1.0, 0.0] == pytest.approx([0.0, 2.0, 3.0])
    points = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert pose @ points == pytest.approx(np.array([[1.0, 3.0, 3.0], [0.0, 2.0, 3.0]]))
    assert (pose @ np.zeros((2, 5, 3))).shape == (2, 5, 3)


@pytest.mark.parametrize('other', [1.0, (1.0, 2.0), np.ones((3, 2)), (0.0,) * 6, 'map'])
def test_matmul_refuses_what_is_neither_pose_nor_points(other):
    with pytest.raises(ValueError, match=r'points \(\.\.\., 3\)'):
        Pose() @ other


@given(poses, vectors)
def test_inverse_takes_points_back(pose, point):
    back = Pose(*pose).inverse() @ (Pose(*pose) @ point)
    assert math.dist(back, point) <= 5e-15 * (1.0 + length(pose) + math.hypot(*point))


@given(poses)
def test_conversions_go_there_and_back(pose):
    pose = Pose(*pose)
    reach = length(pose)
    # Roll is ignored within 1e-12 rad of gimbal lock, which shows there.
    assert_same_pose(Pose.from_xyz_rpy(*pose.translation, *pose.as_rpy()), pose, 5e-12, reach)
    assert_same_pose(Pose.from_matrix(pose.as_matrix()), pose, 1e-14, reach)
    assert_same_pose(Pose.from_parts(pose.translation, pose.rotation), pose, 1e-14, reach)
    assert_same_pose(
        Pose.from_rotation_vector(pose.as_rotation_vector(), pose.translation), pose, 1e-14, reach)


def test_parts_are_translation_and_quaternion_x_y_z_w():
    pose = Pose(1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8)
    assert pose.translation == (1.0, 2.0, 3.0)
    assert pose.rotation == (0.0, 0.0, 0.6, 0.8)


def test_constructors_give_plain_floats():
    for pose in (
        Pose.from_parts(np.array([1, 2, 3]), np.array([0, 0, 0, 2])),
        Pose.from_xyz_rpy(x=1, yaw=2),
        Pose.from_rotation_vector(np.array([0.1, 0.2, 0.3]), [1, 2, 3]),
        Pose.from_matrix(np.eye(4)),
        Pose.from_matrix(np.eye(4).tolist()),
    ):
        assert type(pose) is Pose
        assert {type(value) for value in pose} == {float}


def test_from_parts_normalises_the_quaternion():
    assert_same_rotation(Pose.from_parts(rotation=(0.0, 0.0, 5.0, 5.0)).rotation, QUARTER_TURN)


@pytest.mark.parametrize(('translation', 'rotation', 'problem'), [
    ((1.0, 2.0), so3.IDENTITY, r'3 numbers and a quaternion 4, not \(2,\) and \(4,\)'),
    ((1.0, 2.0, 3.0), (0.0, 0.0, 1.0), r'not \(3,\) and \(3,\)'),
    (np.eye(3), so3.IDENTITY, r'not \(3, 3\) and \(4,\)'),
    ((math.nan, 0.0, 0.0), so3.IDENTITY, r'translation \[nan, 0.0, 0.0\] is not finite'),
    ((0.0, math.inf, 0.0), so3.IDENTITY, r'is not finite'),
    ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 'not a rotation'),
    ((0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), 'not a rotation'),
])
def test_wrong_parts_are_refused(translation, rotation, problem):
    with pytest.raises(ValueError, match=problem):
        Pose.from_parts(translation, rotation)


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_every_constructor_refuses_what_is_not_finite(bad):
    matrix = np.eye(4)
    matrix[0, 3] = bad
    with pytest.raises(ValueError, match='not finite'):
        Pose.from_matrix(matrix)
    with pytest.raises(ValueError, match='not finite'):
        Pose.from_xyz_rpy(x=bad)
    with pytest.raises(ValueError, match='not a rotation|math domain|finite'):
        Pose.from_xyz_rpy(yaw=bad)
    with pytest.raises(ValueError, match='not a rotation|math domain|finite'):
        Pose.from_rotation_vector((bad, 0.0, 0.0))


def test_pose_cannot_be_changed():
    with pytest.raises(AttributeError, match="can't set attribute"):
        Pose().x = 1.0


def test_pose_is_an_array_of_seven_for_numpy():
    assert np.array(Pose(1.0, 2.0, 3.0)).tolist() == [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]


def test_pose_survives_pickle_and_copy():
    pose = Pose.from_xyz_rpy(1.0, 2.0, 3.0, yaw=0.3)
    for again in (pickle.loads(pickle.dumps(pose)), copy.deepcopy(pose)):
        assert again == pose
        assert type(again) is Pose


def test_text_is_metres_and_degrees():
    assert str(Pose.from_xyz_rpy(1.0, -2.0, 0.5, yaw=math.pi / 2)) == (
        '(1.000, -2.000, 0.500) m, rpy (0.00, 0.00, 90.00) deg')
    assert str(Pose(-1e-9, 0.0, -0.0, *so3.from_rpy(-1e-9, -1e-9, 0.0))) == (
        '(0.000, 0.000, 0.000) m, rpy (0.00, 0.00, 0.00) deg')
    assert repr(Pose()) == 'Pose(x=0.0, y=0.0, z=0.0, qx=0.0, qy=0.0, qz=0.0, qw=1.0)'
