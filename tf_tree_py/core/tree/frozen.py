"""
A tree as a file whose arrays are used where they lie: frozen, and thawed in no time.

A file is a magic word, the version, the length and the CRC-32 of the header; the header,
JSON that names frames and edges and says where their arrays stand; then the arrays:
stamps (int64), poses (7 float64) and, for edges that changed their parent, the number of
each sample's parent (uint32). What is in the window is written, not what has expired.

Nothing of the arrays is read before a lookup asks for it, so opening takes the same time
whatever the size, and processes that open one file share its pages.
"""

from array import array
from collections.abc import Iterator, Sequence
from contextlib import suppress
import json
import mmap
import os
from pathlib import Path
import struct
import sys
from typing import Any, NamedTuple, overload
import zlib

from .tree import Tree
from ..edges.discrete import DynamicHistory, HeldHistory
from ..edges.packed import Columns, PackedSamples, POSE_BYTES
from ..edges.protocol import History
from ..edges.static import StaticHistory
from ..errors import TreeFileError

_MAGIC = b'tf_tree\0'
_VERSION = 1
_PREFIX = struct.Struct('<8sIII')  # magic, version, length and CRC-32 of the header
# Arrays begin where every number is aligned.
_ALIGNMENT = 8

_KINDS: dict[str, type[PackedSamples]] = {'interpolated': DynamicHistory, 'held': HeldHistory}
_NAMES = {kind: name for name, kind in _KINDS.items()}

Buffer = bytes | bytearray | memoryview


class Frozen(NamedTuple):
    """
    A tree as bytes.

    :ivar header: everything before the arrays.
    :ivar arrays: to be written behind it, one after the other.
    """

    header: bytes
    arrays: Sequence[Buffer]

    def as_bytes(self) -> bytes:
        """Return all of it."""
        return b''.join([self.header, *self.arrays])


def freeze(tree: Tree) -> Frozen:
    """
    Return a tree as bytes; of a tree that nobody changes meanwhile.

    :raises TreeFileError: a history of a kind that cannot be frozen.
    """
    arrays: list[Buffer] = []
    edges = [_described(history, arrays) for history in tree.histories.values()]
    header = json.dumps({
        'byte_order': sys.byteorder, 'cache_time': tree.cache_time,
        'max_frames': tree.max_frames, 'max_name_bytes': tree.max_name_bytes,
        'frames': list(tree.frames), 'edges': edges,
        'array_bytes': sum(len(each) for each in arrays)}).encode()
    header += b' ' * (-(_PREFIX.size + len(header)) % _ALIGNMENT)
    return Frozen(_PREFIX.pack(_MAGIC, _VERSION, len(header), zlib.crc32(header)) + header,
                  arrays)


def _described(history: History, arrays: list[Buffer]) -> dict[str, Any]:
    """Return an edge for the header, and add its arrays."""
    if isinstance(history, StaticHistory):
        return {'kind': 'static', 'child': history.child, 'parent': history.parent,
                'authority': history.authority, 'pose': history.pose}
    if not isinstance(history, PackedSamples) or type(history) not in _NAMES:
        raise TreeFileError(f'the edge above {history.child!r} cannot be frozen: it is a '
                            f'{type(history).__name__}')
    columns = history.columns()
    arrays += [columns.stamps.cast('B'), columns.poses.cast('B')]
    parents: list[str] = []
    if columns.parents is not None:
        parents = list(dict.fromkeys(columns.parents))
        number = {name: index for index, name in enumerate(parents)}
        codes = array('I', [number[name] for name in columns.parents])
        codes.extend([0] * (len(codes) % 2))  # so that the next array is aligned
        arrays.append(codes.tobytes())
    return {'kind': _NAMES[type(history)], 'child': history.child, 'parent': history.parent,
            'authority': history.authority, 'samples': len(columns.stamps),
            'parents': parents, 'ends': sorted(columns.ends)}


def thaw(data: Buffer, name: object = 'the data') -> Tree:
    """
    Return the tree that was frozen, which uses the data where it lies, and cannot change.

    :param name: how errors call it.
    :raises TreeFileError: no frozen tree, a half one, or one of a newer version.
    """
    view = memoryview(data)
    header, begin = _header(view, name)
    tree = Tree(header['cache_time'], header['max_frames'], header['max_name_bytes'])
    tree.frames.update(dict.fromkeys(header['frames']))
    for edge in header['edges']:
        history, begin = _thawed(edge, view, begin, tree.cache_time)
        tree.histories[history.child] = history
    return tree


def _header(view: memoryview, name: object) -> tuple[dict[str, Any], int]:
    """Return the header, checked, and where it ends."""
    if len(view) < _PREFIX.size or bytes(view[:len(_MAGIC)]) != _MAGIC:
        raise TreeFileError(f'{name} is no frozen tree: those are what save() of a buffer writes')
    _, version, length, checksum = _PREFIX.unpack_from(view)
    if version > _VERSION:
        raise TreeFileError(f'{name} is a frozen tree of version {version}, and this tf_tree_py '
                            f'reads version {_VERSION}: it takes a newer one')
    begin = _PREFIX.size + length
    text = bytes(view[_PREFIX.size:begin])
    if len(text) < length or zlib.crc32(text) != checksum:
        raise TreeFileError(f'{name} is damaged: the header of the frozen tree is not what was '
                            'written')
    header: dict[str, Any] = json.loads(text)
    if header['byte_order'] != sys.byteorder:
        raise TreeFileError(f'{name} is a frozen tree of a {header["byte_order"]}-endian machine, '
                            f'and this one is {sys.byteorder}-endian')
    if len(view) - begin != header['array_bytes']:
        raise TreeFileError(f'{name} is damaged: {len(view) - begin} bytes of samples where '
                            f'{header["array_bytes"]} were written')
    return header, begin


def _thawed(edge: dict[str, Any], view: memoryview, begin: int,
            cache_time: int) -> tuple[History, int]:
    """Return an edge's history, and where its arrays end."""
    if edge['kind'] == 'static':
        return StaticHistory(edge['child'], edge['parent'], tuple(edge['pose']),
                             edge['authority']), begin

    def take(size: int) -> memoryview:
        nonlocal begin
        begin += size
        return view[begin - size:begin]

    count = edge['samples']
    stamps, poses = take(8 * count).cast('q'), take(POSE_BYTES * count).cast('d')
    parents = None
    if edge['parents']:
        codes = take(4 * (count + count % 2)).cast('I')
        parents = _Names(codes[:count], edge['parents'])
    history = _KINDS[edge['kind']](edge['child'], cache_time, edge['authority'])
    history.adopt(Columns(stamps, poses, parents, set(edge['ends'])), edge['parent'])
    assert isinstance(history, DynamicHistory)
    return history, begin


class _Names(Sequence[str]):
    """The parent of every sample, kept as a number of a few names."""

    def __init__(self, codes: 'memoryview[int]', names: Sequence[str]) -> None:
        self._codes = codes
        self._names = names

    def __len__(self) -> int:
        return len(self._codes)

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> '_Names': ...

    def __getitem__(self, index: int | slice) -> 'str | _Names':
        if isinstance(index, slice):
            return _Names(self._codes[index], self._names)
        return self._names[self._codes[index]]

    def __iter__(self) -> Iterator[str]:
        return map(self._names.__getitem__, self._codes)

    def __contains__(self, name: object) -> bool:
        return name in self._names


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
