# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What is saved of a history or a companion: facts for a header, and arrays after it.

``tree_file`` defines the format of a file.
"""

from array import array
from collections.abc import Iterator
import math
from typing import Any, TypeVar

from tf_tree_py.core.geometry.so3 import Array

Bytes = bytes | bytearray | memoryview
Facts = dict[str, object]

# The alignment of the beginning of each array, bytes, which is sufficient for all numbers.
ALIGNMENT = 8

_Value = TypeVar('_Value')


class Arrays:
    """
    Arrays to be written one after the other, without a copy.

    :ivar parts: bytes, each array followed by the padding for the next.
    """

    def __init__(self) -> None:
        self.parts: list[Bytes] = []

    def add(self, values: 'array[int] | array[float] | memoryview[int] | memoryview[float] | Array'
            ) -> None:
        """Add an array, which must not change until it is written."""
        data = memoryview(values)
        if data.nbytes:  # an empty memory view cannot be cast
            self.parts += [data.cast('B'), bytes(-data.nbytes % ALIGNMENT)]


class Saved:
    """
    The stored facts and arrays of a history; they may come from a damaged or hostile file.

    So every fact is checked here: an invalid one raises a ``ValueError``.

    :ivar cache_time: of the tree, nanoseconds.
    """

    def __init__(self, facts: object, data: memoryview, cache_time: int) -> None:
        if not isinstance(facts, dict):
            raise ValueError(f'facts are missing: there is a {type(facts).__name__} instead')
        self._facts = facts
        self._rest = [data]  # a list, because parts share it and take from it, too
        self.cache_time = cache_time

    def part(self, key: str) -> 'Saved':
        """Return a stored part, whose arrays come next."""
        return self._part(self._facts.get(key))

    def parts(self, key: str) -> 'Iterator[Saved]':
        """Yield several stored parts, whose arrays come in the same order."""
        return map(self._part, self.one(key, list))

    def _part(self, facts: object) -> 'Saved':
        part = Saved(facts, memoryview(b''), self.cache_time)
        part._rest = self._rest
        return part

    def names(self) -> list[str]:
        """Return the names of all facts, in their order."""
        return list(self._facts)

    def has(self, key: str) -> bool:
        """Return whether a fact is stored."""
        return self._facts.get(key) is not None

    def one(self, key: str, cls: type[_Value]) -> _Value:
        """Return a fact."""
        return _checked(key, self._facts.get(key), cls)

    def many(self, key: str, cls: type[_Value]) -> list[_Value]:
        """Return a list of facts."""
        return [_checked(key, value, cls) for value in self.one(key, list)]

    def rows(self, key: str, integers: int, floats: int) -> list[list[Any]]:
        """Return a list of rows, each with a number of integers and then of floats."""
        classes = [int] * integers + [float] * floats
        rows = self.many(key, list)
        if any([type(value) for value in row] != classes for row in rows):
            raise ValueError(
                f'the rows of {key!r} do not have {integers} integers and {floats} floats')
        return rows

    def whole(self, key: str, least: int = 0, most: float = math.inf) -> int:
        """Return a fact that is an integer between two limits."""
        number = self.one(key, int)
        if not least <= number <= most:
            raise ValueError(f'{key!r} is not between {least} and {most}')
        return number

    def integers(self, count: int) -> 'memoryview[int]':
        """Return the next array, of int64, in place."""
        data = self._read(8 * count)
        return data.cast('q') if count else memoryview(array('q'))

    def codes(self, count: int) -> 'memoryview[int]':
        """Return the next array, of uint32, in place."""
        data = self._read(4 * count)
        return data.cast('I') if count else memoryview(array('I'))

    def floats(self, count: int) -> 'memoryview[float]':
        """Return the next array, of float64, in place."""
        data = self._read(8 * count)
        return data.cast('d') if count else memoryview(array('d'))

    def _read(self, size: int) -> memoryview:
        rest = self._rest[0]
        if size > len(rest):
            raise ValueError(f'{len(rest)} bytes are left, and {size} are needed')
        self._rest[0] = rest[size + -size % ALIGNMENT:]
        return rest[:size]

    def check_used_up(self) -> None:
        """Raise an error if bytes of the arrays remain unused."""
        if self._rest[0]:
            raise ValueError(f'{len(self._rest[0])} bytes more than were written')


def _checked(key: str, value: object, cls: type[_Value]) -> _Value:
    if type(value) is not cls:
        raise ValueError(f'{key!r} is not of type {cls.__name__}')
    return value
