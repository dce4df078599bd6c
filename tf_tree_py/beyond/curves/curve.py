# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The interface of curves for edges: a pose at any stamp, computed in any way.

``Curve`` is the interface for users. ``EdgeCurve`` is the interface for edges: ``GivenCurve``
adapts any curve to it; a curve with its own formulas for one stamp and for many, such as a
``Spline``, implements it directly. ``ConstantTwist`` is the simplest such motion: one twist
between two stamps.
"""

from dataclasses import dataclass
import math
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import EdgeTrack
from tf_tree_py.core.errors import InvalidArgumentException, no_truth, TransformException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.poses import (
    checked_pose,
    checked_poses,
    is_sound,
    judged,
)
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import (
    BEGINNING,
    FOREVER,
    format_stamp,
    from_seconds,
    NANOSECONDS_PER_SECOND,
)
from tf_tree_py.core.times import checked_stamp, Stamps
from tf_tree_py.files.edges import Arrays, Facts, Saved

# Differences of stamps must fit into 64 bits.
_LONGEST = 2**62
# A curve has no samples. Programs that interpolate, such as players of bags, get poses with this
# period, or this number of poses, whichever gives fewer poses.
_PERIOD, _MOST_SHOWN = from_seconds(0.01), 100_000

_WHAT = ('a curve needs oldest and latest, integer nanoseconds, and poses(stamps), which returns '
         '(N, 7) poses for (N,) stamps')


class Curve(Protocol):
    """
    A motion in continuous time: any function from stamps to poses.

    Curves need not derive from this class. The functions are called from several threads, and
    for a lookup of one stamp while the buffer is locked: so they must be fast, have no side
    effects, and not wait for other threads. A curve must not change after it is inserted;
    insert another one to replace it. It may also have:

    - ``twists(stamps)``: (N, 6) the twist of the child relative to its parent, in the child's
      axes, metres and radians per second. Without it ``lookup_twist`` uses poses.
    - ``saved_as()``: returns a ``Spline`` or a ``ConstantTwist`` that replaces it where functions
      cannot be stored: in files (``save``) and for other processes (``pickle``). Without it
      those raise an error.
    """

    @property
    def oldest(self) -> int:
        """Return the first stamp for which there is a pose, nanoseconds."""

    @property
    def latest(self) -> int:
        """Return the last stamp for which there is a pose, nanoseconds."""

    def poses(self, stamps: Stamps) -> npt.ArrayLike:
        """
        Return ``parent_T_child`` at stamps.

        :param stamps: (N,) int64 nanoseconds between ``oldest`` and ``latest``, in any order.
        :return: (N, 7): x y z in metres and a quaternion x y z w, of any length except zero; or
            anything else that ``insert_track`` accepts as poses.
        """


@runtime_checkable
class EdgeCurve(Curve, Protocol):
    """A curve with all the functions that an edge needs."""

    def __len__(self) -> int:
        """Return the number of samples that represent it, or of its knots."""

    def sample(self, stamp: int) -> PoseTuple:
        """Return the pose at a stamp within the curve."""

    def twists(self, stamps: Stamps) -> Array | None:
        """Return the twists of the child at stamps, (N, 6); None if they are not known."""

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a track for lookups at many stamps between two."""

    def shown_at(self) -> Stamps:
        """Return stamps between which programs may interpolate."""

    def saved_as(self) -> Curve | None:
        """Return a curve of a kind that files support; None if there is none."""


