# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is taken for a pose, for poses and for points, and the exact words about anything else."""

import math
import pickle
from types import SimpleNamespace

from inputs import for_each
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from strategies import random_poses
from tf_tree_py.core import InvalidArgumentException, Pose, Poses, se3
from tf_tree_py.core.geometry.pose import product
from tf_tree_py.core.geometry.poses import (
    array_of,
    checked_pose,
    checked_poses,
    is_sound,
    judged,
)

POSE = Pose(1.0, 2.0, 3.0, 0.5, -0.5, 0.5, 0.5)
TURN = (0.5, -0.5, 0.5, 0.5)
NUMBERS = random_poses(np.random.default_rng(8), 6)
WHAT = ('a pose is a Pose, seven numbers (x y z in metres, quaternion x y z w), a 4x4 matrix, or '
        'a Rotation or RigidTransform of scipy')
OPERAND = ('the right operand of @ must be points (..., 3), poses (..., 7), matrices (..., 4, 4), '
           'or a Rotation or RigidTransform of scipy')


class RigidTransform:
    """As that of scipy, which old versions do not have."""

    def __init__(self, poses):
        self.poses = np.asarray(poses)

    def as_components(self):
        return self.poses[..., :3], Rotation.from_quat(self.poses[..., 3:])


def said(function, *arguments, error=ValueError):
    with pytest.raises(error) as raised:
        function(*arguments)
    return str(raised.value)


# --- one pose, and many


@pytest.mark.parametrize('given', [
    POSE, list(POSE), np.array(POSE), np.array(POSE, object), iter(POSE), POSE.as_matrix(),
    POSE.as_matrix().tolist(), RigidTransform(POSE)], ids=range(8))
def test_pose_of_any_kind_is_seven_floats(given):
    pose = checked_pose(given)
    assert pose == tuple(POSE)
    assert {type(pose), *map(type, pose)} == {tuple, float}


def test_rotation_of_scipy_is_a_pose_without_translation():
    assert checked_pose(Rotation.from_quat(TURN)) == (0.0, 0.0, 0.0, *TURN)
    assert checked_poses(Rotation.from_quat([TURN, TURN])).tolist() == [[0.0, 0.0, 0.0, *TURN]] * 2
    assert array_of(RigidTransform(NUMBERS)) == pytest.approx(NUMBERS)
    grid = SimpleNamespace(as_quat=lambda: np.ones((2, 5, 4)))
    assert array_of(grid).tolist() == [[[0, 0, 0, 1, 1, 1, 1]] * 5] * 2


def test_poses_of_any_kind_are_rows_of_seven():
    for given in (NUMBERS, NUMBERS.tolist(), list(map(tuple, NUMBERS)), Poses(NUMBERS),
                  [Pose(*row) for row in NUMBERS.tolist()], RigidTransform(NUMBERS),
                  [RigidTransform(row) for row in NUMBERS],
                  [NUMBERS[0], *se3.as_matrix_many(NUMBERS[1:])]):
        poses = checked_poses(given)
        assert np.abs(np.sum(poses[:, 3:] * NUMBERS[:, 3:], axis=1)) == pytest.approx(np.ones(6))
        assert poses[:, :3] == pytest.approx(NUMBERS[:, :3], abs=1e-15)
    assert checked_poses(NUMBERS) is NUMBERS
    assert checked_poses(NUMBERS[:, ::-1]).flags.c_contiguous


def test_matrices_that_are_not_finite_become_nan_and_the_others_poses():
    matrices = se3.as_matrix_many(NUMBERS)
    matrices[1, 0, 3], matrices[4, 2, 1] = math.nan, math.inf
    poses = checked_poses(matrices)
    assert np.isnan(poses).tolist() == [[row in (1, 4)] * 7 for row in range(6)]
    assert se3.as_matrix_many(poses)[[0, 2, 3, 5]] == pytest.approx(matrices[[0, 2, 3, 5]])
    matrices[3, 3, 3] = 2.0
    assert said(checked_poses, matrices, error=InvalidArgumentException) == (
        'poses[3]: not a rigid transform: the last row of the matrix is not 0 0 0 1')


