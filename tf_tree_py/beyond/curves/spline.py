# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A motion in continuous time: a pose, a twist and an acceleration at every nanosecond.

It is independent of frames and trees. A spline consists of pieces, with poses on them. Lookups
at many stamps evaluate it as the track of an edge.
"""

import math

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.errors import InvalidArgumentException, no_truth
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.poses import PosesLike
from tf_tree_py.core.geometry.se3 import distance_many, PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import BEGINNING, FOREVER, format_stamp, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, checked_stamps, Stamp, Stamps, StampsLike
from tf_tree_py.files.edges import Arrays, Facts, Saved
from tf_tree_py.screws import Screw

from .spline_fit import (
    checked_rate,
    checked_samples,
    first_guess,
    fitted,
    on_pieces,
    ORDER,
    places,
)
from .spline_segment import (
    Group,
    pose_on,
    poses_on,
    rates_on,
    rates_on_many,
    SE3,
    SPLIT,
    steps_between,
)

# --- at many stamps

# The pieces of a spline are cut into parts that rotate by at most this angle, radians. So there
# are few parts, and on each a polynomial equals the curve apart from rounding.
_TURN = 0.1
# As in ``tree.path``.
_MOST_NODES = 7
# With this limit, a piece that rotates by more than a radian or two is evaluated at every stamp.
_MAX_PARTS = 32


class SplineTrack:
    """
    A spline for the stamps from a first to a last.

    Its knots cut each piece into parts that are short enough for polynomials.
    """

    def __init__(self, spline: 'Spline', first: int, last: int) -> None:
        self._spline = spline
        period = spline.knot_period
        # Without stamps, first and last may be anywhere.
        begin, end = (min(max((stamp - spline.begin) // period, 0), spline.pieces - 1)
                      for stamp in (first, last))
        pieces = range(begin, end + 1)
        self._steps = np.abs(_lengths(spline.steps[pieces.start:pieces.stop + 2]))
        self._positions = spline.knots[pieces.start:pieces.stop + 3, :3]
        # This order of min() and max() is safe for an infinite or NaN bound of a damaged file.
        parts = min(max(1, math.ceil(min(_MAX_PARTS, self._bound()[0] / _TURN))), period)
        self.knots: Stamps = spline.cuts(pieces, parts)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps."""
        return self._spline.samples(stamps, since)

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres: at most that of a knot."""
        return float(np.linalg.norm(self._positions, axis=1).max())

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return an angle and a distance that bound the derivatives between knots.

        On SE(3) there is no bound, so both are infinite.
        """
        if self._spline.group is not SPLIT:
            return math.inf, math.inf
        part = float(np.diff(knots).max()) / self._spline.knot_period
        angle, distance = self._bound()
        return part * angle, part * distance

    def _bound(self) -> tuple[float, float]:
        """
        Return an angle and a distance that bound the derivatives on every piece.

        The nth derivative of a rotation is at most Bell's polynomial of the derivatives of the
        angle, of which there are three, because the weights are cubic. The angle a is chosen
        such that a^n is at least this bound for n up to seven, the largest number of nodes of a
        polynomial. The nth derivative of the position, on edges that rotate by a, is then at
        most n d a^(n-1), with d = p' + 3 p''/a + 5 p'''/a^2.
        """
        turns, ways = self._steps
        bell, angles = [np.ones(len(turns) - 2)], _derivatives(turns)
        for n in range(_MOST_NODES):
            bell.append(sum((math.comb(n, k) * bell[n - k] * angles[k]
                             for k in range(min(n, 2) + 1)), np.zeros(1)))
        angle = max(1.0, *(bell[n].max() ** (1.0 / n) for n in range(1, _MOST_NODES + 1)))
        first, second, third = _derivatives(ways)
        distance = (first + 3.0 * second / angle + 5.0 * third / angle ** 2).max()
        return float(angle), float(distance)


def _lengths(steps: Array) -> Array:
    """Return the angles and the lengths of steps (n, 6), as (2, n)."""
    return np.linalg.norm(steps.reshape(-1, 2, 3), axis=2).T[::-1]


