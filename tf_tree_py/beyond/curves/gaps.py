# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The rotations and the rates at both ends of each gap of a gyroscope, which ``bridge`` connects.

Between two poses, the measured parts are rotated so that the motion agrees with both poses. The
turn in a gap is expected to be the integral of a rate that changes linearly from the one measured
before to the one measured after. The motion then misses the second pose, and each gap takes a
share of this error in proportion to the variance of its turn. If the rate is a random walk, given
at both ends, that is T^3 / 12 for a gap of the length T.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.packed import PackedSamples
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import from_seconds, NANOSECONDS_PER_SECOND

from .gyro import Gyro, rotation_of

BRIDGED = from_seconds(0.1)
"""In a longer gap the rates at its ends say nothing about the rest: it is crossed evenly."""

Gap = tuple[int, int]


class Between(NamedTuple):
    """
    The rotations between two poses, at the ends of the n gaps.

    A gap that begins before the interval, or ends after it, is cut off at the pose.

    :ivar gaps: whole, in order.
    :ivar starts: the rotation at the begin of each; ``ends``: at its end.
    :ivar bases: the rotation before, between and after the gaps, times the inverse of the
        gyroscope's orientation; anything where there is nothing before or after them.
    :ivar missed: the error of the second pose, as a rotation vector.
    :ivar shares: the part of it that each of the ``bases`` takes.
    """

    gaps: list[Gap]
    starts: list[Quaternion]
    ends: list[Quaternion]
    bases: list[Quaternion]
    missed: Vector3
    shares: list[float]


class Ends(NamedTuple):
    """
    The ends of the gaps of an edge's gyroscope.

    :ivar samples: of the edge.
    :ivar oldest: the index of the first sample that may be used; ``newest``: of the last.
    """

    samples: PackedSamples
    gyro: Gyro
    oldest: int
    newest: int

    def between(self, index: int) -> Between:
        """Return the rotations between a sample and the next."""
        begin, end = self.samples.stamps[index:index + 2]
        first, last = (rotation_of(self.samples.pose(each)) for each in (index, index + 1))
        gaps = _with_one_long(self.gyro.gaps(begin, end))
        now, until = first, begin
        starts, ends = [], []
        for gap in gaps:
            since = max(gap[0], begin)
            starts.append(now := self._measured(now, until, since))
            until = min(gap[1], end)
            ends.append(now := so3.multiply(now, self._expected(gap, since, until)))
        missed = so3.log(so3.multiply(last, so3.conjugate(self._measured(now, until, end))))
        shares = _shares(gaps, begin, end)
        turns = [so3.exp((share * missed[0], share * missed[1], share * missed[2]))
                 for share in shares]
        starts = [*map(so3.multiply, turns, starts)]
        ends = [*map(so3.multiply, turns[1:], ends)]
        bases = [self._base(rotation, stamp) for rotation, stamp in zip(
            [first, *ends], [begin, *(gap[1] for gap in gaps)], strict=True)]
        return Between(gaps, starts, ends, bases, missed, shares)

    def _measured(self, rotation: Quaternion, begin: int, end: int) -> Quaternion:
        """Return the rotation at a stamp from that at an earlier one, between two gaps."""
        if begin == end:
            return rotation
        return so3.multiply(self._base(rotation, begin), rotation_of(
            self.gyro.orientations.sample(end)))

    def _base(self, rotation: Quaternion, stamp: int) -> Quaternion:
        """Return a rotation times the inverse of the orientation, the identity if unknown."""
        known = self.gyro.orientations
        if (known.oldest_stamp is None or known.newest_stamp is None
                or not known.oldest_stamp <= stamp <= known.newest_stamp):
            return so3.IDENTITY
        return so3.multiply(rotation, so3.conjugate(rotation_of(known.sample(stamp))))

    def _expected(self, gap: Gap, since: int, until: int) -> Quaternion:
        """Return the turn that the rates at both ends of a gap suggest for a part of it."""
        before, after = self._rates_at_ends(gap)
        if before is None or after is None:
            return so3.IDENTITY
        middle = (0.5 * (since + until) - gap[0]) / (gap[1] - gap[0])
        seconds = (until - since) / NANOSECONDS_PER_SECOND
        x, y, z = (seconds * (one + middle * (other - one))
                   for one, other in zip(before, after, strict=True))
        return so3.exp((x, y, z))

    def _rates_at_ends(self, gap: Gap) -> tuple[Vector3 | None, Vector3 | None]:
        """Return the rates that were measured before and after a gap; None for a long one."""
        if _is_long(gap):
            return None, None
        return self.gyro.rate_before(gap[0]), self.gyro.rate_after(gap[1])

    def rates(self, gap: Gap, since: int, until: int) -> tuple[Vector3 | None, Vector3 | None]:
        """
        Return the rates at both ends of the part of a gap between two poses.

        At a pose in a gap it is that of the spline through all poses inside; None in a long gap,
        and as long as the pose after the gap is not known.

        :param since: the begin of the part; ``until``: its end.
        """
        if _is_long(gap):
            is_short = until - since <= BRIDGED
            return (self.gyro.rate_before(since) if is_short and since == gap[0] else None,
                    self.gyro.rate_after(until) if is_short and until == gap[1] else None)
        before, after = self._rates_at_ends(gap)
        known = {gap[0]: before, gap[1]: after}
        if (since, until) != gap:
            known |= self._rates_inside(gap, before, after)
        return known.get(since), known.get(until)

    def _rates_inside(self, gap: Gap, before: Vector3 | None,
                      after: Vector3 | None) -> dict[int, Vector3]:
        """Return the rates at the samples in a gap, by stamp; empty if not known yet."""
        first = bisect_right(self.samples.stamps, gap[0], self.oldest, self.newest + 1) - 1
        last = bisect_left(self.samples.stamps, gap[1], self.oldest, self.newest + 1)
        if first < self.oldest or last > self.newest:
            return {}
        rotations = {self.samples.stamps[index]: rotation_of(self.samples.pose(index))
                     for index in range(first + 1, last)}
        rotations[gap[0]] = self.between(first).starts[-1]
        rotations[gap[1]] = self.between(last - 1).ends[0]
        knots = sorted(rotations)
        return dict(zip(knots[1:-1], _rates_at_knots(
            knots, [rotations[knot] for knot in knots], before, after)[1:-1], strict=True))


