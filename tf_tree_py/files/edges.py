# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Saving and loading the history of an edge, its samples and its interpolation.

What is saved of a history or a companion is facts for a header, and arrays after it.

The rules:

- ``save`` returns facts of types that JSON supports, and adds arrays; ``load`` takes the arrays in
  the same order, and uses them in place. So nothing can be inserted into a loaded history.
- A fact is checked by ``Saved`` before it is used, and climbs end only if stamps and parents are
  sound, so these are checked here. Other numbers are not: see ``tree_file``, which defines the
  format of a file.
- A class is known by its name in files, and is saved only under its own name.
"""

from array import array
from collections.abc import Callable, Iterator, Sequence
import math
from typing import Any, NamedTuple, overload, Protocol, TypeVar

import numpy as np
from tf_tree_py.core.edges.interpolation import checked_interpolation, Interpolation, LINEAR
from tf_tree_py.core.edges.packed import Columns, POSE_FLOATS
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.errors import TreeFileError
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


# --- histories

class Saveable(History, Protocol):
    """A history with the methods for files."""

    def save(self, arrays: Arrays) -> Facts:
        """
        Return facts for ``load``, and add arrays.

        :raises TreeFileError: files do not support a part of it.
        """

    @classmethod
    def load(cls, child: str, saved: Saved) -> History:
        """
        Return the saved history.

        :raises ValueError: the facts and arrays are not valid for such a history.
        """


class _Format(NamedTuple):
    cls: type[History]
    save: Callable[[Any, Arrays], Facts]
    load: Callable[[str, Saved], History]


HISTORIES: dict[str, _Format] = {}
"""The classes of histories that files can contain, by name."""

_Class = TypeVar('_Class', bound=type[Saveable])


def in_files(name: str) -> Callable[[_Class], _Class]:
    """Return a decorator that registers a class of histories under a name."""
    def register(cls: _Class) -> _Class:
        HISTORIES[name] = _Format(cls, cls.save, cls.load)
        return cls
    return register


def save_history(history: History, arrays: Arrays) -> Facts:
    """
    Return the facts of a history for ``load_history``, and add its arrays.

    :raises TreeFileError: it is of a class that files cannot contain.
    """
    try:
        for name, (cls, save, _) in HISTORIES.items():
            if type(history) is cls:  # a subclass would be loaded as its base class
                return {'kind': name, 'child': history.child, 'authority': history.authority,
                        **save(history, arrays)}
        raise TreeFileError(f'it is a {type(history).__name__}')
    except TreeFileError as error:
        raise TreeFileError(
            f'the edge above {history.child!r} cannot be saved: {error}') from error


def load_history(saved: Saved) -> History:
    """
    Return a saved history.

    :raises ValueError: its class is unknown, or the data is invalid.
    """
    name = saved.one('kind', str)
    if name not in HISTORIES:
        raise ValueError(f'it contains an edge of the kind {name!r}, which is not installed here')
    history = HISTORIES[name].load(saved.one('child', str), saved)
    history.authority = saved.one('authority', str)
    return history


# --- static

def _save_static(history: StaticHistory, arrays: Arrays) -> Facts:
    arrays.add(array('d', history.pose))
    return {'parent': history.parent}


def _load_static(child: str, saved: Saved) -> StaticHistory:
    x, y, z, qx, qy, qz, qw = saved.floats(7)
    return StaticHistory(child, saved.one('parent', str), (x, y, z, qx, qy, qz, qw))


HISTORIES['static'] = _Format(StaticHistory, _save_static, _load_static)


# --- samples

_Samples = TypeVar('_Samples', bound=Samples)


def save_samples(history: Samples, arrays: Arrays) -> Facts:
    """
    Return facts for ``load_samples``, and add the samples in the window to arrays.

    :raises TreeFileError: the interpolation cannot be saved.
    """
    stamps, poses, parents, ends = history.columns()
    arrays.add(stamps)
    arrays.add(poses)
    facts: Facts = {'samples': len(stamps)}
    if parents is None:
        facts['parent'] = history.parent
    else:
        names = list(dict.fromkeys(parents))
        number = {name: index for index, name in enumerate(names)}
        arrays.add(array('I', [number[name] for name in parents]))
        facts |= {'parents': names, 'ends': sorted(ends)}
    if history.interpolation is not LINEAR:
        facts['interpolation'] = save_interpolation(history.interpolation, arrays)
    return facts


def load_samples(cls: type[_Samples], child: str, saved: Saved) -> _Samples:
    """
    Return saved samples as a history of a class.

    :raises ValueError: they are not valid for a history.
    """
    history = cls(child, saved.cache_time)
    history.lie_on(*_load_columns(saved))
    if saved.has('interpolation'):
        history.interpolate_by(load_interpolation(saved.part('interpolation')))
    return history


HISTORIES['samples'] = _Format(
    Samples, save_samples, lambda child, saved: load_samples(Samples, child, saved))


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


def _load_columns(saved: Saved) -> tuple[Columns, str | None]:
    """Return columns in place, and the parent of the newest sample."""
    count = saved.whole('samples')
    stamps, poses = saved.integers(count), saved.floats(POSE_FLOATS * count)
    if not saved.has('parents'):
        return (Columns(stamps, poses, None, ()),
                saved.one('parent', str if count else type(None)))
    names, ends = saved.many('parents', str), saved.many('ends', int)
    codes = saved.codes(count)
    _check_structure(stamps, codes, len(names))
    parents = Names(codes, names)
    return (Columns(stamps, poses, parents, ends),
            None if stamps[-1] in ends else parents[-1])


def _check_structure(stamps: 'memoryview[int]', codes: 'memoryview[int]', names: int) -> None:
    """Check the stamps and the parents of samples: climbs end only if these are valid."""
    times, numbers = np.frombuffer(stamps, np.int64), np.frombuffer(codes, np.uint32)
    if not len(times) or numbers.max() >= names or (times[1:] < times[:-1]).any():
        raise ValueError('the stamps or parents of an edge are not valid')


# --- interpolations

def save_interpolation(interpolation: Interpolation, arrays: Arrays) -> Facts:
    """
    Return facts for ``load_interpolation``, and add arrays.

    :raises TreeFileError: its class has no name of its own, or does not say how to save its data.
    """
    cls = type(interpolation)
    named = _interpolations().get(cls.name)
    # By its full name, because a notebook may have defined the class once more.
    if named is None or (named.__module__, named.__qualname__) != (
            cls.__module__, cls.__qualname__):
        why = '' if named is None or not cls.name else (
            f' of its own ({named.__qualname__} has {cls.name!r}, too)')
        raise TreeFileError(
            f'its interpolation {cls.__name__} needs a name for files{why}, such as '
            "name = 'my policy' in its class")
    save = getattr(interpolation, 'save', None)
    if save is None and vars(interpolation):
        raise TreeFileError(f'its interpolation {cls.__name__} has data, so it needs methods '
                            'save and load: see docs/interpolation.md')
    try:
        facts = {} if save is None else save(arrays)
    except Exception as error:
        raise TreeFileError(f'save() of its interpolation {cls.__name__} raised '
                            f'{error!r}') from error
    if not isinstance(facts, dict):
        raise TreeFileError(f'save() of its interpolation {cls.__name__} must return a dict, and '
                            f'returned {facts!r}')
    return {'name': cls.name, 'data': facts}


def load_interpolation(saved: Saved) -> Interpolation:
    """
    Return a saved interpolation.

    :raises ValueError: its class is not known here, or the facts are not valid for it.
    """
    name = saved.one('name', str)
    cls = _interpolations().get(name)
    if cls is None:
        raise ValueError(f'it contains an edge with the interpolation {name!r}, which is not '
                         'defined here: import the module that defines it first')
    load = getattr(cls, 'load', None)
    data = saved.part('data')
    try:
        return checked_interpolation(cls() if load is None else load(data))
    except ValueError:
        raise
    except Exception as error:
        raise ValueError(f'load() of its interpolation {name!r} raised {error!r}') from error


def _interpolations() -> dict[str, type[Interpolation]]:
    """Return all classes that have a name of their own, by that name."""
    return {cls.name: cls for cls in _below(Interpolation) if 'name' in vars(cls)}


def _below(cls: type[Interpolation]) -> Iterator[type[Interpolation]]:
    for each in cls.__subclasses__():
        yield each
        yield from _below(each)
