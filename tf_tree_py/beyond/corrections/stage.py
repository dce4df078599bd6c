# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One correction of an edge, and the blend that leads to it; many of them in packed memory.

The final pose of a sample is motion @ parent_T_child. Until then a point of the child is offset
from its final position by d, and the child is rotated about that point by Q. Both decrease to
zero. So the speed of the point is at most its own speed plus that of the blend, regardless of
the child's motion.
"""

from array import array
from bisect import bisect_left
from collections.abc import Callable, Sequence
import math
from typing import Any, cast, NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.errors import InvalidArgumentException, no_truth
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Number, Quaternion, Six, Vector3
from tf_tree_py.core.stamp import BEGINNING, FOREVER, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Mask, Stamps
from tf_tree_py.files.edges import Arrays, Facts, Saved

from .blend import AT_REST, Course, Plan, Scale, STANDING, way

ORIGIN = (0.0, 0.0, 0.0)
# The parts of one ``Course``, or of many.
_Course = tuple[Six[Number], Number, Number, Number, Number, Number, Number]

# Some years before the last stamp, where floats of nanoseconds are a microsecond apart.
_LAST = 0.99 * FOREVER

# The columns of a stage in a row of packed memory: motion, about, turn, shift, and the plan.
_MOTION, _ABOUT, _TURN, _SHIFT = slice(7), slice(7, 10), slice(10, 14), slice(14, 17)
_MAIN, _ASIDE, _SCALE, _ACCELERATION = slice(17, 29), slice(29, 41), slice(41, 45), 45
_FLOATS = 46


class Stage(NamedTuple):
    """
    One correction, and the transition to it; see the module docstring.

    :ivar begin: nanoseconds; samples up to this stamp belong to the previous stage.
    :ivar end: from this stamp the correction is fully applied.
    :ivar about: that point, in the child.
    :ivar turn: Q at the beginning.
    :ivar shift: d at the beginning, metres in the parent's axes.
    :ivar plan: how d, and the rotation vector of Q, decrease to zero.
    """

    begin: int
    end: int
    motion: PoseTuple
    about: Vector3 = ORIGIN
    turn: Quaternion = so3.IDENTITY
    shift: Vector3 = ORIGIN
    plan: Plan = AT_REST

    def moved(self, stamp: int, pose: PoseTuple) -> PoseTuple:
        """Return a sample moved by the correction at its stamp."""
        pose = se3.compose(self.motion, pose)
        if stamp >= self.end:
            return pose
        dx, dy, dz, turn = self.offset_at(stamp)
        q = so3.multiply(turn, pose[3:])
        x, y, z = self._moved_origin(pose[3:], q)
        return (pose[0] + dx + x, pose[1] + dy + y, pose[2] + dz + z, *q)

    def raw(self, stamp: int, pose: PoseTuple) -> PoseTuple:
        """Return a pose as received: the inverse of ``moved``."""
        if stamp < self.end:
            dx, dy, dz, turn = self.offset_at(stamp)
            q = so3.multiply(so3.conjugate(turn), pose[3:])
            x, y, z = self._moved_origin(pose[3:], q)
            pose = (pose[0] - dx + x, pose[1] - dy + y, pose[2] - dz + z, *q)
        return se3.compose(se3.inverse(self.motion), pose)

    def _moved_origin(self, before: Quaternion, after: Quaternion) -> Vector3:
        """Return how far the child's origin moves if the child rotates about the point."""
        about = self.about
        if about == ORIGIN:
            return ORIGIN
        (bx, by, bz), (ax, ay, az) = so3.rotate(before, about), so3.rotate(after, about)
        return (bx - ax, by - ay, bz - az)

    def offset_at(self, stamp: int) -> tuple[float, float, float, Quaternion]:
        """Return d and Q at a stamp of the blend."""
        gone = _gone(self._seconds(stamp), *self.plan[:2], min, max)
        x, y, z = self.shift
        return (x + gone[0], y + gone[1], z + gone[2], so3.multiply(so3.exp(gone[3:]), self.turn))

    def rates_at(self, stamp: int) -> tuple[Vector3, Vector3]:
        """Return the rate of d and the angular velocity of Q at a stamp, in the parent's axes."""
        if stamp >= self.end:
            return ORIGIN, ORIGIN
        seconds = self._seconds(stamp)
        turned = _gone(seconds, *self.plan[:2], min, max)[3:]
        vx, vy, vz, wx, wy, wz = self.plan.rates_at(seconds)
        return (vx, vy, vz), screws.left_jacobian_product(turned, (wx, wy, wz))

    def _seconds(self, stamp: int) -> float:
        return max(stamp - self.begin, 0) / NANOSECONDS_PER_SECOND

    def packed(self) -> 'array[float]':
        """Return everything but the two stamps."""
        main, aside, scale, acceleration = self.plan
        return array('d', [*self.motion, *self.about, *self.turn, *self.shift, *main.line,
                           *main[1:], *aside.line, *aside[1:], *scale, acceleration])

    @classmethod
    def unpacked(cls, begin: int, end: int, row: Sequence[float]) -> 'Stage':
        """Return the packed stage."""
        return cls(begin, end, _tuple(row[_MOTION]), _tuple(row[_ABOUT]), _tuple(row[_TURN]),
                   _tuple(row[_SHIFT]), Plan(_course(row[_MAIN]), _course(row[_ASIDE]),
                                             Scale(*row[_SCALE]), row[_ACCELERATION]))