class GivenCurve:
    """
    An ``EdgeCurve`` of any curve of a user; its results are checked.

    :ivar given: the user's curve.
    :ivar oldest: its value at the time of insertion; ``latest`` likewise.
    """

    __slots__ = ('given', 'oldest', 'latest', '_edge', '_period')

    def __init__(self, given: Curve, edge: str) -> None:
        """
        Take a curve, and evaluate it at both of its ends.

        :param edge: the name of its edge in errors.
        :raises InvalidArgumentException: it is not a curve, or its poses are invalid.
        """
        self.given = given
        self._edge = edge
        self.oldest, self.latest = _span(given, edge)
        self._period = max(_PERIOD, -((self.oldest - self.latest) // _MOST_SHOWN))
        ends = np.array([self.oldest, self.latest])
        self.poses(ends)
        self.twists(ends)

    def __len__(self) -> int:
        # The number of stamps in ``shown_at``.
        return 1 - (self.oldest - self.latest) // self._period

    __bool__ = no_truth

    def sample(self, stamp: int) -> PoseTuple:
        """Return the pose at a stamp within the curve."""
        stamps = np.array([stamp])
        poses = self._asked('poses', stamps)
        # Checking arrays takes 40 us in numpy; checking seven floats takes one.
        if type(poses) is np.ndarray and poses.shape == (1, 7) and poses.dtype == float:
            pose: PoseTuple = tuple(poses[0].tolist())
            if is_sound(pose):
                return pose
        x, y, z, qx, qy, qz, qw = self._checked(poses, stamps)[0].tolist()
        return (x, y, z, qx, qy, qz, qw)

    def poses(self, stamps: Stamps) -> Array:
        """Return (N, 7) poses of the curve at stamps (N,) within it."""
        return self._checked(self._asked('poses', stamps), stamps)

    def _checked(self, poses: object, stamps: Stamps) -> Array:
        try:
            array, good = judged(checked_poses(poses))
        except InvalidArgumentException as error:
            raise self._wrong(f'poses(stamps): {error}') from error
        if len(array) != len(stamps):
            raise self._wrong(
                f'poses(stamps) returned {len(array)} poses for {len(stamps)} stamps')
        if not good.all():
            first = int(np.argmin(good))
            raise self._wrong(f'the pose at {format_stamp(int(stamps[first]))} is not finite, or '
                              f'not a rotation: {array[first].tolist()}')
        return array

    def twists(self, stamps: Stamps) -> Array | None:
        """Return (N, 6) twists of the child at stamps (N,); None if they are not known."""
        if getattr(self.given, 'twists', None) is None:
            return None
        try:
            twists = np.asarray(self._asked('twists', stamps), dtype=float)
        except (TypeError, ValueError) as error:
            raise self._wrong(f'twists(stamps) must return numbers: {error}') from error
        if twists.shape != (len(stamps), 6) or not np.isfinite(twists).all():
            raise self._wrong(f'twists(stamps) must return ({len(stamps)}, 6) finite numbers, '
                              f'not {twists.shape}')
        return twists

    def _asked(self, function: str, stamps: Stamps) -> object:
        try:
            # A copy, because the function may compute in place.
            return getattr(self.given, function)(stamps.copy())
        except TransformException:
            raise
        except Exception as error:
            raise self._wrong(f'{function}(stamps) raised {type(error).__name__}: {error}'
                              ) from error

    def _wrong(self, what: str) -> InvalidArgumentException:
        return InvalidArgumentException(
            f'the curve of the edge {self._edge}, a {type(self.given).__name__}: {what}')

    def track(self, first: int, last: int) -> 'GivenTrack':
        """Return a track for lookups at many stamps between two."""
        return GivenTrack(self, self._shown(first, last))

    def shown_at(self) -> Stamps:
        """Return stamps between which programs may interpolate: every 10 ms, 100,000 at most."""
        return self._shown(self.oldest, self.latest)

    def _shown(self, first: int, last: int) -> Stamps:
        """Return these stamps from at or before ``first`` to at or after ``last``."""
        begin, end = ((min(max(stamp, self.oldest), self.latest) - self.oldest, sign)
                      for stamp, sign in ((first, 1), (last, -1)))
        numbers = np.arange(begin[0] // self._period, -(-end[0] // self._period) + 1)
        return np.unique(np.minimum(self.oldest + numbers * self._period, self.latest))

    def saved_as(self) -> Curve | None:
        """Return the replacement that the user's curve defines; None if it defines none."""
        saved_as = getattr(self.given, 'saved_as', None)
        return None if saved_as is None else saved_as()


class GivenTrack:
    """
    A user's curve, evaluated at every stamp, because its motion between stamps is unbounded.

    :param knots: (n,) stamps, sorted.
    """

    reach = math.inf

    def __init__(self, curve: GivenCurve, knots: Stamps) -> None:
        self._curve = curve
        self.knots = knots

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps, rounded to nanoseconds."""
        moments = stamps if since is None else stamps + np.rint(since).astype(np.int64)
        return self._curve.poses(moments.ravel()).T.reshape(7, *moments.shape)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return infinity: there is no bound."""
        return math.inf, math.inf


def as_edge_curve(given: Curve, edge: str) -> EdgeCurve:
    """
    Return a user's curve as an ``EdgeCurve``.

    :param edge: the name of its edge in errors.
    :raises InvalidArgumentException: it is not a curve.
    """
    return given if isinstance(given, EdgeCurve) else GivenCurve(given, edge)


def _span(given: Curve, edge: str) -> tuple[int, int]:
    """Return the first and the last stamp of a curve."""
    of_what = f'Invalid argument curve for the edge {edge}: '
    missing = [name for name in ('oldest', 'latest', 'poses') if not hasattr(given, name)]
    if missing or isinstance(given, type):
        what = f'the class {given.__name__}' if isinstance(given, type) else (
            f'this {type(given).__name__}')
        raise InvalidArgumentException(f'{of_what}{what} is not a curve; {_WHAT}. '
                                       'Spline.fit makes one from stamps and poses')
    try:
        oldest, latest = checked_stamp(given.oldest), checked_stamp(given.latest)
    except InvalidArgumentException as error:
        raise InvalidArgumentException(f'{of_what}oldest or latest: {error}') from error
    if not 0 <= latest - oldest <= _LONGEST:
        raise InvalidArgumentException(
            f'{of_what}it goes from {format_stamp(oldest)} to {format_stamp(latest)}: latest '
            'must not be earlier than oldest, nor more than 146 years later')
    return oldest, latest


# --- one twist

@dataclass(frozen=True)
class ConstantTwist:
    """
    A ``Curve`` along one screw: ``pose`` at ``oldest``, then ``pose`` exp(t ``twist``).

    Lynch, Park, "Modern Robotics", section 3.3.3.

    :ivar oldest: the beginning, nanoseconds; ``latest``: the end.
    :ivar pose: ``parent_T_child`` at ``oldest``: anything that ``insert`` accepts as a pose.
    :ivar twist: six numbers, metres and radians per second, in the child's axes: forwards at
        1 m/s is (1, 0, 0, 0, 0, 0).
    """

    oldest: int
    latest: int
    pose: Pose
    twist: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_to = object.__setattr__  # the only way to set a frozen dataclass
        set_to(self, 'oldest', checked_stamp(self.oldest))
        set_to(self, 'latest', checked_stamp(self.latest))
        set_to(self, 'pose', Pose._make(checked_pose(self.pose)))
        set_to(self, 'twist', _checked_twist(self.twist))

    def poses(self, stamps: Stamps) -> Array:
        """Return (N, 7), one for each of (N,) stamps."""
        since = (stamps - self.oldest) / NANOSECONDS_PER_SECOND
        steps = screws.exp_many(since[:, None] * np.array(self.twist))
        return se3.compose_many(np.array(self.pose), steps)

    def twists(self, stamps: Stamps) -> Array:
        """Return (N, 6), the same twist for each stamp."""
        return np.tile(np.array(self.twist), (len(stamps), 1))

    def saved_as(self) -> 'ConstantTwist':
        """Return this curve, because files support its kind."""
        return self

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the numbers to arrays."""
        arrays.add(np.array([*self.pose, *self.twist]))
        return {'oldest': self.oldest, 'latest': self.latest}

    @classmethod
    def load(cls, saved: Saved) -> 'ConstantTwist':
        """Return the stored curve."""
        numbers = saved.floats(13).tolist()
        return cls(saved.whole('oldest', BEGINNING, FOREVER - 1),
                   saved.whole('latest', BEGINNING, FOREVER - 1),
                   Pose._make(numbers[:7]), tuple(numbers[7:]))


def _checked_twist(given: npt.ArrayLike) -> tuple[float, ...]:
    try:
        twist = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        twist = np.empty(0)
    if twist.shape != (6,) or not np.isfinite(twist).all():
        raise InvalidArgumentException(
            f'Invalid argument twist {given!r:.80}: it must be six finite numbers, metres per '
            'second along x, y, z and radians per second about them')
    return tuple(twist.tolist())