def _is_long(gap: Gap) -> bool:
    return gap[1] - gap[0] > BRIDGED


def _with_one_long(gaps: list[Gap]) -> list[Gap]:
    """
    Return gaps of which one at most is long: from the begin of the first to the end of the last.

    The turns in two long gaps are not known, only their sum.
    """
    long = [number for number, gap in enumerate(gaps) if _is_long(gap)]
    if not long:
        return gaps
    first, last = long[0], long[-1]
    return [*gaps[:first], (gaps[first][0], gaps[last][1]), *gaps[last + 1:]]


def _shares(gaps: list[Gap], begin: int, end: int) -> list[float]:
    """
    Return the share of the error before each gap between two poses, and after all.

    A long gap takes all of it.
    """
    variances = [float(_is_long(gap)) for gap in gaps]
    if not any(variances):
        variances = [_variance(gap, max(gap[0], begin), min(gap[1], end)) for gap in gaps]
    total = sum(variances)
    return [*accumulate((variance / total for variance in variances[:-1]), initial=0.0), 1.0]


def _variance(gap: Gap, since: int, until: int) -> float:
    """Return the variance of the turn in a part of a gap, relative to that of the rate."""
    length = gap[1] - gap[0]
    s, part = (since - gap[0]) / length, (until - since) / length
    return length**3 * part**2 * (s + part / 3.0 - (s + 0.5 * part)**2)


def effects_of(missed: Vector3, shares: Sequence[float]) -> Array:
    """Return how the error of the last rotation changes those with n shares of it, (n, 3, 3)."""
    error, parts = np.array(missed), np.array(shares)
    return np.asarray(parts[:, None, None] * screws.left_jacobian_many(
        parts[:, None] * error) @ np.linalg.inv(screws.left_jacobian_many(error)))


def _rates_at_knots(stamps: Sequence[int], rotations: Sequence[Quaternion],
                    before: Vector3 | None, after: Vector3 | None) -> list[Vector3]:
    """
    Return the rates of a cubic spline through rotations.

    They make the angular acceleration continuous, to first order in the rotation from one knot
    to the next.

    :param stamps: of the n knots, n > 1; ``rotations``: at these.
    :param before: the rate at the first knot; ``after``: at the last. None: not bent there.
    :return: n rates in the child's axes, radians per second.
    """
    spans = np.diff(stamps) / NANOSECONDS_PER_SECOND
    turns = np.array([so3.log(so3.multiply(so3.conjugate(one), other)) for one, other in zip(
        rotations[:-1], rotations[1:], strict=True)])
    means = turns / spans[:, None]
    count = len(stamps)
    matrix, right = np.zeros((count, count)), np.zeros((count, 3))
    for knot in range(1, count - 1):
        one, other = 1.0 / spans[knot - 1:knot + 1]
        matrix[knot, knot - 1:knot + 2] = one, 2.0 * (one + other), other
        right[knot] = 3.0 * (one * means[knot - 1] + other * means[knot])
    for end, next_one, rate, mean in ((0, 1, before, means[0]), (-1, -2, after, means[-1])):
        matrix[end, end] = 1.0 if rate is not None else 2.0
        matrix[end, next_one] = 0.0 if rate is not None else 1.0
        right[end] = 3.0 * mean if rate is None else rate
    return [(x, y, z) for x, y, z in np.linalg.solve(matrix, right).tolist()]
