# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A tree as a file whose arrays are used in place: freezing it, and thawing it at once.

A file consists of a magic word, the version, the length and the CRC-32 of the header; then the
header, a JSON description of the tree; then the arrays. Each kind of history and of companion
defines its part of both. The basic kinds of history are listed here; every other kind
registers itself. Expired samples are not written.

A sample is not read until a lookup needs it; only the parents of edges that changed their
parent are read at once. So the time for opening does not depend on the size, and processes
that open one file share its pages. Hence a damaged sample gives wrong numbers, unless the
caller requests a comparison with the arrays' CRC-32, which a saved file has in its header; that
reads everything.
"""

from collections.abc import Callable, Iterable, Sequence
import json
import mmap
import os
from pathlib import Path
import struct
import sys
from typing import NamedTuple, Protocol, TypeVar
import zlib

from .companions import COMPANIONS
from .tree import Tree
from ..edges.histories import DynamicHistory, HeldHistory, StaticHistory
from ..edges.protocol import History
from ..edges.storage import ALIGNMENT, Arrays, Bytes, Facts, Stored
from ..errors import TreeFileError
from ..text import shorten
from ..whole_files import write_whole


class Freezable(History, Protocol):
    """A history that can be frozen; its class is in ``KINDS``."""

    def frozen(self, arrays: Arrays) -> Facts:
        """Return facts for ``thawed``, of types that JSON supports, and add its arrays."""

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> History:
        """
        Return the frozen history from its facts and arrays; it need not take samples.

        :raises ValueError: they are not valid for such a history.
        """


KINDS: dict[str, type[Freezable]] = {
    'static': StaticHistory, 'interpolated': DynamicHistory, 'held': HeldHistory}

_Kind = TypeVar('_Kind', bound=type[Freezable])


def storable(name: str) -> Callable[[_Kind], _Kind]:
    """Return a decorator that registers a class of histories under a name."""
    def register(kind: _Kind) -> _Kind:
        KINDS[name] = kind
        return kind
    return register


def frozen(history: History, arrays: Arrays) -> Facts:
    """
    Return the facts of a history for ``thawed``, and add its arrays.

    :raises TreeFileError: it is of a kind that cannot be frozen.
    """
    for name, kind in KINDS.items():
        if type(history) is kind:  # a subclass would be thawed as its base class
            return {'kind': name, 'child': history.child, 'authority': history.authority,
                    **kind.frozen(history, arrays)}
    raise TreeFileError(f'the edge above {history.child!r} cannot be frozen: it is a '
                        f'{type(history).__name__}')


def thawed(stored: Stored) -> History:
    """
    Return the frozen history.

    :raises ValueError: the kind is unknown, or the data is invalid.
    """
    name = stored.one('kind', str)
    if name not in KINDS:
        raise ValueError(f'it contains an edge of the kind {name!r}, which is not installed here')
    history = KINDS[name].thawed(stored.one('child', str), stored)
    history.authority = stored.one('authority', str)
    return history


# --- files

_MAGIC = b'tf_tree\0'
_VERSION = 2
_PREFIX = struct.Struct('<8sIII')  # magic, version, length and CRC-32 of the header
_CHECKSUM = 'arrays_crc32'  # an optional fact of the header
# The facts of the header besides those of companions.
_FACTS = {'byte_order', 'cache_time', 'max_frames', 'max_name_bytes', 'frames', 'edges', _CHECKSUM}


class Frozen(NamedTuple):
    """
    A tree as bytes.

    :ivar header: everything before the arrays.
    :ivar arrays: to be written after it, one after the other.
    """

    header: bytes
    arrays: Sequence[Bytes]

    def as_bytes(self) -> bytes:
        """Return the header and the arrays as one object."""
        return b''.join([self.header, *self.arrays])


def freeze(tree: Tree, *, checksum: bool = False) -> Frozen:
    """
    Return a tree as bytes; the tree must not change meanwhile.

    :param checksum: whether to compute a checksum of the arrays, which reads all of them.
    :raises TreeFileError: a history of a kind that cannot be frozen.
    """
    arrays = Arrays()
    facts = {
        'byte_order': sys.byteorder, 'cache_time': tree.cache_time,
        'max_frames': tree.max_frames, 'max_name_bytes': tree.max_name_bytes,
        'frames': list(tree.frames),
        'edges': [frozen(history, arrays) for history in tree.histories.values()]}
    for kind, companion in tree.companions.items():
        part = companion.frozen(arrays) if kind.key in COMPANIONS else None  # others are caches
        if part:
            facts[kind.key] = part
    if checksum:
        facts[_CHECKSUM] = _crc32(arrays.parts)
    header = json.dumps(facts).encode()
    header += b' ' * (-(_PREFIX.size + len(header)) % ALIGNMENT)
    return Frozen(_PREFIX.pack(_MAGIC, _VERSION, len(header), zlib.crc32(header)) + header,
                  arrays.parts)


def _crc32(parts: Iterable[Bytes]) -> int:
    checksum = 0
    for part in parts:
        checksum = zlib.crc32(part, checksum)
    return checksum


def thaw(data: Bytes, name: object = 'the data', *, verify: bool = False) -> Tree:
    """
    Return the frozen tree; it uses the data in place, and cannot change.

    :param name: its name in error messages.
    :param verify: whether to read all the data, and compare it with its checksum.
    :raises TreeFileError: the data is not a frozen tree, is incomplete, or has another version;
        or, with ``verify``, it has changed or has no checksum.
    """
    view = memoryview(data)
    header, begin = _header(view, name)
    try:
        facts = json.loads(header)
        if verify:
            _verify(facts, view[begin:])
        return _tree(facts, view[begin:])
    except (ValueError, RecursionError) as error:
        raise TreeFileError(f'{name} is damaged: {shorten(str(error))}') from error


def _header(view: memoryview, name: object) -> tuple[bytes, int]:
    """Return the header as it was written, and its end."""
    if len(view) < _PREFIX.size or bytes(view[:len(_MAGIC)]) != _MAGIC:
        raise TreeFileError(f'{name} is not a frozen tree, as save() of a buffer writes it')
    _, version, length, checksum = _PREFIX.unpack_from(view)
    if version != _VERSION:
        raise TreeFileError(f'{name} is a frozen tree of version {version}, and this tf_tree_py '
                            f'reads version {_VERSION}: use the version that wrote it, or save '
                            'the tree again from its recording')
    begin = _PREFIX.size + length
    header = bytes(view[_PREFIX.size:begin])
    if len(header) < length or zlib.crc32(header) != checksum:
        raise TreeFileError(f'{name} is damaged: the header of the frozen tree has changed')
    return header, begin


def _verify(facts: object, arrays: memoryview) -> None:
    stored = Stored(facts, arrays, 0)
    if not stored.has(_CHECKSUM):
        raise ValueError('it has no checksum, because an older tf_tree_py wrote it; load it '
                         'without verify=True, and save it again')
    if _crc32([arrays]) != stored.whole(_CHECKSUM):
        raise ValueError('its samples have changed since they were written')


def _tree(facts: object, arrays: memoryview) -> Tree:
    """Return the tree of a header and arrays; raise a ``ValueError`` if they are invalid."""
    stored = Stored(facts, arrays, 0)
    byte_order = stored.one('byte_order', str)
    if byte_order != sys.byteorder:
        raise ValueError(f'it was written on a {byte_order}-endian machine, and this machine is '
                         f'{sys.byteorder}-endian')
    tree = Tree(stored.whole('cache_time', 1), stored.whole('max_frames'),
                stored.whole('max_name_bytes'))
    stored.cache_time = tree.cache_time
    tree.frames.update(dict.fromkeys(stored.many('frames', str)))
    for edge in stored.parts('edges'):
        history = thawed(edge)
        tree.histories[history.child] = history
    for key in stored.names():
        if key not in _FACTS:
            if key not in COMPANIONS:
                raise ValueError(f'it contains {key!r}, which is not installed here')
            companion = COMPANIONS[key].thawed(stored)
            tree.companions[type(companion)] = companion
    stored.check_used_up()
    return tree


# --- files

def write_frozen(frozen: Frozen, path: str | os.PathLike[str]) -> None:
    """
    Write a frozen tree to a file, either completely or not at all.

    :raises TreeFileError: the file cannot be written.
    """
    path = Path(path)
    try:
        write_whole(path, [frozen.header, *frozen.arrays])
    except OSError as error:
        raise TreeFileError(f'{path} cannot be written: {error.strerror}') from error


def read_tree(path: str | os.PathLike[str], *, verify: bool = False) -> Tree:
    """
    Return the tree in a file; it uses the file in place, and cannot change.

    :param verify: whether to compare it with its checksum; see ``thaw``.
    :raises TreeFileError: the file cannot be read, or does not contain a frozen tree.
    """
    try:
        with open(path, 'rb', opener=_open_at_once) as file:
            if not os.fstat(file.fileno()).st_size:
                raise TreeFileError(f'{path} is empty, not a frozen tree')
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise TreeFileError(f'{path} cannot be read: {error.strerror}') from error
    return thaw(memoryview(data), path, verify=verify)


def _open_at_once(path: str, flags: int) -> int:
    """Open a file; a pipe is opened without waiting for a writer."""
    return os.open(path, flags | getattr(os, 'O_NONBLOCK', 0))
