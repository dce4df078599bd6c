# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

import math

from hypothesis import assume, given, strategies as st
import pytest
from strategies import angle_between, assert_same_pose, components, MILLION, poses, quaternions
from tf_tree_py.core.geometry import se2, se3, so3

headings = st.one_of(st.sampled_from([0.0, math.pi, -math.pi / 2]), st.floats(-math.pi, math.pi))
distances = st.floats(-MILLION, MILLION, allow_subnormal=False)
planar_poses = st.tuples(distances, distances, headings)


def assert_same_planar(a, b, reach):
    assert math.dist(a[:2], b[:2]) <= 3e-15 * max(1.0, reach)
    assert abs(se2.wrap(a[2] - b[2])) <= 3e-15


def reach(*planar):
    return sum(math.hypot(*pose[:2]) for pose in planar)


# --- the group


@given(planar_poses, planar_poses, planar_poses)
def test_composition_is_associative(a, b, c):
    assert_same_planar(se2.compose(se2.compose(a, b), c),
                       se2.compose(a, se2.compose(b, c)), reach(a, b, c))


@given(planar_poses)
def test_identity_changes_nothing(pose):
    assert_same_planar(se2.compose(se2.IDENTITY, pose), pose, 0.0)
    assert_same_planar(se2.compose(pose, se2.IDENTITY), pose, 0.0)


@given(planar_poses)
def test_inverse_undoes_from_both_sides(pose):
    assert_same_planar(se2.compose(pose, se2.inverse(pose)), se2.IDENTITY, reach(pose))
    assert_same_planar(se2.compose(se2.inverse(pose), pose), se2.IDENTITY, reach(pose))


@given(planar_poses, planar_poses, st.tuples(distances, distances))
def test_applying_twice_is_applying_the_product(a, b, point):
    once, twice = se2.apply(se2.compose(a, b), point), se2.apply(a, se2.apply(b, point))
    assert math.dist(once, twice) <= 3e-15 * (reach(a, b) + math.hypot(*point))


def test_yaw_turns_x_towards_y():
    assert se2.apply((1.0, 2.0, math.pi / 2), (3.0, 0.0)) == pytest.approx((1.0, 5.0))


@pytest.mark.parametrize(('angle', 'wrapped'), [
    (0.0, 0.0), (math.pi, math.pi), (-math.pi, math.pi), (3 * math.pi, math.pi),
    (math.tau, 0.0), (-0.1, -0.1), (math.pi + 0.1, 0.1 - math.pi), (100 * math.tau + 1.0, 1.0),
])
def test_wrap_gives_the_same_angle_within_half_a_turn(angle, wrapped):
    assert se2.wrap(angle) == pytest.approx(wrapped, abs=1e-13)
    assert -math.pi < se2.wrap(angle) <= math.pi


@given(planar_poses, planar_poses)
def test_composed_yaw_is_wrapped(a, b):
    assert -math.pi < se2.compose(a, b)[2] <= math.pi
    assert -math.pi < se2.inverse(a)[2] <= math.pi


# --- to and from SE(3)


@given(planar_poses, planar_poses)
def test_lifting_a_product_is_the_product_of_the_lifted(a, b):
    assert_same_pose(se2.lift(se2.compose(a, b)),
                     se3.compose(se2.lift(a), se2.lift(b)), 3e-15, reach(a, b))
    assert_same_pose(se2.lift(se2.inverse(a)), se3.inverse(se2.lift(a)), 3e-15, reach(a))


@given(planar_poses, distances)
def test_projection_takes_back_what_was_lifted(planar, height):
    projected, residual = se2.project(se2.lift(planar, height))
    assert_same_planar(projected, planar, 0.0)
    assert residual == (height, 0.0)


@given(poses)
def test_projection_keeps_the_place_and_tells_the_height(pose):
    (x, y, _), residual = se2.project(pose)
    assert (x, y, residual.z) == pose[:3]


@given(quaternions)
def test_tilt_is_the_angle_between_the_two_z_axes(q):
    _, residual = se2.project((0.0, 0.0, 0.0, *q))
    x, y, z = so3.rotate(q, (0.0, 0.0, 1.0))
    assert 0.0 <= residual.tilt <= math.pi
    assert residual.tilt == pytest.approx(math.atan2(math.hypot(x, y), z), abs=1e-14)


@given(quaternions, components)
def test_projected_yaw_is_the_nearest_of_all(q, offset):
    (_, _, yaw), residual = se2.project((0.0, 0.0, 0.0, *q))
    assume(residual.tilt < math.pi - 1e-6)
    nearest, other = (angle_between(q, so3.from_rpy(0.0, 0.0, angle))
                      for angle in (yaw, yaw + math.pi * offset))
    assert nearest == pytest.approx(residual.tilt, abs=1e-9)
    assert nearest <= other + 1e-9


@given(quaternions, components)
def test_point_above_the_origin_is_misplaced_by_height_times_sine_of_tilt(q, height):
    _, residual = se2.project((0.0, 0.0, 0.0, *q))
    x, y, _ = so3.rotate(q, (0.0, 0.0, height))
    assert math.hypot(x, y) == pytest.approx(abs(height) * math.sin(residual.tilt), abs=1e-14)


def test_camera_at_30_cm_on_a_5_degree_ramp_is_2_6_cm_off():
    _, residual = se2.project((0.0, 0.0, 0.0, *so3.from_rpy(0.0, math.radians(5.0), 0.7)))
    assert 0.3 * math.sin(residual.tilt) == pytest.approx(0.026, abs=5e-4)


def test_upside_down_has_no_yaw():
    (_, _, yaw), residual = se2.project((0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0))
    assert yaw == 0.0
    assert residual.tilt == pytest.approx(math.pi)
