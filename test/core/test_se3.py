# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import functools
import math

from hypothesis import assume, given, strategies as st
import numpy as np
import pytest
from strategies import (
    about,
    assert_same_pose,
    assert_same_rotation,
    axes,
    length,
    poses,
    quaternions,
    random_poses,
    ratios,
    signs,
    vectors,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.chain import between_samples


def reach(*given_poses):
    return sum(map(length, given_poses))


# --- the group


@given(poses, poses, poses)
def test_composition_is_associative(a, b, c):
    left = se3.compose(se3.compose(a, b), c)
    right = se3.compose(a, se3.compose(b, c))
    assert_same_pose(left, right, 3e-15, reach(a, b, c))


@given(poses)
def test_identity_changes_nothing(pose):
    assert se3.compose(se3.IDENTITY, pose) == pose
    assert se3.compose(pose, se3.IDENTITY) == pose


@given(poses)
def test_inverse_undoes_from_both_sides(pose):
    assert_same_pose(se3.compose(pose, se3.inverse(pose)), se3.IDENTITY, 3e-15, reach(pose))
    assert_same_pose(se3.compose(se3.inverse(pose), pose), se3.IDENTITY, 3e-15, reach(pose))


@given(poses)
def test_inverse_of_the_inverse_is_the_pose(pose):
    assert_same_pose(se3.inverse(se3.inverse(pose)), pose, 3e-15, reach(pose))


@given(poses, poses)
def test_inverse_of_a_product_turns_it_round(a, b):
    assert_same_pose(se3.inverse(se3.compose(a, b)),
                     se3.compose(se3.inverse(b), se3.inverse(a)), 3e-15, reach(a, b))


def test_inverse_is_not_the_negative_translation():
    pose = (1.0, 2.0, 3.0, *so3.from_rpy(0.0, 0.0, math.pi / 2))
    assert se3.inverse(pose)[:3] == pytest.approx((-2.0, 1.0, -3.0), abs=1e-15)


@given(poses, poses)
def test_composition_is_the_product_of_the_matrices(a, b):
    product = se3.as_matrix(a) @ se3.as_matrix(b)
    assert np.abs(se3.as_matrix(se3.compose(a, b)) - product).max() <= 3e-15 * max(1, reach(a, b))


@given(poses, poses)
def test_composition_is_rotate_and_multiply(a, b):
    x, y, z = so3.rotate(a[3:], b[:3])
    expected = (a[0] + x, a[1] + y, a[2] + z, *so3.multiply(a[3:], b[3:]))
    assert se3.compose(a, b) == pytest.approx(expected, rel=1e-15, abs=1e-15 * reach(b) + 1e-300)


@given(st.lists(poses, max_size=6))
def test_chain_is_composition_from_the_left(chain):
    expected = functools.reduce(se3.compose, chain, se3.IDENTITY)
    assert_same_pose(se3.compose_chain(chain), expected, 3e-15, reach(*chain))


def test_no_poses_compose_to_the_identity():
    assert se3.compose_chain([]) == se3.IDENTITY


@given(poses, poses, vectors)
def test_applying_twice_is_applying_the_product(a, b, point):
    once, twice = se3.apply(se3.compose(a, b), point), se3.apply(a, se3.apply(b, point))
    assert math.dist(once, twice) <= 3e-15 * max(1.0, reach(a, b) + math.hypot(*point))


@given(poses, st.lists(vectors, min_size=1, max_size=5))
def test_one_pose_moves_many_points_as_it_moves_each(pose, points):
    moved = se3.apply_many(pose, points)
    assert moved.shape == (len(points), 3)
    for point, result in zip(points, moved, strict=True):
        tolerance = 3e-15 * max(1.0, reach(pose) + math.hypot(*point))
        assert math.dist(se3.apply(pose, point), result) <= tolerance


@pytest.mark.parametrize(('pose', 'points'), [
    (se3.IDENTITY, np.zeros((4, 4))), (se3.IDENTITY, 1.0), (np.zeros(6), np.zeros(3)),
])
def test_wrong_shapes_are_named(pose, points):
    with pytest.raises(ValueError, match=r'poses are \(..., 7\) and points \(..., 3\), not'):
        se3.apply_many(pose, points)


def test_an_empty_cloud_stays_empty():
    assert se3.apply_many(se3.IDENTITY, np.empty((0, 3))).shape == (0, 3)


def test_ten_thousand_random_poses_compose_to_a_rigid_transform():
    chain = random_poses(np.random.default_rng(7), 10_000, reach=10.0)
    pose = se3.IDENTITY
    for step in map(tuple, chain.tolist()):
        pose = se3.compose(pose, step)
    for result in (pose, se3.compose_chain([*map(tuple, chain.tolist())])):
        rotation = se3.as_matrix(result)[:3, :3]
        assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-6)
        assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-6
    expected = functools.reduce(np.matmul, se3.as_matrix_many(chain))
    assert se3.as_matrix(pose) == pytest.approx(expected, abs=1e-8)


