# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Saving a tree as a file, and loading it at once: its arrays are used in place.

A file consists of a magic word, the version, the length and the CRC-32 of the header; then the
header, a JSON description of the tree; then the arrays. Each class of histories and of companions
defines its part of both. Expired samples are not written.

A sample is not read until a lookup needs it; only the parents of edges that changed their
parent are read at once. So the time for opening does not depend on the size, and processes
that open one file share its pages. Hence a damaged sample gives wrong numbers, unless the
caller requests a comparison with the arrays' CRC-32, which a saved file has in its header; that
reads everything.
"""

from collections.abc import Iterable, Sequence
import json
import mmap
import os
from pathlib import Path
import struct
import sys
from typing import Any, NamedTuple
import zlib

from tf_tree_py.core.errors import TreeFileError
from tf_tree_py.core.text import shorten
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.tree import Tree

from .edges import ALIGNMENT, Arrays, Bytes, Facts, load_history, save_history, Saved
from .whole_files import write_whole

_MAGIC = b'tf_tree\0'
_VERSION = 3
_PREFIX = struct.Struct('<8sIII')  # magic, version, length and CRC-32 of the header
_CHECKSUM = 'arrays_crc32'  # an optional fact of the header
# The facts of the header besides those of companions.
_FACTS = {'byte_order', 'cache_time', 'max_frames', 'max_name_bytes', 'frames', 'edges', _CHECKSUM}


class SavedTree(NamedTuple):
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


def saved_tree(tree: Tree, *, checksum: bool = False) -> SavedTree:
    """
    Return a tree as bytes; the tree must not change meanwhile.

    :param checksum: whether to compute a checksum of the arrays, which reads all of them.
    :raises TreeFileError: a history that files cannot contain.
    """
    arrays = Arrays()
    facts: Facts = {
        'byte_order': sys.byteorder, 'cache_time': tree.cache_time,
        'max_frames': tree.max_frames, 'max_name_bytes': tree.max_name_bytes,
        'frames': list(tree.frames),
        'edges': [save_history(history, arrays) for history in tree.histories.values()]}
    for cls, companion in tree.companions.items():
        if cls.key:  # others are caches
            facts |= _save_companion(companion, arrays)
    if checksum:
        facts[_CHECKSUM] = _crc32(arrays.parts)
    try:
        header = json.dumps(facts).encode()
    except TypeError as error:  # of an interpolation of a user
        raise TreeFileError(f'the tree cannot be saved: {error}') from error
    header += b' ' * (-(_PREFIX.size + len(header)) % ALIGNMENT)
    return SavedTree(_PREFIX.pack(_MAGIC, _VERSION, len(header), zlib.crc32(header)) + header,
                     arrays.parts)


def _save_companion(companion: Any, arrays: Arrays) -> Facts:
    """Return the part of a companion in the header; nothing if it is empty."""
    part = companion.save(arrays)
    return {companion.key: part} if part else {}


def _crc32(parts: Iterable[Bytes]) -> int:
    checksum = 0
    for part in parts:
        checksum = zlib.crc32(part, checksum)
    return checksum


def load_tree(data: Bytes, name: object = 'the data', *, verify: bool = False) -> Tree:
    """
    Return the saved tree; it uses the data in place, and cannot change.

    :param name: its name in error messages.
    :param verify: whether to read all the data, and compare it with its checksum.
    :raises TreeFileError: the data is not a saved tree, is incomplete, or has another version;
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
        raise TreeFileError(f'{name} is not a saved tree, as save() of a buffer writes it')
    _, version, length, checksum = _PREFIX.unpack_from(view)
    if version != _VERSION:
        raise TreeFileError(f'{name} is a saved tree of version {version}, and this tf_tree_py '
                            f'reads version {_VERSION}: use the version that wrote it, or save '
                            'the tree again from its recording')
    begin = _PREFIX.size + length
    header = bytes(view[_PREFIX.size:begin])
    if len(header) < length or zlib.crc32(header) != checksum:
        raise TreeFileError(f'{name} is damaged: the header of the saved tree has changed')
    return header, begin


def _verify(facts: object, arrays: memoryview) -> None:
    saved = Saved(facts, arrays, 0)
    if not saved.has(_CHECKSUM):
        raise ValueError('it has no checksum, because an older tf_tree_py wrote it; load it '
                         'without verify=True, and save it again')
    if _crc32([arrays]) != saved.whole(_CHECKSUM):
        raise ValueError('its samples have changed since they were written')


def _tree(facts: object, arrays: memoryview) -> Tree:
    """Return the tree of a header and arrays; raise a ``ValueError`` if they are invalid."""
    saved = Saved(facts, arrays, 0)
    byte_order = saved.one('byte_order', str)
    if byte_order != sys.byteorder:
        raise ValueError(f'it was written on a {byte_order}-endian machine, and this machine is '
                         f'{sys.byteorder}-endian')
    tree = Tree(saved.whole('cache_time', 1), saved.whole('max_frames'),
                saved.whole('max_name_bytes'))
    saved.cache_time = tree.cache_time
    tree.frames.update(dict.fromkeys(saved.many('frames', str)))
    for edge in saved.parts('edges'):
        history = load_history(edge)
        tree.histories[history.child] = history
    companions: dict[str, Any] = {
        cls.key: cls for cls in Companion.__subclasses__() if cls.key}
    for key in saved.names():
        if key not in _FACTS:
            if key not in companions:
                raise ValueError(f'it contains {key!r}, which is not installed here')
            companion = companions[key].load(saved)
            tree.companions[type(companion)] = companion
    saved.check_used_up()
    return tree


# --- files

def save_file(saved: SavedTree, path: str | os.PathLike[str]) -> None:
    """
    Write a saved tree to a file, either completely or not at all.

    :raises TreeFileError: the file cannot be written.
    """
    path = Path(path)
    try:
        write_whole(path, [saved.header, *saved.arrays])
    except OSError as error:
        raise TreeFileError(f'{path} cannot be written: {error.strerror}') from error


def load_file(path: str | os.PathLike[str], *, verify: bool = False) -> Tree:
    """
    Return the tree in a file; it uses the file in place, and cannot change.

    :param verify: whether to compare it with its checksum; see ``load_tree``.
    :raises TreeFileError: the file cannot be read, or does not contain a saved tree.
    """
    try:
        with open(path, 'rb', opener=_open_at_once) as file:
            if not os.fstat(file.fileno()).st_size:
                raise TreeFileError(f'{path} is empty, not a saved tree')
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise TreeFileError(f'{path} cannot be read: {error.strerror}') from error
    return load_tree(memoryview(data), path, verify=verify)


def _open_at_once(path: str, flags: int) -> int:
    """Open a file; a pipe is opened without waiting for a writer."""
    return os.open(path, flags | getattr(os, 'O_NONBLOCK', 0))
