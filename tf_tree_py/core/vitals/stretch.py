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

"""Samples of one edge as arrays, and what changes from each to the next."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..geometry import se3
from ..geometry.so3 import Array
from ..times import Stamps

Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

TAIL = 3
"""So many rows are looked at again with those that follow: a step is judged by its neighbours."""


@dataclass(frozen=True)
class Rows:
    """
    Samples of one edge, in order of arrival.

    :ivar received: (N,) nanoseconds; 0 where the clock had not begun.
    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (N, 7) as they arrived, unchecked.
    """

    received: Stamps
    stamps: Stamps
    poses: Array

    def __getitem__(self, part: slice | Mask | Places) -> 'Rows':
        return Rows(self.received[part], self.stamps[part], self.poses[part])

    def __len__(self) -> int:
        return len(self.stamps)

    def after(self, tail: 'Rows | None') -> 'Rows':
        """Return these rows, behind the last rows of the stretch before."""
        if tail is None:
            return self
        return Rows(np.concatenate([tail.received, self.received]),
                    np.concatenate([tail.stamps, self.stamps]),
                    np.concatenate([tail.poses, self.poses]))

    def last(self, count: int) -> 'Rows':
        """Return a copy of the last rows, which does not keep the others alive."""
        return Rows(self.received[-count:].copy(), self.stamps[-count:].copy(),
                    self.poses[-count:].copy())

    def of_use(self) -> 'Rows':
        """Return the rows with a valid pose: finite, its quaternion not zero."""
        return self[np.isfinite(self.poses).all(axis=1) & self.poses[:, 3:].any(axis=1)]


class Steps:
    """
    The steps from each row to the next, (N - 1,) of N rows, and over two, (N - 2,).

    In a ``size``, one metre of translation counts as much as one radian of rotation: both move
    a point that is a metre away from the frame by a metre.

    :ivar time: from each stamp to the next, nanoseconds.
    :ivar gone: how far the frame went, metres.
    :ivar turned: how far it turned, radians.
    :ivar size: both together.
    :ivar size_of_two: from each row to the next but one.
    """

    def __init__(self, rows: Rows) -> None:
        poses = rows.poses
        self.stamps = rows.stamps
        self.time = np.diff(rows.stamps)
        self.gone, self.turned = se3.distance_many(poses[:-1], poses[1:])
        self.size = self.gone + self.turned
        self.size_of_two = np.add(*se3.distance_many(poses[:-2], poses[2:]))
