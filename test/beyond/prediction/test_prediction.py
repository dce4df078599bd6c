# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Predictions: the pose, the horizon, the earlier errors; plain lookups never predict."""

import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, screws
from tf_tree_py.beyond.uncertainty.learning import Learnt
from tf_tree_py.core import (
    ConnectivityException,
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LookupException,
    Pose,
    se3,
)
from tf_tree_py.core.geometry import so3

SECOND = 1_000_000_000
MS = 1_000_000
NOW = 4 * SECOND
# Without accelerations, the covariance is that of the earlier predictions.
STEADY = {'base': (0.0,) * 6}


def steady(stamp):
    """Return a pose on a helix: a constant twist."""
    return Pose._make(screws.exp(tuple(value * stamp / SECOND for value in (
        0.8, 0.1, 0.05, 0.02, -0.1, 0.6))))


def wandering(stamp):
    """Return a pose on the floor with continuously changing speed and turn rate."""
    t = stamp / SECOND
    return Pose.from_xyz_rpy(x=t + 0.3 * np.sin(2.0 * t), y=0.2 * np.sin(3.0 * t),
                             yaw=0.7 * np.sin(1.7 * t))


def driven(motion, upto=NOW, **extra):
    buffer = BufferCore(cache_time=100 * SECOND)
    buffer.insert('base', 'camera', 0, Pose.from_xyz_rpy(x=0.3, z=1.0, pitch=0.3), static=True)
    for stamp in range(20 * MS, upto + 1, 20 * MS):
        buffer.insert('odom', 'base', stamp, motion(stamp), **extra)
    return buffer


def test_constant_twist_goes_on_exactly():
    buffer = driven(steady)
    found = buffer.predict('odom', 'camera', NOW + 150 * MS, 200 * MS)
    truth = steady(NOW + 150 * MS) @ buffer.lookup('base', 'camera')
    assert_same_pose(found.pose, truth, tolerance=1e-9)
    assert (found.stamp, found.beyond) == (NOW + 150 * MS, 150 * MS)
    sure = buffer.predict('odom', 'camera', NOW + 150 * MS, 200 * MS, acceleration=STEADY)
    assert sure.pose == found.pose and np.abs(sure.covariance).max() < 1e-8
    back = buffer.predict('camera', 'odom', NOW + 150 * MS, 200 * MS)
    assert_same_pose(back.pose, truth.inverse(), tolerance=1e-9)


def test_lookups_never_go_beyond_the_data():
    buffer = driven(steady)
    buffer.predict('odom', 'base', NOW + MS, SECOND)
    for ask in (buffer.lookup, buffer.lookup_at, buffer.lookup_uncertain, buffer.lookup_budget):
        with pytest.raises(FutureExtrapolationException):
            ask('odom', 'base', NOW + 1)
    with pytest.raises(FutureExtrapolationException):
        buffer.lookup_uncertain_many('odom', 'base', [NOW + 1])


def test_where_there_is_data_it_is_looked_up():
    buffer = driven(wandering, covariance=np.eye(6) * 1e-8)
    for stamp in (0, NOW, NOW - 7 * MS):
        found = buffer.predict('odom', 'camera', stamp, SECOND)
        pose, covariance = buffer.lookup_uncertain('odom', 'camera', stamp)
        assert found.pose == pose and found.beyond == 0
        np.testing.assert_array_equal(found.covariance, covariance)
    assert buffer.predict('base', 'camera', 9 * SECOND, SECOND).beyond == 0
    assert buffer.predict('odom', 'odom', 9 * SECOND, SECOND).pose == Pose()


def test_no_edge_is_taken_beyond_the_horizon():
    buffer = driven(steady)
    assert buffer.predict('odom', 'base', NOW + 100 * MS, 100 * MS).beyond == 100 * MS
    with pytest.raises(FutureExtrapolationException, match=(
            r'100 ms older.*odom -> base.*from frame \[base\] to frame \[odom\]\.\n.*'
            'beyond the horizon of the prediction, 90 ms')):
        buffer.predict('odom', 'base', NOW + 100 * MS, 90 * MS)