def stage_of(begin: int, motion: PoseTuple, about: Vector3, offset: PoseTuple,
             plan: Plan) -> Stage:
    """
    Return the stage of a plan that begins at a stamp.

    :raises InvalidArgumentException: it would end after the last stamp of 64 bits.
    """
    span = plan.seconds * NANOSECONDS_PER_SECOND
    if not begin + span < _LAST:
        raise InvalidArgumentException(
            f'Moving {math.hypot(*offset[:3]):g} m and rotating by '
            f'{math.hypot(*so3.log(offset[3:])):g} rad within these limits takes {span:g} ns, '
            'which does not fit into stamps of 64 bits: use a shorter over, or a higher max_speed '
            'or max_turn_rate')
    return Stage(begin, begin + math.ceil(span), motion, about, offset[3:], offset[:3], plan)


def _gone(seconds: Number, main: _Course[Number], aside: _Course[Number],
          lesser: Callable[[Number, Number], Number],
          greater: Callable[[Number, Number | float], Number]) -> Six[Number]:
    """Return the change of d so far, and the rotation vector of the change of Q."""
    far, (a, b, c, d, e, f) = way(seconds, main[1:], lesser, greater), main[0]
    if aside is STANDING:
        return far * a, far * b, far * c, far * d, far * e, far * f
    near, (g, h, i, j, k, m) = way(seconds, aside[1:], lesser, greater), aside[0]
    return (far * a + near * g, far * b + near * h, far * c + near * i,
            far * d + near * j, far * e + near * k, far * f + near * m)


