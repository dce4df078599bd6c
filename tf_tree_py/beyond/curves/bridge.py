# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The rotation of an edge in the gaps of its gyroscope, from what was measured before and after.

A gap is bridged by the smoothest rotation, that with the least mean square of the angular
acceleration: a cubic spline through the rotations at both ends of the gap and the poses
inside, with the rates that were measured at both ends. If the rate is a random walk, this spline
is the expected rotation: Kimeldorf, Wahba, "A Correspondence Between Bayesian Estimation on
Stochastic Processes and Smoothing by Splines", Annals of Mathematical Statistics 41(2), 1970.
The rotations at the ends are in ``gaps``.
"""

from bisect import bisect_left
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.packed import PackedSamples
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array, Quaternion, Vector3
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Indices, Mask, Stamps

from .gaps import effects_of, Ends
from .gyro import Gyro, rotation_of

Terms = tuple[Vector3, Vector3, Vector3]

# For the derivatives by a rotation vector, radians.
_STEP = 1e-5


class Crossing(NamedTuple):
    """
    The rotation in a gap: R(s) = Ra Exp(s c1 + s^2 c2 + s^3 c3), s from 0 to 1.

    :ivar begin: that of the gap within the interval between two poses; ``end`` likewise.
    :ivar start: Ra.
    :ivar turn: Log(Ra^-1 Rb).
    :ivar rates: those before the gap and after it, in the child's axes; None if unknown.
    :ivar terms: c1, c2, c3.
    """

    begin: int
    end: int
    start: Quaternion
    turn: Vector3
    rates: tuple[Vector3 | None, Vector3 | None]
    terms: Terms

    def rotation(self, stamp: int) -> Quaternion:
        """Return the rotation at a stamp in the gap."""
        s = (stamp - self.begin) / (self.end - self.begin)
        x, y, z = (s * (c1 + s * (c2 + s * c3)) for c1, c2, c3 in zip(*self.terms, strict=True))
        return so3.multiply(self.start, so3.exp((x, y, z)))

    def rotations(self, s: Array) -> Array:
        """Return the quaternions (N, 4) at parts (N, 1) of the gap."""
        return so3.multiply_many(np.array(self.start), so3.exp_many(_turned(self.terms, s)))

    def effects(self, s: Array, first: Array, last: Array) -> Array:
        """
        Return how the errors at both ends change the rotations, (N, 3, 3), in the parent's axes.

        They change Log(Ra^-1 Rb) and with it the rotation in the gap. The rates are regarded as
        certain.

        :param s: parts (N, 1) of the gap.
        :param first: what the error of the pose makes of that of Ra, (3, 3); ``last``: of Rb.
        """
        turn, seconds = np.array(self.turn), (self.end - self.begin) / NANOSECONDS_PER_SECOND
        columns = []
        for step in _STEP * np.eye(3):
            low, high = (_turned(crossed(_vector(turn + change), seconds, *self.rates), s)
                         for change in (-step, step))
            columns.append((high - low) / (2.0 * _STEP))
        changes = np.stack(columns, axis=-1) @ np.linalg.inv(screws.left_jacobian_many(turn))
        axes = so3.as_matrix_many(np.array(self.start))
        return np.asarray(first + axes @ screws.left_jacobian_many(
            _turned(self.terms, s)) @ changes @ axes.T @ (last - first))


class Bridge(NamedTuple):
    """
    The motion between two poses, of which the gyroscope did not measure some parts.

    Before the first gap, the rotation is that of the gyroscope since the first pose; after the
    last gap, that of the gyroscope until the second; see ``gaps.Ends`` for that in between.

    :ivar place: the position at the beginning; ``way``: from there to that at the end.
    :ivar latest: the newest stamp of the poses for which it was computed.
    :ivar bases: the rotation before, between and after the gaps, times the inverse of the
        gyroscope's orientation.
    :ivar missed: the error of the second pose before it was shared out, a rotation vector.
    :ivar shares: the part of it that each of the ``bases`` takes.
    :ivar crossings: of the n gaps.
    """

    begin: int
    end: int
    place: Vector3
    way: Vector3
    latest: int
    bases: list[Quaternion]
    missed: Vector3
    shares: list[float]
    crossings: list[Crossing]

    def rotation(self, stamp: int, measured: Samples) -> Quaternion:
        """
        Return the rotation at a stamp within the interval.

        :param measured: the gyroscope's orientations.
        """
        passed = bisect_left(self.crossings, stamp, key=lambda crossing: crossing.begin)
        if passed and stamp < self.crossings[passed - 1].end:
            return self.crossings[passed - 1].rotation(stamp)
        return so3.multiply(self.bases[passed], rotation_of(measured.sample(stamp)))

    def rotations(self, passed: Array, measured: Array) -> Array:
        """Return ``rotation`` (N, 4), nanoseconds (N,) after the begin; orientations (N, 4)."""
        number, inside = self._around(passed)
        found = so3.multiply_many(np.array(self.bases)[number], measured)
        for crossing, here, s in inside:
            found[here] = self.crossings[crossing].rotations(s)
        return np.asarray(found)

    def effects(self, stamps: Stamps) -> Array:
        """
        Return the errors of rotations, relative to that of the second pose, (N, 3, 3).

        All axes are the parent's.
        """
        number, inside = self._around(np.asarray(stamps - self.begin, dtype=float))
        at_ends = effects_of(self.missed, self.shares)
        found: Array = at_ends[number]
        for crossing, here, s in inside:
            found[here] = self.crossings[crossing].effects(
                s, *at_ends[crossing:crossing + 2])
        return found

    def _around(self, passed: Array) -> tuple[Indices, list[tuple[int, Mask, Array]]]:
        """
        Return how many gaps have begun before each time (N,) after the begin of the interval.

        Also return each gap that contains some of them, which they are, and the parts (n, 1) of
        the gap at these.
        """
        edges = np.array([(each.begin, each.end) for each in self.crossings]) - self.begin
        number = np.searchsorted(edges[:, 0], passed)
        begins, ends = edges[np.maximum(number, 1) - 1].T
        inside = (number > 0) & (passed < ends)
        s = ((passed - begins) / (ends - begins))[:, None]
        return number, [(each - 1, here, s[here]) for each in np.unique(number[inside]).tolist()
                        for here in [inside & (number == each)]]


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
        b = np.array(screws.log((*b.tolist(), *so3.exp(_vector(-q))))[:3])
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


# --- between two poses

def bridged(samples: PackedSamples, gyro: Gyro, index: int, oldest: int,
            newest: int) -> Bridge | None:
    """
    Return the bridge from a sample to the next, between which the gyroscope has a gap.

    :param oldest: the index of the first sample that may be used; ``newest``: of the last.
    :return: None if nothing was measured between the two samples.
    """
    known = Ends(samples, gyro, oldest, newest)
    begin, end = samples.stamps[index:index + 2]
    between = known.between(index)
    crossings = []
    for gap, start, turned in zip(between.gaps, between.starts, between.ends, strict=True):
        since, until = max(gap[0], begin), min(gap[1], end)
        rates = known.rates(gap, since, until)
        if (since, until) == (begin, end) and None in rates:
            return None
        turn = so3.log(so3.multiply(so3.conjugate(start), turned))
        crossings.append(Crossing(since, until, start, turn, rates, crossed(
            turn, (until - since) / NANOSECONDS_PER_SECOND, *rates)))
    (x, y, z, *_), (ex, ey, ez, *_) = samples.pose(index), samples.pose(index + 1)
    return Bridge(begin, end, (x, y, z), (ex - x, ey - y, ez - z),
                  samples.stamps[-1],
                  between.bases, between.missed, between.shares, crossings)