def test_only_edges_without_data_are_predicted():
    buffer = driven(wandering)
    buffer.insert('map', 'odom', NOW + SECOND, Pose(y=2.0))
    buffer.insert('map', 'odom', NOW - SECOND, Pose(y=1.0))
    found = buffer.predict('map', 'base', NOW + 100 * MS, SECOND)
    alone = buffer.predict('odom', 'base', NOW + 100 * MS, SECOND)
    assert found.beyond == 100 * MS
    assert_same_pose(found.pose, Pose(y=1.55) @ alone.pose, tolerance=1e-9)
    np.testing.assert_allclose(found.covariance, alone.covariance)


@pytest.mark.parametrize('ahead', [50 * MS, 200 * MS, 400 * MS])
def test_covariance_is_that_of_the_errors(ahead):
    """
    The mean of the squared errors, normalised, is about three: three numbers on the floor.

    It is less if the robot may stop.
    """
    squares, earlier = [], []
    buffer = driven(wandering, upto=SECOND)
    for stamp in range(SECOND + 20 * MS, 16 * SECOND, 20 * MS):
        buffer.insert('odom', 'base', stamp, wandering(stamp))
        if stamp < 3 * SECOND or stamp % (300 * MS):
            continue
        for limits, found in ((None, squares), (STEADY, earlier)):
            ahead_of = buffer.predict('odom', 'base', stamp + ahead, SECOND, acceleration=limits)
            found.append(normalised(ahead_of, wandering(stamp + ahead)))
    assert 1.0 < np.mean(squares) <= np.mean(earlier) and 2.5 < np.mean(earlier) < 3.5


def normalised(found, truth):
    """Return the square of a prediction's error on the floor, relative to its covariance."""
    off = np.array([*np.subtract(truth[:3], found.pose[:3]), *so3.log(
        so3.multiply(truth[3:], so3.conjugate(found.pose[3:])))])[[0, 1, 5]]
    return off @ np.linalg.solve(found.covariance[np.ix_([0, 1, 5], [0, 1, 5])], off)


def test_covariance_grows():
    buffer = driven(wandering)
    sizes = [np.trace(buffer.predict('odom', 'base', NOW + ahead * MS, SECOND).covariance)
             for ahead in (0, 1, 10, 50, 100, 200, 400)]
    # Nearly nothing of this motion looks like noise.
    assert sizes[0] < 1e-18 and (np.diff(sizes) > 0.0).all()


@pytest.mark.parametrize('ahead', [12, 33, 50, 61, 222, 400])
def test_variance_between_two_rungs_is_at_most_a_little_too_large(ahead):
    """At a constant acceleration a, a prediction h ahead is off by a (h^2 + 0.1 s h) / 2."""
    buffer = BufferCore()
    for stamp in range(2 * MS, NOW + 1, 2 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=0.4 * (stamp / SECOND)**2))
    found = buffer.predict('odom', 'base', NOW + ahead * MS, SECOND, acceleration=STEADY)
    h = ahead * 1e-3
    assert 0.999 < found.covariance[0, 0] / (0.4 * (h * h + 0.1 * h))**2 < 1.04


@pytest.mark.parametrize('ahead', [10, 30, 50, 100])
def test_change_within_a_period_is_that_of_an_acceleration(ahead):
    """Nothing is known there, but how the error of an acceleration grows."""
    buffer = BufferCore()
    for stamp in range(0, 12 * SECOND + 1, 100 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=0.4 * (stamp / SECOND)**2))
    found = buffer.predict('odom', 'base', 12 * SECOND + ahead * MS, SECOND, acceleration=STEADY)
    h = ahead * 1e-3
    assert 0.95 < found.covariance[0, 0] / (0.4 * (h * h + 0.1 * h))**2 < 1.3


@pytest.mark.parametrize('step', [20 * MS, 470 * MS])
def test_what_is_kept_of_earlier_predictions_changes_no_answer(step):
    """A buffer with many predictions returns the same results as one without."""
    buffer = driven(wandering, upto=200 * MS)
    for stamp in range(220 * MS, 25 * SECOND, step):
        buffer.insert('odom', 'base', stamp, wandering(stamp))
        asked = 'odom', 'camera', stamp + 20 * MS + stamp % (50 * MS), SECOND
        found = buffer.predict(*asked)
        if stamp % 9 == 0:
            np.testing.assert_allclose(
                found.covariance, buffer.snapshot().predict(*asked).covariance, rtol=1e-9)
    buffer.clear()
    assert not buffer.intake.tree.companion(Learnt).by_child


