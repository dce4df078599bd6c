# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rows of numbers by stamp, in packed memory, which files contain as they are."""

from array import array
from collections.abc import Iterable
from typing import cast, ClassVar, TypeVar

import numpy as np
from tf_tree_py.core.errors import no_truth
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .edges import Arrays, Facts, Saved

_Rows = TypeVar('_Rows', bound='StampedRows')


class StampedRows:
    """
    Rows of numbers, sorted by their stamps.

    :ivar width: how many numbers a row has.
    :ivar name: of the number of rows, in files.
    :ivar least: the smallest number of rows in files.
    """

    __slots__ = ('stamps', 'numbers')

    width: ClassVar[int]
    name: ClassVar[str]
    least: ClassVar[int] = 0

    def __init__(self) -> None:
        self.stamps, self.numbers = array('q'), array('d')

    def __len__(self) -> int:
        return len(self.stamps)

    __bool__ = no_truth

    def add(self, place: int, stamp: int, row: Iterable[float]) -> None:
        """Add a row at its place."""
        self.stamps.insert(place, stamp)
        self.numbers[self.width * place:self.width * place] = array('d', row)

    def drop(self, begin: int, end: int) -> None:
        """Remove the rows from one place to another."""
        del self.stamps[begin:end]
        del self.numbers[self.width * begin:self.width * end]

    def around(self, stamps: Stamps) -> tuple[Stamps, Stamps, Array, Array, Array]:
        """
        Return the rows around stamps (N,), for interpolation.

        Before the first row and after the last, both are that one.

        :return: the stamps before and after, (N,); these rows, (N, width) each; and how far each
            stamp is between the two, 0 to 1.
        """
        # An array cannot grow while numpy has a view of it, so this function returns only copies.
        knots = np.frombuffer(self.stamps, np.int64)
        rows = np.frombuffer(self.numbers).reshape(-1, self.width)
        after = knots.searchsorted(stamps, side='right')
        before, after = np.maximum(after - 1, 0), np.minimum(after, len(knots) - 1)
        begins, ends = knots[before], knots[after]
        ratio = np.where(begins < ends, (stamps - begins) / np.maximum(ends - begins, 1), 0.0)
        return begins, ends, rows[before], rows[after], ratio

    def copy(self: _Rows) -> _Rows:
        """Return an independent copy."""
        twin = type(self)()
        twin.stamps, twin.numbers = self.stamps[:], self.numbers[:]
        return twin

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the rows to arrays."""
        arrays.add(self.stamps)
        arrays.add(self.numbers)
        return {self.name: len(self)}

    @classmethod
    def load(cls: type[_Rows], saved: Saved) -> _Rows:
        """Return the saved rows; they use the memory in place, and nothing can be added."""
        rows, count = cls(), saved.whole(cls.name, cls.least)
        # Memory views are read like arrays.
        rows.stamps = cast('array[int]', saved.integers(count))
        rows.numbers = cast('array[float]', saved.floats(cls.width * count))
        return rows
