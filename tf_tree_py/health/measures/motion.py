# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measurements of the poses of one edge."""

from dataclasses import dataclass
import math

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds

from .sample_rows import JUDGED, Mask, Rows, Steps
from .spread import Spread
from .thresholds import Thresholds

# tf2's tolerance of a quaternion's length is 0.01; the precision of a float32 is 1e-7.
_LENGTH_TOLERANCE = 1e-3
# A smaller step is noise.
_NOISE = 1e-3
# A step that is this many times faster than both its neighbours is a jump.
_ISOLATED = 10.0
# Two publishers of one edge that differ by less than this do little harm.
_DISPUTE = 5e-3
# The next step reverses a step if less than this part of it remains.
_LEFT, _EXACTLY = 0.3, 0.05
# Radians; a rotation by more may have been one by less in the other direction.
_HALF = math.pi / 2
# A slow jump has at least this size, metres and radians together, and takes at least this long, so
# that many lookups fall into it.
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
        """Take the marked ones of the steps that are judged."""
        found = np.flatnonzero(which) + 1
        if not len(found):
            return
        self.count += len(found)
        worst = found[steps.size[found].argmax()]
        if steps.size[worst] > self.gone + self.turned:
            self.stamp, self.time = int(steps.stamps[worst]), int(steps.time[worst])
            self.gone, self.turned = float(steps.gone[worst]), float(steps.turned[worst])


class Turns:
    """
    Samples whose step the next one reverses, or that are beside the line of their neighbours.

    In the second case these neighbours are on the other side of theirs, as if two robots that
    drive side by side had one frame. The causes are two publishers, noise, and outliers.

    :ivar all: their number.
    :ivar exact: the number of those that are reversed exactly, as a vibration is only near half
        the rate of the samples.
    :ivar count: the number of those that did not arrive late.
    :ivar large: the number of samples more than half as far from that line as their median.
    :ivar sizes: their distances from that line, metres and radians together.
    :ivar spans: the time between the two neighbours, nanoseconds.
    :ivar first: when the first arrived, nanoseconds.
    :ivar last: when the last arrived, nanoseconds.
    """

    def __init__(self) -> None:
        self.all = self.exact = self.count = self.large = self.first = self.last = 0
        self.sizes, self.spans = Spread(), Spread()

    def add(self, steps: Steps) -> None:
        """Take steps; the first and the last two serve only to judge their neighbours."""
        # Of a wheel that turns by nearly half a turn a sample, nobody knows in which direction.
        smaller = np.minimum(steps.size[JUDGED], steps.size[2:-1])
        useful = ((smaller > _DISPUTE)
                  & ((steps.gone[JUDGED] > _DISPUTE) | (steps.turned[JUDGED] < _HALF)))
        if not useful.any():
            return
        aside = steps.aside
        sizes = _sizes(aside[:, 1:-1])
        rest = _sizes(aside[:, 1:-1] + 0.5 * (aside[:, :-2] + aside[:, 2:]))
        turns = useful & (sizes > _DISPUTE)
        reverse = turns & (steps.size_of_two[1:-1] < _LEFT * smaller)
        self.exact += int(np.count_nonzero(reverse | turns & (rest < _EXACTLY * sizes)))
        turns = reverse | turns & (rest < _LEFT * sizes)
        if turns.any():
            self.all += int(np.count_nonzero(turns))
            # Samples that arrive late are also beside the line.
            self.count += int(np.count_nonzero(
                turns & (steps.time[JUDGED] >= 0) & (steps.time[2:-1] >= 0)))
            self.sizes.add(sizes[turns])
            self.spans.add((steps.time[JUDGED] + steps.time[2:-1])[turns])
            received = steps.received[JUDGED][turns]
            self.first, self.last = self.first or int(received[0]), int(received[-1])
        if self.all:
            self.large += int(np.count_nonzero(sizes > 0.5 * self.sizes.median))


def _sizes(aside: Array) -> Array:
    sizes: Array = np.sqrt(np.einsum('ij,ij->j', aside[:3], aside[:3])) + np.sqrt(
        np.einsum('ij,ij->j', aside[3:], aside[3:]))
    return sizes


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
    :ivar turns: samples that go to and fro, at any speed.
    """

    def __init__(self, limits: Thresholds) -> None:
        self._limits = limits
        self._first: Array | None = None
        self.moved, self.planar, self.tilt, self.travelled = False, True, 0.0, 0.0
        self.off_length, self.worst_length = 0, 1.0
        self.steps = 0
        self.speeds, self.turn_rates = Spread(), Spread()
        self.fast, self.slow, self.outliers = Jump(), Jump(), Jump()
        self.turns = Turns()

    def add(self, rows: Rows) -> None:
        """Take samples, and measure each without its neighbours."""
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
        """Take steps; the first and the last two serve only to judge their neighbours."""
        self.steps += len(steps.time[JUDGED])
        if not self.moved:
            return
        seconds = np.maximum(steps.time, 1) / 1e9
        speeds, turn_rates = steps.gone / seconds, steps.turned / seconds
        onward = steps.time[JUDGED] > 0
        self.speeds.add(speeds[JUDGED][onward])
        self.turn_rates.add(turn_rates[JUDGED][onward])
        fast = ((speeds > self._limits.max_speed) | (turn_rates > self._limits.max_turn_rate))
        speed = speeds + turn_rates
        self._add_jumps(steps, speed, fast)
        if fast.any():
            self._add_outliers(steps, speed, fast)
        self.turns.add(steps)

    def _add_jumps(self, steps: Steps, speed: Array, fast: Mask) -> None:
        size, time, here = steps.size[JUDGED], steps.time[JUDGED], speed[JUDGED]
        alone = (time > 0) & (here > _ISOLATED * np.maximum(speed[:-3], speed[2:-1]))
        if alone.any():
            self.fast.add(steps, alone & fast[JUDGED] & (size > _NOISE))
            self.slow.add(steps, alone & (size > _LARGE) & (time > _LONG))

    def _add_outliers(self, steps: Steps, speed: Array, fast: Mask) -> None:
        """Count pairs of a step and its reverse, if the steps around them are much slower."""
        size = np.minimum(steps.size[JUDGED], steps.size[2:-1])
        pair = np.minimum(speed[JUDGED], speed[2:-1])
        self.outliers.add(steps, (
            fast[JUDGED] & fast[2:-1] & (steps.time[JUDGED] > 0) & (steps.time[2:-1] > 0)
            & (pair > _ISOLATED * np.maximum(speed[:-3], speed[3:]))
            & (steps.size_of_two[1:-1] < _LEFT * size) & (size > _NOISE)))