def test_covariance_of_the_newest_pose_is_carried_on():
    covariance = np.diag([1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4])
    buffer = driven(steady, covariance=covariance)
    found = buffer.predict('odom', 'base', NOW + 500 * MS, SECOND, acceleration=STEADY)
    way = np.linalg.norm(np.subtract(found.pose[:2], buffer.lookup('odom', 'base')[:2]))
    assert np.trace(found.covariance[:2, :2]) == pytest.approx(2e-4 + 1e-4 * way ** 2, rel=1e-6)


def test_too_little_history_is_as_unsure_as_the_motion_is_long():
    buffer = BufferCore()
    buffer.insert('odom', 'base', SECOND, Pose())
    with pytest.raises(
            ExtrapolationException, match='requires two samples, and the edge odom -> b'):
        buffer.predict('odom', 'base', SECOND + 1, SECOND)
    buffer.insert('odom', 'base', SECOND + 100 * MS, Pose(x=0.1))
    found = buffer.predict('odom', 'base', SECOND + 300 * MS, SECOND, acceleration=STEADY)
    assert found.pose.x == pytest.approx(0.3)
    # The noise may be as large as the motion of a period.
    assert found.covariance[0, 0] == pytest.approx(0.2**2 + 0.1**2)
    assert not found.covariance[1:, 1:].any()


def test_errors_of_long_ago_are_forgotten():
    """It wandered for 4 s, and then drove straight for 12 s, in a buffer that keeps all."""
    buffer = driven(wandering)
    for stamp in range(NOW + 20 * MS, 4 * NOW, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=stamp / SECOND))
    found = buffer.predict('odom', 'base', 4 * NOW + 100 * MS, SECOND, acceleration=STEADY)
    assert np.abs(found.covariance).max() < 1e-12


@pytest.mark.parametrize('period', [10, 100, 500])
def test_errors_within_a_period_are_those_of_the_noise(period):
    """The prediction is (1 + u) x0 - u x1, with u = h / l: l is 0.1 s, or one period."""
    rng, newest = np.random.default_rng(4), 30 * SECOND
    buffer = BufferCore(cache_time=100 * SECOND)
    for stamp in range(0, newest + 1, period * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=rng.normal(scale=0.01)))
    noise = buffer.edge_noise('base').covariance[0, 0]
    assert noise == pytest.approx(0.01**2, rel=0.5)
    for ahead in (1, period // 2, period):
        u = ahead / max(period, 100)
        found = buffer.predict('odom', 'base', newest + ahead * MS, SECOND, acceleration=STEADY)
        assert found.covariance[0, 0] == pytest.approx(((1 + u)**2 + u * u) * noise, rel=0.3)
    assert buffer.predict('odom', 'base', newest, SECOND).covariance[0, 0] == pytest.approx(noise)


def test_gyroscope_leads_on():
    """The turn rate changes after the last pose, and the gyroscope has measured it."""
    rate = 0.0, 0.0, 1.5
    buffer = BufferCore(cache_time=100 * SECOND)
    for stamp in range(0, NOW + 1, 50 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=stamp / SECOND))
    stamps = np.arange(0, NOW + 300 * MS, 5 * MS)
    rates = np.where((stamps > NOW)[:, None], rate, (0.0, 0.0, 0.0))
    blind = buffer.predict('odom', 'base', NOW + 200 * MS, SECOND)
    buffer.aid('base', stamps, rates)
    found = buffer.predict('odom', 'base', NOW + 200 * MS, SECOND)
    truth = Pose(x=4.0) @ Pose._make(screws.exp((0.2, 0.0, 0.0, 0.0, 0.0, 0.3)))
    assert se3.distance(blind.pose, truth)[1] > 0.29
    off = se3.distance(found.pose, truth)
    assert off[0] < 2e-3 and off[1] < 5e-3
    # Beyond the gyroscope, it continues like the poses.
    assert buffer.predict('odom', 'base', NOW + 500 * MS, SECOND).beyond == 500 * MS


