# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Predictions of edges that accelerate, brake and turn: their errors are in the covariance."""

from math import inf, sqrt

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py import BufferCore, screws
from tf_tree_py.beyond.curves.curve import ConstantTwist
from tf_tree_py.beyond.prediction.past import deviations
from tf_tree_py.core import InvalidArgumentException, Pose, se3
from tf_tree_py.core.geometry import so3
from turning_robot import aided, turning

SECOND = 1_000_000_000
MS = 1_000_000
# 95 % of a normal distribution are within so many standard deviations.
INSIDE = 1.96
STEADY = {'base': (0.0,) * 6}


class Drive:
    """A robot that drives along x at a piecewise constant acceleration."""

    def __init__(self, *speeds, acceleration):
        """
        Drive at speeds.

        :param speeds: pairs: from when on, seconds, which speed is wanted.
        """
        self._knots = [(0.0, 0.0, speeds[0][1], 0.0)]
        for time, wanted in speeds[1:]:
            _, speed = self.at(time)
            rate = np.copysign(acceleration, wanted - speed)
            self._knots.append((time, self.at(time)[0], speed, rate))
            reached = time + (wanted - speed) / rate
            self._knots.append((reached, self.at(reached)[0], wanted, 0.0))

    def at(self, seconds):
        """Return the position and the speed."""
        time, place, speed, rate = next(
            knot for knot in reversed(self._knots) if knot[0] <= seconds)
        since = seconds - time
        return place + speed * since + 0.5 * rate * since**2, speed + rate * since

    def __call__(self, stamp):
        """Return the pose at a stamp."""
        return Pose(x=self.at(stamp / SECOND)[0])


def worst(drive, begin, end, ahead, period=20 * MS, cache_time=100 * SECOND, **more):
    """Return the largest error along x of predictions between two times, in deviations."""
    buffer, ratios = BufferCore(cache_time=cache_time), []
    for stamp in range(0, end, period):
        buffer.insert('odom', 'base', stamp, drive(stamp))
        if stamp >= begin:
            found = buffer.predict('odom', 'base', stamp + ahead, SECOND, **more)
            off = found.pose.x - drive(stamp + ahead).x
            ratios.append(abs(off) / sqrt(found.covariance[0, 0]))
    return max(ratios)


# --- braking

@for_each(period=[10 * MS, 33 * MS, 100 * MS], ahead=[50 * MS, 200 * MS, 500 * MS])
def test_first_brake_of_half_a_second_is_covered(period, ahead):
    drive = Drive((0.0, 1.0), (5.0, 0.0), acceleration=2.0)
    assert worst(drive, 4 * SECOND, 6 * SECOND, ahead, period) < INSIDE


@for_each(ahead=[50 * MS, 200 * MS])
def test_harder_first_brake_is_covered_if_its_limit_is_given(ahead):
    drive = Drive((0.0, 1.0), (5.0, 0.0), acceleration=4.0)
    limits = {'base': (4.0, 0.0, 0.0, 0.0, 0.0, 0.0)}
    assert worst(drive, 4 * SECOND, 6 * SECOND, ahead) > INSIDE
    assert worst(drive, 4 * SECOND, 6 * SECOND, ahead, acceleration=limits) < INSIDE


@for_each(ahead=[50 * MS, 200 * MS])
def test_start_is_covered_if_its_limit_is_given(ahead):
    drive = Drive((0.0, 0.0), (5.0, 1.0), acceleration=2.0)
    limits = {'/base': np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 'elsewhere': range(6)}
    assert worst(drive, 4 * SECOND, 6 * SECOND, ahead, acceleration=limits) < INSIDE


