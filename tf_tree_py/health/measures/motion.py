# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measurements of the poses of one edge."""

from dataclasses import dataclass
import math

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds

from .sample_rows import JUDGED, Mask, Rows, Steps
from .spread import Spread
from .thresholds import Thresholds
from .turns import Turns

# tf2's tolerance of a quaternion's length is 0.01; the precision of a float32 is 1e-7.
_LENGTH_TOLERANCE = 1e-3
# A smaller step is noise.
_NOISE = 1e-3
# A step that is this many times larger and faster than both its neighbours is a jump, if it is
# also this many times faster than the usual ones, and at most this part of all are as fast.
_ISOLATED, _UNUSUAL, _SELDOM = 10.0, 5.0, 0.01
# A resting edge that is computed anew each time moves by this, metres and radians together.
_STILL = 1e-6
# The next step reverses a step if less than this part of it remains.
_LEFT = 0.3
# A slow jump has at least this size, metres or radians, and takes at least this long, so that many
# lookups fall into it.
_LARGE = 0.2
_LONG = from_seconds(0.09)


@dataclass
class Jump:
    """
    The largest of some steps.

    :ivar count: the number of steps.
    :ivar stamp: the stamp before the largest step, nanoseconds.
    :ivar time: from that stamp to the next, nanoseconds.
    :ivar gone: its translation, metres.
    :ivar turned: its rotation, radians.
    """

    count: int = 0
    stamp: int = 0
    time: int = 0
    gone: float = 0.0
    turned: float = 0.0

    def add(self, steps: Steps, which: Mask) -> None:
        """Add the marked ones of the steps that are judged."""
        found = np.flatnonzero(which) + 1
        if not len(found):
            return
        self.count += len(found)
        worst = found[steps.size[found].argmax()]
        if steps.size[worst] > self.gone + self.turned:
            self.stamp, self.time = int(steps.stamps[worst]), int(steps.time[worst])
            self.gone, self.turned = float(steps.gone[worst]), float(steps.turned[worst])


