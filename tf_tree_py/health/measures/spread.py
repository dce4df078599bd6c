# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quantiles of a stream of numbers, in little memory."""

from collections.abc import Sequence
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

# At least this many rows are kept, if there are as many, and at most twice as many.
_KEPT = 128
_GOLDEN = 0.6180339887498949
_Number = TypeVar('_Number', bound=np.number)


class Sampled(Generic[_Number]):
    """
    About every n-th row of a stream, evenly over all time; n doubles as the stream grows.

    The distances between the rows that are kept vary: a regular pattern of the stream, such as
    one of every fourth row, must not decide which of its rows are seen. Multiples of the golden
    ratio, modulo one, are spread evenly: see Knuth, The Art of Computer Programming, 6.4.

    Adding an array costs some microseconds.

    :ivar count: the number of rows added.
    :ivar kept: the rows that are kept, in order.
    """

    __slots__ = ('count', 'kept', '_every', '_places')

    def __init__(self, empty: npt.NDArray[_Number]) -> None:
        """
        Begin without rows.

        :param empty: an array of the type and shape of the rows.
        """
        self.count = 0
        self.kept = empty
        self._every = 1
        # The places of the kept rows in the stream, as multiples of the golden ratio, modulo one.
        self._places: Array = np.empty(0)

    def add(self, rows: npt.NDArray[np.number]) -> None:
        """Add (N, ...) rows, in order."""
        places = np.arange(self.count, self.count + len(rows)) * _GOLDEN % 1.0
        self.count += len(rows)
        chosen = places < 1.0 / self._every
        self.kept = np.concatenate([self.kept, rows[chosen]])
        self._places = np.concatenate([self._places, places[chosen]])
        while len(self.kept) > 2 * _KEPT:
            self._every *= 2
            chosen = self._places < 1.0 / self._every
            self.kept, self._places = self.kept[chosen], self._places[chosen]


class Spread:
    """
    Quantiles of a stream of numbers, with the exact minimum and maximum.

    :ivar least: the smallest number; infinity without numbers.
    :ivar most: the largest number; minus infinity without numbers.
    """

    __slots__ = ('least', 'most', '_sampled', '_sorted', '_total')

    def __init__(self) -> None:
        self.least = np.inf
        self.most = -np.inf
        self._total = 0.0
        self._sampled = Sampled(np.empty(0))
        # The kept numbers in ascending order; computed when first needed.
        self._sorted: Array | None = None

    @property
    def count(self) -> int:
        """Return how many numbers were added."""
        return self._sampled.count

    @property
    def kept(self) -> int:
        """Return how many of them the quantiles are based on."""
        return len(self._sampled.kept)

    def add(self, numbers: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> None:
        """Add (N,) numbers, in order."""
        if not len(numbers):
            return
        self.least = min(self.least, float(numbers.min()))
        self.most = max(self.most, float(numbers.max()))
        self._total += float(numbers.sum())
        self._sampled.add(numbers)
        self._sorted = None

    def at(self, *parts: float) -> list[float]:
        """Return quantiles; each part is from 0 to 1. Without numbers they are zero."""
        if self._sorted is None:
            self._sorted = np.sort(self._sampled.kept)
        return quantiles(self._sorted, parts)

    def part_above(self, number: float) -> float:
        """Return which part of the numbers is at least as large as this one, from 0 to 1."""
        kept = self._sampled.kept
        return float(np.count_nonzero(kept >= number)) / max(len(kept), 1)

    @property
    def mean(self) -> float:
        """Return the mean; 0 without numbers."""
        return self._total / max(self.count, 1)

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
