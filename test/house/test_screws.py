# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Twists and wrenches, transformed between frames; exp and log."""

import math

from hypothesis import assume, given, strategies as st
import numpy as np
import pytest
from scipy.linalg import expm
from strategies import (
    about,
    assert_same_pose,
    axes,
    components,
    length,
    MILLION,
    poses,
    ratios,
    signs,
    tiny_angles,
    twists,
    vectors,
)
from tf_tree_py import screws
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.screws import adjoint, carry

six_numbers = st.tuples(*[st.floats(-100.0, 100.0, allow_subnormal=False)] * 6)


def skew(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@given(poses, six_numbers)
def test_adjoint_is_the_matrix_of_carry(pose, screw):
    rotation = np.array(so3.as_matrix(pose[3:]))
    matrix = np.block([[rotation, skew(pose[:3]) @ rotation], [np.zeros((3, 3)), rotation]])
    reach = 1.0 + math.hypot(*pose[:3])
    assert carry(pose, screw) == pytest.approx(matrix @ screw, abs=1e-12 * reach * 200)
    assert adjoint(pose) == pytest.approx(matrix, abs=1e-14 * reach)


@given(poses, poses, six_numbers)
def test_carrying_twice_is_carrying_by_the_product(a_T_b, b_T_c, screw):
    reach = (1.0 + math.hypot(*a_T_b[:3])) * (1.0 + math.hypot(*b_T_c[:3]))
    once = carry(se3.compose(a_T_b, b_T_c), screw)
    assert carry(a_T_b, carry(b_T_c, screw)) == pytest.approx(once, abs=1e-11 * reach)


@given(poses, six_numbers, six_numbers)
def test_the_power_of_a_wrench_is_the_same_in_every_frame(pose, twist, wrench):
    def power(twist, wrench):
        return float(np.dot(twist[:3], wrench[3:]) + np.dot(twist[3:], wrench[:3]))

    reach = 1.0 + math.hypot(*pose[:3])
    assert power(carry(pose, twist), carry(pose, wrench)) == pytest.approx(
        power(twist, wrench), abs=1e-9 * reach)


# --- exp and log


def hat(twist):
    """Return the (4, 4) matrix whose exponential is the pose."""
    vx, vy, vz, wx, wy, wz = twist
    return np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0]])


@given(twists)
def test_log_gives_back_the_twist(twist):
    angle = math.hypot(*twist[3:])
    assume(angle < math.pi - 1e-9)
    back = screws.log(screws.exp(twist))
    assert math.dist(back[:3], twist[:3]) <= 1e-14 * length(twist)
    assert math.dist(back[3:], twist[3:]) <= 1e-14 * angle


@given(poses)
def test_exp_gives_back_the_pose(pose):
    assert_same_pose(screws.exp(screws.log(pose)), pose, 1e-14, length(pose))


@given(axes, tiny_angles, signs, vectors)
def test_tiny_rotations_far_from_the_origin_survive_exp_and_log(axis, angle, sign, direction):
    """A log that ignores small angles is metres off here: 1e-6 rad, 1e6 m."""
    x, y, z = (MILLION + abs(value) for value in direction)
    pose = (x, y, z, *about(axis, angle, sign))
    twist = screws.log(pose)
    assert math.hypot(*twist[3:]) == pytest.approx(angle, rel=1e-12)
    assert_same_pose(screws.exp(twist), pose, 1e-15, length(pose))
    # To first order v = t - w x t / 2; the second-order term is below 1e-12 of it.
    expected = np.array(pose[:3]) - 0.5 * np.cross(twist[3:], pose[:3])
    assert math.dist(twist[:3], expected) <= 1e-12 * length(pose)


@given(st.tuples(*[components] * 6))
def test_exp_is_the_matrix_exponential(twist):
    assert se3.as_matrix(screws.exp(twist)) == pytest.approx(expm(hat(twist)), abs=1e-14)


@given(twists, ratios)
def test_a_constant_twist_goes_on_where_it_was(twist, ratio):
    first, second = (tuple(part * value for value in twist) for part in (ratio, 1.0 - ratio))
    both = se3.compose(screws.exp(first), screws.exp(second))
    assert_same_pose(both, screws.exp(twist), 1e-14, length(twist))


@pytest.mark.parametrize('angle', [0.1, 1e-3])
def test_exp_and_log_are_smooth_where_a_series_ends(angle):
    below, above = ((MILLION, -MILLION, MILLION, 0.0, angle * (1.0 + side), 0.0)
                    for side in (-1e-15, 1e-15))
    assert math.dist(screws.exp(below), screws.exp(above)) < 3e-15 * MILLION
    assert math.dist(screws.log((*below[:3], *so3.exp(below[3:]))),
                     screws.log((*above[:3], *so3.exp(above[3:])))) < 3e-15 * MILLION


def test_screw_about_z_climbs_along_z():
    assert screws.exp((0.0, 0.0, 2.0, 0.0, 0.0, math.pi)) == pytest.approx(
        (0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0), abs=1e-15)


def test_half_a_circle_ends_at_its_diameter():
    # Forward at 1 m/s, turning left: the radius is 1/pi.
    pose = screws.exp((1.0, 0.0, 0.0, 0.0, 0.0, math.pi))
    assert pose[:3] == pytest.approx((0.0, 2.0 / math.pi, 0.0), abs=1e-15)
