# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Samples of one edge that go to and fro, and whether only two publishers can have sent them.

A publisher may stamp a sample late by any part of its period. That does not make it go to and fro:
see ``Steps.aside``.
"""

import math

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamps

from .sample_rows import JUDGED, Mask, Steps
from .spread import Spread
from .two_tracks import intervals_of_two

# Two publishers of one edge that differ by less than this do little harm.
_DISPUTE = 5e-3
# The next step reverses a step if less than this part of it remains.
_LEFT = 0.3
# Radians; a rotation by more may have been one by less in the other direction.
_HALF = math.pi / 2
# The other publisher's sample is further aside than this part of its neighbours' distances.
_ALONE = 0.75
# This many samples are examined together; of a fast edge with noise, not all, because that would
# take most of the time. Nanoseconds from the last one examined to the next.
_TOGETHER, _OFTEN = 256, from_seconds(1.0)


class Turns:
    """
    Samples that the next one reverses, or that are beside the line between their neighbours.

    In the second case these neighbours are on the other side of theirs, as if two robots that
    drive side by side had one frame. The causes are two publishers, noise, and outliers.

    :ivar all: their number.
    :ivar sizes: their distances from that line, metres and radians together.
    :ivar first: when the first arrived, nanoseconds.
    :ivar last: when the last arrived, nanoseconds.
    """

    def __init__(self) -> None:
        self.all = self.first = self.last = 0
        self.sizes = Spread()
        self._intervals: tuple[float, float] | None = None
        # Those of the last samples, and whether they were judged since the last change.
        self._partial: tuple[float, float] | None = None
        self._judged = False
        # The last samples: stamps and arrivals, poses, and whether each is aside alone.
        self._began, self._examined = False, -2 * _OFTEN
        self._times: Stamps = np.empty((2, 0), np.int64)
        self._poses: Array = np.empty((7, 0))
        self._turns: Mask = np.empty(0, bool)

    @property
    def intervals(self) -> tuple[float, float] | None:
        """Return the intervals of two publishers that alternated at any time, if they did."""
        if not self._intervals and not self._judged:
            # A report asks several times, and this takes about a millisecond.
            self._judged = True
            self._partial = intervals_of_two(self._times, self._poses, self._turns)
        return self._intervals or self._partial

    def add(self, steps: Steps) -> None:
        """Add steps; the first and the last two serve only to judge their neighbours."""
        # Of a wheel that turns by nearly half a turn a sample, the direction is not known.
        smaller = np.minimum(steps.size[JUDGED], steps.size[2:-1])
        slow = (steps.turned[JUDGED] < _HALF) & (steps.turned[2:-1] < _HALF)
        useful = (smaller > _DISPUTE) & (slow | (steps.gone[JUDGED] > _DISPUTE))
        if useful.any():
            self._add_turns(steps, smaller, slow, useful)
        elif self.all:
            self._examine(steps, useful)

    def _add_turns(self, steps: Steps, smaller: Array, slow: Mask, useful: Mask) -> None:
        aside = steps.aside
        sizes = _sizes(aside[:, 1:-1])
        rest = _sizes(aside[:, 1:-1] + 0.5 * (aside[:, :-2] + aside[:, 2:]))
        aloof = useful & (sizes > _DISPUTE)
        reverse = aloof & (np.add(*steps.sizes_of_two)[1:-1] < _LEFT * smaller)
        turns = reverse | aloof & slow & (rest < _LEFT * sizes)
        if turns.any():
            self.all += int(np.count_nonzero(turns))
            self.sizes.add(sizes[turns])
            received = steps.received[JUDGED][turns]
            self.first, self.last = self.first or int(received[0]), int(received[-1])
        if self.all:
            # Beside a single sample of another publisher, its neighbours go half as far aside.
            around = np.maximum(_sizes(aside[:, :-2]), _sizes(aside[:, 2:]))
            self._examine(steps, turns & (sizes > _ALONE * around))

    def _examine(self, steps: Steps, turns: Mask) -> None:
        """Add the second rows of the steps that are judged, from the first turn on."""
        if self._intervals:
            return
        begin = 0 if self._began else int(turns.argmax())
        self._began = True
        times = np.concatenate([self._times, np.array(
            [steps.stamps[2:-1], steps.received[2:-1]])[:, begin:]], axis=1)
        poses = np.concatenate([self._poses, steps.points[:, 2:-2][:, begin:]], axis=1)
        turns = np.concatenate([self._turns, turns[begin:]])
        while len(turns) >= _TOGETHER and not self._intervals:
            if abs(int(times[0, 0]) - self._examined) > _OFTEN:
                self._examined = int(times[0, _TOGETHER - 1])
                self._intervals = intervals_of_two(
                    times[:, :_TOGETHER], poses[:, :_TOGETHER], turns[:_TOGETHER])
            times, poses, turns = times[:, _TOGETHER:], poses[:, _TOGETHER:], turns[_TOGETHER:]
        self._times, self._poses, self._turns = times.copy(), poses.copy(), turns.copy()
        self._judged = False


def _sizes(aside: Array) -> Array:
    sizes: Array = np.sqrt(np.einsum('ij,ij->j', aside[:3], aside[:3])) + np.sqrt(
        np.einsum('ij,ij->j', aside[3:], aside[3:]))
    return sizes
