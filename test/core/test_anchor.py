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

"""A relocalisation as a live anchor: what is believed, and what is published."""

import math

import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py.core import from_seconds, InvalidArgumentException, Pose, se3
from tf_tree_py.core.anchor import Anchor, GATE, Sighting
from tf_tree_py.core.geometry.blend import Limits

SECOND = 1_000_000_000
LIMITS = Limits(from_seconds(0.3), 0.2, 0.1, 0.0)
SURE = np.diag([1e-4] * 3 + [1e-5] * 3)
NONE = np.zeros((6, 6))
MAP_T_ODOM = Pose.from_xyz_rpy(x=3.0, y=-1.0, yaw=0.5)
ODOM_T_CAMERA = Pose.from_xyz_rpy(x=40.0, y=20.0, z=1.0, yaw=1.0)
AWAY = Pose.from_xyz_rpy(x=2.0, yaw=1.0)


def sighting(stamp, map_T_odom=MAP_T_ODOM, covariance=SURE, spread=NONE):
    return Sighting(stamp, map_T_odom @ ODOM_T_CAMERA, covariance, ODOM_T_CAMERA, spread)


def anchored(**options):
    anchor = Anchor(LIMITS, **options)
    anchor.take(sighting(0))
    assert anchor.take(sighting(SECOND)).accepted
    return anchor


def test_nothing_is_published_before_two_agree():
    anchor = Anchor(LIMITS)
    assert anchor.publish(0) is None
    assert not anchor.take(sighting(0, AWAY)).accepted
    assert not anchor.take(sighting(0)).accepted and anchor.publish(1) is None
    assert anchor.take(sighting(SECOND)).accepted
    assert_same_pose(anchor.publish(SECOND), MAP_T_ODOM, 1e-9, reach=50.0)


def test_outlier_is_refused_and_changes_nothing():
    anchor = anchored()
    before = anchor.held
    verdict = anchor.take(sighting(2 * SECOND, AWAY))
    assert not verdict.accepted and verdict.distance > GATE
    assert anchor.held == before


def test_four_in_a_row_that_agree_are_believed_as_after_a_kidnapping():
    anchor = anchored()
    verdicts = [anchor.take(sighting(number * SECOND, AWAY)).accepted for number in range(2, 6)]
    assert verdicts == [False, False, False, True]
    assert_same_pose(anchor.held.map_T_odom, AWAY, 1e-9, reach=50.0)


def test_scattered_outliers_are_never_believed():
    anchor, rng = anchored(), np.random.default_rng(2)
    for number in range(2, 40):
        away = Pose.from_xyz_rpy(*rng.uniform(-20, 20, 2), yaw=rng.uniform(-3, 3))
        assert not anchor.take(sighting(number * SECOND, away)).accepted


def test_it_is_the_kalman_filter_where_all_is_linear():
    anchor = Anchor(LIMITS, drift=(0.1, 1e-6))
    still = Pose()
    variance, estimate = 0.04, 0.0
    for number, seen in enumerate([0.0, 0.1, -0.2, 0.15]):
        anchor.take(Sighting(number * SECOND, Pose(x=seen), 0.04 * np.eye(6), still, NONE))
        if number:
            variance += 0.01
            gain = variance / (variance + 0.04)
            estimate, variance = estimate + gain * (seen - estimate), (1 - gain) * variance
    assert anchor.held.map_T_odom[0] == pytest.approx(estimate, abs=1e-6)
    assert anchor.held.covariance[0, 0] == pytest.approx(variance, rel=1e-6)


def test_good_poses_pass_the_gate_as_often_as_their_covariance_says():
    rng, accepted = np.random.default_rng(4), 0
    anchor = anchored(drift=(1e-3, 1e-3))
    spread = np.diag([4e-4] * 3 + [1e-5] * 3)
    for number in range(2, 600):
        x, y, z, roll, pitch, yaw = rng.normal(size=6) * np.sqrt(np.diag(SURE + spread))
        there = MAP_T_ODOM @ ODOM_T_CAMERA
        seen = Pose.from_parts(np.add(there[:3], (x, y, z)),
                               (Pose.from_xyz_rpy(0, 0, 0, roll, pitch, yaw) @ there)[3:])
        accepted += anchor.take(Sighting(number * SECOND, seen, SURE, ODOM_T_CAMERA,
                                         spread)).accepted
    assert 590 <= accepted <= 598


def test_what_was_published_stays_and_the_camera_is_no_faster_than_stated():
    anchor = anchored()
    published, rng = {}, np.random.default_rng(3)
    for number in range(400):
        stamp = SECOND + number * SECOND // 50
        if number % 25 == 0:
            x, y, yaw = rng.normal(0.0, (0.05, 0.05, 0.01))
            anchor.take(sighting(stamp - SECOND // 3,
                                 Pose.from_xyz_rpy(x=x, y=y, yaw=yaw) @ MAP_T_ODOM,
                                 100.0 * SURE))
        published[stamp] = anchor.publish(stamp)
    poses = np.array([pose @ ODOM_T_CAMERA for pose in published.values()])
    gone, turned = se3.distance_many(poses[:-1], poses[1:])
    assert 0.01 < gone.max() * 50 <= LIMITS.max_speed + 1e-9
    assert turned.max() * 50 <= LIMITS.max_turn_rate + 1e-9
    assert all(anchor.publish(stamp) == pose for stamp, pose in published.items())


def test_what_is_not_finite_is_refused_with_a_reason():
    with pytest.raises(InvalidArgumentException, match='not finite'):
        Anchor(LIMITS).take(sighting(0, Pose(x=math.nan)))
