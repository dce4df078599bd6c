# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Copies of edges for lookups at many stamps; see ``EdgeTrack``.

The first axis of their poses is that of the seven coordinates, (7, ...), because numpy is fastest
on long rows.

A track has its own memory, so it needs no lock. One thread makes it, uses it and drops it.
"""

from collections.abc import Callable
import math

import numpy as np
import numpy.typing as npt

from .protocol import EdgeTrack
from ..geometry import se3, so3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Indices, Stamps


class ConstantTrack:
    """An edge that never moves."""

    knots: Stamps = np.empty(0, dtype=np.int64)

    def __init__(self, pose: PoseTuple) -> None:
        self._pose = np.array(pose)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the pose, (7, 1, ...)."""
        return self._pose.reshape(7, *(1 for _ in stamps.shape))

    @property
    def reach(self) -> float:
        """Return the distance of the child, metres."""
        return math.hypot(*self._pose[:3])

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return zeros, because it does not move."""
        return 0.0, 0.0


class InterpolatedTrack:
    """
    Samples with linear translation and rotation at constant speed between them.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, knots: Stamps, poses: Array) -> None:
        self.knots = knots
        self._poses = np.ascontiguousarray(poses.T)

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""
        x, y, z = self._poses[:3]
        return math.sqrt((x * x + y * y + z * z).max())

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) interpolated between the samples before and after."""
        before, after = self._around(stamps)
        began = self.knots.take(before)
        # The last sample is its own successor.
        lengths = np.maximum(self.knots.take(after) - began, 1)
        elapsed = stamps - began if since is None else (stamps - began) + since
        return _between(self._poses.take(before, axis=1), self._poses.take(after, axis=1),
                        elapsed / lengths)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return the largest angle and distance between successive knots."""
        before, after = self._around(knots[:-1])
        a, b = self._poses.take(before, axis=1), self._poses.take(after, axis=1)
        parts = np.diff(knots) / np.maximum(self.knots.take(after) - self.knots.take(before), 1)
        turns = 2.0 * np.arccos(np.minimum(np.abs(_sum(a[3:] * b[3:])), 1.0))
        steps = b[:3] - a[:3]
        return (float((turns * parts).max()),
                math.sqrt((np.square(steps * parts).sum(axis=0)).max()))

    def _around(self, stamps: Stamps) -> tuple[Indices, Indices]:
        """Return the indices of the samples before and after each stamp."""
        after = self.knots.searchsorted(stamps, side='right')
        return after - 1, np.minimum(after, len(self.knots) - 1)


class HeldTrack:
    """
    A track whose last pose stays valid afterwards.

    :param track: valid up to its last knot.
    """

    def __init__(self, track: EdgeTrack) -> None:
        self.knots = track.knots
        self._track = track
        self._end = int(track.knots[-1])

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""
        return self._track.reach

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps."""
        inside = np.minimum(stamps, self._end)
        if since is not None:
            since = since * (stamps < self._end)
        return self._track.at(inside, since)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return the largest motion between successive stamps; there is none after the end."""
        return self._track.motion(np.minimum(knots, self._end))


class OneByOneTrack:
    """
    Poses that are computed one after the other, for an edge that has no formula for many.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    :param between: returns the pose after a sample, by its index, and a stamp before the next.
    """

    def __init__(self, knots: Stamps, poses: Array,
                 between: Callable[[int, int], PoseTuple]) -> None:
        self.knots = knots
        self._poses = poses
        self._between = between

    @property
    def reach(self) -> float:
        """Return infinity, because only the samples are known."""
        return math.inf

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at whole nanoseconds."""
        times = np.asarray(stamps if since is None else stamps + since).astype(np.int64)
        poses = [self._at(stamp) for stamp in times.ravel().tolist()]
        return np.array(poses).T.reshape(7, *times.shape)

    def _at(self, stamp: int) -> npt.ArrayLike:
        index = int(self.knots.searchsorted(stamp, side='right')) - 1
        if stamp == self.knots[index] or index + 1 == len(self.knots):
            return np.asarray(self._poses[index])
        return self._between(index, stamp)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return infinity: between two samples it may move in any way."""
        return math.inf, math.inf


def _between(a: Array, b: Array, ratio: Array) -> Array:
    """Interpolate between poses (7, ...) as ``se3.interpolate_many`` and tf2 do."""
    cosine = _sum(a[3:] * b[3:])
    if so3.is_half_turn(cosine).any():
        first, second = (np.moveaxis(each, 0, -1) for each in (a, b))
        return np.moveaxis(se3.interpolate_many(first, second, ratio, as_tf2=True), -1, 0)
    first, second = so3.slerp_weights_many(cosine, ratio, as_tf2=True)
    poses = np.empty((7, *first.shape))
    np.multiply(1.0 - ratio, a[:3], out=poses[:3])
    poses[:3] += ratio * b[:3]
    np.multiply(first, a[3:], out=poses[3:])
    poses[3:] += second * b[3:]
    return poses


def _sum(products: Array) -> Array:
    """Sum in the order of the scalar form, because the last bit decides whether it is one."""
    x, y, z, w = products
    return np.asarray(x + y + z + w)
