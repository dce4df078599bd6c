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

"""Quantiles of a stream of numbers, in little memory."""

import numpy as np
import numpy.typing as npt

from ..geometry.so3 import Array

# Of many numbers at least this many are kept, and at most twice as many.
_KEPT = 128


class Spread:
    """
    Every n-th of the numbers that came, evenly over all time; n doubles as they grow.

    An exact minimum and maximum beside them. Adding an array costs some microseconds.

    :ivar count: how many came.
    :ivar least: the smallest; infinity before any came.
    :ivar most: the largest.
    """

    __slots__ = ('count', 'least', 'most', '_kept', '_every', '_sorted')

    def __init__(self) -> None:
        self.count = 0
        self.least = np.inf
        self.most = -np.inf
        self._kept: Array = np.empty(0)
        self._every = 1
        # What is kept, in order; made when it is first asked for.
        self._sorted: Array | None = None

    def add(self, numbers: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> None:
        """Take (N,) numbers, in order."""
        if not len(numbers):
            return
        self.least = min(self.least, float(numbers.min()))
        self.most = max(self.most, float(numbers.max()))
        self._kept = np.concatenate([self._kept, numbers[-self.count % self._every::self._every]])
        self.count += len(numbers)
        self._sorted = None
        while len(self._kept) > 2 * _KEPT:
            # A copy: a view would keep the others alive.
            self._kept = self._kept[::2].copy()
            self._every *= 2

    def at(self, *parts: float) -> list[float]:
        """Return quantiles; each part is from 0 to 1. Zeros before any number came."""
        if self._sorted is None:
            self._sorted = np.sort(self._kept)
        if not len(self._sorted):
            return [0.0] * len(parts)
        last = len(self._sorted) - 1
        return [float(self._sorted[round(part * last)]) for part in parts]

    @property
    def median(self) -> float:
        """Return the number in the middle; 0 before any came."""
        return self.at(0.5)[0]
