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
A tree as a file whose arrays are used where they lie: frozen, and thawed in no time.

A file is a magic word, the version, the length and the CRC-32 of the header; the header,
JSON that lists what the tree has; then the arrays. Each kind of history (``edges.kinds``)
knows what it needs of both. Expired samples are not written.

Samples are not read before a lookup needs them; only the parents of edges that changed their
parent are. So opening takes the same time whatever the size, and processes that open one file
share its pages. Hence samples have no checksum: a damaged sample gives wrong numbers.
"""

from collections.abc import Sequence
from contextlib import suppress
import json
import mmap
import os
from pathlib import Path
import struct
import sys
from typing import NamedTuple
import zlib

from .tree import Tree
from ..edges.kinds import frozen, thawed
from ..edges.storage import ALIGNMENT, Arrays, Bytes, Stored
from ..edges.uncertainty import Uncertainty
from ..errors import TreeFileError
from ..text import shorten

_MAGIC = b'tf_tree\0'
_VERSION = 1
_PREFIX = struct.Struct('<8sIII')  # magic, version, length and CRC-32 of the header


class Frozen(NamedTuple):
    """
    A tree as bytes.

    :ivar header: everything before the arrays.
    :ivar arrays: to be written behind it, one after the other.
    """

    header: bytes
    arrays: Sequence[Bytes]

    def as_bytes(self) -> bytes:
        """Return all of it."""
        return b''.join([self.header, *self.arrays])


def freeze(tree: Tree) -> Frozen:
    """
    Return a tree as bytes; nobody may change it meanwhile.

    :raises TreeFileError: a history of a kind that cannot be frozen.
    """
    arrays = Arrays()
    facts = {
        'byte_order': sys.byteorder, 'cache_time': tree.cache_time,
        'max_frames': tree.max_frames, 'max_name_bytes': tree.max_name_bytes,
        'frames': list(tree.frames), 'corrections': tree.corrections,
        'edges': [frozen(history, arrays) for history in tree.histories.values()],
        'uncertainty': [{'child': child} | known.frozen(arrays)
                        for child, known in tree.uncertainty.items()]}
    header = json.dumps(facts).encode()
    header += b' ' * (-(_PREFIX.size + len(header)) % ALIGNMENT)
    return Frozen(_PREFIX.pack(_MAGIC, _VERSION, len(header), zlib.crc32(header)) + header,
                  arrays.parts)


def thaw(data: Bytes, name: object = 'the data') -> Tree:
    """
    Return the tree that was frozen, which uses the data where it lies, and cannot change.

    :param name: how errors call it.
    :raises TreeFileError: no frozen tree, a half one, or one of a newer version.
    """
    view = memoryview(data)
    header, begin = _header(view, name)
    try:
        return _tree(json.loads(header), view[begin:])
    except (ValueError, RecursionError) as error:
        raise TreeFileError(f'{name} is damaged: {shorten(str(error))}') from error


def _header(view: memoryview, name: object) -> tuple[bytes, int]:
    """Return the header, as it was written, and where it ends."""
    if len(view) < _PREFIX.size or bytes(view[:len(_MAGIC)]) != _MAGIC:
        raise TreeFileError(f'{name} is no frozen tree: those are what save() of a buffer writes')
    _, version, length, checksum = _PREFIX.unpack_from(view)
    if version != _VERSION:
        raise TreeFileError(f'{name} is a frozen tree of version {version}, and this tf_tree_py '
                            f'reads version {_VERSION}: it takes the one that wrote it')
    begin = _PREFIX.size + length
    header = bytes(view[_PREFIX.size:begin])
    if len(header) < length or zlib.crc32(header) != checksum:
        raise TreeFileError(f'{name} is damaged: the header of the frozen tree is not what was '
                            'written')
    return header, begin


def _tree(facts: object, arrays: memoryview) -> Tree:
    """Return what a header and arrays say; a ``ValueError`` says what is wrong with them."""
    stored = Stored(facts, arrays, 0)
    byte_order = stored.one('byte_order', str)
    if byte_order != sys.byteorder:
        raise ValueError(f'it is of a {byte_order}-endian machine, and this one is '
                         f'{sys.byteorder}-endian')
    tree = Tree(stored.whole('cache_time', 1), stored.whole('max_frames'),
                stored.whole('max_name_bytes'))
    tree.corrections = stored.whole('corrections')
    stored.cache_time = tree.cache_time
    tree.frames.update(dict.fromkeys(stored.many('frames', str)))
    for edge in stored.parts('edges'):
        history = thawed(edge)
        tree.histories[history.child] = history
    uncertainty = {one.one('child', str): Uncertainty.thawed(one)
                   for one in stored.parts('uncertainty')}
    if uncertainty:
        tree.uncertainty = uncertainty
    stored.check_used_up()
    return tree


# --- files

def write_frozen(frozen: Frozen, path: str | os.PathLike[str]) -> None:
    """
    Write a frozen tree into a file: all of it, or none.

    :raises TreeFileError: no place for the file.
    """
    path = Path(path)
    unfinished = path.with_name(f'.{path.name}.{os.getpid()}.unfinished')
    try:
        with unfinished.open('wb') as file:
            file.write(frozen.header)
            for each in frozen.arrays:
                file.write(each)
        unfinished.replace(path)
    except OSError as error:
        raise TreeFileError(f'{path} cannot be written: {error.strerror}') from error
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def read_tree(path: str | os.PathLike[str]) -> Tree:
    """
    Return the tree in a file, which uses the file where it lies, and cannot change.

    :raises TreeFileError: nothing that can be read, or what is no frozen tree.
    """
    try:
        with open(path, 'rb') as file:
            if not os.fstat(file.fileno()).st_size:
                raise TreeFileError(f'{path} is empty, and no frozen tree')
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise TreeFileError(f'{path} cannot be read: {error.strerror}') from error
    return thaw(memoryview(data), path)