# --- matrices


@given(poses)
def test_pose_survives_the_matrix(pose):
    back = se3.from_matrix(se3.as_matrix(pose))
    assert back[:3] == pose[:3]
    assert_same_rotation(back[3:], pose[3:], 2e-15)


def with_entry(row, column, value):
    matrix = np.eye(4)
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(('matrix', 'problem'), [
    (with_entry(3, 0, 0.1), 'last row'),
    (with_entry(3, 3, 2.0), 'last row'),
    (with_entry(3, 3, math.nan), 'last row'),
    (with_entry(0, 0, -1.0), 'a reflection'),
    (with_entry(0, 1, 0.01), 'differs from I'),
    (with_entry(1, 3, math.nan), 'not finite'),
    (with_entry(1, 3, math.inf), 'not finite'),
])
def test_what_is_no_rigid_transform_is_refused(matrix, problem):
    with pytest.raises(ValueError, match=problem):
        se3.from_matrix(matrix)
    with pytest.raises(ValueError, match=problem):
        se3.from_matrix_many(np.stack([np.eye(4), matrix]))


def test_a_matrix_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r'shape \(4, 4\), not \(3, 3\)'):
        se3.from_matrix(np.eye(3))


# --- interpolating


@given(poses, poses)
def test_interpolation_begins_and_ends_at_the_two_poses(a, b):
    assert_same_pose(se3.interpolate(a, b, 0.0), a, 1e-14)
    assert_same_pose(se3.interpolate(a, b, 1.0), b, 1e-14)


@given(poses, poses, ratios)
def test_interpolation_is_a_line_and_a_slerp(a, b, ratio):
    pose = se3.interpolate(a, b, ratio)
    line = [(1.0 - ratio) * start + ratio * end for start, end in zip(a[:3], b[:3], strict=True)]
    assert pose[:3] == tuple(line)
    assert pose[3:] == so3.slerp(a[3:], b[3:], ratio)


@given(poses, poses, st.integers(0, 1000))
def test_between_two_samples_a_pose_is_interpolated_unless_tf2_rounds(a, b, passed):
    expected = se3.interpolate(a, b, passed / 1000)
    between = between_samples((*a, *b), 7 + passed, 7, 1007)
    # tf2 rounds rotations that are closer than 3e-8 rad, and turns half turns in its own way.
    assert between[:3] == expected[:3]
    if se3.distance(a, b)[1] < 3.1:
        assert se3.distance(between, expected)[1] <= 3e-8


def test_samples_years_apart_are_interpolated_like_floats():
    """The quotient of two large integers has another last bit than that of their floats."""
    first, last = 0, 3 * 2 ** 60 + 1
    pair = (*se3.IDENTITY, 1.0, *se3.IDENTITY[1:])
    for stamp in range(2 ** 59 + 1, 2 ** 59 + 4_000, 31):
        assert between_samples(pair, stamp, first, last)[0] == float(stamp) / float(last)


@given(poses, ratios)
def test_interpolation_between_equal_poses_stays_there(pose, ratio):
    assert_same_pose(se3.interpolate(pose, pose, ratio), pose, 1e-14, reach(pose))


@given(quaternions, axes, st.floats(-12.0, -8.5), signs)
def test_interpolation_keeps_tf2s_rotation_below_its_resolution(
        rotation, axis, power, sign):
    a = (0.0, 0.0, 0.0, *rotation)
    b = (2.0, 0.0, 0.0, *so3.multiply(rotation, about(axis, 10.0 ** power, sign)))
    (ax, ay, az, aw), (bx, by, bz, bw) = a[3:], b[3:]
    # Rounded like the code: sum() of Python 3.12 would be more exact.
    assume(abs(ax * bx + ay * by + az * bz + aw * bw) >= 1.0)
    assert between_samples((*a, *b), 1, 0, 2) == (1.0, 0.0, 0.0, *rotation)


# --- distances


@given(poses, vectors, axes, st.floats(0.0, math.pi), signs)
def test_distance_is_how_far_one_was_moved_and_turned(pose, step, axis, angle, sign):
    moved = (*np.add(pose[:3], step), *so3.multiply(pose[3:], about(axis, angle, sign)))
    distance, turned = se3.distance(pose, moved)
    assert distance == pytest.approx(length(step), abs=1e-15 * reach(pose, moved))
    assert turned == pytest.approx(angle, abs=1e-7 if angle > 3.1 else 1e-14)
    assert se3.distance(moved, pose) == pytest.approx((distance, turned), rel=1e-15, abs=1e-14)
    many = se3.distance_many(np.array(pose), np.array(moved))
    assert many == pytest.approx((distance, turned), rel=1e-15, abs=1e-14)