def test_noise_free_samples_are_not_certain():
    """It may stop within half a second: 2 m/s^2, from a twist that is 0.05 s old."""
    buffer = BufferCore()
    for stamp in range(0, 4 * SECOND + 1, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(x=stamp / SECOND))
    found = buffer.predict('odom', 'base', 4200 * MS, SECOND)
    assert found.pose.x == pytest.approx(4.2)
    assert found.covariance[0, 0] == pytest.approx((2.0 * (0.04 + 0.02) / 2)**2 / 3)
    # It never left the line, and did not turn.
    assert np.abs(found.covariance[1:]).max() < 1e-12


def test_edge_that_never_moved_is_certain():
    buffer = BufferCore()
    for stamp in range(0, 4 * SECOND + 1, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose.from_xyz_rpy(x=3.0, roll=0.4, yaw=1.0))
    assert np.abs(buffer.predict('odom', 'base', 4500 * MS, SECOND).covariance).max() < 1e-20


# --- turning, in a plane and in space

def integrated(twist_at, end, begin=0.0):
    """Return the motion from one time to another at twists (N, 6) that change over time."""
    step = 1e-4
    times = np.arange(begin, end - 0.5 * step, step) + 0.5 * step
    return se3.compose_chain([tuple(one) for one in screws.exp_many(
        twist_at(times[:, None]) * step).tolist()])


@for_each(axis=range(6), ahead=[0.05, 0.2, 0.5], measured=[0.0, 0.6, 1.0])
def test_errors_are_those_of_an_edge_that_accelerates(axis, ahead, measured):
    """A gyroscope measured the rotation for a part of the time."""
    twist, limits, lag = np.array([1.0, 0.2, -0.1, 0.1, -0.2, 0.7]), np.zeros(6), 0.1
    limits[axis] = 1.5

    def true(times):
        return twist + limits * (times + lag / 2)

    def assumed(times):
        known = np.where(times < measured * ahead, true(times), twist)
        return np.concatenate([np.broadcast_to(twist[:3], known[:, 3:].shape), known[:, 3:]], 1)

    off = np.array(screws.log(se3.compose(
        se3.inverse(integrated(assumed, ahead)), integrated(true, ahead))))
    bounds = sqrt(3.0) * np.array(deviations(
        tuple(twist), limits, inf, lag, ahead, measured * ahead))
    # The bounds are those of the first order.
    assert (np.abs(off) <= 1.1 * bounds + 0.05 * bounds.max() + 1e-12).all()
    if axis < 3 or measured < 1.0:
        assert off[axis] == pytest.approx(bounds[axis], rel=0.1)


@for_each(ahead=[50, 200, 500])
def test_point_far_away_is_covered_and_not_by_much_more_than_needed(ahead):
    buffer, ratios = BufferCore(), []
    buffer.insert('base', 'tip', 0, Pose(x=10.0), static=True)
    for stamp in range(0, 12 * SECOND, 20 * MS):
        buffer.insert('odom', 'base', stamp, turning(stamp / SECOND))
        if stamp > 6 * SECOND:
            found = buffer.predict('odom', 'tip', stamp + ahead * MS, SECOND)
            truth = turning(stamp / SECOND + 1e-3 * ahead) @ Pose(x=10.0)
            across = np.array(so3.rotate(found.pose[3:], (0.0, 1.0, 0.0)))
            off = across @ np.subtract(truth[:3], found.pose[:3])
            ratios.append(off / sqrt(across @ found.covariance[:3, :3] @ across))
    assert np.abs(ratios).max() < INSIDE and sqrt(np.mean(np.square(ratios))) > 0.5


# --- what is learnt

def excess(buffer, stamp):
    """Return the deviation along x that the accelerations add to a prediction, metres."""
    known, steady = (buffer.predict('odom', 'base', stamp, SECOND, acceleration=limits)
                     for limits in (None, STEADY))
    return sqrt(known.covariance[0, 0] - steady.covariance[0, 0])


def test_mean_twist_of_slow_samples_is_older():
    """It is the mean of the last second, in which the edge may have stopped."""
    buffer = BufferCore()
    for second in range(9):
        buffer.insert('odom', 'base', second * SECOND, Pose(x=second))
    assert excess(buffer, 8500 * MS) == pytest.approx(0.5 / sqrt(3))


