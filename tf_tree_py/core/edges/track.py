# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Copies of edges' histories for many stamps, each kind with its own evaluation.

They are made with the buffer's lock held, and used without it. The first axis of poses here is
that of the seven coordinates, (7, ...), because numpy is fastest on long rows.
"""

import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..geometry import so3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..times import Stamps


class EdgeTrack(Protocol):
    """
    One edge from a first to a last stamp.

    :ivar knots: (n,) sorted stamps; the edge moves smoothly between successive ones. Empty if
        it never moves.
    """

    knots: Stamps

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses at times after stamps.

        :param stamps: (...) nanoseconds.
        :param since: (...) nanoseconds after the stamps, at most up to the next knot, which is
            then approached from below; None: zero.
        :return: (7, ...), of any shape that broadcasts with that of stamps and since.
        """

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return the largest motion between successive stamps.

        The error bound of an interpolating polynomial uses it, and assumes motion at a constant
        speed between knots. A kind that moves differently returns infinity, and is then
        evaluated at every stamp.

        :param knots: (n,) sorted, n > 1; its own knots between the first and the last are
            included.
        :return: the angle, radians, and the distance, metres.
        """


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


class HeldTrack:
    """
    Samples that are each valid until the next.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, knots: Stamps, poses: Array) -> None:
        self.knots = knots
        self._poses = np.ascontiguousarray(poses.T)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) of the samples valid at stamps."""
        return self._poses.take(self._before(stamps), axis=1)

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres."""
        x, y, z = self._poses[:3]
        return math.sqrt((x * x + y * y + z * z).max())

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return zeros, because nothing moves between samples."""
        return 0.0, 0.0

    def _before(self, stamps: Stamps) -> npt.NDArray[np.intp]:
        """Return the index of the last sample at or before each stamp."""
        return self.knots.searchsorted(stamps, side='right') - 1


class InterpolatedTrack(HeldTrack):
    """
    Samples with linear translation and rotation at constant speed between them.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

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
        turns = 2.0 * np.arccos(np.minimum(np.abs(_dot(a[3:], b[3:])), 1.0))
        steps = b[:3] - a[:3]
        return (float((turns * parts).max()),
                math.sqrt((np.square(steps * parts).sum(axis=0)).max()))

    def _around(self, stamps: Stamps) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Return the indices of the samples before and after each stamp."""
        after = self.knots.searchsorted(stamps, side='right')
        return after - 1, np.minimum(after, len(self.knots) - 1)


def _between(a: Array, b: Array, ratio: Array) -> Array:
    """Interpolate between poses (7, ...) as ``se3.interpolate_many`` and tf2 do."""
    cosine = _dot(a[3:], b[3:])
    if so3.is_half_turn(cosine).any():
        first, second = (np.moveaxis(each[3:], 0, -1) for each in (a, b))
        turned = so3.slerp_many(first, second, ratio, as_tf2=True)
        return np.concatenate([(1.0 - ratio) * a[:3] + ratio * b[:3],
                               np.moveaxis(turned, -1, 0)])
    first, second = so3.slerp_weights_many(cosine, ratio, as_tf2=True)
    poses = np.empty((7, *first.shape))
    np.multiply(1.0 - ratio, a[:3], out=poses[:3])
    poses[:3] += ratio * b[:3]
    np.multiply(first, a[3:], out=poses[3:])
    poses[3:] += second * b[3:]
    return poses


def _dot(a: Array, b: Array) -> Array:
    """Sum in the order of the scalar form, because the last bit decides whether it is one."""
    x, y, z, w = a * b
    return np.asarray(x + y + z + w)
