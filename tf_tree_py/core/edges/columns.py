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

"""The memory of samples, column by column: it belongs to a history, or to a file."""

from array import array
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple, overload

import numpy as np

from .storage import Arrays, Facts, Stored

POSE_FLOATS = 7


class Columns(NamedTuple):
    """
    The memory of a history: columns, all of one length.

    :ivar stamps: int64 nanoseconds, sorted.
    :ivar poses: float64, seven a sample.
    :ivar parents: of each sample; None while all name the newest's.
    :ivar ends: stamps of the samples with which the edge ended.
    """

    stamps: 'memoryview[int]'
    poses: 'memoryview[float]'
    parents: Sequence[str] | None
    ends: Collection[int]


class Names(Sequence[str]):
    """The parent of every sample, kept as a number of a few names."""

    def __init__(self, codes: 'memoryview[int]', names: Sequence[str]) -> None:
        self._codes = codes
        self._names = names

    def __len__(self) -> int:
        return len(self._codes)

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> 'Names': ...

    def __getitem__(self, index: int | slice) -> 'str | Names':
        if isinstance(index, slice):
            return Names(self._codes[index], self._names)
        return self._names[self._codes[index]]

    def __iter__(self) -> Iterator[str]:
        return map(self._names.__getitem__, self._codes)

    def __contains__(self, name: object) -> bool:
        return name in self._names


def store(columns: Columns, parent: str | None, arrays: Arrays) -> Facts:
    """Add columns to arrays, and return the facts for ``restored``."""
    arrays.add(columns.stamps)
    arrays.add(columns.poses)
    facts: Facts = {'samples': len(columns.stamps)}
    if columns.parents is None:
        return facts | {'parent': parent}
    names = list(dict.fromkeys(columns.parents))
    number = {name: index for index, name in enumerate(names)}
    arrays.add(array('I', [number[name] for name in columns.parents]))
    return facts | {'parents': names, 'ends': sorted(columns.ends)}


def restored(stored: Stored) -> tuple[Columns, str | None]:
    """
    Return columns where they lie, and the parent of the newest sample.

    :raises ValueError: they cannot be a history's.
    """
    count = stored.whole('samples')
    stamps, poses = stored.integers(count), stored.floats(POSE_FLOATS * count)
    if not stored.has('parents'):
        return (Columns(stamps, poses, None, ()),
                stored.one('parent', str if count else type(None)))
    names, ends = stored.many('parents', str), stored.many('ends', int)
    codes = stored.codes(count)
    _check_structure(stamps, codes, len(names))
    parents = Names(codes, names)
    return (Columns(stamps, poses, parents, ends),
            None if stamps[-1] in ends else parents[-1])


def _check_structure(stamps: 'memoryview[int]', codes: 'memoryview[int]', names: int) -> None:
    """Read which parent each sample names, and check it: climbs end only if that is sound."""
    times, numbers = np.frombuffer(stamps, np.int64), np.frombuffer(codes, np.uint32)
    if not len(times) or numbers.max() >= names or (times[1:] < times[:-1]).any():
        raise ValueError('the parents of an edge are in no order')
