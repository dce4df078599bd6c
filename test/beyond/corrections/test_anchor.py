# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A relocalisation as a live anchor: accepted poses and published poses."""

import math

from hypothesis import settings
from inputs import for_each
from memory import bytes_of
import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py.beyond.corrections.anchor import Anchor, GATE, Sighting
from tf_tree_py.beyond.corrections.blend import BlendLimits
from tf_tree_py.core import from_seconds, InvalidArgumentException, Pose, se3
from tf_tree_py.core.geometry import so3

SECOND = 1_000_000_000
LIMITS = BlendLimits(from_seconds(0.3), 0.2, 0.1, 0.0)
SURE = np.diag([1e-4] * 3 + [1e-5] * 3)
NONE = np.zeros((6, 6))
MAP_T_ODOM = Pose.from_xyz_rpy(x=3.0, y=-1.0, yaw=0.5)
ODOM_T_CAMERA = Pose.from_xyz_rpy(x=40.0, y=20.0, z=1.0, yaw=1.0)
SEEDS = round(0.6 * settings().max_examples)
AWAY = Pose.from_xyz_rpy(x=2.0, yaw=1.0)


def sighting(stamp, map_T_odom=MAP_T_ODOM, covariance=SURE, spread=NONE):
    return Sighting(stamp, map_T_odom @ ODOM_T_CAMERA, covariance, ODOM_T_CAMERA, spread)


def anchored(**options):
    anchor = Anchor(LIMITS, **options)
    anchor.update(sighting(0))
    assert anchor.update(sighting(SECOND)).accepted
    return anchor


def test_nothing_is_published_before_two_agree():
    anchor = Anchor(LIMITS)
    assert anchor.publish(0, ODOM_T_CAMERA) is None
    assert not anchor.update(sighting(0, AWAY)).accepted
    assert not anchor.update(sighting(0)).accepted and anchor.publish(1, ODOM_T_CAMERA) is None
    assert anchor.update(sighting(SECOND)).accepted
    assert_same_pose(anchor.publish(SECOND, ODOM_T_CAMERA), MAP_T_ODOM, 1e-9, reach=50.0)


def test_outlier_is_refused_and_changes_nothing():
    anchor = anchored()
    before = anchor.held
    verdict = anchor.update(sighting(2 * SECOND, AWAY))
    assert not verdict.accepted and verdict.distance > GATE
    assert anchor.held == before


def test_four_in_a_row_that_agree_are_believed_as_after_a_kidnapping():
    anchor = anchored()
    verdicts = [anchor.update(sighting(number * SECOND, AWAY)).accepted for number in range(2, 6)]
    assert verdicts == [False, False, False, True]
    assert_same_pose(anchor.held.map_T_odom, AWAY, 1e-9, reach=50.0)


def test_late_sighting_from_before_a_kidnapping_does_not_bring_the_old_estimate_back():
    anchor = anchored()
    for number in (2, 3, 5):
        assert anchor.update(sighting(number * SECOND)).accepted
    for number in range(6, 10):
        anchor.update(sighting(number * SECOND, AWAY))
    assert not anchor.update(sighting(4 * SECOND)).accepted
    assert_same_pose(anchor.held.map_T_odom, AWAY, 1e-9, reach=50.0)


def test_scattered_outliers_are_never_believed():
    anchor, rng = anchored(), np.random.default_rng(2)
    for number in range(2, 40):
        away = Pose.from_xyz_rpy(*rng.uniform(-20, 20, 2), yaw=rng.uniform(-3, 3))
        assert not anchor.update(sighting(number * SECOND, away)).accepted


def test_it_is_the_kalman_filter_where_all_is_linear():
    anchor = Anchor(LIMITS, drift=(0.1, 1e-6))
    still = Pose()
    variance, estimate = 0.04, 0.0
    for number, seen in enumerate([0.0, 0.1, -0.2, 0.15]):
        anchor.update(Sighting(number * SECOND, Pose(x=seen), 0.04 * np.eye(6), still, NONE))
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
        accepted += anchor.update(Sighting(number * SECOND, seen, SURE, ODOM_T_CAMERA,
                                           spread)).accepted
    assert 590 <= accepted <= 598