class Motion:
    """
    The motion of one edge.

    :ivar moved: whether any pose differs from the first.
    :ivar travelled: the largest distance from the first position along an axis, metres.
    :ivar planar: whether roll and pitch were always exactly zero.
    :ivar tilt: the largest angle between its z axis and its parent's, radians.
    :ivar off_length: how many quaternions are not of unit length; ``worst_length`` is the
        length furthest from one.
    :ivar steps: how many steps were judged.
    :ivar speeds: of its steps, metres per second; ``turn_rates`` likewise, radians per second.
    :ivar fast: steps faster than the limits and much faster than their neighbours.
    :ivar slow: large steps over a long time, much faster than their neighbours.
    :ivar outliers: steps faster than the limits that the next one reverses.
    :ivar lone: all steps that are not zero; few, if the edge rests.
    :ivar turns: samples that go to and fro, at any speed.
    """

    def __init__(self, limits: Thresholds) -> None:
        self._limits = limits
        self._first: Array | None = None
        self.moved, self.planar, self.tilt, self.travelled = False, True, 0.0, 0.0
        self.off_length, self.worst_length = 0, 1.0
        self.steps = 0
        self.speeds, self.turn_rates = Spread(), Spread()
        self.fast, self.slow, self.outliers, self.lone = Jump(), Jump(), Jump(), Jump()
        self.turns = Turns()

    def add(self, rows: Rows) -> None:
        """Add samples, and measure each without its neighbours."""
        poses = rows.poses
        if self._first is None:
            self._first = poses[:, :1].copy()
        self.moved = self.moved or bool((poses != self._first).any())
        if self.moved:
            self.travelled = max(self.travelled, float(
                np.abs(poses[:3] - self._first[:3]).max()))
        q = poses[3:]
        lengths = np.sqrt(np.einsum('ij,ij->j', q, q))
        off = np.abs(lengths - 1.0)
        worst = off.argmax()
        if off[worst] > _LENGTH_TOLERANCE:
            self.off_length += int(np.count_nonzero(off > _LENGTH_TOLERANCE))
            self.worst_length = max(self.worst_length, float(lengths[worst]),
                                    key=lambda length: abs(length - 1.0))
        if q[:2].any():
            self.planar = False
            self.tilt = max(self.tilt, 2.0 * math.asin(min(1.0, float(
                (np.hypot(q[0], q[1]) / lengths).max()))))

    def add_steps(self, steps: Steps) -> None:
        """Add steps; the first and the last two serve only to judge their neighbours."""
        self.steps += len(steps.time[JUDGED])
        if not self.moved:
            return
        seconds = np.maximum(steps.time, 1) / 1e9
        speeds, turn_rates = steps.gone / seconds, steps.turned / seconds
        onward = steps.time > 0
        self.speeds.add(speeds[JUDGED][onward[JUDGED]])
        self.turn_rates.add(turn_rates[JUDGED][onward[JUDGED]])
        self.lone.add(steps, steps.size[JUDGED] > _STILL)
        found = np.zeros((3, len(steps.time) - 3), bool)
        # Each is judged alone: a frame that turns fast may have a mounting that jumps.
        found |= _jumps(steps, 0, self._limits.max_speed)
        found |= _jumps(steps, 1, self._limits.max_turn_rate)
        fast, large, outlying = found & onward[JUDGED]
        self.fast.add(steps, fast)
        self.slow.add(steps, large & (steps.time[JUDGED] > _LONG))
        self.outliers.add(steps, outlying & onward[2:-1])
        self.turns.add(steps)

    def is_rare(self, jump: Jump) -> bool:
        """Return whether hardly any other step is as fast as a jump."""
        seconds = max(jump.time, 1) / 1e9
        return any(rate > _UNUSUAL * spread.median
                   and spread.part_above(rate) <= 2.0 * jump.count / spread.count + _SELDOM
                   for spread, rate in ((self.speeds, jump.gone / seconds),
                                        (self.turn_rates, jump.turned / seconds)))


def _jumps(steps: Steps, part: int, limit: float) -> npt.NDArray[np.bool_]:
    """
    Return which of the judged steps are jumps: fast ones, large ones, and outliers.

    A jump is much larger than the steps before and after it, and much faster: the time alone may
    be short because a stamp was late. So it counts as at least half of the times beside it.

    :param part: 0: of their translation, 1: of their rotation.
    :param limit: of the metres or radians per second.
    :return: (3, N - 4) for N rows.
    """
    sizes, seconds = steps.sizes[part], np.maximum(steps.time, 1) / 1e9
    here, rates = sizes[JUDGED], sizes / seconds
    alone = _is_alone(sizes) & _is_alone(rates)
    fast = sizes[1:-1] > limit * np.maximum(seconds[1:-1], 0.25 * (seconds[:-2] + seconds[2:]))
    pairs = fast[:-1] & fast[1:]
    if pairs.any():
        pairs &= (_is_pair(sizes) & _is_pair(rates)
                  & (steps.sizes_of_two[part][1:-1] < _LEFT * np.minimum(here, sizes[2:-1])))
    return np.array([alone & fast[:-1] & (here > _NOISE), alone & (here > _LARGE),
                     pairs & (here > _NOISE)])


def _is_alone(numbers: Array) -> Mask:
    """Return which steps have a much larger number than those before and after."""
    alone: Mask = numbers[JUDGED] > _ISOLATED * np.maximum(numbers[:-3], numbers[2:-1])
    return alone


def _is_pair(numbers: Array) -> Mask:
    """Return the same for a step and the next."""
    pair: Mask = np.minimum(numbers[JUDGED], numbers[2:-1]) > _ISOLATED * np.maximum(
        numbers[:-3], numbers[3:])
    return pair
