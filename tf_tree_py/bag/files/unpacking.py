# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A limit on unpacking the chunks of bags that rosbags reads: rosbags itself has none."""

import bz2
from collections.abc import Callable
from importlib.metadata import version
import sys
from typing import Any
import warnings

from lz4.frame import LZ4FrameDecompressor
from rosbags.rosbag1 import reader as rosbag1
from rosbags.rosbag2 import storage_mcap

from .size_limit import too_large, unpacked_limit, VARIABLE

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd


def limit_chunks(reader: rosbag1.Reader) -> None:
    """Make an open reader of ROS 1 raise TooLarge for a chunk beyond the limit."""
    limited = {rosbag1.decompressors[name]: _limited(make) for name, make in (
        ('bz2', bz2.BZ2Decompressor), ('lz4', LZ4FrameDecompressor))}
    for position, chunk in reader.chunks.items():
        reader.chunks[position] = chunk._replace(
            decompressor=limited.get(chunk.decompressor, chunk.decompressor))


def _limited(make: Callable[[], Any]) -> Callable[[bytes], bytes]:
    def unpack(packed: bytes) -> bytes:
        limit = unpacked_limit(len(packed))
        unpacked = _unpacked(packed, make, limit)
        if len(unpacked) > limit:
            raise too_large('a chunk', len(packed))
        return unpacked
    return unpack


def _as_said(make: Callable[[], Any]) -> Callable[[bytes, int], bytes]:
    """Return a function that unpacks a chunk of MCAP up to the size in its header."""
    def unpack(packed: bytes, size: int) -> bytes:
        return _unpacked(packed, make, min(size, unpacked_limit(len(packed))))
    return unpack


def _unpacked(packed: bytes, make: Callable[[], Any], limit: int) -> bytes:
    """Unpack one or several frames, but at most one byte more than a limit."""
    parts, left = [], limit + 1
    while packed and left > 0:
        reader = make()
        parts.append(reader.decompress(packed, max_length=left))
        left -= len(parts[-1])
        if not reader.eof and left > 0:
            raise EOFError('a chunk ends too soon')
        packed = reader.unused_data if reader.eof else b''
    return b''.join(parts)


def limit_mcap(table: dict[str, Any] | None) -> None:
    """
    Make rosbags unpack chunks of MCAP up to the size in their headers, and a limit.

    The only place for that is rosbags' own table. rosbags refuses a chunk of another size than in
    its header, so other users of rosbags get the same results, only without the memory for the
    rest.

    :param table: of rosbags; None: a version without one, which causes a warning.
    """
    if table is None:
        warnings.warn(
            f'rosbags {version("rosbags")} has no place for a limit on chunks of MCAP: they are '
            f'unpacked whole, and {VARIABLE} has no effect on them. rosbags 0.11 has one',
            RuntimeWarning, stacklevel=2)
        return
    table.update(zstd=_as_said(zstd.ZstdDecompressor), lz4=_as_said(LZ4FrameDecompressor))


limit_mcap(getattr(storage_mcap, 'DECOMPRESSORS', None))
