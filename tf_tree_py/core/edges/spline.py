# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
A motion in continuous time: a pose, a twist and an acceleration at every nanosecond.

It knows no frames and no tree.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from .spline_samples import checked_rate, checked_samples, first_guess, places
from .storage import Arrays, Facts, Stored
from ..errors import InvalidArgumentException
from ..geometry.pose import Pose
from ..geometry.screws import Screw
from ..geometry.se3 import distance_many
from ..geometry.so3 import Array
from ..geometry.spline import (
    Group,
    pose_on,
    poses_on,
    rates_on,
    rates_on_many,
    SE3,
    SPLIT,
    steps_between,
)
from ..geometry.spline_fit import fitted, on_pieces, ORDER
from ..stamp import BEGINNING, FOREVER, format_stamp, NANOSECONDS_PER_SECOND
from ..times import checked_stamp, checked_stamps, Stamps

# Radians: where a piece turns by more than half a turn, the curve takes the other way round.
_HOPELESS = 0.5

_GROUPS = {group.name: group for group in (SPLIT, SE3)}


class Spline:
    """
    A cumulative cubic B-spline; it never changes. ``fit`` makes one of poses.

    Twice continuously differentiable, so it has an acceleration, and no corners. The error of
    positions falls with the fourth power of the rate of the knots, that of rotations with the
    third. The two lie on splines of their own; ``on_se3`` moves both together, on screws.
    Between two neighbouring knots the child turns by less than half a turn.

    See ``geometry.spline`` for the formulas. 104 bytes a knot.

    :ivar oldest: the stamp at which it begins, nanoseconds.
    :ivar latest: the stamp at which it ends.
    :ivar begin: the stamp at which the first piece begins.
    :ivar knot_period: how long a piece lasts, nanoseconds.
    :ivar knots: (n, 7) the control poses, three more than there are pieces. The curve passes
        near them, not through them.
    :ivar group: on what it lies.
    """

    __slots__ = ('oldest', 'latest', 'begin', 'knot_period', 'knots', 'steps', 'group')

    def __init__(self, begin: int, knot_period: int, knots: Array, latest: int,
                 group: Group = SPLIT) -> None:
        self.begin = self.oldest = begin
        self.latest = latest
        self.knot_period = knot_period
        self.knots = knots.copy()
        self.steps = steps_between(group, knots)
        self.knots.flags.writeable = self.steps.flags.writeable = False
        self.group = group

    @classmethod
    def fit(cls, stamps: npt.ArrayLike, poses: Any, knot_rate_hz: float, *,
            on_se3: bool = False) -> 'Spline':
        """
        Return the spline that comes closest to poses.

        By least squares: noise is averaged where there are more poses than knots. A motion
        that changes within less than two knots is smoothed away.

        :param stamps: (N,) nanoseconds, in any order.
        :param poses: ``parent_T_child``: (N, 7) or whatever else ``insert_track`` takes.
        :param knot_rate_hz: knots a second; up to half the rate of the poses averages their
            noise, up to that rate passes through them.
        :param on_se3: on SE(3) instead of R3 x SO(3).
        :raises InvalidArgumentException: too few poses for so many knots, or knots for what
            they turn; what are no stamps or poses, or no rate.
        """
        times, array = checked_samples(stamps, poses)
        rate = checked_rate(knot_rate_hz)
        begin, latest = int(times[0]), int(times[-1])
        # The knots are a little closer than asked for, so that the last piece is whole.
        pieces = max(1, math.ceil((latest - begin) * rate / NANOSECONDS_PER_SECOND - 1e-9))
        if pieces > max(1, len(times) - 1):
            raise InvalidArgumentException(
                f'{len(times)} poses between {format_stamp(begin)} and {format_stamp(latest)} '
                f'cannot tell the {pieces + ORDER - 1} knots of a spline: pass more of them, or '
                f'a knot_rate_hz below {rate * (len(times) - 1) / pieces:.3g}')
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
                f'no spline of {rate:.3g} knots a second follows these poses, the best is off by '
                f'{np.median(turned):.1f} rad: do they turn by half a turn or more between two '
                'knots? Then pass a greater knot_rate_hz')

    def __len__(self) -> int:
        return len(self.knots)

    def __repr__(self) -> str:
        return (f'<Spline on {self.group.name}: {len(self)} knots, '
                f'{format_stamp(self.oldest)} to {format_stamp(self.latest)} s>')

    def __reduce__(self) -> tuple[Any, ...]:
        # The formulas of a group are functions: they stay here.
        return (_restored, (self.begin, self.knot_period, self.knots, self.latest,
                            self.group is SE3))

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the knots and steps to arrays."""
        arrays.add(self.knots)
        arrays.add(np.ascontiguousarray(self.steps))
        return {'knots': len(self), 'begin': self.begin, 'knot_period': self.knot_period,
                'latest': self.latest, 'group': self.group.name}

    @classmethod
    def thawed(cls, stored: Stored) -> 'Spline':
        """Return what was frozen, which uses the memory where it lies."""
        spline, count = cls.__new__(cls), stored.whole('knots', ORDER)
        spline.knots = np.frombuffer(stored.floats(7 * count)).reshape(-1, 7)
        spline.steps = np.frombuffer(stored.floats(6 * count - 6)).reshape(-1, 6)
        spline.begin = spline.oldest = stored.whole('begin', BEGINNING, FOREVER)
        spline.knot_period = stored.whole('knot_period', 1, FOREVER)
        spline.latest = stored.whole('latest', spline.oldest, FOREVER)
        spline.group = _GROUPS.get(stored.one('group', str), SPLIT)
        if spline.latest > spline.begin + spline.pieces * spline.knot_period:
            raise ValueError('a spline ends behind its last piece')
        # No more than half a turn, but for rounding. Infinite numbers would raise errors in sines.
        if not (np.abs(spline.steps[:, 3:]) < 3.2).all():
            raise ValueError('a spline turns by more than half a turn from knot to knot')
        return spline

    @property
    def pieces(self) -> int:
        """Return how many pieces there are."""
        return len(self.knots) - ORDER + 1

    def cuts(self, pieces: range, parts: int) -> Stamps:
        """Return the stamps that cut pieces into equal parts, from end to end."""
        begins = self.begin + self.knot_period * np.arange(pieces.start, pieces.stop + 1)
        cuts = [self.knot_period * part // parts for part in range(parts)]
        return np.unique(np.clip((begins[:, None] + cuts).ravel(), self.oldest, self.latest))

    # --- at one stamp

    def pose(self, stamp: int) -> Pose:
        """
        Return ``parent_T_child``.

        :param stamp: nanoseconds; 0 is a time here.
        :raises InvalidArgumentException: the stamp lies outside the spline.
        """
        return Pose._make(self.sample(self._inside(stamp)))

    def twist(self, stamp: int) -> Screw:
        """
        Return how fast the child moves in its parent, in the child's axes.

        :return: the velocity of the child's origin, m/s, and the angular velocity, rad/s: of
            an IMU the latter is what its gyroscope measures.
        :raises InvalidArgumentException: the stamp lies outside the spline.
        """
        twist, _ = rates_on(self.group, *self._piece(self._inside(stamp)))
        return _scaled(twist, NANOSECONDS_PER_SECOND / self.knot_period)

    def acceleration(self, stamp: int) -> Screw:
        """
        Return the acceleration of the child in its parent, in the child's axes.

        :return: that of the child's origin, m/s^2, without gravity, and the angular one,
            rad/s^2.
        :raises InvalidArgumentException: the stamp lies outside the spline.
        """
        _, bend = rates_on(self.group, *self._piece(self._inside(stamp)))
        return _scaled(bend, (NANOSECONDS_PER_SECOND / self.knot_period) ** 2)

    def sample(self, stamp: int) -> Any:
        """Return the pose at a stamp that lies inside, as plain floats."""
        return pose_on(self.group, *self._piece(stamp))

    def _piece(self, stamp: int) -> tuple[tuple[float, ...], list[list[float]], float]:
        """Return the first knot of a stamp's piece, the steps, and where on it the stamp is."""
        since = stamp - self.begin
        number = min(since // self.knot_period, self.pieces - 1)
        return (tuple(self.knots[number].tolist()), self.steps[number:number + 3].tolist(),
                (since - number * self.knot_period) / self.knot_period)

    def _inside(self, stamp: int) -> int:
        stamp = checked_stamp(stamp)
        if not self.oldest <= stamp <= self.latest:
            raise self._outside(stamp)
        return stamp

    def _outside(self, stamp: int) -> InvalidArgumentException:
        return InvalidArgumentException(
            f'the stamp {format_stamp(stamp)} lies outside the spline, which goes from '
            f'{format_stamp(self.oldest)} to {format_stamp(self.latest)}')

    # --- at many

    def poses(self, stamps: npt.ArrayLike) -> Array:
        """Return (N, 7), one for each of (N,) stamps; see ``pose``."""
        return self.samples(self._all_inside(stamps)).T

    def twists(self, stamps: npt.ArrayLike) -> Array:
        """Return (N, 6), one for each of (N,) stamps; see ``twist``."""
        twists, _ = rates_on_many(self.group, *self._pieces_at(self._all_inside(stamps)))
        return twists.T * (NANOSECONDS_PER_SECOND / self.knot_period)

    def accelerations(self, stamps: npt.ArrayLike) -> Array:
        """Return (N, 6), one for each of (N,) stamps; see ``acceleration``."""
        _, bends = rates_on_many(self.group, *self._pieces_at(self._all_inside(stamps)))
        return bends.T * (NANOSECONDS_PER_SECOND / self.knot_period) ** 2

    def samples(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses (7, ...) at stamps that lie inside, or some time after.

        :param since: (...) nanoseconds.
        """
        return poses_on(self.group, *self._pieces_at(stamps, since))

    def _pieces_at(self, stamps: Stamps, since: Array | None = None) -> tuple[Array, Array, Array]:
        numbers, u = places(stamps, self.begin, self.knot_period, self.pieces)
        if since is not None:
            numbers, u = np.broadcast_arrays(numbers, u + since / self.knot_period)
        return *on_pieces(self.knots, self.steps, numbers), u

    def _all_inside(self, stamps: npt.ArrayLike) -> Stamps:
        times = checked_stamps(stamps)
        outside = (times < self.oldest) | (times > self.latest)
        if outside.any():
            raise self._outside(int(times[np.argmax(outside)]))
        return times


def _restored(begin: int, knot_period: int, knots: Array, latest: int, on_se3: bool) -> Spline:
    return Spline(begin, knot_period, knots, latest, SE3 if on_se3 else SPLIT)


def _scaled(tangent: tuple[float, ...], factor: float) -> Screw:
    a, b, c, d, e, f = tangent
    return factor * a, factor * b, factor * c, factor * d, factor * e, factor * f
