# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The rotation of an edge in a gap of its gyroscope, from what was measured before and after.

The gap is bridged by the smoothest rotation, that with the least mean square of the angular
acceleration: a cubic spline through the rotations at both ends of the gap and the poses
inside, with the rates that were measured at both ends. If the rate is a random walk, this spline
is the expected rotation: Kimeldorf, Wahba, "A Correspondence Between Bayesian Estimation on
Stochastic Processes and Smoothing by Splines", Annals of Mathematical Statistics 41(2), 1970.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.histories import DynamicHistory
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps

from .gyro import Gyro, rotation_of

BRIDGED = from_seconds(0.1)
"""In a longer gap the rates at its ends say nothing about the rest: it is crossed evenly."""


Terms = tuple[Vector3, Vector3, Vector3]

# For the derivatives by a rotation vector, radians.
_STEP = 1e-5


class Bridge(NamedTuple):
    """
    The motion between two poses, of which the gyroscope did not measure a part.

    Before the gap, the rotation is that of the gyroscope since the first pose; after it, that of
    the gyroscope until the second. In between it is R(s) = Ra Exp(s c1 + s^2 c2 + s^3 c3), s from
    0 to 1.

    :ivar place: the position at the beginning; ``way``: from there to that at the end.
    :ivar latest: the newest stamp of the poses for which it was computed.
    :ivar gap: the begin and the end of the gap, within the interval.
    :ivar first: the rotation before the gap, times the inverse of the gyroscope's orientation;
        ``last``: likewise after the gap.
    :ivar start: Ra.
    :ivar turn: Log(Ra^-1 Rb).
    :ivar rates: those before the gap and after it, in the child's axes; None if unknown.
    :ivar terms: c1, c2, c3.
    """

    begin: int
    end: int
    place: Vector3
    way: Vector3
    latest: int
    gap: tuple[int, int]
    first: Quaternion
    last: Quaternion
    start: Quaternion
    turn: Vector3
    rates: tuple[Vector3 | None, Vector3 | None]
    terms: Terms

    def rotation(self, stamp: int, measured: DynamicHistory) -> Quaternion:
        """
        Return the rotation at a stamp within the interval.

        :param measured: the gyroscope's orientations.
        """
        begin, end = self.gap
        if not begin < stamp < end:
            return so3.multiply(self.first if stamp <= begin else self.last,
                                rotation_of(measured.sample(stamp)))
        s = (stamp - begin) / (end - begin)
        x, y, z = (s * (c1 + s * (c2 + s * c3)) for c1, c2, c3 in zip(*self.terms, strict=True))
        return so3.multiply(self.start, so3.exp((x, y, z)))

    def rotations(self, passed: Array, measured: Array) -> Array:
        """Return ``rotation`` (N, 4), nanoseconds (N,) after the begin; orientations (N, 4)."""
        begin, end = self.gap
        s = ((passed - (begin - self.begin)) / (end - begin))[:, None]
        bridged = so3.multiply_many(np.array(self.start), so3.exp_many(_turned(self.terms, s)))
        before, after = (so3.multiply_many(np.array(each), measured)
                         for each in (self.first, self.last))
        return np.where(s <= 0.0, before, np.where(s >= 1.0, after, bridged))

    def effects(self, stamps: Stamps) -> Array:
        """
        Return the errors of rotations, relative to that of the second pose, (N, 3, 3).

        The error of the second pose is that of Rb, which changes Log(Ra^-1 Rb) and with it the
        rotation in the gap. All axes are the parent's. The rates are regarded as certain.
        """
        begin, end = self.gap
        s = np.clip((stamps - begin) / (end - begin), 0.0, 1.0)[:, None]
        seconds = (end - begin) / NANOSECONDS_PER_SECOND
        columns = []
        for step in _STEP * np.eye(3):
            low, high = (_turned(crossed(_vector(np.array(self.turn) + change), seconds,
                                         *self.rates), s) for change in (-step, step))
            columns.append((high - low) / (2.0 * _STEP))
        changes = np.stack(columns, axis=-1) @ np.linalg.inv(
            se3.left_jacobian_many(np.array(self.turn)))
        axes = so3.as_matrix_many(np.array(self.start))
        within = axes @ se3.left_jacobian_many(_turned(self.terms, s)) @ changes @ axes.T
        return np.where(s[..., None] < 1.0, within, np.eye(3))


def _turned(terms: Terms, s: Array) -> Array:
    """Return the rotation vectors (N, 3) at parts (N, 1) of a gap."""
    c1, c2, c3 = np.array(terms)
    return np.asarray(s * (c1 + s * (c2 + s * c3)))