def test_what_was_published_stays_and_the_camera_is_no_faster_than_stated():
    anchor = anchored()
    published, rng = {}, np.random.default_rng(3)
    for number in range(400):
        stamp = SECOND + number * SECOND // 50
        if number % 25 == 0:
            x, y, yaw = rng.normal(0.0, (0.05, 0.05, 0.01))
            anchor.update(sighting(stamp - SECOND // 3,
                                   Pose.from_xyz_rpy(x=x, y=y, yaw=yaw) @ MAP_T_ODOM,
                                   100.0 * SURE))
        published[stamp] = anchor.publish(stamp, ODOM_T_CAMERA)
    poses = np.array([pose @ ODOM_T_CAMERA for pose in published.values()])
    gone, turned = se3.distance_many(poses[:-1], poses[1:])
    assert 0.01 < gone.max() * 50 <= LIMITS.max_speed + 1e-9
    assert turned.max() * 50 <= LIMITS.max_turn_rate + 1e-9
    assert all(anchor.publish(stamp, ODOM_T_CAMERA) == pose for stamp, pose in published.items())


@for_each(speed=[1.0, 2.0], radius=[None, 3.0])
def test_frame_that_drives_on_is_no_faster_than_stated(speed, radius):
    """Sightings at 1 Hz of an odometry that slips by decimetres and rotates by tens of degrees."""
    def odom_T_base(stamp):
        way = speed * stamp / SECOND
        if radius is None:
            return Pose(x=way)
        yaw = way / radius
        return Pose.from_xyz_rpy(radius * math.sin(yaw), radius * (1.0 - math.cos(yaw)), yaw=yaw)

    for seed in range(SEEDS // 10):
        rng, anchor, map_T_odom = np.random.default_rng(seed), Anchor(LIMITS), Pose()
        steps, before = [], None
        for stamp in range(0, 30 * SECOND, SECOND // 20):
            here = odom_T_base(stamp)
            if not stamp % (10 * SECOND):
                x, y, yaw = (0.6, 0.6, 0.35) * rng.uniform(-1.0, 1.0, 3)
                map_T_odom = map_T_odom @ here @ Pose.from_xyz_rpy(x, y, yaw=yaw) @ here.inverse()
            if not stamp % SECOND:
                anchor.update(Sighting(stamp, map_T_odom @ here, SURE, here, NONE))
            published = anchor.publish(stamp, here)
            if before is not None:
                steps += [math.dist(se3.apply(before, place[:3]), se3.apply(published, place[:3]))
                          for place in (here, odom_T_base(stamp - SECOND // 20))]
            before = published
        allowed = LIMITS.max_speed + LIMITS.max_turn_rate * speed / 20
        assert 0.1 < max(steps) * 20 <= allowed


def test_edge_whose_frame_is_lost_turns_about_its_last_known_place():
    """So the frame is also moved by the turn, times how far it has driven since."""
    anchor, before, fastest = anchored(), None, 0.0
    anchor.publish(SECOND, ODOM_T_CAMERA)
    turned = MAP_T_ODOM @ ODOM_T_CAMERA @ Pose.from_xyz_rpy(yaw=0.5) @ ODOM_T_CAMERA.inverse()
    for number in range(2, 8):
        anchor.update(sighting(number * SECOND, turned))
    for number in range(40):
        here = Pose(y=0.1 * number) @ ODOM_T_CAMERA
        published = anchor.publish(SECOND + number * SECOND // 20, None)
        if before is not None:
            step = 20 * math.dist(se3.apply(before, here[:3]), se3.apply(published, here[:3]))
            assert step <= LIMITS.max_speed + LIMITS.max_turn_rate * 0.1 * number + 1e-9
            fastest = max(fastest, step)
        before = published
    assert fastest > 1.5 * LIMITS.max_speed


def test_after_a_kidnapping_it_says_how_far_it_still_has_to_go():
    anchor = anchored()
    anchor.publish(SECOND, ODOM_T_CAMERA)
    assert anchor.remaining == (0.0, 0.0, 0.0)
    verdicts = [anchor.update(sighting(number * SECOND, AWAY)) for number in range(2, 6)]
    assert [verdict.relocalised for verdict in verdicts] == [False, False, False, True]
    expected = se3.distance(MAP_T_ODOM @ ODOM_T_CAMERA, AWAY @ ODOM_T_CAMERA)
    distance, angle, seconds = anchor.remaining
    assert (distance, angle) == pytest.approx(expected)
    assert distance / LIMITS.max_speed < seconds < 2.0 * distance / LIMITS.max_speed + 1.0
    end = SECOND + round(seconds * SECOND)
    for stamp in range(SECOND, end + 2, SECOND // 10):
        left = anchor.publish(stamp, ODOM_T_CAMERA) and anchor.remaining.seconds
        assert left == pytest.approx((end - stamp) / SECOND, abs=1e-6)
    assert_same_pose(anchor.publish(end + 1, ODOM_T_CAMERA), AWAY, 1e-9, reach=50.0)


@for_each(jump_above=[(1.0, math.inf), (math.inf, 0.1)])
def test_beyond_a_distance_or_an_angle_it_jumps_and_says_so(jump_above):
    anchor = anchored(jump_above=jump_above)
    before = anchor.publish(SECOND, ODOM_T_CAMERA)
    near = anchor.update(sighting(2 * SECOND, Pose(x=0.01) @ MAP_T_ODOM))
    assert near.accepted and near.jump is None
    verdicts = [anchor.update(sighting(number * SECOND, AWAY)) for number in range(3, 7)]
    assert [verdict.jump is None for verdict in verdicts] == [True, True, True, False]
    expected = se3.distance(MAP_T_ODOM @ ODOM_T_CAMERA, AWAY @ ODOM_T_CAMERA)
    assert verdicts[-1].jump == pytest.approx(expected, abs=0.02)
    assert anchor.publish(SECOND, ODOM_T_CAMERA) == before
    assert_same_pose(anchor.publish(SECOND + 1, ODOM_T_CAMERA), AWAY, 1e-9, reach=50.0)


def test_one_jump_is_reported_once_however_many_sightings_follow():
    anchor = anchored(jump_above=(1.0, 0.5))
    anchor.publish(SECOND, ODOM_T_CAMERA)
    verdicts = [anchor.update(sighting(number * SECOND, AWAY)) for number in range(2, 12)]
    assert [verdict.jump is not None for verdict in verdicts] == 3 * [False] + [True] + 6 * [False]
    assert_same_pose(anchor.publish(SECOND + 1, ODOM_T_CAMERA), AWAY, 1e-9, reach=50.0)
    back = [anchor.update(sighting(number * SECOND)).jump is None for number in range(12, 16)]
    assert back == [True, True, True, False]


def test_what_was_published_more_than_a_minute_ago_is_refused():
    """Blends are kept for so long; without them, another value would be returned."""
    anchor, published = anchored(), {}
    for number in range(90):
        stamp = (2 + number) * SECOND
        anchor.update(sighting(stamp, Pose(x=0.01 * (number % 7)) @ MAP_T_ODOM))
        published[stamp] = anchor.publish(stamp, ODOM_T_CAMERA)
    for stamp, pose in published.items():
        if stamp >= 31 * SECOND:
            assert anchor.publish(stamp, ODOM_T_CAMERA) == pose
    for stamp in (0, 2 * SECOND, 31 * SECOND - 1):
        with pytest.raises(InvalidArgumentException, match=f'is known from {31 * SECOND} on'):
            anchor.publish(stamp, ODOM_T_CAMERA)


def test_what_is_not_finite_is_refused_with_a_reason():
    with pytest.raises(InvalidArgumentException, match='must be finite'):
        Anchor(LIMITS).update(sighting(0, Pose(x=math.nan)))


def test_one_that_is_delivered_again_is_no_second_one():
    """For example by two bridges, from a latched topic, or from a bag played in a loop."""
    anchor = Anchor(LIMITS)
    assert not anchor.update(sighting(0)).accepted
    assert anchor.update(sighting(0)) == (False, None, True, False, None) and anchor.held is None
    anchor = anchored()
    before = anchor.held
    verdicts = [anchor.update(sighting(2 * SECOND, AWAY)) for _ in range(9)]
    assert [verdict.repeated for verdict in verdicts] == [False] + 8 * [True]
    assert anchor.held == before
    for number in range(3, 5_500):
        anchor.update(sighting(number * SECOND))
    assert bytes_of(anchor) < 2_200_000
    assert not anchor.update(sighting(498 * SECOND)).repeated
    assert anchor.update(sighting(5_499 * SECOND)).repeated


def test_two_cameras_with_one_stamp_are_two():
    anchor = Anchor(LIMITS)
    anchor.update(sighting(0))
    assert anchor.update(sighting(0, Pose(x=1e-3) @ MAP_T_ODOM)).accepted


def test_what_is_no_covariance_is_refused_with_a_reason():
    for wrong in ({'covariance': -SURE}, {'spread': np.diag([1.0, 1, 1, 1, 1, -1])},
                  {'covariance': np.full((6, 6), np.nan)}):
        with pytest.raises(InvalidArgumentException, match='covariance'):
            Anchor(LIMITS).update(sighting(0, **wrong))


def test_in_the_plane_nothing_but_x_y_and_yaw_moves():
    anchor, rng = Anchor(LIMITS, planar=True), np.random.default_rng(6)
    there = MAP_T_ODOM @ ODOM_T_CAMERA
    for number in range(30):
        x, y, z, roll, pitch, yaw = rng.normal(0.0, 0.003, 6)
        seen = Pose.from_parts(np.add(there[:3], (x, y, 0.5 + z)), (Pose.from_xyz_rpy(
            roll=0.3 + roll, pitch=pitch, yaw=yaw) @ there)[3:])
        anchor.update(Sighting(number * SECOND, seen, SURE, ODOM_T_CAMERA, NONE))
        if anchor.held:
            x, y, z, *q = anchor.held.map_T_odom
            roll, pitch, _ = so3.as_rpy(tuple(q))
            assert max(abs(z), abs(roll), abs(pitch)) < 1e-12
    assert anchor.held.agreed > 25
    here = Pose._make(anchor.held.map_T_odom) @ ODOM_T_CAMERA
    np.testing.assert_allclose(here[:2], there[:2], atol=0.02)


def test_drift_may_grow_with_the_way():
    """While the robot stands, the anchor loses no confidence; after driving, it has less."""
    anchor = Anchor(LIMITS, drift=(0.0, 0.0), drift_by_way=(0.1, 0.01))
    for stamp, x in ((0, 0.0), (SECOND, 0.0), (9 * SECOND, 0.0), (10 * SECOND, 4.0)):
        anchor.update(Sighting(stamp, Pose(x=x), SURE, Pose(x=x), NONE))
        if stamp == 9 * SECOND:
            assert anchor.held.covariance[0, 0] == pytest.approx(SURE[0, 0] / 3, rel=1e-3)
    expected = 1.0 / (1.0 / SURE[0, 0] + 1.0 / (SURE[0, 0] / 3 + 4.0 * 0.1**2))
    assert anchor.held.covariance[0, 0] == pytest.approx(expected, rel=1e-3)


# The covariance of a sighting that says nothing.
UNSURE = np.diag([1e6] * 3 + [1e3] * 3)


def test_turns_of_the_odometry_move_the_frame_by_the_way_that_follows():
    """The integral of the lever's square over a straight way is a third of the way's square."""
    turn, way, seconds = 0.01, 12.0, 20
    anchor = Anchor(LIMITS, drift=(0.0, turn), gate=math.inf)
    for number in range(2):
        anchor.update(Sighting(0, Pose(x=1e-6 * number), 1e-12 * SURE, Pose(), NONE))
    here = Pose(x=way)
    anchor.update(Sighting(seconds * SECOND, here, UNSURE, here, NONE))
    variance = turn**2 * seconds
    for place, expected in (((1, 1), way**2 / 3), ((2, 2), way**2 / 3), ((1, 5), way / 2),
                            ((2, 4), -way / 2), ((5, 5), 1.0), ((0, 0), 0.0)):
        assert anchor.held.covariance[place] == pytest.approx(expected * variance, rel=1e-3,
                                                              abs=1e-3 * variance), place


@for_each(planar=[False, True])
def test_order_in_which_sightings_arrive_does_not_matter(planar):
    """The odometry drifts much between two of them, so an older one is of another place."""
    for seed in range(SEEDS):
        rng, coming, map_T_odom = np.random.default_rng(seed), [], Pose()
        for number in range(30):
            here = Pose.from_xyz_rpy(x=0.1 * number, yaw=0.03 * number)
            x, y, yaw = rng.normal(0.0, (0.02, 0.02, 0.01)).tolist()
            map_T_odom = map_T_odom @ here @ Pose.from_xyz_rpy(x, y, yaw=yaw) @ here.inverse()
            coming.append(Sighting(number * SECOND // 30, map_T_odom @ here, SURE, here, NONE))
        delays = rng.uniform(0.0, 10.0, len(coming)) + np.arange(len(coming))
        late = [0, 1, *[number for number in np.argsort(delays) if number > 1]]
        assert late != sorted(late)
        first, second = (Anchor(LIMITS, (0.12, 0.06), planar=planar) for _ in range(2))
        for number, other in enumerate(late):
            assert first.update(coming[number]).accepted == (number > 0)
            assert second.update(coming[other]).accepted == (number > 0)
        assert_same_pose(first.held.map_T_odom, second.held.map_T_odom, 1e-9, reach=10.0)
        np.testing.assert_allclose(first.held.covariance, second.held.covariance, atol=1e-12)


def test_in_the_plane_nothing_is_known_to_be_off_it():
    """Height, roll and pitch are those of the plane, so they do not drift."""
    anchor = Anchor(LIMITS, drift_by_way=(0.05, 0.02), planar=True)
    for number in range(200):
        here = Pose(x=0.5 * number)
        anchor.update(Sighting(number * SECOND, here, SURE, here, NONE))
    in_plane, off = [0, 1, 5], [2, 3, 4]
    assert not anchor.held.covariance[off].any() and not anchor.held.covariance[:, off].any()
    assert (np.linalg.eigvalsh(anchor.held.covariance[np.ix_(in_plane, in_plane)]) > 0.0).all()


# --- at every rate

SLIP = 0.5


def slipped(rate, seed, seconds=14.0):
    """
    Return the published position of a robot along the slip, and when the slip is accepted.

    It stands still. At 2 s, its odometry jumps by 0.5 m, but sightings still see it where it was.
    """
    rng, anchor, told, believed = np.random.default_rng(seed), Anchor(LIMITS), [], None
    period, seen = round(SECOND / rate), 0
    covariance = np.diag([1e-4] * 3 + [1e-5] * 3)
    for stamp in range(0, round(seconds * SECOND), 20_000_000):
        while seen <= stamp:
            x, y, z = rng.normal(0.0, 0.01, 3).tolist()
            odom = Pose(x=SLIP if seen >= 2 * SECOND else 0.0)
            anchor.update(Sighting(seen, Pose(x, y, z), covariance, odom, NONE))
            seen += period
        if anchor.held and believed is None and anchor.held.map_T_odom[0] < -0.8 * SLIP:
            believed = stamp
        pose = anchor.publish(stamp, ODOM_T_CAMERA)
        if pose is not None and stamp >= 2 * SECOND:
            told.append((stamp, pose[0] + SLIP))
    return np.array(told), believed


@for_each(rate=[1, 2, 10, 30])
def test_at_any_rate_it_goes_to_the_truth_and_never_the_other_way(rate):
    once = 1.5 * (SLIP / LIMITS.max_speed + 0.3) * SECOND
    for seed in range(SEEDS):
        told, believed = slipped(rate, seed)
        assert told[:, 1].max() < SLIP + 0.05 and told[:, 1].min() > -0.05
        late = told[:, 0] > believed + once
        assert late.sum() > 10 and np.abs(told[late, 1]).max() < 0.05