def test_edge_that_was_hung_elsewhere_is_judged_by_its_present_parent():
    buffer = driven(steady)
    for stamp in range(NOW + 20 * MS, NOW + SECOND, 20 * MS):
        buffer.insert('map', 'base', stamp, Pose(x=stamp / SECOND), strict=False)
    newest = NOW + 980 * MS
    found = buffer.predict('map', 'base', newest + 100 * MS, SECOND)
    assert found.pose.x == pytest.approx((newest + 100 * MS) / SECOND)
    # It turned only below its former parent.
    assert found.covariance[0, 0] > 1e-4 and np.abs(found.covariance[1:]).max() < 1e-12


def test_errors_are_told():
    buffer = driven(steady)
    for horizon in (0, -5, 0.1, 'long', None):
        with pytest.raises(InvalidArgumentException, match='positive number of nanoseconds'):
            buffer.predict('odom', 'base', NOW, horizon)
    with pytest.raises(LookupException, match='does not exist'):
        buffer.predict('odom', 'nobody', NOW + 1, SECOND)
    buffer.insert('moon', 'rover', 1, Pose())
    with pytest.raises(ConnectivityException):
        buffer.predict('odom', 'rover', NOW + 1, SECOND)
    with pytest.raises(ExtrapolationException, match='into the past'):
        buffer.predict('odom', 'base', 1, SECOND)


@pytest.mark.parametrize('samples', [3, 200])
@pytest.mark.parametrize('size', [1e76, 1e160])
def test_error_that_is_too_large_is_refused_with_its_edge(samples, size):
    buffer = BufferCore()
    for number in range(samples):
        buffer.insert('odom', 'base', number * 20 * MS, Pose(x=size * (number % 7)))
    for _ in range(2):
        with pytest.raises(ExtrapolationException, match='odom -> base .* too far .*samples'):
            buffer.predict('odom', 'base', samples * 20 * MS, SECOND)


# --- scenes

@pytest.mark.parametrize(('hertz', 'last'), [(1, 200), (50, 15), (10, 15)])
def test_noise_that_is_not_known_yet_is_not_zero(hertz, last):
    """GPS, of which there are never enough samples, and the first samples of any edge."""
    rng, period, inside, asked = np.random.default_rng(1), SECOND // hertz, 0, 0
    for _ in range(1 if hertz == 1 else 20):
        buffer = BufferCore()
        for number in range(last):
            buffer.insert('map', 'gps', number * period, Pose(x=rng.normal()))
            if number >= 5:
                found = buffer.predict('map', 'gps', number * period + period // 100, SECOND)
                inside += abs(found.pose.x) < 1.96 * np.sqrt(found.covariance[0, 0])
                asked += 1
    assert 0.8 * asked < inside and found.covariance[0, 0] < 4.0


@pytest.mark.parametrize('far', [1.0, 50.0])
@pytest.mark.parametrize('hertz', [10, 50])
def test_first_fix_of_a_localisation_that_rested_is_predicted(hertz, far):
    buffer, period = BufferCore(), SECOND // hertz
    for number in range(10 * hertz + 30):
        jumped = number >= 10 * hertz
        buffer.insert('map', 'odom', number * period, Pose(x=far if jumped else 0.0))
        for ahead in ((200 * MS, 5 * SECOND) if jumped else ()):
            covariance = buffer.predict(
                'map', 'odom', number * period + ahead, 6 * SECOND).covariance
            assert np.isfinite(covariance).all() and np.linalg.eigvalsh(covariance)[0] >= -1e-12


def test_second_sample_with_a_new_parent_is_enough():
    buffer = BufferCore()
    buffer.insert('world', 'hand', 0, Pose(), static=True)
    for number in range(100):
        buffer.insert('world', 'cup', number * 20 * MS, Pose(x=0.01 * number))
    for number in range(100, 140):
        buffer.insert('hand', 'cup', number * 20 * MS, Pose(x=0.01 * number))
        asked = 'world', 'cup', number * 20 * MS + 10 * MS, SECOND
        if number == 100:
            with pytest.raises(ExtrapolationException, match='hand -> cup has one with this'):
                buffer.predict(*asked)
        else:
            assert buffer.predict(*asked).pose.x == pytest.approx(0.01 * number + 0.005)


def test_snapshot_predicts_too():
    buffer = driven(wandering)
    found = buffer.predict('odom', 'base', NOW + 100 * MS, SECOND)
    assert buffer.snapshot().predict('odom', 'base', NOW + 100 * MS, SECOND).pose == found.pose