def crossed(turn: Vector3, seconds: float, before: Vector3 | None,
            after: Vector3 | None) -> Terms:
    """
    Return the terms of a bridge.

    With both rates the rotation vector is the cubic of Hermite. Without one of them, that
    end is not bent, as at the end of a natural spline; without both the rate is constant.

    :param turn: Log(Ra^-1 Rb).
    :param before: the rate in the child's axes at the beginning, radians per second, or None;
        ``after``: at the end.
    """
    q, still = np.array(turn), np.zeros(3)
    a, b = (still if rate is None else seconds * np.array(rate) for rate in (before, after))
    if after is not None:
        # The rate of the rotation vector: Jr(q)^-1 b = Jl(-q)^-1 b.
        b = np.array(se3.log((*b.tolist(), *so3.exp(_vector(-q))))[:3])
    if before is None and after is None:
        terms = q, still, still
    elif before is None:
        terms = b + 1.5 * (q - b), still, -0.5 * (q - b)
    elif after is None:
        terms = a, 1.5 * (q - a), -0.5 * (q - a)
    else:
        terms = a, 3.0 * q - 2.0 * a - b, a + b - 2.0 * q
    first, second, third = map(_vector, terms)
    return first, second, third


def _vector(array: Array) -> Vector3:
    x, y, z = array.tolist()
    return x, y, z


def rates_at_knots(stamps: Sequence[int], rotations: Sequence[Quaternion],
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
    return [*map(_vector, np.linalg.solve(matrix, right))]


# --- the gap

def bridged(stamps: Sequence[int], pose_of: Callable[[int], PoseTuple], gyro: Gyro, index: int,
            oldest: int, newest: int) -> Bridge | None:
    """
    Return the bridge from a sample to the next, between which the gyroscope has a gap.

    :param pose_of: the pose of a sample by its index.
    :param oldest: the index of the first sample that may be used; ``newest``: of the last.
    :return: None if nothing was measured between the two samples.
    """
    begin, end = stamps[index:index + 2]
    gap, around = _gap_and_samples(stamps, gyro, index, oldest, newest)
    since, until = max(gap[0], begin), min(gap[1], end)
    rotations = _Rotations(stamps, pose_of, gyro)
    if around is not None:
        rates = rotations.rates_across(gap, *around)
        before, after = rates[since], rates[until]
    elif (since, until) == (begin, end):
        return None
    else:
        is_short = until - since <= BRIDGED
        before = gyro.rate_before(since) if is_short and since == gap[0] else None
        after = gyro.rate_after(until) if is_short and until == gap[1] else None
    start, turned = rotations.at(since, index), rotations.at(until, index + 1)
    turn = so3.log(so3.multiply(so3.conjugate(start), turned))
    (x, y, z, *_), (ex, ey, ez, *_) = pose_of(index), pose_of(index + 1)
    return Bridge(begin, end, (x, y, z), (ex - x, ey - y, ez - z), stamps[-1], (since, until),
                  rotations.base(index) if since > begin else so3.IDENTITY,
                  rotations.base(index + 1) if until < end else so3.IDENTITY,
                  start, turn, (before, after),
                  crossed(turn, (until - since) / NANOSECONDS_PER_SECOND, before, after))


def _gap_and_samples(stamps: Sequence[int], gyro: Gyro, index: int, oldest: int,
                     newest: int) -> tuple[tuple[int, int], tuple[int, int] | None]:
    """
    Return the gap between a sample and the next, and the samples before and after it.

    Gaps without a sample between them are one. The samples are None if one is not known yet,
    or the gap is long: then it ends at the sample, and begins again there.
    """
    own = gap = gyro.gap(stamps[index], stamps[index + 1]) or (stamps[index], stamps[index])
    while gap[1] - gap[0] <= BRIDGED:
        around = (bisect_right(stamps, gap[0], oldest, newest + 1) - 1,
                  bisect_left(stamps, gap[1], oldest, newest + 1))
        if around[0] < oldest or around[1] > newest:
            break
        wider = gyro.gap(stamps[around[0]], stamps[around[1]]) or gap
        if wider == gap:
            return gap, around
        gap = wider
    return own, None


class _Rotations(NamedTuple):
    """The rotations of the poses at samples, and by the gyroscope before and after each."""

    stamps: Sequence[int]
    pose_of: Callable[[int], PoseTuple]
    gyro: Gyro

    def base(self, index: int) -> Quaternion:
        """Return the rotation of a sample, times the inverse of the gyroscope's orientation."""
        return so3.multiply(rotation_of(self.pose_of(index)), so3.conjugate(rotation_of(
            self.gyro.orientations.sample(self.stamps[index]))))

    def at(self, stamp: int, index: int) -> Quaternion:
        """Return the rotation at a stamp, from a sample."""
        if stamp == self.stamps[index]:
            return rotation_of(self.pose_of(index))
        return so3.multiply(self.base(index), rotation_of(
            self.gyro.orientations.sample(stamp)))

    def rates_across(self, gap: tuple[int, int], first: int,
                     last: int) -> dict[int, Vector3 | None]:
        """
        Return the rates at both ends of a gap and at the samples inside, by stamp.

        :param first: the index of the sample before the gap; ``last``: after it.
        """
        rotations = {self.stamps[index]: rotation_of(self.pose_of(index))
                     for index in range(first + 1, last)}
        rotations[gap[0]], rotations[gap[1]] = self.at(gap[0], first), self.at(gap[1], last)
        knots = sorted(rotations)
        before, after = self.gyro.rate_before(gap[0]), self.gyro.rate_after(gap[1])
        if len(knots) == 2:
            return {gap[0]: before, gap[1]: after}
        return dict(zip(knots, rates_at_knots(
            knots, [rotations[knot] for knot in knots], before, after), strict=True))
