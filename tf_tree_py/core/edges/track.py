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
Copies of edges' histories, for many stamps: each kind with its own evaluation.

Made under the buffer's lock, and used without it. Poses have their seven coordinates
first here, (7, ...): numpy is quickest on long rows.
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

    :ivar knots: (n,) sorted stamps; between two neighbours the edge moves smoothly. None
        where it never moves.
    """

    knots: Stamps

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses some time after stamps.

        :param stamps: (...) nanoseconds.
        :param since: (...) nanoseconds after them, no further than the next knot, which is
            then approached from below; None: none.
        :return: (7, ...), of any shape that broadcasts with that of stamps and since.
        """

    @property
    def reach(self) -> float:
        """Return how far the child is away at most, metres."""

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return how much it moves from one stamp to the next, at most.

        What the error of an interpolating polynomial is judged by: it holds for motion at
        a constant speed between knots. A kind that moves otherwise returns infinity, and
        is then evaluated at every stamp.

        :param knots: (n,) sorted, n > 1; its own between the first and the last are among
            them.
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
        """Return how far the child is away, metres."""
        return math.hypot(*self._pose[:3])

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return that it does not move."""
        return 0.0, 0.0


class HeldTrack:
    """
    Samples that each hold until the next.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def __init__(self, knots: Stamps, poses: Array) -> None:
        self.knots = knots
        self._poses = np.ascontiguousarray(poses.T)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) of the samples that hold at stamps."""
        return self._poses.take(self._before(stamps), axis=1)

    @property
    def reach(self) -> float:
        """Return how far the child is away at most, metres."""
        x, y, z = self._poses[:3]
        return math.sqrt((x * x + y * y + z * z).max())

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return that nothing moves between two samples."""
        return 0.0, 0.0

    def _before(self, stamps: Stamps) -> npt.NDArray[np.intp]:
        """Return the index of the last sample at or before each stamp."""
        return self.knots.searchsorted(stamps, side='right') - 1


class InterpolatedTrack(HeldTrack):
    """
    Samples between which the edge goes straight and turns at a constant speed.

    :param knots: (n,) nanoseconds, sorted, n > 0.
    :param poses: (n, 7) ``parent_T_child``.
    """

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) between the samples before and after."""
        before, after = self._around(stamps)
        began = self.knots.take(before)
        # The last sample is its own successor.
        lengths = np.maximum(self.knots.take(after) - began, 1)
        elapsed = stamps - began if since is None else (stamps - began) + since
        return _between(self._poses.take(before, axis=1), self._poses.take(after, axis=1),
                        elapsed / lengths)

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """Return the greatest angle and distance between two neighbouring knots."""
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
    """Interpolate between poses (7, ...) as ``se3.interpolate_many`` does, and as tf2."""
    first, second = so3.slerp_weights_many(_dot(a[3:], b[3:]), ratio, as_tf2=True)
    poses = np.empty((7, *first.shape))
    np.multiply(1.0 - ratio, a[:3], out=poses[:3])
    poses[:3] += ratio * b[:3]
    np.multiply(first, a[3:], out=poses[3:])
    poses[3:] += second * b[3:]
    return poses


def _dot(a: Array, b: Array) -> Array:
    """Sum as the scalar form does it, for the last bit decides what is "one" there."""
    x, y, z, w = a * b
    return np.asarray(x + y + z + w)
