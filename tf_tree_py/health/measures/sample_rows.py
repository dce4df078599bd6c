# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples of one edge as arrays, and the steps between them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.poses import UNIT_TOLERANCE
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

TAIL = 4
"""The number of rows that are used again with the next: a step is judged by its neighbours."""

JUDGED = slice(1, -2)
"""The steps of a stretch that are judged: those with one step before and two after them."""


@dataclass(frozen=True)
class Rows:
    """
    Samples of one edge, in order of arrival.

    :ivar received: (N,) nanoseconds; 0 if the clock had not begun.
    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (7, N) as received, unchecked: each coordinate is contiguous, because numpy takes
        several times as long for numbers that are apart.
    """

    received: Stamps
    stamps: Stamps
    poses: Array

    def __getitem__(self, part: slice | Mask | Places) -> 'Rows':
        return Rows(self.received[part], self.stamps[part], self.poses[:, part])

    def __len__(self) -> int:
        return len(self.stamps)

    def after(self, tail: 'Rows | None') -> 'Rows':
        """Return the last rows of the previous stretch, followed by these rows."""
        if tail is None:
            return self
        return Rows(np.concatenate([tail.received, self.received]),
                    np.concatenate([tail.stamps, self.stamps]),
                    np.concatenate([tail.poses, self.poses], axis=1))

    def last(self, count: int) -> 'Rows':
        """Return a copy of the last rows, which does not keep the others in memory."""
        return Rows(self.received[-count:].copy(), self.stamps[-count:].copy(),
                    self.poses[:, -count:].copy())

    def where(self, mask: Mask) -> 'Rows':
        """Return the marked rows; without a copy if all are, as is usual."""
        return self if mask.all() else self[mask]

    def of_use(self) -> 'Rows':
        """Return the rows with a valid pose: finite, with a quaternion that is not zero."""
        finite = np.isfinite(self.poses)
        if finite.all() and self.poses[6].all():
            # The common case: no w is zero, so no quaternion is.
            return self
        return self.where(finite.all(axis=0) & self.poses[3:].any(axis=0))


class Steps:
    """
    The steps between N successive rows, (N - 1,), and over two rows, (N - 2,).

    In a ``size``, one metre of translation counts as much as one radian of rotation: both move
    a point that is a metre away from the frame by a metre.

    :ivar stamps: of the row before each step, nanoseconds.
    :ivar received: when the row before each step arrived, nanoseconds; 0: not known.
    :ivar waited: the time between successive arrivals, nanoseconds.
    :ivar time: the time between successive stamps, nanoseconds.
    :ivar gone: the translation, metres.
    :ivar turned: the rotation, radians.
    :ivar size: the sum of both.
    """

    def __init__(self, rows: Rows) -> None:
        self.stamps = rows.stamps[:-1]
        self.received = rows.received[:-1]
        self.waited = rows.received[1:] - self.received
        self.time = rows.stamps[1:] - self.stamps
        self._poses = unit_poses(rows.poses)
        self.gone, self.turned = distances(self._poses[:, :-1], self._poses[:, 1:])
        self.size = self.gone + self.turned

    @cached_property
    def size_of_two(self) -> Array:
        """Return the size of the step over two rows, which few edges need."""
        return np.add(*distances(self._poses[:, :-2], self._poses[:, 2:]))


def unit_poses(poses: Array) -> Array:
    """Return poses (7, N) of use with unit quaternions."""
    q = poses[3:]
    excess = np.einsum('ij,ij->j', q, q) - 1.0
    if np.einsum('i,i->', excess, excess) < UNIT_TOLERANCE ** 2:
        return poses
    # The square of a very small or large number would be zero or infinite.
    q = q / np.abs(q).max(axis=0)
    return np.concatenate([poses[:3], q / np.sqrt(np.einsum('ij,ij->j', q, q))])


def distances(a: Array, b: Array) -> tuple[Array, Array]:
    """Return the distances of poses (7, N): metres (N,), radians (N,)."""
    return se3.distance_many(a.T, b.T)
