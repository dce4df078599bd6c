# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math

from hypothesis import assume, given, strategies as st
import numpy as np
import pytest
from recordings import is_next_to_a_tie
from scipy.spatial.transform import Rotation, Slerp
from strategies import (
    about,
    angle_between,
    angles,
    assert_same_rotation,
    axes,
    components,
    quaternions,
    ratios,
    signs,
    tiny_angles,
    tiny_quaternions,
    vectors,
)
from tf_tree_py.core.geometry import so3


def scaled(axis, angle):
    return tuple(angle * value for value in axis)


# --- the group


@given(quaternions, quaternions, quaternions)
def test_multiplication_is_associative(a, b, c):
    left = so3.multiply(so3.multiply(a, b), c)
    right = so3.multiply(a, so3.multiply(b, c))
    assert left == pytest.approx(right, rel=0, abs=1e-15)


@given(quaternions)
def test_identity_changes_nothing(q):
    assert so3.multiply(so3.IDENTITY, q) == q
    assert so3.multiply(q, so3.IDENTITY) == q


@given(quaternions)
def test_conjugate_is_the_inverse(q):
    assert so3.multiply(q, so3.conjugate(q)) == pytest.approx(so3.IDENTITY, abs=1e-15)
    assert so3.multiply(so3.conjugate(q), q) == pytest.approx(so3.IDENTITY, abs=1e-15)


def test_multiplication_applies_the_right_factor_first():
    quarter_about_z, quarter_about_x = about((0, 0, 1), math.pi / 2), about((1, 0, 0), math.pi / 2)
    # About x, y becomes z, and about z, z is unchanged.
    rotated = so3.rotate(so3.multiply(quarter_about_z, quarter_about_x), (0.0, 1.0, 0.0))
    assert rotated == pytest.approx((0.0, 0.0, 1.0), abs=1e-15)


@given(quaternions, quaternions, vectors)
def test_rotating_twice_is_rotating_by_the_product(a, b, v):
    once, twice = so3.rotate(so3.multiply(a, b), v), so3.rotate(a, so3.rotate(b, v))
    assert math.dist(once, twice) <= 3e-15 * math.hypot(*v)


@given(quaternions, vectors)
def test_rotation_keeps_lengths(q, v):
    assert math.hypot(*so3.rotate(q, v)) == pytest.approx(math.hypot(*v), rel=1e-14, abs=0)


@given(quaternions, vectors)
def test_both_signs_of_a_quaternion_rotate_alike(q, v):
    negative = tuple(-value for value in q)
    assert so3.rotate(negative, v) == pytest.approx(so3.rotate(q, v), rel=1e-14, abs=1e-20)


@given(quaternions, vectors)
def test_rotating_is_what_the_matrix_does(q, v):
    assert math.dist(np.array(so3.as_matrix(q)) @ v, so3.rotate(q, v)) <= 3e-15 * math.hypot(*v)


# --- normalising


@pytest.mark.parametrize('scale', [1e-300, 1e-10, 0.5, 1.0, 3.0, 1e10, 1e300])
def test_normalize_scales_to_length_one(scale):
    q = so3.normalize((scale * 1.0, scale * -2.0, scale * 3.0, scale * -4.0))
    assert q == pytest.approx([value / math.sqrt(30.0) for value in (1, -2, 3, -4)])
    assert math.hypot(*q) == pytest.approx(1.0, abs=3e-16)


@pytest.mark.parametrize('q', [(0.0,) * 4, (math.nan, 0.0, 0.0, 1.0), (math.inf, 0.0, 0.0, 1.0)])
def test_normalize_refuses_what_has_no_direction(q):
    with pytest.raises(ValueError, match='not a rotation: the quaternion .* has length'):
        so3.normalize(q)


# --- exp and log


@given(axes, angles, signs)
def test_log_gives_back_the_rotation_vector(axis, angle, sign):
    assume(angle < math.pi - 1e-9)
    vector = scaled(axis, angle)
    q = tuple(sign * value for value in so3.exp(vector))
    # Relative to the angle: a rotation of 1e-12 rad also keeps its digits.
    assert math.dist(so3.log(q), vector) <= 1e-14 * angle


@given(quaternions)
def test_exp_gives_back_the_rotation(q):
    assert_same_rotation(so3.exp(so3.log(q)), q, 1e-15)


@given(quaternions)
def test_log_is_never_longer_than_pi(q):
    assert math.hypot(*so3.log(q)) <= math.pi * (1 + 1e-15)


@given(axes, tiny_angles)
def test_half_of_a_tiny_rotation_vector_is_the_vector_part(axis, angle):
    assert so3.exp(scaled(axis, angle))[:3] == pytest.approx(
        scaled(axis, 0.5 * angle), rel=1e-12, abs=1e-300)


