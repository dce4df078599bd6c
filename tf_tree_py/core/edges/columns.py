# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The memory of samples as columns, which a history or a file owns."""

from array import array
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple, overload

import numpy as np

from .storage import Arrays, Facts, Stored

POSE_FLOATS = 7


class Columns(NamedTuple):
    """
    The memory of a history as columns for the same samples.

    :ivar stamps: int64 nanoseconds, sorted.
    :ivar poses: float64, seven per sample.
    :ivar parents: of each sample; None if all are that of the newest.
    :ivar ends: stamps of the samples at which the edge ended.
    """

    stamps: 'memoryview[int]'
    poses: 'memoryview[float]'
    parents: Sequence[str] | None
    ends: Collection[int]


class Names(Sequence[str]):
    """The parent of every sample, stored as an index into a list of names."""

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
    Return columns in place, and the parent of the newest sample.

    :raises ValueError: they are not valid for a history.
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
    """Check the stamps and the parents of samples: climbs end only if these are valid."""
    times, numbers = np.frombuffer(stamps, np.int64), np.frombuffer(codes, np.uint32)
    if not len(times) or numbers.max() >= names or (times[1:] < times[:-1]).any():
        raise ValueError('the stamps or parents of an edge are not valid')