class Stages:
    """
    The successive stages of one edge, 384 bytes each.

    At the stamp where a stage begins, the previous stage applies, because earlier lookups
    used it.
    """

    __slots__ = ('newest', '_begins', '_ends', '_rows')

    def __init__(self, first: Stage) -> None:
        self._begins, self._ends, self._rows = array('q'), array('q'), array('d')
        self._append(first)

    def __len__(self) -> int:
        return len(self._begins)

    __bool__ = no_truth

    def _append(self, stage: Stage) -> None:
        self._begins.append(stage.begin)
        self._ends.append(stage.end)
        self._rows.extend(stage.packed())
        self.newest = stage

    def add(self, stage: Stage, oldest: int) -> None:
        """
        Add a stage; it replaces all that begin no earlier.

        :param oldest: stages that no sample from this stamp on needs are removed.
        """
        kept = bisect_left(self._begins, stage.begin)
        expired = max(bisect_left(self._begins, oldest) - 1, 0)
        if expired or kept < len(self):
            for each, size in ((self._begins, 1), (self._ends, 1), (self._rows, _FLOATS)):
                del each[size * kept:]
                del each[:size * expired]
        self._append(stage)

    def at(self, stamp: int) -> Stage:
        """Return the stage that applies at a stamp."""
        number = max(bisect_left(self._begins, stamp) - 1, 0)
        if number == len(self._begins) - 1:
            return self.newest
        return self._stage(number)

    def _stage(self, number: int) -> Stage:
        return Stage.unpacked(self._begins[number], self._ends[number],
                              self._rows[_FLOATS * number:_FLOATS * (number + 1)])

    # --- many stamps

    def settled_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return the final poses of samples (N, 7), without the blends."""
        return se3.compose_many(self._rows_at(stamps)[1][:, _MOTION], poses)

    def moved_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return samples (N, 7) moved by the corrections at their stamps (N,)."""
        fading, rows, seconds = self._rows_at(stamps)
        poses = se3.compose_many(rows[:, _MOTION], poses)
        if fading.any():
            poses[fading] = _changed(poses[fading], rows[fading], seconds[fading], 1.0)
        return poses

    def raw_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return poses (N, 7) as received: the inverse of ``moved_many``."""
        fading, rows, seconds = self._rows_at(stamps)
        if fading.any():
            poses = poses.copy()
            poses[fading] = _changed(poses[fading], rows[fading], seconds[fading], -1.0)
        return se3.compose_many(se3.inverse_many(rows[:, _MOTION]), poses)

    def _rows_at(self, stamps: Stamps) -> tuple[Mask, Array, Array]:
        """Return whether each stamp is in a blend, its row, and the seconds since its start."""
        which = np.maximum(np.searchsorted(self._begins, stamps, side='left') - 1, 0)
        # An array cannot grow while numpy has a view of it, so this function returns only copies.
        begins, ends = (np.frombuffer(each, np.int64)[which] for each in (
            self._begins, self._ends))
        rows = np.frombuffer(self._rows).reshape(-1, _FLOATS)[which]
        seconds = np.where(stamps > begins, stamps - begins, 0) / NANOSECONDS_PER_SECOND
        return stamps < ends, rows, seconds

    # --- copies and files

    def copy(self) -> 'Stages':
        """Return a copy."""
        twin = Stages(self.newest)
        twin._begins, twin._ends, twin._rows = self._begins[:], self._ends[:], self._rows[:]
        return twin

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the arrays."""
        for each in (self._begins, self._ends, self._rows):
            arrays.add(each)
        return {'stages': len(self)}

    @classmethod
    def load(cls, saved: Saved) -> 'Stages':
        """
        Return the saved data; it uses the memory in place, and nothing can be added.

        :raises ValueError: the arrays are not valid for stages.
        """
        count = saved.whole('stages', 1)
        twin = cls(Stage(BEGINNING, BEGINNING, se3.IDENTITY))
        # Memory views are read like arrays.
        twin._begins = cast('array[int]', saved.integers(count))
        twin._ends = cast('array[int]', saved.integers(count))
        twin._rows = cast('array[float]', saved.floats(_FLOATS * count))
        if (np.diff(np.frombuffer(twin._begins, np.int64).astype(float)) < 0.0).any():
            raise ValueError("'stages' are not in order")
        twin.newest = twin._stage(count - 1)
        return twin


def _changed(poses: Array, rows: Array, seconds: Array, sign: float) -> Array:
    """Return poses with the offset of a blend added (1) or removed (-1)."""
    main, aside = ((part[:6], *part[6:]) for part in (rows.T[_MAIN], rows.T[_ASIDE]))
    gone = np.stack(_gone(seconds, main, aside, np.minimum, np.maximum), axis=1)
    turn = so3.multiply_many(so3.exp_many(gone[:, 3:]), rows[:, _TURN])
    if sign < 0.0:
        turn = so3.conjugate_many(turn)
    q = so3.multiply_many(turn, poses[:, 3:])
    about = rows[:, _ABOUT]
    t = (poses[:, :3] + sign * (rows[:, _SHIFT] + gone[:, :3])
         + so3.rotate_many(poses[:, 3:], about) - so3.rotate_many(q, about))
    return np.concatenate([t, q], axis=1)


def _course(row: Sequence[float]) -> Course:
    return Course(_tuple(row[:6]), *row[6:])


def _tuple(numbers: Sequence[float]) -> Any:
    return tuple(numbers)