def test_exp_is_smooth_where_the_series_ends():
    below, above = (so3.exp((1e-3 * (1.0 + side), 0.0, 0.0))[0] for side in (-1e-9, 1e-9))
    assert above - below == pytest.approx(1e-12, rel=1e-3)


def test_half_a_turn_has_a_log_of_length_pi():
    assert so3.log((0.0, 1.0, 0.0, 0.0)) == pytest.approx((0.0, math.pi, 0.0))
    assert so3.log((0.0, 1.0, 0.0, -1e-17)) == pytest.approx((0.0, -math.pi, 0.0))


# --- matrices


@given(quaternions)
def test_matrix_is_a_rotation(q):
    matrix = np.array(so3.as_matrix(q))
    assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-14)
    assert np.abs(matrix.T @ matrix - np.eye(3)).max() < 1e-14


@given(quaternions)
def test_quaternion_survives_the_matrix(q):
    back = so3.from_matrix(so3.as_matrix(q))
    assert back[3] >= 0.0
    assert_same_rotation(back, q, 2e-15)


@pytest.mark.parametrize(('matrix', 'problem'), [
    (np.eye(4), r'shape \(3, 3\), not \(4, 4\)'),
    (np.diag([1.0, 1.0, -1.0]), 'a reflection'),
    (2.0 * np.eye(3), r'differs from I'),
    (np.eye(3) + 1e-5, r'differs from I'),
    (np.zeros((3, 3)), r'differs from I'),
    (np.full((3, 3), np.nan), r'differs from I'),
])
def test_what_is_no_rotation_matrix_is_refused(matrix, problem):
    with pytest.raises(ValueError, match=problem):
        so3.from_matrix(matrix)


def test_matrix_that_is_off_by_rounding_is_taken():
    assert so3.from_matrix(np.eye(3) + 1e-8) == pytest.approx(so3.IDENTITY, abs=1e-7)


# --- roll, pitch, yaw


@given(quaternions)
def test_roll_pitch_yaw_give_back_the_rotation(q):
    roll, pitch, yaw = so3.as_rpy(q)
    # Within 1e-12 rad of gimbal lock, the ignored roll shows.
    assert_same_rotation(so3.from_rpy(roll, pitch, yaw), q, 5e-12)
    assert abs(pitch) <= math.pi / 2
    assert abs(roll) <= math.pi and abs(yaw) <= math.pi


@given(st.floats(-12.0, -3.0), signs, components, components)
def test_roll_pitch_yaw_keep_all_digits_next_to_gimbal_lock(power, sign, roll, yaw):
    q = so3.from_rpy(3.0 * roll, sign * (math.pi / 2 - 10.0 ** power), 3.0 * yaw)
    assert_same_rotation(so3.from_rpy(*so3.as_rpy(q)), q, 5e-12 if power < -11.5 else 3e-15)


@pytest.mark.parametrize(('pitch', 'yaw'), [(math.pi / 2, 0.2), (-math.pi / 2, 0.8)])
def test_roll_is_zero_in_gimbal_lock(pitch, yaw):
    q = so3.from_rpy(0.3, pitch, 0.5)
    assert so3.as_rpy(q) == pytest.approx((0.0, pitch, yaw), abs=1e-15)


def test_yaw_turns_x_towards_y():
    assert so3.rotate(so3.from_rpy(0.0, 0.0, math.pi / 2), (1.0, 0.0, 0.0)) == pytest.approx(
        (0.0, 1.0, 0.0), abs=1e-15)


# --- slerp


@given(quaternions, quaternions, ratios)
def test_slerp_stays_on_the_sphere(a, b, ratio):
    assert math.hypot(*so3.slerp(a, b, ratio)) == pytest.approx(1.0, abs=1e-14)


@given(quaternions, quaternions)
def test_slerp_begins_at_the_first_and_ends_at_the_second(a, b):
    assert_same_rotation(so3.slerp(a, b, 0.0), a, 1e-14)
    assert_same_rotation(so3.slerp(a, b, 1.0), b, 1e-14)


@given(quaternions, axes, angles, signs, ratios)
def test_slerp_goes_the_short_way_at_constant_speed(a, axis, angle, sign, ratio):
    assume(angle < math.pi - 1e-9)
    b = so3.multiply(a, about(axis, angle, sign))
    expected = so3.multiply(a, about(axis, ratio * angle))
    assert_same_rotation(so3.slerp(a, b, ratio), expected, 3e-15 + 1e-15 * angle)


@given(tiny_quaternions, ratios)
def test_slerp_is_exact_for_the_tiniest_rotation(b, ratio):
    angle = angle_between(so3.IDENTITY, b)
    reached = angle_between(so3.IDENTITY, so3.slerp(so3.IDENTITY, b, ratio))
    assert reached == pytest.approx(ratio * angle, rel=1e-9, abs=1e-30)


