# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import copy
import math
import pickle

from hypothesis import given
import hypothesis.strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from strategies import poses
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, Poses

STAMPS = np.arange(0, 1_000_000_001, 100_000_000)
base_T_camera = Pose.from_xyz_rpy(0.2, -0.1, 0.8, 0.3, -0.5, 1.1)


@pytest.fixture
def map_T_base():
    """Return eleven different poses, as ``lookup_many`` returns them."""
    buffer = BufferCore()
    for stamp in STAMPS:
        buffer.insert('map', 'base', stamp, Pose.from_xyz_rpy(2e-9 * stamp, 1.0, yaw=3e-9 * stamp))
    return buffer.lookup_many('map', 'base', STAMPS)


def one_by_one(many):
    return [Pose(*row) for row in np.asarray(many).tolist()]


def test_parts_are_those_of_each_pose(map_T_base):
    each = one_by_one(map_T_base)
    assert map_T_base.translation.tolist() == [[*pose.translation] for pose in each]
    assert map_T_base.rotation.tolist() == [[*pose.rotation] for pose in each]


def test_lookup_many_composes_with_a_pose(map_T_base):
    map_T_camera = map_T_base @ base_T_camera
    assert isinstance(map_T_camera, Poses)
    expected = [pose @ base_T_camera for pose in one_by_one(map_T_base)]
    assert np.allclose(map_T_camera, expected, rtol=0.0, atol=1e-14)


def test_pose_composes_with_lookup_many(map_T_base):
    world_T_base = base_T_camera @ map_T_base
    assert isinstance(world_T_base, Poses)
    expected = [base_T_camera @ pose for pose in one_by_one(map_T_base)]
    assert np.allclose(world_T_base, expected, rtol=0.0, atol=1e-14)


def test_plain_array_composes_with_a_pose_as_poses_do(map_T_base):
    plain = np.array(map_T_base)
    assert type(plain) is np.ndarray
    assert np.array_equal(plain @ base_T_camera, map_T_base @ base_T_camera)
    assert np.array_equal(base_T_camera @ plain, base_T_camera @ map_T_base)
    assert np.array_equal(np.matmul(plain, base_T_camera), map_T_base @ base_T_camera)


@given(st.lists(poses, min_size=1, max_size=5), poses)
def test_products_are_those_of_single_poses(rows, other):
    many, other = Poses(rows), Pose(*other)
    size = 1.0 + np.abs(many).max() + max(map(abs, other))
    for product, expected in (
            (many @ other, [pose @ other for pose in one_by_one(many)]),
            (other @ many, [other @ pose for pose in one_by_one(many)]),
            (many @ many, [pose @ pose for pose in one_by_one(many)]),
            (many.inverse(), [pose.inverse() for pose in one_by_one(many)])):
        assert np.allclose(product, expected, rtol=0.0, atol=1e-14 * size)


def test_matrix_on_either_side_is_a_pose():
    turned = Pose.from_xyz_rpy(1.0, 2.0, 3.0, yaw=math.pi / 2)
    for product in (turned.as_matrix() @ base_T_camera, np.eye(4) @ (turned @ base_T_camera),
                    turned @ base_T_camera.as_matrix(),
                    turned.as_matrix().tolist() @ base_T_camera):
        assert isinstance(product, Pose)
        assert product == pytest.approx(turned @ base_T_camera, abs=1e-14)
    many = np.stack([turned.as_matrix(), np.eye(4)])
    assert np.allclose(many @ base_T_camera, [turned @ base_T_camera, base_T_camera])


def test_rotation_of_scipy_is_a_pose():
    rotation = Rotation.from_euler('z', 90, degrees=True)
    assert Pose(1.0) @ rotation == pytest.approx(Pose.from_xyz_rpy(1.0, yaw=math.pi / 2))


