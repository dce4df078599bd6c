# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How often the covariance of a prediction covers its error: robots that brake, start and turn.

The robots are simulated with and without noise. Each prediction is compared with the true pose.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import gammaincinv
from tf_tree_py import screws
from tf_tree_py.beyond.prediction.prediction import Prediction
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamps

RATES_HZ = (10, 25, 100)
_AHEADS_S = (0.05, 0.1, 0.2, 0.5)
_NOISES = (0.0, 0.005)

_STEP_S = 0.01
_DRIVE_S = 12.0
_FIRST_S, _EVERY_S = 5.0, 0.2
# A cheap gyroscope: its samples in each step, its bias about each axis, the standard deviation of
# its noise, and where it saturates, radians per second. It is read until so long after a pose.
_GYRO_SAMPLES, _GYRO_BIAS, _GYRO_NOISE, _SATURATION = 4, (0.02, -0.02, 0.02), 0.005, 0.8
_GYRO_LEAD_S = 0.02
_HORIZON = from_seconds(1.0)
# Variances of less, relative to the largest, are those of rounding errors.
_NOTHING = 1e-12
_PLANE, _SPACE, _YAW = (0, 1, 5), (0, 1, 2, 3, 4, 5), (5,)


class Robot(NamedTuple):
    """
    A simulated robot.

    :ivar twists: by time, every 10 ms, (N, 6) metres and radians per second, in its own axes.
    :ivar axes: those in which its samples have noise.
    :ivar event_s: when it begins what it had not done for a while, seconds; None: all the time.
    :ivar limits: the argument ``acceleration`` of its predictions.
    :ivar has_gyroscope: whether a gyroscope measures its rotation, with noise, a bias and a limit.
    """

    name: str
    twists: Array
    axes: Sequence[int] = _PLANE
    event_s: float | None = None
    limits: Sequence[float] | None = None
    has_gyroscope: bool = False


def _followed(targets: Sequence[tuple[float, float]], rate: float) -> Array:
    """Return a velocity that follows targets, from the time of each on, at a bounded rate."""
    times, wanted = (np.array(each) for each in zip(*targets, strict=True))
    steps = np.arange(0.0, _DRIVE_S, _STEP_S)
    velocities, now = [], float(wanted[0])
    for goal in wanted[times.searchsorted(steps, side='right') - 1].tolist():
        now += min(max(goal - now, -rate * _STEP_S), rate * _STEP_S)
        velocities.append(now)
    return np.array(velocities)


def _moving(**velocities: Array) -> Array:
    twists = np.zeros((round(_DRIVE_S / _STEP_S), 6))
    for axis, velocity in velocities.items():
        twists[:, ('x', 'y', 'z', 'roll', 'pitch', 'yaw').index(axis)] = velocity
    return twists


def _steady(velocity: float) -> Array:
    return _followed([(0.0, velocity)], 1.0)


def _random(rng: np.random.Generator, largest: float, rate: float) -> Array:
    """Return a velocity that is changed every second or so."""
    times = np.cumsum(rng.uniform(0.4, 1.6, 30)) - 0.4
    return _followed([*zip(times, rng.uniform(-largest, largest, 30), strict=True)], rate)


