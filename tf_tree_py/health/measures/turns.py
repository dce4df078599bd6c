# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Samples of one edge that go to and fro, and whether only two publishers can have sent them.

A publisher may stamp a sample late by any part of its period. That does not make it go to and fro:
see ``Steps.aside``. Two publishers leave two tracks, each with regular stamps of its own.
"""

from collections.abc import Iterable, Sequence
import math
from operator import mul

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.times import Stamps

from .sample_rows import JUDGED, Mask, Steps
from .spread import quantiles, Spread

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
        self._examined = math.inf
        # The last samples: stamps and arrivals, poses, and whether each is aside alone.
        self._times: Stamps = np.empty((2, 0), np.int64)
        self._poses: Array = np.empty((7, 0))
        self._turns: Mask = np.empty(0, bool)

    @property
    def intervals(self) -> tuple[float, float] | None:
        """Return the intervals of two publishers that alternated at any time, if they did."""
        return self._intervals or _intervals_of_two(self._times, self._poses, self._turns)

    def add(self, steps: Steps) -> None:
        """Add steps; the first and the last two serve only to judge their neighbours."""
        # Of a wheel that turns by nearly half a turn a sample, the direction is not known.
        smaller = np.minimum(steps.size[JUDGED], steps.size[2:-1])
        slow = (steps.turned[JUDGED] < _HALF) & (steps.turned[2:-1] < _HALF)
        useful = (smaller > _DISPUTE) & (slow | (steps.gone[JUDGED] > _DISPUTE))
        if useful.any():
            self._add_turns(steps, smaller, slow, useful)
        elif self.all:
            self._examine(steps, useful, begin=0)

    def _add_turns(self, steps: Steps, smaller: Array, slow: Mask, useful: Mask) -> None:
        aside = steps.aside
        sizes = _sizes(aside[:, 1:-1])
        rest = _sizes(aside[:, 1:-1] + 0.5 * (aside[:, :-2] + aside[:, 2:]))
        aloof = useful & (sizes > _DISPUTE)
        reverse = aloof & (np.add(*steps.sizes_of_two)[1:-1] < _LEFT * smaller)
        turns = reverse | aloof & slow & (rest < _LEFT * sizes)
        begin = 0 if self.all else int(turns.argmax())
        if turns.any():
            self.all += int(np.count_nonzero(turns))
            self.sizes.add(sizes[turns])
            received = steps.received[2:-1][turns]
            self.first, self.last = self.first or int(received[0]), int(received[-1])
        if self.all:
            # Beside a single sample of another publisher, its neighbours go half as far aside.
            around = np.maximum(_sizes(aside[:, :-2]), _sizes(aside[:, 2:]))
            self._examine(steps, turns & (sizes > _ALONE * around), begin)

    def _examine(self, steps: Steps, turns: Mask, begin: int) -> None:
        """Add the second rows of the steps that are judged."""
        if self._intervals:
            return
        times = np.concatenate([self._times, np.array(
            [steps.stamps[2:-1], steps.received[2:-1]])[:, begin:]], axis=1)
        poses = np.concatenate([self._poses, steps.points[:, 2:-2][:, begin:]], axis=1)
        turns = np.concatenate([self._turns, turns[begin:]])
        while len(turns) >= _TOGETHER and not self._intervals:
            if abs(int(times[0, 0]) - self._examined) > _OFTEN:
                self._examined = int(times[0, _TOGETHER - 1])
                self._intervals = _intervals_of_two(
                    times[:, :_TOGETHER], poses[:, :_TOGETHER], turns[:_TOGETHER])
            times, poses, turns = times[:, _TOGETHER:], poses[:, _TOGETHER:], turns[_TOGETHER:]
        self._times, self._poses, self._turns = times.copy(), poses.copy(), turns.copy()


def _sizes(aside: Array) -> Array:
    sizes: Array = np.sqrt(np.einsum('ij,ij->j', aside[:3], aside[:3])) + np.sqrt(
        np.einsum('ij,ij->j', aside[3:], aside[3:]))
    return sizes


# --- the tracks of two publishers

# Each track has at least this many samples, and they are aside at least this often: fewer may be
# chance, if an edge turns by about half a turn a sample.
_EACH, _TURNS = 8, 16
# The intervals of one publisher vary by less than this part of the variation of those of two, and
# those of the other by less than this part of themselves. Those of two vary by more than the last.
_REGULAR, _NEARLY, _IRREGULAR = 0.5, 0.75, 0.1
# The tracks alternate if at least this part of the samples are on another one than those before.
_ALTERNATE = 0.7
# Metres and radians together: a track within this stands still, one beyond many of it moves.
_STILL, _MANY = 1e-3, 20.0
# If a larger part of the stamps is not newer than the one before, arrivals are compared, too.
_SELDOM = 0.05
# Metres per second squared: nothing that moves to and fro accelerates more.
_SHAKEN = 3000.0


def _intervals_of_two(times: Stamps, points: Array,
                      turns: Mask) -> tuple[float, float] | None:
    """
    Return the usual intervals of two publishers, nanoseconds; None: it may be one.

    Only a second publisher adds samples between those of the first, so that the stamps are regular
    on one track and irregular together. An outlier replaces a sample, and the stamps of
    a publisher that vibrates vary as much on each side as together. Nor does a publisher return to
    one pose at every second sample and move in between, or accelerate without limit.

    :param times: (2, N) stamps and arrivals, nanoseconds. Where stamps repeat or are out of order,
        the arrivals may show the tracks.
    :param points: (7, N) as ``Steps.points``.
    :param turns: (N,) whether each sample is on another side than the one before and after it.
    """
    if np.count_nonzero(turns) < _TURNS:
        return None
    stamps, received = times
    wrong = (len(stamps) - len(np.unique(stamps)) + np.count_nonzero(np.diff(stamps) < 0)) / len(
        stamps)
    return _tracks(stamps, points, turns) or (
        _tracks(received, points, turns) if wrong > _SELDOM else None)


def _tracks(times: Stamps, points: Array, turns: Mask) -> tuple[float, float] | None:
    # Where messages of two publishers overtake each other, only their stamps are in order.
    order = np.argsort(times, kind='stable')
    times, points = times[order], points[:, order]
    return (_regular_tracks(times, points, _sides_of_turns(turns)[order])
            or _regular_tracks(times, points, _nearest_tracks(points))
            or _regular_tracks(times, points, _at_most_common(points)))


def _sides_of_turns(turns: Mask) -> Mask:
    changes = turns.copy()
    changes[1:] |= turns[:-1]
    sides: Mask = np.cumsum(changes) % 2 > 0
    return sides


def _nearest_tracks(points: Array) -> Mask:
    """Put each sample on the track whose last sample is nearest; the largest step begins both."""
    begin = int(np.linalg.norm(np.diff(points), axis=0).argmax()) + 1
    rows = points.T.tolist()
    before = _follow(reversed(rows[:begin - 1]), rows[begin - 1], rows[begin])
    after = _follow(rows[begin + 1:], rows[begin - 1], rows[begin])
    return np.array([*reversed(before), False, True, *after])


def _at_most_common(points: Array) -> Mask:
    """Return which points are at the pose that occurs most often, such as zero."""
    rounded = np.rint(points / _STILL)
    rounded[3:] *= np.copysign(1.0, rounded[6])
    _, places, counts = np.unique(rounded, axis=1, return_inverse=True, return_counts=True)
    common: Mask = places.ravel() == counts.argmax()
    return common


def _follow(rows: Iterable[Sequence[float]], one: Sequence[float],
            other: Sequence[float]) -> list[bool]:
    """Return whether each point is nearer to the last point of the other track."""
    found = []
    for row in rows:
        is_other = _apart(row, other) < _apart(row, one)
        one, other = (one, row) if is_other else (row, other)
        found.append(is_other)
    return found


def _apart(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the square of the distance, less eight; q and -q are one rotation."""
    same: float = sum(map(mul, a[3:], b[3:]))
    return math.dist(a[:3], b[:3]) ** 2 - 2.0 * abs(same)