@pytest.mark.parametrize(('given', 'words'), [
    ((1.0, 2.0, 3.0), f'an array of the shape (3,) is not a pose: {WHAT}; Pose(x, y, z) makes a '
     'pose from a translation'),
    (np.zeros((2, 7)), f'an array of the shape (2, 7) is not a pose: {WHAT}'),
    (np.zeros((1, 4, 4)), f'an array of the shape (1, 4, 4) is not a pose: {WHAT}'),
    (np.eye(3), f'an array of the shape (3, 3) is not a pose: {WHAT}; Pose.from_parts('
     'translation, Rotation.from_matrix(R).as_quat()) makes a pose from a rotation matrix'),
    (None, f'None is not a pose: {WHAT}'), (5.0, f'5.0 is not a pose: {WHAT}'),
    ('x' * 77, f"'{'x' * 77}' is not a pose: {WHAT}"),
    ('x' * 78, f'this str is not a pose: {WHAT}'),
    (frozenset(range(7)), f'frozenset({{0, 1, 2, 3, 4, 5, 6}}) is not a pose: {WHAT}'),
    (SimpleNamespace(translation=1), f'namespace(translation=1) is not a pose: {WHAT}; '
     'tf_tree_py.as_pose converts a message'),
    (SimpleNamespace(transform=1), f'namespace(transform=1) is not a pose: {WHAT}; '
     'tf_tree_py.as_pose converts a message'),
], ids=range(11))
def test_words_about_what_is_no_pose(given, words):
    assert said(checked_pose, given, error=InvalidArgumentException) == words


@pytest.mark.parametrize(('given', 'begin', 'end'), [
    (np.zeros((5, 6)), 'an array of the shape (5, 6)', '; six numbers are ambiguous, angles or a '
     'rotation vector: use Pose.from_xyz_rpy or Pose.from_rotation_vector'),
    (np.zeros((6, 7, 7)), 'an array of the shape (6, 7, 7)', ''),
    (np.zeros(7), 'an array of the shape (7,)', ''),
    (np.eye(5), 'an array of the shape (5, 5)', ''),
    (np.zeros((4, 3)), 'an array of the shape (4, 3)',
     '; Pose(x, y, z) makes a pose from a translation'),
    (np.zeros((2, 2, 4, 4)), 'an array of the shape (2, 2, 4, 4)', ''),
    ('ab', "'ab'", ''), (None, 'None', ''), (3, '3', ''),
], ids=range(9))
def test_words_about_what_are_no_poses(given, begin, end):
    assert said(checked_poses, given, error=InvalidArgumentException) == (
        f'poses are (N, 7) numbers or (N, 4, 4) matrices: {begin} is not a row of poses: '
        f'{WHAT}{end}')


# --- which poses are good


def with_length(excess, translation=(1.0, 2.0, 0.0)):
    return (*translation, *(math.sqrt(1.0 + excess) * value for value in TURN))


@pytest.mark.parametrize(('excess', 'sound'), [
    (0.0, True), (0.9e-12, True), (-0.9e-12, True), (1.1e-12, False), (-1.1e-12, False),
    (1e-7, False), (1.0, False), (-1.0, False)])
def test_pose_is_sound_if_its_quaternion_has_length_one(excess, sound):
    for signs in ((1, 1, 1, 1), (-1, 1, 1, 1), (1, -1, 1, 1), (1, 1, -1, 1), (1, 1, 1, -1)):
        pose = with_length(excess)
        pose = (*pose[:3], *np.multiply(pose[3:], signs).tolist())
        assert is_sound(pose) is sound
        if excess == -1.0:
            continue
        poses = np.array([POSE, pose])
        judgement, good = judged(poses)
        assert good.tolist() == [True, True]
        assert judgement[1, :3].tolist() == [1.0, 2.0, 0.0]
        expected = np.multiply(TURN, signs)
        assert judgement[1, 3:] == pytest.approx(pose[3:] if sound else expected, rel=2e-16)
        assert poses.tolist() == [list(POSE), list(pose)]


@pytest.mark.filterwarnings('error')
def test_good_poses_are_judged_without_a_copy():
    for poses in (np.array([POSE] * 3), NUMBERS, np.zeros((0, 7))):
        judgement, good = judged(poses)
        assert judgement is poses
        assert good.tolist() == [True] * len(poses)
        assert good.dtype == bool