@given(quaternions, ratios)
def test_slerp_between_both_signs_of_one_rotation_stays_there(q, ratio):
    assert_same_rotation(so3.slerp(q, tuple(-value for value in q), ratio), q, 1e-15)


# --- scipy as an oracle


@given(quaternions)
def test_matrix_rotation_vector_and_rpy_are_those_of_scipy(q):
    scipy_rotation = Rotation.from_quat(q)
    assert np.array(so3.as_matrix(q)) == pytest.approx(scipy_rotation.as_matrix(), abs=1e-14)
    assert_same_rotation(so3.exp(tuple(scipy_rotation.as_rotvec())), q, 1e-14)
    assert_same_rotation(Rotation.from_rotvec(so3.log(q)).as_quat(), q, 1e-14)
    # Extrinsic, about the fixed axes x, y, z, as URDF has it.
    assert_same_rotation(Rotation.from_euler('xyz', so3.as_rpy(q)).as_quat(), q, 5e-12)


@given(components, components, components)
def test_rpy_gives_the_quaternion_of_scipy(roll, pitch, yaw):
    angles_rad = (3.0 * roll, 1.5 * pitch, 3.0 * yaw)
    assert_same_rotation(
        so3.from_rpy(*angles_rad), Rotation.from_euler('xyz', angles_rad).as_quat(), 1e-14)
    assert so3.as_rpy(so3.from_rpy(*angles_rad)) == pytest.approx(angles_rad, abs=1e-13)


@given(quaternions, quaternions, ratios)
def test_slerp_is_that_of_scipy(a, b, ratio):
    # At half a turn, both ways are equally short, and either is correct.
    assume(angle_between(a, b) < math.pi - 1e-3)
    expected = Slerp([0.0, 1.0], Rotation.from_quat([a, b]))(ratio).as_quat()
    assert_same_rotation(so3.slerp(a, b, ratio), expected, 1e-14)


# --- the sign that tf2 gives


def rotation_of_tf2(matrix):
    """Return the quaternion of a matrix as ``tf2::Matrix3x3::getRotation`` writes it."""
    m = matrix
    trace = m[0][0] + m[1][1] + m[2][2]
    q = [0.0] * 4
    if trace > 0.0:
        s = math.sqrt(trace + 1.0)
        q[3] = s * 0.5
        s = 0.5 / s
        q[0], q[1], q[2] = ((m[2][1] - m[1][2]) * s, (m[0][2] - m[2][0]) * s,
                            (m[1][0] - m[0][1]) * s)
        return q
    i = ((2 if m[1][1] < m[2][2] else 1) if m[0][0] < m[1][1]
         else (2 if m[0][0] < m[2][2] else 0))
    j, k = (i + 1) % 3, (i + 2) % 3
    s = math.sqrt(m[i][i] - m[j][j] - m[k][k] + 1.0)
    q[i] = s * 0.5
    s = 0.5 / s
    q[3], q[j], q[k] = ((m[k][j] - m[j][k]) * s, (m[j][i] + m[i][j]) * s,
                        (m[k][i] + m[i][k]) * s)
    return q


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4), signs)
def test_sign_is_that_of_the_quaternion_that_tf2_makes_of_the_matrix(values, sign):
    assume(math.hypot(*values) > 0.1)
    q = tuple(sign * value for value in so3.normalize(values))
    assume(not is_next_to_a_tie(q))
    assert so3.with_tf2_sign(q) == pytest.approx(rotation_of_tf2(so3.as_matrix(q)), abs=1e-8)


@given(quaternions)
def test_sign_of_q_is_that_of_its_negative(q):
    assume(not is_next_to_a_tie(q))
    signed = so3.with_tf2_sign(q)
    assert signed == so3.with_tf2_sign(tuple(-value for value in q))
    assert so3.has_tf2_sign(*signed)
    assert not so3.has_tf2_sign(*(-value for value in signed))
    assert_same_rotation(signed, q, 1e-15)


@pytest.mark.parametrize(('q', 'sign'), [
    ((0.0, 0.0, 0.0, 1.0), 1.0),
    ((0.0, 0.0, -0.6, 0.8), 1.0),
    ((-0.1, 0.7, -0.7, 0.1), 1.0),   # next to a tie: the first of the two
    ((0.0, 0.0, -0.99, 0.14106735979665894), -1.0),
    ((0.0, -0.8, 0.44, 0.40792156108742274), -1.0),
    ((-1.0, 0.0, 0.0, 0.0), -1.0),
    ((0.9, -0.3, -0.3, -0.1), 1.0),
])
def test_sign_by_hand(q, sign):
    assert so3.with_tf2_sign(q) == tuple(sign * value for value in q)


@given(st.lists(quaternions, min_size=1, max_size=5))
def test_signs_of_many_are_those_of_each(many):
    signed = so3.with_tf2_sign_many(np.array(many))
    assert [tuple(q) for q in signed.tolist()] == [so3.with_tf2_sign(q) for q in many]