def robots() -> list[Robot]:
    """Return the robots, those that are not covered first."""
    rng = np.random.default_rng(1)
    seconds = np.arange(0.0, _DRIVE_S, _STEP_S)
    start = _followed([(0.0, 0.0), (9.0, 1.0)], 2.0)
    harder = _followed([(0.0, 1.0), (9.0, 0.0)], 4.0)
    turn = _followed([(0.0, 0.0), (9.0, 1.0)], 2.0)
    return [
        Robot('starts, for the first time', _moving(x=start), event_s=9.0),
        Robot('turns, for the first time', _moving(x=_steady(1.0), yaw=turn), event_s=9.0),
        Robot('brakes within 0.25 s, for the first time', _moving(x=harder), event_s=9.0),
        Robot('starts, limit given', _moving(x=start), event_s=9.0,
              limits=(2.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        Robot('turns, limit given', _moving(x=_steady(1.0), yaw=turn), event_s=9.0,
              limits=(2.0, 0.0, 0.0, 0.0, 0.0, 2.0)),
        Robot('brakes within 0.25 s, limit given', _moving(x=harder), event_s=9.0,
              limits=(4.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        Robot('brakes within 0.5 s, for the first time', _moving(
            x=_followed([(0.0, 1.0), (9.0, 0.0)], 2.0)), event_s=9.0),
        Robot('starts and stops', _moving(x=_followed(
            [(0.0, 0.0), (1.0, 1.0), (3.0, 0.0), (5.0, 1.0), (7.0, 0.0), (9.0, 1.0),
             (11.0, 0.0)], 2.0)), event_s=9.0),
        Robot('turns again', _moving(x=_steady(1.0), yaw=_followed(
            [(0.0, 0.0), (2.0, 1.0), (4.0, 0.0), (9.0, -1.0)], 2.0)), event_s=9.0),
        Robot('drives about', _moving(x=_random(rng, 1.5, 2.0), yaw=_random(rng, 1.0, 4.0))),
        Robot('flies about', _moving(
            x=_random(rng, 2.0, 4.0), y=_random(rng, 2.0, 4.0), z=_random(rng, 1.0, 4.0),
            roll=_random(rng, 1.0, 6.0), pitch=_random(rng, 1.0, 6.0),
            yaw=_random(rng, 1.0, 6.0)), _SPACE),
        Robot('drives about, with a gyroscope', _moving(
            x=_random(rng, 1.5, 2.0), yaw=_random(rng, 1.0, 4.0)), _SPACE, has_gyroscope=True),
        Robot('a joint that swings at 1 Hz', _moving(yaw=3.0 * np.cos(2.0 * np.pi * seconds)),
              _YAW),
        Robot('drives in a circle', _moving(x=_steady(1.0), yaw=_steady(0.4))),
        Robot('stands', _moving()),
    ]


def true_poses(robot: Robot) -> Array:
    """Return the poses of a robot, every 10 ms, (N + 1, 7)."""
    poses = [se3.IDENTITY]
    for motion in screws.exp_many(robot.twists * _STEP_S).tolist():
        x, y, z, qx, qy, qz, qw = se3.compose(poses[-1], tuple(motion))
        poses.append((x, y, z, *so3.normalize((qx, qy, qz, qw))))
    return np.array(poses)


def covered(robot: Robot, poses: Array, rate_hz: int, noise: float) -> Array:
    """
    Predict a robot all the time.

    :param poses: its true poses, every 10 ms.
    :param noise: of the samples, metres and radians.
    :return: (A, N, 5) of N predictions by each time ahead: whether the error is inside the
        region of 68 %, and of 95 %; the latter in the first second of the event, or at all times,
        and otherwise NaN; the squares of the standard deviations, and of the errors.
    """
    rng, buffer = np.random.default_rng(2), BufferCore()
    gyro_stamps, gyro_rates = _gyroscope(robot)
    limits = None if robot.limits is None else {'base': robot.limits}
    rows: list[list[tuple[float, ...]]] = [[] for _ in _AHEADS_S]
    due, every = _FIRST_S, round(1.0 / (rate_hz * _STEP_S))
    for number in range(0, len(poses) - round(max(_AHEADS_S) / _STEP_S), every):
        now = number * _STEP_S
        stamp = from_seconds(1.0 + now)
        buffer.insert('odom', 'base', stamp, _measured(poses[number], noise, robot.axes, rng))
        read = int(gyro_stamps.searchsorted(stamp + from_seconds(_GYRO_LEAD_S)))
        if read:
            buffer.aid('base', gyro_stamps[:read], gyro_rates[:read], saturation=_SATURATION)
            gyro_stamps, gyro_rates = gyro_stamps[read:], gyro_rates[read:]
        if now < due:
            continue
        due += _EVERY_S
        for ahead, found in zip(_AHEADS_S, rows, strict=True):
            truth = poses[number + round(ahead / _STEP_S)]
            is_event = robot.event_s is None or -ahead <= now - robot.event_s < 1.0
            in_68, in_95, *squares = _judged(buffer.predict(
                'odom', 'base', stamp + from_seconds(ahead), _HORIZON, acceleration=limits), truth)
            found.append((in_68, in_95, in_95 if is_event else np.nan, *squares))
    return np.array(rows)


def _gyroscope(robot: Robot) -> tuple[Stamps, Array]:
    """Return the stamps of a robot's gyroscope and its rates (N, 3); none without a gyroscope."""
    twists = np.repeat(robot.twists[:, 3:] if robot.has_gyroscope else np.empty((0, 3)),
                       _GYRO_SAMPLES, axis=0)
    stamps = from_seconds(1.0) + np.arange(len(twists)) * (from_seconds(_STEP_S) // _GYRO_SAMPLES)
    noise = np.random.default_rng(3).normal(scale=_GYRO_NOISE, size=twists.shape)
    return stamps, np.clip(twists + _GYRO_BIAS + noise, -_SATURATION, _SATURATION)


def _measured(true: Array, noise: float, axes: Sequence[int], rng: np.random.Generator) -> Pose:
    if not noise:
        return Pose._make(true.tolist())
    errors = np.zeros(6)
    errors[list(axes)] = rng.normal(scale=noise, size=len(axes))
    return Pose.from_parts(true[:3] + errors[:3], so3.multiply(
        so3.exp(tuple(errors[3:].tolist())), tuple(true[3:].tolist())))


def _judged(found: Prediction, truth: Array) -> tuple[float, float, float, float]:
    """
    Return whether an error is inside the regions of 68 % and of 95 %, and the mean squares.

    The regions are those of the directions in which the covariance is not zero; in the others
    there must not be any error.
    """
    off = np.array([*np.subtract(truth[:3], found.pose[:3]), *so3.log(so3.multiply(
        tuple(truth[3:].tolist()), so3.conjugate(found.pose[3:])))])
    variances, directions = np.linalg.eigh(found.covariance)
    known = variances > max(_NOTHING * variances[-1], _NOTHING**2)
    along = directions.T @ off
    square = float((along[known] ** 2 / variances[known]).sum())
    if (np.abs(along[~known]) > 1e-6).any():
        square = np.inf
    regions = (2.0 * gammaincinv(max(known.sum(), 1) / 2.0, share) for share in (0.6827, 0.95))
    in_68, in_95 = (float(square <= region) for region in regions)
    return in_68, in_95, float(variances.sum()), float(off @ off)


def by_robot() -> list[tuple[str | float | None, ...]]:
    """
    Return the mean outcome of each robot, over all rates and times ahead.

    :return: its name, and the noise; the shares of errors inside the regions of 68 % and of 95 %,
        and of 95 % in the event; and the standard deviations, relative to the errors, or None
        without errors.
    """
    rows: list[tuple[str | float | None, ...]] = []
    for robot in robots():
        poses = true_poses(robot)
        # Poses without noise beside a gyroscope with errors would be certain along some axes.
        for noise in _NOISES[1:] if robot.has_gyroscope else _NOISES:
            shares = [np.nanmean(covered(robot, poses, rate, noise), axis=1) for rate in RATES_HZ]
            in_68, in_95, in_event, claimed, off = np.mean(shares, axis=(0, 1)).tolist()
            rows.append((robot.name, noise, in_68, in_95, in_event,
                         float(np.sqrt(claimed / off)) if off > _NOTHING else None))
    return rows
