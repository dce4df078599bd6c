# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The true motion of a robot, and its odometry, which slips.

The body's velocities are sums of sines. They are integrated 200 times a second. The odometry
measures the motion between two of its samples with three errors: a scale, which is constant; a
slip, which changes with the ground; and, once in ten metres, a slip of some centimetres.
"""

from dataclasses import dataclass
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]

FINE_HZ, ODOMETRY_HZ = 200, 50
FINE_S, PERIOD_S = 1.0 / FINE_HZ, 1.0 / ODOMETRY_HZ
_EVERY = FINE_HZ // ODOMETRY_HZ

# The mean of each velocity of the body, its standard deviation over all drives, the amplitude of
# each of its sines, and their periods.
_MEAN = np.array([0.7, 0.0, 0.0, 0.0, 0.0, 0.0])
_USUAL = np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.1])
_AMPLITUDE = np.array([0.12, 0.04, 0.04, 0.12, 0.12, 0.15])
_PERIODS_S = (3.0, 17.0)
_SINES = 3
# The velocities that a robot has in the plane: forward and yaw.
IN_PLANE = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
_DRIVEN_IN_PLANE = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0])

# The standard deviations of a slip, metres and radians per square root of a metre. How often short
# slips happen, how long they last, and their turn, radians per metre.
_SLIP = np.array([0.03] * 3 + [0.015] * 3)
_SHORT_PER_M, _SHORT_S, _SHORT_TURN = 0.1, 0.2, 0.3

# Where the robot is carried to.
CARRIED_M, CARRIED_RAD = 3.6, 1.2


class Wheels(NamedTuple):
    """
    How good an odometry is.

    :ivar scale: the standard deviation of a constant error of all ways and turns, as their part.
    :ivar ground: the correlation length of a slip, metres.
    :ivar short: the standard deviation of a short slip along each axis, metres.
    """

    scale: float = 0.005
    ground: float = 0.02
    short: float = 0.03


@dataclass(frozen=True)
class Motion:
    """
    Poses in time.

    :ivar positions: (N, 3)
    :ivar rotations: N of them.
    """

    positions: Array
    rotations: Rotation

    def __getitem__(self, which: Any) -> 'Motion':
        return Motion(self.positions[which], self.rotations[which])

    def steps(self) -> 'Motion':
        """Return the motion from each pose to the next, in the axes of the first."""
        back = self.rotations[:-1].inv()
        return Motion(back.apply(np.diff(self.positions, axis=0)), back * self.rotations[1:])

    def inverse(self) -> 'Motion':
        """Return the inverse of each pose."""
        back = self.rotations.inv()
        return Motion(-back.apply(self.positions), back)

    def apply(self, points: Array) -> Array:
        """Return points (N, 3), each moved by a pose."""
        return np.asarray(self.positions + self.rotations.apply(points))

    def after(self, outer: 'Motion') -> 'Motion':
        """Return these poses in the frame of which another motion, or one pose, is the pose."""
        return Motion(outer.apply(self.positions), outer.rotations * self.rotations)

    def rows(self) -> Array:
        """Return (N, 7): x, y, z and a quaternion x, y, z, w."""
        return np.concatenate([self.positions, self.rotations.as_quat()], axis=-1)


def one(position: npt.ArrayLike, vector: npt.ArrayLike) -> Motion:
    """Return one pose, of a position and a rotation vector."""
    return Motion(np.asarray(position, dtype=float), Rotation.from_rotvec(vector))


def motion_of(rows: npt.ArrayLike) -> Motion:
    """Return the poses of rows (N, 7)."""
    rows = np.asarray(rows)
    return Motion(rows[..., :3], Rotation.from_quat(rows[..., 3:]))


def added_up(steps: Motion) -> Motion:
    """Return the poses, from the identity on, that steps lead to."""
    rotations = Rotation.from_quat(_products(steps.rotations.as_quat()))
    gone = rotations[:-1].apply(steps.positions)
    return Motion(np.concatenate([np.zeros((1, 3)), np.cumsum(gone, axis=0)]), rotations)


def _products(turns: Array) -> Array:
    """Return the identity and the products of the first 1, 2, ... quaternions (N, 4)."""
    side = math.isqrt(len(turns)) + 1
    grid = np.tile([0.0, 0.0, 0.0, 1.0], (side * side, 1))
    grid[1:1 + len(turns)] = turns
    grid = grid.reshape(side, side, 4)
    for column in range(1, side):  # those of each row, for all rows at once
        grid[:, column] = _product(grid[:, column - 1], grid[:, column])
    for row in range(1, side):
        grid[row] = _product(grid[row - 1, -1], grid[row])
    return grid.reshape(-1, 4)[:1 + len(turns)]


def _product(a: Array, b: Array) -> Array:
    return np.asarray((Rotation.from_quat(a) * Rotation.from_quat(b)).as_quat())


class Robot(NamedTuple):
    """
    One robot on one drive.

    :ivar fine: the true poses in the map, every 5 ms.
    :ivar odometry: the poses in odom, every 20 ms.
    :ivar way: (N,) the metres travelled at each sample of the odometry.
    """

    fine: Motion
    odometry: Motion
    way: Array

    @property
    def truth(self) -> Motion:
        """Return the true poses at the stamps of the odometry."""
        return self.fine[::_EVERY]


def driven(rng: np.random.Generator, seconds: float, planar: bool, wheels: Wheels,
           carried_at: float | None = None) -> Robot:
    """
    Return a robot that drives.

    :param carried_at: when it is carried to another place, which the odometry does not notice.
    """
    smooth = added_up(steps_of(_velocities(rng, round(seconds * FINE_HZ), planar)))
    odometry, way = _odometry(rng, smooth[::_EVERY].steps(), planar, wheels)
    start = one(rng.uniform(-10.0, 10.0, 3) * _flat(planar)[:3],
                rng.normal(size=3) * _flat(planar)[3:])
    fine = smooth.after(start)
    if carried_at is not None:
        fine = _carried(rng, fine, round(carried_at * FINE_HZ), planar)
    return Robot(fine, odometry, way)


def _flat(planar: bool) -> Array:
    return IN_PLANE if planar else np.ones(6)


def _velocities(rng: np.random.Generator, count: int, planar: bool) -> Array:
    """Return (N, 6) the velocities of the body in the middle of each step."""
    middle = (np.arange(count) + 0.5) * FINE_S
    phases = rng.uniform(0.0, 2.0 * np.pi, (6, _SINES, 1))
    rates = 2.0 * np.pi / rng.uniform(*_PERIODS_S, (6, _SINES, 1))
    waves = np.sin(rates * middle + phases).sum(axis=1).T
    mean = _MEAN + _USUAL * rng.normal(size=6)
    return np.asarray((mean + _AMPLITUDE * waves) * (_DRIVEN_IN_PLANE if planar else 1.0))


def steps_of(velocities: Array) -> Motion:
    """Return the motion of each step, whose translation is along the rotation in its middle."""
    vectors = FINE_S * velocities[:, 3:]
    middle = Rotation.from_rotvec(0.5 * vectors)
    return Motion(middle.apply(FINE_S * velocities[:, :3]), Rotation.from_rotvec(vectors))


def _odometry(rng: np.random.Generator, steps: Motion, planar: bool,
              wheels: Wheels) -> tuple[Motion, Array]:
    """Return the odometry of the true steps between its samples, and the way to each."""
    ways = np.linalg.norm(steps.positions, axis=1)
    scale = 1.0 + wheels.scale * rng.normal(size=2)
    slips = _slips(rng, ways, wheels.ground) + _short_slips(rng, ways, wheels.short)
    errors = slips * _flat(planar)
    measured = Motion(
        scale[0] * steps.positions + errors[:, :3],
        Rotation.from_rotvec(scale[1] * steps.rotations.as_rotvec() + errors[:, 3:]))
    return added_up(measured), np.concatenate([[0.0], np.cumsum(ways)])


def _slips(rng: np.random.Generator, ways: Array, ground: float) -> Array:
    """Return the slip of each step (N, 6): a first-order Gauss-Markov process over the way."""
    kept = np.exp(-ways / ground)
    fresh = np.sqrt(1.0 - kept**2)[:, None] * rng.normal(size=(len(ways), 6))
    part, parts = rng.normal(size=6), np.empty((len(ways), 6))
    for number, (keep, new) in enumerate(zip(kept.tolist(), fresh, strict=True)):
        parts[number] = part = keep * part + new
    return np.asarray(parts * _SLIP * ways[:, None] / np.sqrt(2.0 * ground))


def _short_slips(rng: np.random.Generator, ways: Array, short: float) -> Array:
    """Return slips, each of which lasts for some steps."""
    errors, lasts = np.zeros((len(ways), 6)), round(_SHORT_S * ODOMETRY_HZ)
    deviations = short * np.array([1.0] * 3 + [_SHORT_TURN] * 3)
    for begin in np.flatnonzero(rng.random(len(ways)) < _SHORT_PER_M * ways):
        errors[begin:begin + lasts] += deviations * rng.normal(size=6) / lasts
    return errors


def _carried(rng: np.random.Generator, fine: Motion, begin: int, planar: bool) -> Motion:
    """Return a motion that continues from another place."""
    flat = _flat(planar)
    here = fine[begin]
    shift, axis = rng.normal(size=3) * flat[:3], rng.normal(size=3) * flat[3:]
    turn = Rotation.from_rotvec(CARRIED_RAD * axis / np.linalg.norm(axis))
    there = here.positions + CARRIED_M * shift / np.linalg.norm(shift)
    later = fine[begin:]
    moved = Motion(there + turn.apply(later.positions - here.positions), turn * later.rotations)
    return Motion(np.concatenate([fine.positions[:begin], moved.positions]), Rotation.from_quat(
        np.concatenate([fine.rotations[:begin].as_quat(), moved.rotations.as_quat()])))


def drift_by_way(planar: bool, wheels: Wheels, robots: int = 20) -> tuple[float, float]:
    """
    Return the drift of such odometries, as drives with a reference measure it.

    :return: metres and radians per square root of a metre, from what the odometry is off
        after a second.
    """
    squares, length = np.zeros(6), 0.0
    for seed in range(robots):
        robot = driven(np.random.default_rng((seed, 7)), 40.0, planar, wheels)
        true, seen = (each[::ODOMETRY_HZ].steps() for each in (robot.truth, robot.odometry))
        off = np.concatenate([seen.positions - true.positions,
                              (seen.rotations * true.rotations.inv()).as_rotvec()], axis=1)
        squares += (off**2).sum(axis=0)
        length += robot.way[-1]
    count = _flat(planar)
    both = squares * count / length
    return (float(np.sqrt(both[:3].sum() / count[:3].sum())),
            float(np.sqrt(both[3:].sum() / count[3:].sum())))
