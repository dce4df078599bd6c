# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quantiles of a stream of numbers, in little memory."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

# At least this many rows are kept, if there are as many, and at most twice as many.
_KEPT = 128


class Sampled:
    """
    Every n-th row of a stream, evenly over all time; n doubles as the stream grows.

    Adding an array costs some microseconds.

    :ivar count: the number of rows added.
    :ivar kept: the rows that are kept, in order.
    """

    __slots__ = ('count', 'kept', '_every')

    def __init__(self, empty: npt.NDArray[Any]) -> None:
        """
        Begin without rows.

        :param empty: (0, ...) an array of the shape and type of the rows.
        """
        self.count = 0
        self.kept = empty
        self._every = 1

    def add(self, rows: npt.NDArray[Any]) -> None:
        """Take (N, ...) rows, in order."""
        self.kept = np.concatenate([self.kept, rows[-self.count % self._every::self._every]])
        self.count += len(rows)
        while len(self.kept) > 2 * _KEPT:
            # A view would keep the other rows in memory.
            self.kept = self.kept[::2].copy()
            self._every *= 2


class Spread:
    """
    Quantiles of a stream of numbers, with the exact minimum and maximum.

    :ivar least: the smallest number; infinity without numbers.
    :ivar most: the largest number; minus infinity without numbers.
    """

    __slots__ = ('least', 'most', '_sampled', '_sorted')

    def __init__(self) -> None:
        self.least = np.inf
        self.most = -np.inf
        self._sampled = Sampled(np.empty(0))
        # The kept numbers in ascending order; computed when first needed.
        self._sorted: Array | None = None

    @property
    def count(self) -> int:
        """Return how many numbers were added."""
        return self._sampled.count

    def add(self, numbers: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> None:
        """Take (N,) numbers, in order."""
        if not len(numbers):
            return
        self.least = min(self.least, float(numbers.min()))
        self.most = max(self.most, float(numbers.max()))
        self._sampled.add(numbers)
        self._sorted = None

    def at(self, *parts: float) -> list[float]:
        """Return quantiles; each part is from 0 to 1. Without numbers they are zero."""
        if self._sorted is None:
            self._sorted = np.sort(self._sampled.kept)
        return quantiles(self._sorted, parts)

    @property
    def median(self) -> float:
        """Return the median; 0 without numbers."""
        return self.at(0.5)[0]


def median(numbers: npt.ArrayLike) -> float:
    """
    Return the median of (N,) numbers, or one of the two middle ones; 0 without numbers.

    numpy's own median takes ten times as long for a few numbers.
    """
    return quantiles(np.sort(numbers), (0.5,))[0]


def quantiles(ordered: Array, parts: Sequence[float]) -> list[float]:
    """Return quantiles of (N,) numbers in ascending order; zeros without numbers."""
    if not len(ordered):
        return [0.0] * len(parts)
    last = len(ordered) - 1
    return [float(ordered[round(part * last)]) for part in parts]
