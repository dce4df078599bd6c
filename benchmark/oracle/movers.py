# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Seven robots whose next second is to be predicted, and their samples.

Each moves as such a machine does: it accelerates, turns, stops, and starts again at random times.
Its samples have a period that trembles; some are lost, and each may have noise.
"""

from collections.abc import Callable
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from .robot import added_up, Array, Motion

FINE_HZ = 1000
_FINE_S = 1.0 / FINE_HZ
_GRAVITY = 9.81
# The noise of a sample along and about each axis, metres and radians; how much the time from one
# sample to the next trembles, as a part of the period; and the part of the samples that is lost.
NOISE = np.array([0.002] * 3 + [0.002] * 3)
_TREMBLE, _LOST = 0.1, 0.1


def _moments(rng: np.random.Generator, seconds: float, shortest: float, longest: float) -> Array:
    """Return the times at which a robot changes what it does, from a random one before 0 on."""
    count = math.ceil(seconds / shortest) + 2
    return np.asarray(np.cumsum(rng.uniform(shortest, longest, count)) - rng.uniform(0.0, longest)
                      - longest)


def _followed(moments: Array, wanted: npt.ArrayLike, rate: float, seconds: float) -> Array:
    """Return a velocity that follows one target after the other at a bounded rate."""
    goals = np.asarray(wanted, dtype=float)
    step, now, found = rate * _FINE_S, float(goals[0]), []
    times = np.arange(round(seconds * FINE_HZ)) * _FINE_S
    for goal in goals[moments.searchsorted(times, side='right') - 1].tolist():
        now += min(max(goal - now, -step), step)
        found.append(now)
    return np.array(found)


def _moved(**velocities: Array) -> Motion:
    """Return the motion with velocities of the body, metres and radians per second."""
    twists = np.zeros((len(next(iter(velocities.values()))), 6))
    for axis, velocity in velocities.items():
        twists[:, ('x', 'y', 'z', 'roll', 'pitch', 'yaw').index(axis)] = velocity
    half = Rotation.from_rotvec(0.5 * _FINE_S * twists[:, 3:])
    return added_up(Motion(half.apply(_FINE_S * twists[:, :3]),
                           Rotation.from_rotvec(_FINE_S * twists[:, 3:])))


def _course(rng: np.random.Generator, seconds: float) -> tuple[Array, Array]:
    """Return the speed and the turn rate of a robot that drives about."""
    when, then = (_moments(rng, seconds, 0.6, 2.0) for _ in range(2))
    return (_followed(when, rng.uniform(-0.2, 1.0, len(when)), 1.0, seconds),
            _followed(then, rng.uniform(-0.8, 0.8, len(then)), 2.0, seconds))


def _differential(rng: np.random.Generator, seconds: float) -> Motion:
    speed, turn = _course(rng, seconds)
    return _moved(x=speed, yaw=turn)


def _tracked(rng: np.random.Generator, seconds: float) -> Motion:
    """Drive with a slip that changes with a time constant of 0.2 s."""
    speed, turn = _course(rng, seconds)
    rest = math.exp(-_FINE_S / 0.2)
    slip, found = np.zeros(3), []
    for kick in rng.normal(size=(len(speed), 3)) * math.sqrt(1.0 - rest * rest):
        slip = rest * slip + kick
        found.append(slip)
    along, across, about = np.array(found).T
    return _moved(x=speed * (1.0 + 0.1 * along), y=0.05 * (np.abs(speed) + np.abs(turn)) * across,
                  yaw=turn * (1.0 + 0.1 * about))


def _quadrotor(rng: np.random.Generator, seconds: float) -> Motion:
    """Accelerate by tilting, with a bounded jerk; the attitude follows."""
    when = _moments(rng, seconds, 0.5, 2.0)
    wanted = rng.uniform(-1.0, 1.0, (len(when), 3)) * (2.0, 2.0, 1.0)
    times = np.arange(round(seconds * FINE_HZ)) * _FINE_S
    velocity, acceleration, found = wanted[0].copy(), np.zeros(3), []
    for goal in wanted[when.searchsorted(times, side='right') - 1]:
        asked = np.clip((goal - velocity) / 0.4, -3.0, 3.0)
        acceleration = acceleration + np.clip(asked - acceleration, -0.015, 0.015)
        velocity = velocity + _FINE_S * acceleration
        found.append((velocity, acceleration))
    velocities, accelerations = np.swapaxes(np.array(found), 0, 1)
    then = _moments(rng, seconds, 0.6, 2.0)
    yaw = np.cumsum(_followed(then, rng.uniform(-0.8, 0.8, len(then)), 2.0, seconds)) * _FINE_S
    x, y, z = accelerations.T
    # Tilts of the axes that would be level: to first order.
    c, s = np.cos(yaw), np.sin(yaw)
    turned = Rotation.from_euler('ZYX', np.stack([
        yaw, (c * x + s * y) / (_GRAVITY + z), (s * x - c * y) / (_GRAVITY + z)], axis=1))
    return Motion(np.cumsum(velocities, axis=0) * _FINE_S, turned)


def _joint(rng: np.random.Generator, seconds: float) -> Motion:
    """Move from one angle to another with the least jerk, and rest there for a while."""
    times = np.arange(round(seconds * FINE_HZ)) * _FINE_S
    angle = np.zeros(len(times))
    begin, here = -rng.uniform(0.0, 2.0), 0.0
    while begin < seconds:
        there, lasts = rng.uniform(-1.5, 1.5), rng.uniform(0.8, 1.6)
        part = np.clip((times - begin) / lasts, 0.0, 1.0)
        angle += (there - here) * part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
        begin, here = begin + lasts + rng.uniform(0.0, 0.6), there
    return Motion(np.tile((0.1, 0.0, 0.4), (len(times), 1)),
                  Rotation.from_rotvec(angle[:, None] * (0.0, 0.0, 1.0)))


def _lift(rng: np.random.Generator, seconds: float) -> Motion:
    when = _moments(rng, seconds, 1.0, 3.0)
    return _moved(z=_followed(when, rng.choice([-0.8, -0.4, 0.0, 0.4, 0.8], len(when)), 0.8,
                              seconds))


def _conveyor(rng: np.random.Generator, seconds: float) -> Motion:
    when = _moments(rng, seconds, 0.8, 2.0)
    return _moved(x=_followed(when, 0.5 * (np.arange(len(when)) % 2), 1.0, seconds))


def _ship(rng: np.random.Generator, seconds: float) -> Motion:
    """Float in waves of 3 to 9 s: metres and radians about a course."""
    times = np.arange(round(seconds * FINE_HZ)) * _FINE_S
    size = np.array([0.3, 0.3, 0.6, 0.12, 0.06, 0.03])
    waves = np.zeros((len(times), 6))
    for _ in range(4):
        waves += size / 2.0 * np.sin(2.0 * math.pi * times[:, None] / rng.uniform(3.0, 9.0)
                                     + rng.uniform(0.0, 2.0 * math.pi, 6))
    waves[:, 0] += 2.0 * times
    return Motion(waves[:, :3], Rotation.from_euler('ZYX', waves[:, :2:-1]))


MOVERS: dict[str, Callable[[np.random.Generator, float], Motion]] = {
    'differential drive': _differential, 'quadrotor': _quadrotor, 'arm joint': _joint,
    'lift': _lift, 'ship in waves': _ship, 'stop-and-go conveyor': _conveyor,
    'tracked robot with slip': _tracked}


class Samples(NamedTuple):
    """
    What a robot publishes.

    :ivar numbers: (N,) of the true poses.
    :ivar poses: of the samples.
    """

    numbers: npt.NDArray[np.int64]
    poses: Motion


def sampled(truth: Motion, rate_hz: float, noise: float, rng: np.random.Generator) -> Samples:
    """
    Return the samples of a drive.

    :param noise: as a multiple of ``NOISE``.
    """
    period = FINE_HZ / rate_hz
    due = np.arange(0.0, len(truth.positions) - period, period)
    due = due + rng.normal(scale=_TREMBLE * period, size=len(due))
    numbers = np.unique(np.clip(np.round(due), 0, len(truth.positions) - 1).astype(np.int64))
    numbers = numbers[rng.random(len(numbers)) > _LOST]
    errors = noise * NOISE * rng.normal(size=(len(numbers), 6))
    true = truth[numbers]
    return Samples(numbers, Motion(true.positions + errors[:, :3],
                                   Rotation.from_rotvec(errors[:, 3:]) * true.rotations))