def _derivatives(lengths: Array) -> tuple[Array, Array, Array]:
    """Return bounds of the weights' derivatives multiplied by a piece's three steps."""
    one, two, three = lengths[:-2], lengths[1:-1], lengths[2:]
    return (0.5 * one + 0.75 * two + 0.5 * three, one + two + three, one + 2.0 * two + three)


# --- the spline

# Radians: if a piece rotates by more than half a turn, the curve rotates the other way round.
_HOPELESS = 0.5

# With ten poses, linear interpolation between them has a hundredth of the error of linear
# interpolation between knots.
_POSES_A_PIECE = 10

_GROUPS = {group.name: group for group in (SPLIT, SE3)}


class Spline:
    """
    An immutable cumulative cubic B-spline. ``fit`` makes one from poses.

    It is twice continuously differentiable, so it has an acceleration and no corners. The
    error of positions decreases with the fourth power of the knot rate, that of rotations with
    the third. Position and rotation are separate splines; with ``on_se3`` both move together,
    on screws. The child rotates by less than half a turn between successive knots.

    See ``spline_segment`` for the formulas. A knot takes 104 bytes.

    :ivar oldest: the stamp at which it begins, nanoseconds.
    :ivar latest: the stamp at which it ends.
    :ivar begin: the stamp at which the first piece begins.
    :ivar knot_period: the duration of a piece, nanoseconds.
    :ivar knots: (n, 7) the control poses, three more than there are pieces. The curve passes
        near them, not through them.
    :ivar group: the group of the spline.
    :ivar steps: (n - 1, 6) the tangents from each knot to the next; computed unless given.
    """

    __slots__ = ('oldest', 'latest', 'begin', 'knot_period', 'knots', 'steps', 'group')

    def __init__(self, begin: int, knot_period: int, knots: Array, latest: int,
                 group: Group = SPLIT, steps: Array | None = None) -> None:
        self.begin = self.oldest = begin
        self.latest = latest
        self.knot_period = knot_period
        self.knots = knots.copy()
        self.steps = steps_between(group, knots) if steps is None else steps
        self.knots.flags.writeable = self.steps.flags.writeable = False
        self.group = group

    def __len__(self) -> int:
        return len(self.knots)

    __bool__ = no_truth

    @classmethod
    def fit(cls, stamps: StampsLike, poses: PosesLike, knot_rate_hz: float, *,
            on_se3: bool = False) -> 'Spline':
        """
        Return the spline that fits poses best, by least squares.

        Noise is averaged if there are more poses than knots. A change of the motion within
        less than two knots is smoothed.

        :param stamps: (N,) nanoseconds, in any order.
        :param poses: ``parent_T_child``: (N, 7) or anything else that ``insert_track`` accepts.
        :param knot_rate_hz: knots per second; a rate up to half that of the poses averages
            their noise, a rate up to that of the poses makes the curve pass through them.
        :param on_se3: on SE(3) instead of R3 x SO(3).
        :raises InvalidArgumentException: too few poses for the number of knots, too few knots
            for the rotation, or invalid stamps, poses or rate.
        """
        times, array = checked_samples(stamps, poses)
        rate = checked_rate(knot_rate_hz)
        begin, latest = int(times[0]), int(times[-1])
        # The knots are slightly closer than requested, so that the last piece is complete.
        pieces = max(1, math.ceil((latest - begin) * rate / NANOSECONDS_PER_SECOND - 1e-9))
        if pieces > max(1, len(times) - 1):
            raise InvalidArgumentException(
                f'{len(times)} poses between {format_stamp(begin)} and {format_stamp(latest)} '
                f'do not determine the {pieces + ORDER - 1} knots of a spline: pass more poses, '
                f'or a knot_rate_hz below {rate * (len(times) - 1) / pieces:.3g}')
        group = SE3 if on_se3 else SPLIT
        period = max(1, -((begin - latest) // pieces))
        knots = first_guess(group, begin, period, pieces, times, array)
        numbers, u = places(times, begin, period, pieces)
        spline = cls(begin, period, fitted(group, knots, 0, numbers, u, array), latest, group)
        spline._refuse_hopeless(times, array)
        return spline

    def _refuse_hopeless(self, stamps: Stamps, poses: Array) -> None:
        _, turned = distance_many(poses, self.samples(stamps).T)
        if np.median(turned) > _HOPELESS:
            rate = NANOSECONDS_PER_SECOND / self.knot_period
            raise InvalidArgumentException(
                f'no spline of {rate:.3g} knots per second fits these poses; the best differs by '
                f'{np.median(turned):.1f} rad. If the poses rotate by half a turn or more between '
                'two knots, pass a greater knot_rate_hz')

    def __repr__(self) -> str:
        return (f'<Spline on {self.group.name}: {len(self)} knots, '
                f'{format_stamp(self.oldest)} to {format_stamp(self.latest)} s>')

    def __reduce__(self) -> tuple[object, ...]:
        # The formulas of a group are functions, so they are not pickled.
        return (_restored, (self.begin, self.knot_period, self.knots, self.latest,
                            self.group is SE3))

    def saved_as(self) -> 'Spline':
        """Return this curve, because files support its kind."""
        return self

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the knots and steps to arrays."""
        arrays.add(self.knots)
        arrays.add(np.ascontiguousarray(self.steps))
        return {'knots': len(self), 'begin': self.begin, 'knot_period': self.knot_period,
                'latest': self.latest, 'group': self.group.name}

    @classmethod
    def load(cls, saved: Saved) -> 'Spline':
        """Return the stored spline, which uses the memory in place."""
        spline, count = cls.__new__(cls), saved.whole('knots', ORDER)
        spline.knots = np.frombuffer(saved.floats(7 * count)).reshape(-1, 7)
        spline.steps = np.frombuffer(saved.floats(6 * count - 6)).reshape(-1, 6)
        spline.begin = spline.oldest = saved.whole('begin', BEGINNING, FOREVER)
        spline.knot_period = saved.whole('knot_period', 1, FOREVER)
        spline.latest = saved.whole('latest', spline.oldest, FOREVER)
        spline.group = _GROUPS.get(saved.one('group', str), SPLIT)
        if spline.latest > spline.begin + spline.pieces * spline.knot_period:
            raise ValueError('a spline ends after its last piece')
        # At most half a turn, except for rounding. Infinite numbers would raise errors in sines.
        if not (np.abs(spline.steps[:, 3:]) < 3.2).all():
            raise ValueError('a spline turns by more than half a turn from knot to knot')
        return spline

    # --- at one stamp

    def pose(self, stamp: Stamp) -> Pose:
        """
        Return ``parent_T_child`` at a stamp.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :raises InvalidArgumentException: the stamp is outside the spline.
        """
        return Pose._make(self.sample(self._inside(stamp)))

    def twist(self, stamp: Stamp) -> Screw:
        """
        Return the twist of the child relative to its parent, in the child's axes.

        :return: the velocity of the child's origin, m/s, and the angular velocity, rad/s: for
            an IMU, the latter is its gyroscope's measurement.
        :raises InvalidArgumentException: the stamp is outside the spline.
        """
        twist, _ = rates_on(self.group, *self._piece(self._inside(stamp)))
        return screws.times(NANOSECONDS_PER_SECOND / self.knot_period, twist)

    def acceleration(self, stamp: Stamp) -> Screw:
        """
        Return the acceleration of the child relative to its parent, in the child's axes.

        :return: the acceleration of the child's origin, m/s^2, without gravity, and the angular
            acceleration, rad/s^2.
        :raises InvalidArgumentException: the stamp is outside the spline.
        """
        _, bend = rates_on(self.group, *self._piece(self._inside(stamp)))
        return screws.times((NANOSECONDS_PER_SECOND / self.knot_period) ** 2, bend)

    def sample(self, stamp: int) -> PoseTuple:
        """Return the pose at a stamp within the spline, as plain floats."""
        x, y, z, qx, qy, qz, qw = pose_on(self.group, *self._piece(stamp))
        return (x, y, z, qx, qy, qz, qw)

    def _piece(self, stamp: int) -> tuple[PoseTuple, list[list[float]], float]:
        """Return the first knot of a stamp's piece, the steps, and the place on it (u)."""
        since = stamp - self.begin
        number = min(since // self.knot_period, self.pieces - 1)
        return (tuple(self.knots[number].tolist()), self.steps[number:number + 3].tolist(),
                (since - number * self.knot_period) / self.knot_period)

    def _inside(self, stamp: Stamp) -> int:
        stamp = checked_stamp(stamp)
        if not self.oldest <= stamp <= self.latest:
            raise self._outside(stamp)
        return stamp

    def _outside(self, stamp: int) -> InvalidArgumentException:
        return InvalidArgumentException(
            f'the stamp {format_stamp(stamp)} is outside the spline, which is defined from '
            f'{format_stamp(self.oldest)} to {format_stamp(self.latest)}')

    # --- at many stamps

    def poses(self, stamps: StampsLike) -> Array:
        """Return (N, 7), one for each of (N,) stamps; see ``pose``."""
        return self.samples(self._all_inside(stamps)).T

    def twists(self, stamps: StampsLike) -> Array:
        """Return (N, 6), one for each of (N,) stamps; see ``twist``."""
        twists, _ = rates_on_many(self.group, *self.pieces_at(self._all_inside(stamps)))
        return twists.T * (NANOSECONDS_PER_SECOND / self.knot_period)

    def accelerations(self, stamps: StampsLike) -> Array:
        """Return (N, 6), one for each of (N,) stamps; see ``acceleration``."""
        _, bends = rates_on_many(self.group, *self.pieces_at(self._all_inside(stamps)))
        return bends.T * (NANOSECONDS_PER_SECOND / self.knot_period) ** 2

    def track(self, first: int, last: int) -> SplineTrack:
        """Return a track for lookups at many stamps between two."""
        return SplineTrack(self, first, last)

    def shown_at(self) -> Stamps:
        """Return stamps between which programs may interpolate: ten on each piece."""
        return self.cuts(range(self.pieces), _POSES_A_PIECE)

    @property
    def pieces(self) -> int:
        """Return the number of pieces."""
        return len(self.knots) - ORDER + 1

    def cuts(self, pieces: range, parts: int) -> Stamps:
        """Return the stamps that cut pieces into equal parts, from end to end."""
        begins = self.begin + self.knot_period * np.arange(pieces.start, pieces.stop + 1)
        cuts = [self.knot_period * part // parts for part in range(parts)]
        return np.unique(np.clip((begins[:, None] + cuts).ravel(), self.oldest, self.latest))

    def samples(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses (7, ...) at stamps within the spline, or at times after them.

        :param since: (...) the times after the stamps, nanoseconds.
        """
        return poses_on(self.group, *self.pieces_at(stamps, since))

    def pieces_at(self, stamps: Stamps, since: Array | None = None) -> tuple[Array, Array, Array]:
        """Return the first knot of each stamp's piece, its steps, and the place on it (u)."""
        numbers, u = places(stamps, self.begin, self.knot_period, self.pieces)
        if since is not None:
            numbers, u = np.broadcast_arrays(numbers, u + since / self.knot_period)
        return *on_pieces(self.knots, self.steps, numbers), u

    def _all_inside(self, stamps: StampsLike) -> Stamps:
        times = checked_stamps(stamps)
        outside = (times < self.oldest) | (times > self.latest)
        if outside.any():
            raise self._outside(int(times[np.argmax(outside)]))
        return times


def _restored(begin: int, knot_period: int, knots: Array, latest: int, on_se3: bool) -> Spline:
    return Spline(begin, knot_period, knots, latest, SE3 if on_se3 else SPLIT)