def test_curve_may_stop_too():
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', ConstantTwist(
        0, 20 * SECOND, Pose(), (1.0, 0.0, 0.0, 0.0, 0.0, 0.5)))
    found = buffer.predict('odom', 'base', 20200 * MS, SECOND)
    assert found.covariance[5, 5] == pytest.approx((1.0 * (0.04 + 0.02) / 2)**2 / 3)
    assert excess(buffer, 20200 * MS) > 0.0


def test_only_the_present_parent_teaches():
    """Below map it braked hard, below odom it only stands."""
    buffer, drive = BufferCore(cache_time=100 * SECOND), (
        Drive((0.0, 2.0), (3.0, 0.0), acceleration=5.0))
    for stamp in range(0, 5 * SECOND, 20 * MS):
        buffer.insert('map', 'base', stamp, drive(stamp))
    for stamp in range(5 * SECOND, 9 * SECOND + 1, 20 * MS):
        buffer.insert('odom', 'base', stamp, Pose(), strict=False)
    assert not buffer.predict('odom', 'base', 9200 * MS, SECOND).covariance.any()


# --- gyroscopes

def test_rotation_that_a_gyroscope_measured_is_not_uncertain():
    """The remaining part is less certain, and less than without a gyroscope."""
    whole, part, none = (sqrt(aided(until).predict(
        'odom', 'base', 6200 * MS, SECOND).covariance[5, 5])
        for until in (6200 * MS, 6100 * MS, 6000 * MS))
    assert whole < 1e-4 < 0.01 < part < 0.7 * none


def test_gyroscope_that_lags_behind_is_not_believed_to_lead():
    """Earlier predictions are compared as if the gyroscope had ended as early as now."""
    for until in (5980 * MS, 6100 * MS, 6190 * MS):
        found = aided(until).predict('odom', 'base', 6200 * MS, SECOND, acceleration=STEADY)
        off = turning(6.2).as_rpy()[2] - found.pose.as_rpy()[2]
        assert abs(off) < 2.5 * sqrt(found.covariance[5, 5])


@for_each(lead=[5 * MS, 20 * MS, 40 * MS, 100 * MS])
def test_bias_of_a_gyroscope_is_in_the_covariance(lead):
    """However small the part of the time ahead is in which it measured."""
    buffer, newest, bias = BufferCore(), 10 * SECOND, 0.02
    for stamp in range(0, newest + 1, 40 * MS):
        buffer.insert('odom', 'base', stamp, Pose())
    stamps = np.arange(0, newest + lead + 1, 5 * MS)
    buffer.aid('base', stamps, np.tile((0.0, 0.0, bias), (len(stamps), 1)))
    for ahead in (10 * MS, 50 * MS, 100 * MS, 220 * MS, 500 * MS):
        found = buffer.predict('odom', 'base', newest + ahead, SECOND)
        off = found.pose.as_rpy()[2]
        assert off == pytest.approx(bias * min(lead, ahead) / SECOND)
        assert 0.999 * off < sqrt(found.covariance[5, 5]) < 4.0 * off


# --- arguments

@for_each(wrong=[
    7, 'base', [('base', (1.0,) * 6)], {'base': 1.0}, {'base': (1.0, 2.0)}, {3: (1.0,) * 6},
    {'base': (1.0, 0.0, 0.0, 0.0, 0.0, -1.0)}, {'base': (np.nan,) * 6},
    {'base': (np.inf,) * 6}, {'base': 'fast!!'}, {'base': None}])
def test_wrong_limits_are_told(wrong):
    buffer = BufferCore()
    buffer.insert('odom', 'base', 1, Pose())
    with pytest.raises(InvalidArgumentException, match='six limits each.*none may be negative'):
        buffer.predict('odom', 'base', 1, SECOND, acceleration=wrong)