def test_each_pose_takes_its_own_point_or_all_take_one(map_T_base):
    points = np.arange(33.0).reshape(11, 3)
    each = [pose @ point for pose, point in zip(one_by_one(map_T_base), points, strict=True)]
    assert map_T_base @ points == pytest.approx(np.array(each))
    one = [pose @ points[4] for pose in one_by_one(map_T_base)]
    assert map_T_base @ points[4] == pytest.approx(np.array(one))


@pytest.mark.parametrize(('left', 'right', 'sentence'), [
    (Poses(np.ones((4, 7))), np.ones((3, 3)), r'one for each pose, or one for all'),
    (Poses(np.ones((4, 7))), np.ones((3, 7)), r'one for each pose, or one for all'),
    (Pose(), (1.0, 2.0, 3.0, 1.0), r'homogeneous points.*points\[\.\.\., :3\]'),
    (Pose(), np.ones((5, 4)), r'homogeneous points'),
    (Pose(), 2.0, r'right operand of @ must be points .* not a float'),
    (Pose(), 'map', r'right operand of @ must be points .* not a str'),
    (np.ones((5, 3)), Pose(), r'left operand of @ must be poses'),
    (np.ones(4), Pose(), r'left operand of @ must be poses'),
    (2.0 * np.eye(4), Pose(), r'rigid'),
])
def test_what_cannot_be_composed_is_refused_in_a_sentence(left, right, sentence):
    with pytest.raises(ValueError, match=sentence):
        left @ right


def test_columns_and_masked_numbers_of_poses_are_plain(map_T_base):
    assert map_T_base.shape == (11, 7)
    for part in (map_T_base[:, :3], map_T_base[:, 0], map_T_base.translation,
                 map_T_base[..., 1], map_T_base[map_T_base > 0.5], map_T_base[3][:3]):
        assert type(part) is np.ndarray
    map_T_base[2:5, 0] = 4.0
    map_T_base[7] = base_T_camera
    assert np.asarray(map_T_base)[[2, 4, 7], 0].tolist() == [4.0, 4.0, 0.2]


def test_rows_of_poses_are_poses(map_T_base):
    mask = np.arange(11) % 2 == 0
    for rows in (map_T_base[2:5], map_T_base[mask], map_T_base[[1, 2]], map_T_base[3],
                 map_T_base.copy(), copy.copy(map_T_base), pickle.loads(pickle.dumps(map_T_base))):
        assert isinstance(rows, Poses)
        assert np.array_equal((rows @ base_T_camera)[..., :3], rows @ base_T_camera.translation)
    assert isinstance(map_T_base[3][0], float)


def test_masked_lookup_composes_where_it_has_poses():
    buffer = BufferCore()
    for stamp in STAMPS:
        buffer.insert('map', 'base', stamp, Pose(x=1e-9 * stamp))
    found, valid = buffer.lookup_many('map', 'base', [5, -1], outside='mask')
    assert np.isnan((found @ base_T_camera)[~valid]).all()
    assert np.array_equal((found @ base_T_camera)[valid][0], Pose(*found[0]) @ base_T_camera)


def test_poses_go_into_pandas(map_T_base):
    pandas = pytest.importorskip('pandas')
    frame = pandas.DataFrame(map_T_base, columns=['x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'])
    assert np.array_equal(Poses(frame), map_T_base)
    for difference in (frame - map_T_base, map_T_base - frame):
        assert isinstance(difference, pandas.DataFrame)
        assert not difference.to_numpy().any()
    frame[['x', 'y', 'z', 'qx', 'qy', 'qz', 'qw']] = map_T_base @ base_T_camera
    assert np.array_equal(Poses(frame), map_T_base @ base_T_camera)


def test_poses_go_into_matplotlib(map_T_base):
    lines = pytest.importorskip('matplotlib.figure').Figure().subplots().plot(map_T_base)
    assert np.array_equal(np.transpose([line.get_ydata() for line in lines]), map_T_base)


def test_velocity_of_poses_is_of_numbers(map_T_base):
    assert type(np.diff(map_T_base.translation, axis=0)) is np.ndarray
    assert np.concatenate([map_T_base, map_T_base]).shape == (22, 7)