@pytest.mark.filterwarnings('error')
def test_bad_poses_stay_as_they_are_and_the_others_are_normalised():
    bad = [(0.0, 0.0, math.nan, *TURN), (math.inf, -math.inf, 0.0, *TURN),
           (0.0, 0.0, 0.0, 2.0, math.nan, 0.0, 1.0), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0),
           (0.0, 0.0, 0.0, 1e308, 1e308, 1e308, 1e308), (5.0, math.inf, 6.0, 2.0, 2.0, 2.0, 2.0)]
    rough = [(1.0, 2.0, 3.0, size, -size, size, size) for size in (2.0, 1e-170, 1e300)]
    poses, good = judged(np.array([row for pair in zip(bad, rough * 2, strict=True)
                                   for row in pair]))
    assert good.tolist() == [False, True] * 6
    np.testing.assert_array_equal(poses[::2], bad)
    assert poses[1::2] == pytest.approx(np.array([POSE] * 6), rel=1e-15)
    for pose in bad:
        assert not is_sound(pose)
        assert judged(np.array([pose]))[1].tolist() == [False]
    assert is_sound((1e308, 1e308, -1e308, *TURN))


# --- the class of one pose, and that of many


def test_poses_show_their_numbers_and_survive_pickle():
    poses = Poses([POSE])
    assert repr(poses) == 'Poses([[ 1. ,  2. ,  3. ,  0.5, -0.5,  0.5,  0.5]])'
    again = pickle.loads(pickle.dumps(poses))
    assert type(again) is Poses
    assert again.tolist() == poses.tolist() == [list(POSE)]
    for shape in ((6,), (7, 6), (2, 8), (7, 1), ()):
        assert said(Poses, np.zeros(shape)) == f'poses are (..., 7), not {shape}'


@pytest.mark.filterwarnings('ignore:Setting the shape:DeprecationWarning')
def test_poses_keep_their_shape_when_the_owner_of_the_memory_changes_its_own():
    array = np.zeros((2, 7))
    poses = Poses(array)
    array.shape = (14,)
    assert poses.shape == (2, 7)
    assert len(poses) == 2


def test_array_of_poses_shares_the_memory_unless_a_copy_is_asked_for():
    poses = Poses(NUMBERS.copy())
    for array in (poses.__array__(), poses.__array__(float), np.asarray(poses)):
        assert type(array) is np.ndarray
        assert np.shares_memory(array, poses.translation)
    assert poses.__array__(np.float32).dtype == np.float32
    assert poses.__array__(float, copy=True).tolist() == NUMBERS.tolist()
    assert not np.shares_memory(poses.__array__(copy=True), poses.translation)
    assert poses.copy('F').flags.f_contiguous
    assert not np.shares_memory(poses.copy(), poses.translation)


def test_parts_of_poses_are_poses_only_as_whole_rows():
    poses = Poses(np.stack([NUMBERS, NUMBERS]))
    for key in (0, slice(1), [1, 0], np.array([True, False])):
        assert type(poses[key]) is Poses
        assert poses[key].tolist() == np.asarray(poses)[key].tolist()
    for key in ((0, 1), (0, 1, 2), [[0, 1], [1, 0]], np.ones(poses.shape, bool), (..., 0)):
        assert not isinstance(poses[key], Poses)
    assert [type(part) for part in poses] == [Poses] * 2
    assert [type(part) for part in Poses(POSE)] == [np.float64] * 7
    assert Poses(POSE)[0] == 1.0


@for_each(name=['resize', '_private', '__array_interface__', 'no_such_name'])
def test_poses_have_no_other_attributes_than_an_array(name):
    with pytest.raises(AttributeError, match=f"^'Poses' object has no attribute '{name}'$"):
        getattr(Poses(NUMBERS), name)


def test_function_of_numpy_with_two_results_fills_those_it_was_given():
    poses, whole = Poses(NUMBERS), np.trunc(NUMBERS)
    for outs in (2, 1, 0), (None, 1), (0, None), (0, 1):
        places = tuple(None if out is None else np.zeros((6, 7)) for out in outs[-2:])
        found = np.modf(poses, out=places)
        assert type(found) is tuple
        for result, place, expected in zip(found, places, (NUMBERS - whole, whole), strict=True):
            assert place is None or result is place
            assert result == pytest.approx(expected)
    assert np.add(poses, 1.0).tolist() == (NUMBERS + 1.0).tolist()
    assert np.add(poses, 1.0, out=(place := np.zeros((6, 7)))) is place
    assert np.add.reduce(poses, axis=0).tolist() == np.add.reduce(NUMBERS, axis=0).tolist()
    assert np.add.outer(Pose(), poses).shape == (7, 6, 7)
    for outs in ((Pose(), None), (None, Pose())):
        assert said(lambda outs=outs: np.modf(poses[0], out=outs), error=TypeError) == (
            'a Pose never changes: pass an array as out')