def _regular_tracks(stamps: Stamps, points: Array, sides: Mask) -> tuple[float, float] | None:
    count = np.count_nonzero(sides)
    if not _EACH <= count <= len(sides) - _EACH:
        return None
    larger = sides == (2 * count > len(sides))
    first, varies = _intervals(stamps[larger])
    second, of_second = _intervals(stamps[~larger])
    usual, together = _intervals(stamps)
    added = (varies < _REGULAR * together and together > _IRREGULAR * usual
             and of_second < _NEARLY * second)
    alternate = int(np.count_nonzero(sides[1:] != sides[:-1])) > _ALTERNATE * len(sides)
    both = added or alternate and (_returns(points, sides) or _is_shaken(points, usual))
    return (first, second) if both else None


def _returns(points: Array, sides: Mask) -> bool:
    """Return whether one side is at one pose, while the other is on the move."""
    still, moving = sorted(_extent(points[:, side]) for side in (sides, ~sides))
    return still < _STILL and moving > _MANY * _STILL


def _is_shaken(points: Array, interval: float) -> bool:
    """Return whether an oscillation with these points, nanoseconds apart, is impossible."""
    apart = np.median(np.linalg.norm(np.diff(points[:3]), axis=0))
    # Of amplitude a and angular frequency w, it accelerates by a w^2 at most.
    return bool(0.5 * apart * (np.pi * 1e9) ** 2 > _SHAKEN * interval ** 2)


def _extent(points: Array) -> float:
    signs = np.where(points[3:, :1].T @ points[3:] < 0.0, -1.0, 1.0)
    return float(np.ptp(points[:3], axis=1).sum() + np.ptp(signs * points[3:], axis=1).sum())


def _intervals(stamps: Stamps) -> tuple[float, float]:
    """Return the usual interval, and by how much the middle 80 % of the intervals vary."""
    low, usual, high = quantiles(np.sort(np.diff(stamps)), (0.1, 0.5, 0.9))
    return usual, high - low
