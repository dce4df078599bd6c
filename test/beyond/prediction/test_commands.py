# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Predictions of robots whose command is known: a simulated one follows it with a lag."""

import math

import numpy as np
import pytest
from scipy.stats import chi2
from tf_tree_py import BufferCore, screws
from tf_tree_py.core import InvalidArgumentException, LookupException, Pose, se3
from tf_tree_py.core.geometry import so3

SECOND, MS = 1_000_000_000, 1_000_000
STEP, FINE = 20 * MS, 2 * MS
SPAN = 24 * SECOND
LAG_S = 0.1
NOISE = np.array([2e-3, 2e-3, 1e-3, 1e-3, 1e-3, 2e-3])
PLANE = [0, 1, 5]


class Robot:
    """A robot that gets another command about twice a second, and follows it with a lag."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.truth, self.commands = {0: Pose()}, {}
        velocity, command, pose = np.zeros(2), np.zeros(2), Pose()
        for stamp in range(0, SPAN, FINE):
            if stamp % STEP == 0 and self.rng.random() < 0.04:
                command = self.rng.uniform((-0.5, -1.0), (1.0, 1.0)) * (self.rng.random() > 0.2)
            self.commands[stamp] = command
            velocity = velocity + (command - velocity) * FINE / SECOND / LAG_S
            moved = screws.exp(screws.times(FINE / SECOND, six(velocity)))
            pose = Pose._make(se3.compose(pose, moved))
            self.truth[stamp + FINE] = pose

    def measured(self, stamp, scale):
        off = scale * NOISE * self.rng.normal(size=6)
        return Pose._make(se3.compose(self.truth[stamp], (
            *off[:3], *so3.exp(tuple(off[3:].tolist())))))


def six(command):
    return (float(command[0]), 0.0, 0.0, 0.0, 0.0, float(command[1]))


def driven(robot, scale, ahead):
    """Drive, and predict after each sample; yield the error with the command, and without."""
    buffer = BufferCore()
    for stamp in range(0, SPAN - SECOND, STEP):
        buffer.insert('odom', 'base', stamp, robot.measured(stamp, scale))
        if stamp < STEP:
            continue
        twist = {'base': six(robot.commands[stamp])}
        asked = 'odom', 'base', stamp + ahead, SECOND
        found = buffer.predict(*asked, twist=twist)
        if stamp > 6 * SECOND:
            yield [off(each, robot.truth[stamp + ahead]) for each in (
                found, buffer.predict(*asked))]


def off(found, truth):
    """Return the error in the plane, and the squared Mahalanobis distance of x, y and yaw."""
    turn = so3.log(se3.compose(found.pose, se3.inverse(truth))[3:])
    error = np.array([found.pose.x - truth.x, found.pose.y - truth.y, turn[2]])
    covariance = found.covariance[np.ix_(PLANE, PLANE)]
    return math.hypot(*error[:2]), error @ np.linalg.solve(covariance, error)


@pytest.mark.parametrize(('scale', 'ahead'), [
    (0.0, 10 * MS), (1.0, 2 * MS), (1.0, 60 * MS), (1.0, 200 * MS)])
def test_regions_with_a_command_contain_what_they_say(scale, ahead):
    """The errors are large only after a new command, so the smaller region contains more."""
    errors, distances = [], []
    for seed in range(2):
        for (known, distance), (free, _) in driven(Robot(seed), scale, ahead):
            errors.append((known, free))
            distances.append(distance)
    inside = [(np.array(distances) < chi2.ppf(part, 3)).mean() for part in (0.68, 0.95)]
    assert 0.64 < inside[0] < 0.95 and 0.88 < inside[1] < 0.99
    assert 0.3 < np.mean(distances) / 3.0 < 1.7
    known, free = np.sqrt((np.array(errors)**2).mean(axis=0))
    if ahead == 200 * MS:
        assert known < 0.8 * free


def resting(samples=200):
    buffer = BufferCore()
    for number in range(samples):
        buffer.insert('odom', 'base', number * STEP, Pose(x=1.0))
    return buffer


FORWARD = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize('samples', [1, 2, 200])
def test_first_start_is_covered_with_a_command(samples):
    """Whether the robot follows the first command or rests, it is in the region."""
    buffer = resting(samples)
    asked = 'odom', 'base', samples * STEP + 180 * MS, SECOND
    found = buffer.predict(*asked, twist={'/base': FORWARD})
    assert found.pose.x == pytest.approx(1.1) and found.covariance[0, 0] == pytest.approx(0.01)
    if samples > 1:
        assert buffer.predict(*asked).covariance[0, 0] == 0.0


def test_robot_that_follows_exactly_is_certain_soon_and_one_that_does_not_is_not():
    for speed, deviation in ((0.5, 0.0), (0.0, 0.5)):
        buffer = resting()
        for number in range(200, 260):
            buffer.insert('odom', 'base', number * STEP, Pose(
                x=1.0 + speed * 1e-9 * (number - 199) * STEP))
            found = buffer.predict('odom', 'base', number * STEP + 100 * MS, SECOND,
                                   twist={'base': FORWARD})
        assert math.sqrt(found.covariance[0, 0]) == pytest.approx(
            0.1 * deviation, rel=0.1, abs=1e-3)


def test_first_start_after_commands_to_rest_is_covered():
    """Earlier commands to rest say nothing about how the robot starts."""
    buffer = resting()
    for number in range(200, 300):
        buffer.insert('odom', 'base', number * STEP, Pose(x=1.0))
        asked = 'odom', 'base', number * STEP + 100 * MS, SECOND
        rested = buffer.predict(*asked, twist={'base': (0.0,) * 6})
    started = buffer.predict(*asked, twist={'base': FORWARD})
    assert rested.covariance[0, 0] < 1e-12
    assert started.covariance[0, 0] == pytest.approx(0.05**2)


def test_robot_that_ceases_to_follow_is_covered():
    """It is commanded 0.8 m/s after 0.5, and cannot: the first errors show only after 0.1 s."""
    rng, buffer, inside = np.random.default_rng(1), BufferCore(), []
    for number in range(600):
        x, (dx, dy, yaw) = 0.01 * number, rng.normal(scale=(1e-3, 1e-3, 1e-4))
        buffer.insert('odom', 'base', number * STEP, Pose.from_xyz_rpy(x=x + dx, y=dy, yaw=yaw))
        if number > 2:
            found = buffer.predict('odom', 'base', number * STEP + 100 * MS, SECOND, twist={
                'base': (0.8 if number > 400 else 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)})
            inside.append(abs(found.pose.x - x - 0.05) < 1.96 * math.sqrt(found.covariance[0, 0]))
    assert np.mean(inside[400:]) > 0.93


def test_far_prediction_and_another_command_before_change_nothing():
    rng, plain, disturbed = np.random.default_rng(1), BufferCore(), BufferCore()
    for number in range(400):
        pose = Pose(x=0.01 * number + rng.normal(scale=1e-3))
        for buffer in (plain, disturbed):
            buffer.insert('odom', 'base', number * STEP, pose)
        asked = 'odom', 'base', number * STEP + 100 * MS, SECOND
        if number == 50:
            disturbed.predict('odom', 'base', 90 * SECOND, 100 * SECOND, twist={'base': FORWARD})
        if number > 2:
            disturbed.predict(*asked, twist={'base': (0.0,) * 6})
            expected, found = (buffer.predict(*asked, twist={'base': FORWARD}).covariance
                               for buffer in (plain, disturbed))
            np.testing.assert_allclose(found, expected)


def test_snapshot_knows_the_commands_and_what_is_cleared_forgets_them():
    buffer, robot = BufferCore(), Robot(1)
    for stamp in range(0, 4 * SECOND, STEP):
        buffer.insert('odom', 'base', stamp, robot.measured(stamp, 1.0))
        asked = 'odom', 'base', stamp + 50 * MS, SECOND
        twist = {'base': six(robot.commands[stamp])}
        if stamp:
            found = buffer.predict(*asked, twist=twist)
    again = buffer.snapshot().predict(*asked, twist=twist)
    np.testing.assert_allclose(again.covariance, found.covariance, rtol=0.2)
    buffer.clear()
    buffer.insert('odom', 'base', 0, Pose())
    cold = buffer.predict('odom', 'base', 50 * MS, SECOND, twist={'base': FORWARD})
    assert cold.covariance[0, 0] == pytest.approx(0.025**2)


def test_late_sample_and_clock_that_goes_back_change_what_was_shown():
    buffer = resting()
    for number in range(200, 260):
        if number != 230:
            buffer.insert('odom', 'base', number * STEP, Pose(x=1.0))
        buffer.predict('odom', 'base', number * STEP + 30 * MS, SECOND, twist={'base': FORWARD})
    asked = 'odom', 'base', 259 * STEP + 30 * MS, SECOND
    before = buffer.predict(*asked, twist={'base': FORWARD}).covariance[0, 0]
    buffer.insert('odom', 'base', 230 * STEP, Pose(x=2.0))
    assert buffer.predict(*asked, twist={'base': FORWARD}).covariance[0, 0] > 2.0 * before
    buffer.clear()
    for number in range(100):
        buffer.insert('odom', 'base', number * STEP, Pose(x=1.0 + 0.5e-9 * number * STEP))
        if number > 1:
            found = buffer.predict('odom', 'base', number * STEP + 30 * MS, SECOND,
                                   twist={'base': FORWARD})
    assert found.covariance[0, 0] < 1e-9


def test_gyroscope_measures_the_rotation_that_was_commanded():
    buffer = resting()
    stamps = np.arange(0, 205 * STEP, 2 * MS)
    buffer.aid('base', stamps, np.tile((0.0, 0.0, 0.5), (len(stamps), 1)))
    found = buffer.predict('odom', 'base', 204 * STEP, SECOND,
                           twist={'base': (0.5, 0.0, 0.0, 0.0, 0.0, 9.0)})
    assert found.pose.as_rpy()[2] == pytest.approx(0.5 * 5 * STEP / SECOND, rel=0.01)


@pytest.mark.parametrize('twist', [
    3, {'base': 1.0}, {'base': (1.0, 2.0)}, {'base': '123456'}, {'base': (1e200,) * 6},
    {'base': (10**400,) * 6}, {'base': (math.nan,) * 6}, {3: FORWARD}])
def test_what_is_no_twist_is_refused_with_an_example(twist):
    with pytest.raises(InvalidArgumentException, match='twist.*six finite numbers'):
        resting().predict('odom', 'base', 5 * SECOND, 9 * SECOND, twist=twist)


def test_misspelt_frame_of_a_twist_is_an_error():
    with pytest.raises(LookupException, match='predict argument twist does not exist'):
        resting().predict('odom', 'base', 5 * SECOND, 9 * SECOND, twist={'bsae': FORWARD})


def test_twist_and_limit_of_one_edge_contradict_each_other():
    with pytest.raises(InvalidArgumentException, match='twist and acceleration: both.*"base"'):
        resting().predict('odom', 'base', 5 * SECOND, 9 * SECOND, twist={'base': FORWARD},
                          acceleration={'base': (1.0,) * 6})
