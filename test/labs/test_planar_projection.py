# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math

from hypothesis import assume, given, strategies as st
import pytest
from strategies import angle_between, components, MILLION, poses, quaternions
from tf_tree_py.core.geometry import so3
from tf_tree_py.labs.planar import lift, project

headings = st.one_of(st.sampled_from([0.0, math.pi, -math.pi / 2]), st.floats(-math.pi, math.pi))
distances = st.floats(-MILLION, MILLION, allow_subnormal=False)
planar_poses = st.tuples(distances, distances, headings)


@given(planar_poses)
def test_projection_undoes_lifting(planar):
    (x, y, yaw), residual = project(lift(planar))
    assert (x, y, residual) == (*planar[:2], (0.0, 0.0))
    assert -math.pi < yaw <= math.pi
    assert abs(math.remainder(yaw - planar[2], math.tau)) <= 3e-15


@given(poses)
def test_projection_keeps_the_position_and_returns_the_height(pose):
    (x, y, _), residual = project(pose)
    assert (x, y, residual.z) == pose[:3]


@given(quaternions)
def test_tilt_is_the_angle_between_the_two_z_axes(q):
    _, residual = project((0.0, 0.0, 0.0, *q))
    x, y, z = so3.rotate(q, (0.0, 0.0, 1.0))
    assert 0.0 <= residual.tilt <= math.pi
    assert residual.tilt == pytest.approx(math.atan2(math.hypot(x, y), z), abs=1e-14)


@given(quaternions, components)
def test_projected_yaw_is_the_nearest_of_all(q, offset):
    (_, _, yaw), residual = project((0.0, 0.0, 0.0, *q))
    assume(residual.tilt < math.pi - 1e-6)
    nearest, other = (angle_between(q, so3.from_rpy(0.0, 0.0, angle))
                      for angle in (yaw, yaw + math.pi * offset))
    assert nearest == pytest.approx(residual.tilt, abs=1e-9)
    assert nearest <= other + 1e-9


@given(quaternions, components)
def test_point_above_the_origin_is_misplaced_by_height_times_sine_of_tilt(q, height):
    _, residual = project((0.0, 0.0, 0.0, *q))
    x, y, _ = so3.rotate(q, (0.0, 0.0, height))
    assert math.hypot(x, y) == pytest.approx(abs(height) * math.sin(residual.tilt), abs=1e-14)


def test_camera_at_30_cm_on_a_5_degree_ramp_is_2_6_cm_off():
    _, residual = project((0.0, 0.0, 0.0, *so3.from_rpy(0.0, math.radians(5.0), 0.7)))
    assert 0.3 * math.sin(residual.tilt) == pytest.approx(0.026, abs=5e-4)


def test_upside_down_has_no_yaw():
    (_, _, yaw), residual = project((0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0))
    assert yaw == 0.0
    assert residual.tilt == pytest.approx(math.pi)
