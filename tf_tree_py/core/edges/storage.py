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
What a frozen history is made of: facts for a header, and arrays behind it.

Each kind of history chooses its facts and arrays, and can be made of them again. ``tree.frozen``
knows how a file holds both.
"""

from array import array
from collections.abc import Iterator
import math
from typing import Any, TypeVar

from ..geometry.so3 import Array

Bytes = bytes | bytearray | memoryview
Facts = dict[str, Any]

# Arrays begin where every number is aligned.
ALIGNMENT = 8

_Kind = TypeVar('_Kind')


class Arrays:
    """
    Arrays to be written one after the other, without a copy.

    :ivar parts: bytes, each array with what it takes to align the next.
    """

    def __init__(self) -> None:
        self.parts: list[Bytes] = []

    def add(self, values: 'array[Any] | memoryview[Any] | Array') -> None:
        """Take an array, which nobody changes until it is written."""
        data = memoryview(values)
        if data.nbytes:  # without any, it cannot be cast
            self.parts += [data.cast('B'), bytes(-data.nbytes % ALIGNMENT)]


class Stored:
    """
    The stored facts and arrays of a history; they may come from a damaged or hostile file.

    So every fact is checked here: a wrong one raises a ``ValueError``.

    :ivar cache_time: of the tree, nanoseconds.
    """

    def __init__(self, facts: object, data: memoryview, cache_time: int) -> None:
        if not isinstance(facts, dict):
            raise ValueError(f'it has {type(facts).__name__} where facts should be')
        self._facts = facts
        self._rest = [data]  # in a list, for parts share it and take from it, too
        self.cache_time = cache_time

    def part(self, key: str) -> 'Stored':
        """Return what was stored of a part, whose arrays come next."""
        return self._part(self._facts.get(key))

    def parts(self, key: str) -> 'Iterator[Stored]':
        """Yield what was stored of each of several parts, whose arrays come in that order."""
        return map(self._part, self.one(key, list))

    def _part(self, facts: object) -> 'Stored':
        part = Stored(facts, memoryview(b''), self.cache_time)
        part._rest = self._rest
        return part

    def has(self, key: str) -> bool:
        """Return whether there is such a fact."""
        return self._facts.get(key) is not None

    def one(self, key: str, kind: type[_Kind]) -> _Kind:
        """Return a fact."""
        return _checked(key, self._facts.get(key), kind)

    def many(self, key: str, kind: type[_Kind]) -> list[_Kind]:
        """Return a list of facts."""
        return [_checked(key, value, kind) for value in self.one(key, list)]

    def rows(self, key: str, integers: int, floats: int) -> list[list[Any]]:
        """Return a list of rows, each so many integers and then so many floats."""
        kinds = [int] * integers + [float] * floats
        rows = self.many(key, list)
        if any([type(value) for value in row] != kinds for row in rows):
            raise ValueError(f'{key!r} has not {integers} integers and {floats} floats a row')
        return rows

    def whole(self, key: str, least: int = 0, most: float = math.inf) -> int:
        """Return a fact that is a number between two others."""
        number = self.one(key, int)
        if not least <= number <= most:
            raise ValueError(f'{key!r} is not between {least} and {most}')
        return number

    def integers(self, count: int) -> 'memoryview[int]':
        """Return the next array, of int64, where it lies."""
        data = self._take(8 * count)
        return data.cast('q') if count else memoryview(array('q'))

    def codes(self, count: int) -> 'memoryview[int]':
        """Return the next array, of uint32, where it lies."""
        data = self._take(4 * count)
        return data.cast('I') if count else memoryview(array('I'))

    def floats(self, count: int) -> 'memoryview[float]':
        """Return the next array, of float64, where it lies."""
        data = self._take(8 * count)
        return data.cast('d') if count else memoryview(array('d'))

    def _take(self, size: int) -> memoryview:
        rest = self._rest[0]
        if size > len(rest):
            raise ValueError(f'{len(rest)} bytes where {size} were written')
        self._rest[0] = rest[size + -size % ALIGNMENT:]
        return rest[:size]

    def check_used_up(self) -> None:
        """Raise an error if arrays are left over."""
        if self._rest[0]:
            raise ValueError(f'{len(self._rest[0])} bytes more than were written')


def _checked(key: str, value: object, kind: type[_Kind]) -> _Kind:
    if type(value) is not kind:
        raise ValueError(f'{key!r} is no {kind.__name__}')
    return value