def test_product_of_numpy_is_one_pose_if_an_operand_is():
    one, row = POSE, np.array(POSE)
    for left, right, kind in ((one, one, Pose), (one, row, Pose), (row, one, Pose),
                              (Poses(row), row, Poses), (row, Poses(row), Poses),
                              (one, NUMBERS, Poses), (NUMBERS, one, Poses)):
        found = np.matmul(left, right)
        assert type(found) is kind
        assert found == pytest.approx(se3.compose_many(np.array(left), np.array(right)))
    assert type(POSE @ row) is type(row @ POSE) is Pose
    assert type(POSE @ NUMBERS) is type(NUMBERS @ POSE) is Poses


# --- operands


def test_operand_is_recognised_by_its_shape():
    pose = np.array(POSE)
    points = np.arange(6.0).reshape(2, 3)
    assert product(pose, points) == pytest.approx(se3.apply_many(pose, points))
    assert type(product(pose, NUMBERS)) is Poses
    assert product(pose, se3.as_matrix_many(NUMBERS)).shape == (6, 7)
    assert product(pose, np.eye(4)).tolist() == pose.tolist()
    assert product(NUMBERS, np.ones((5, 1, 3))).shape == (5, 6, 3)
    # Seven matrices of points are points, and matrices (4, 4) are matrices.
    assert type(product(pose, np.ones((4, 4, 3)))) is np.ndarray


@pytest.mark.parametrize(('right', 'words'), [
    ('map', f'{OPERAND}, and not a str'), (None, f'{OPERAND}, and not a NoneType'),
    (2.0, f'{OPERAND}, and not a float'),
    (np.ones((3, 2)), f'{OPERAND}, and not the shape (3, 2)'),
    ((1.0, 2.0, 3.0, 1.0), f'{OPERAND}. The shape (4,) is that of homogeneous points: pass their '
     'first three numbers, points[..., :3]'),
    (np.ones((5, 4)), f'{OPERAND}. The shape (5, 4) is that of homogeneous points: pass their '
     'first three numbers, points[..., :3]'),
    (np.ones((3, 3)), '(6, 7) poses and (3, 3) do not match: pass one for each pose, or one for '
     'all'),
    (np.ones((5, 7)), '(6, 7) poses and (5, 7) do not match: pass one for each pose, or one for '
     'all'),
    (2.0 * np.eye(4), 'not a rigid transform: the last row of the matrix is not 0 0 0 1'),
], ids=range(9))
def test_words_about_what_is_no_right_operand(right, words):
    assert said(lambda: Poses(NUMBERS) @ right) == words


@pytest.mark.parametrize(('left', 'words'), [
    ((1.0, 2.0), 'not a tuple of the shape (2,)'), ('map', 'not a str'), (2.0, 'not a float'),
    ([[0.0] * 3] * 4, 'not a list of the shape (4, 3)'),
    ([[0.0] * 4] * 3, 'not a list of the shape (3, 4)')], ids=range(5))
def test_words_about_what_is_no_left_operand(left, words):
    for right in (POSE, Poses(NUMBERS)):
        assert said(lambda right=right: left @ right) == (
            f'the left operand of @ must be poses (..., 7) or matrices (..., 4, 4), {words}')


def test_defaults_of_a_pose_are_no_translation_and_no_rotation():
    identity = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert (Pose() == Pose.from_parts() == Pose.from_xyz_rpy()
            == Pose.from_rotation_vector((0.0, 0.0, 0.0)) == identity)
    half = math.sqrt(0.5)
    for number, axis in enumerate(('roll', 'pitch', 'yaw')):
        turned = Pose.from_xyz_rpy(**{axis: math.pi / 2})
        assert turned == pytest.approx(
            (0.0, 0.0, 0.0, *(half * (i == number) for i in range(3)), half), abs=1e-15)
        assert turned.as_rotation_vector()[number] == pytest.approx(math.pi / 2)
    for number, axis in enumerate('xyz'):
        assert Pose.from_xyz_rpy(**{axis: 5.0})[number] == 5.0
    assert Pose.from_rotation_vector((0.0, 0.0, 0.1), (1, 2, 3)).translation == (1.0, 2.0, 3.0)


def test_text_of_a_pose_has_millimetres_and_hundredths_of_a_degree():
    pose = Pose.from_xyz_rpy(1.23456, -0.0004, 0.0006, math.radians(1.234), math.radians(-5.678),
                             math.radians(90.999))
    assert str(pose) == '(1.235, 0.000, 0.001) m, rpy (1.23, -5.68, 91.00) deg'
