# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Compressed files and parts of bags, also those that end too soon: unpacks all before the damage.

zstd and bz2 pack blocks, and a block is unpacked as a whole or not at all. The block of lz4 in
which a file ends is unpacked here, because programs of ROS 1 pack a whole chunk into one block.

Readers get a file that is not compressed, and has the rows of its log.
"""

import bz2
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from shutil import copyfile
import sqlite3
import sys
from tempfile import TemporaryDirectory
from typing import BinaryIO

from lz4.frame import LZ4FrameDecompressor
from tf_tree_py.core.text import printable

from .connections import too_large, TooLarge, unpacked_limit
from .discovery import PACKED
from .sqlite_log import check_for_sqlite, log_of

# With an alias, so that other files may import it from here.
if sys.version_info >= (3, 14):
    from compression import zstd as zstd
else:
    from backports import zstd as zstd

_ERRORS = (zstd.ZstdError, OSError, EOFError, RuntimeError, ValueError)

Decompressor = bz2.BZ2Decompressor | zstd.ZstdDecompressor
_DECOMPRESSORS: dict[str, Callable[[], Decompressor]] = {
    'zstd': zstd.ZstdDecompressor, 'lz4': LZ4FrameDecompressor, 'bz2': bz2.BZ2Decompressor}

# The part of a file that counts as unread is exact to this many bytes.
_STEP = 256


class Unpacker:
    """
    Unpacks one frame after another, piece by piece.

    :ivar used: the number of packed bytes that gave all unpacked ones.
    :ivar error: why it went no further; None: it may go on.
    """

    def __init__(self, compression: str, what: str, size: int) -> None:
        """
        Begin.

        :param compression: zstd, lz4 or bz2.
        :param what: the packed part, for the error.
        :param size: of all packed bytes.
        """
        self._make, self._what, self._size = _DECOMPRESSORS[compression], what, size
        self._left = unpacked_limit(size)
        self._reader, self._read, self._in_frame = self._make(), 0, False
        self.used = 0
        self.error: Exception | None = None

    @property
    def whole(self) -> bool:
        """Return whether it stands at the end of a frame."""
        return self.error is None and not self._in_frame

    def unpack(self, piece: bytes | memoryview) -> bytes:
        """
        Return what the next packed bytes give; nothing after an error.

        :raises TooLarge: it exceeds the limit.
        """
        parts = []
        while piece and self.error is None:
            reader = self._reader
            try:
                part = reader.decompress(piece, max_length=self._left)
            except _ERRORS as error:
                self.error = error
                break
            if not reader.eof and not reader.needs_input:
                raise too_large(self._what, self._size)
            rest = (reader.unused_data or b'') if reader.eof else b''
            self._read += len(piece) - len(rest)
            if part or reader.eof:
                self.used = self._read
            parts.append(part)
            self._left -= len(part)
            self._in_frame = not reader.eof
            if reader.eof:
                self._reader = self._make()
            piece = rest
        return b''.join(parts)


def unpacked_part(compression: str, packed: memoryview) -> tuple[bytes | memoryview, int]:
    """
    Unpack as much of a chunk as there is.

    :param compression: '' or none: it is not compressed.
    :return: the unpacked bytes, and how many of the packed ones gave them.
    :raises TooLarge: it exceeds the limit.
    :raises Exception: it is damaged, or its compression is unknown.
    """
    if compression in ('', 'none'):
        return packed, len(packed)
    if compression not in _DECOMPRESSORS:
        raise ValueError(f'a chunk is compressed with {compression}')
    unpacker = Unpacker(compression, 'a chunk', len(packed))
    unpacked = b''.join(unpacker.unpack(packed[begin:begin + _STEP])
                        for begin in range(0, len(packed), _STEP))
    if unpacker.error is not None:
        raise unpacker.error
    if compression == 'lz4' and not unpacker.whole:
        block = _last_block(packed)
        if block:
            return unpacked + unpacked_block(block, unpacked[-_REACH:]), len(packed)
    return unpacked, unpacker.used


# --- lz4: https://github.com/lz4/lz4/tree/dev/doc describes its frames and blocks

_REACH = 2**16
"""How far back in the unpacked bytes a block of lz4 can refer."""

_LARGEST = 2**22
"""The most bytes that a block of lz4 unpacks to."""


def _last_block(frame: memoryview) -> memoryview:
    """Return what is there of the last block of a frame of lz4, unless it is not compressed."""
    flags = frame[4] if len(frame) > 4 else 0
    position = 7 + (8 if flags & 8 else 0) + (4 if flags & 1 else 0)
    while position + 4 <= len(frame):
        size = int.from_bytes(frame[position:position + 4], 'little')
        begin, end = position + 4, position + 4 + (size & 2**31 - 1)
        if end > len(frame):
            return frame[begin:] if size < 2**31 else frame[:0]
        position = end + (4 if flags & 16 else 0)
    return frame[:0]


def unpacked_block(block: memoryview, before: bytes) -> bytes:
    """
    Return what the begin of a block of lz4 gives; the library gives it as a whole only.

    A sequence has the lengths of two parts, the bytes of the first, and how far back the second
    one is to be copied from.

    :param before: the last bytes that were unpacked before the block.
    """
    unpacked, place, most = bytearray(before), 0, len(before) + _LARGEST
    try:
        while place < len(block) and len(unpacked) < most:
            token, place = block[place], place + 1
            size, place = _length(block, token >> 4, place)
            unpacked += block[place:place + size]
            place += size
            back, place = block[place] | block[place + 1] << 8, place + 2
            size, place = _length(block, token & 15, place)
            _repeat(unpacked, back, min(size + 4, _LARGEST))
    except IndexError:
        pass  # the block is not whole
    return bytes(unpacked[len(before):])


def _length(block: memoryview, nibble: int, place: int) -> tuple[int, int]:
    """Return a length, and the place behind it: more bytes follow as long as they are 255."""
    more = nibble == 15
    while more:
        nibble += block[place]
        more = block[place] == 255
        place += 1
    return nibble, place


def _repeat(unpacked: bytearray, back: int, size: int) -> None:
    """
    Append bytes that are there already; those that are being appended may be among them.

    :raises IndexError: there are fewer, so the block is damaged.
    """
    if not 0 < back <= len(unpacked):
        raise IndexError
    repeated = unpacked[-back:][:size]
    unpacked += (repeated * (size // len(repeated) + 1))[:size]


# --- whole files

_PIECE = 2**12


class PlainFile:
    """
    One file as it can be read; the recording itself may be read-only, and stays as it is.

    :ivar name: of the recording.
    :ivar path: of the recording, or of a copy in a temporary folder.
    :ivar fault: why it is not the whole recording; None: it is.
    """

    def __init__(self, recording: Path) -> None:
        """
        Make the copy, if one is necessary.

        :raises TooLarge: it unpacks to more than the limit.
        :raises OSError: there is no room for the copy.
        """
        self.name, self.path = recording.name, recording
        self.fault: Exception | None = None
        self._recording, self._folder = recording, None
        log = log_of(recording)
        if log is None and recording.suffix not in PACKED:
            return
        self._folder = TemporaryDirectory()
        try:
            if log is None:
                self._unpack(Path(self._folder.name) / recording.stem)
            else:
                self._add_log(log, Path(self._folder.name))
        except (OSError, TooLarge):
            self.close()
            raise

    def _add_log(self, log: Path, folder: Path) -> None:
        """Write the log into a copy, if SQLite can; a scan reads both as they are."""
        try:
            check_for_sqlite(self._recording, log)
            self.path = _with_log(self._recording, log, folder)
        except (sqlite3.Error, OSError, ValueError) as error:
            self.fault = error

    def _unpack(self, target: Path) -> None:
        """Write as much of the recording as can be unpacked into a file."""
        size, self.path = self._recording.stat().st_size, target
        with self._recording.open('rb') as packed, target.open('wb') as unpacked:
            unpacker = _unpack(packed, unpacked, size, size)
            if unpacker.error is not None:
                # A block that ends in the piece of the error is whole.
                unpacker = _unpack(packed, unpacked, size, packed.tell() - _PIECE)
        if not unpacker.whole:
            state = ('ends too soon' if unpacker.error is None else
                     f'is damaged, so its last messages may be wrong ({unpacker.error})')
            self.fault = ValueError(
                f'the compressed file {state}: {unpacker.used:,} of its {size:,} bytes unpack to '
                f'{target.stat().st_size:,}')

    def reason(self, error: object) -> str:
        """Return the text of an error on one line; it names the recording instead of the copy."""
        text = str(error).replace(str(self.path), str(self._recording)).rstrip('.')
        return printable(text) or type(error).__name__  # a MemoryError has no text

    def close(self) -> None:
        """Remove the copy."""
        if self._folder is not None:
            self._folder.cleanup()


def _with_log(path: Path, log: Path, folder: Path) -> Path:
    """
    Copy a file of SQLite into a folder, write the rows of its log into the copy, and return it.

    :raises sqlite3.Error: SQLite refuses the file.
    """
    copy = folder / path.name
    for file in (path, log):
        copyfile(file, folder / file.name)
    with closing(sqlite3.connect(copy)) as database:
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        database.execute('PRAGMA journal_mode = DELETE')
    return copy


def _unpack(packed: BinaryIO, unpacked: BinaryIO, size: int, fine: int) -> Unpacker:
    """
    Write as much as can be unpacked.

    :param size: of the packed file.
    :param fine: from this place in it on, unpack byte by byte.
    """
    unpacker = Unpacker('zstd', 'the file', size)
    packed.seek(0)
    unpacked.seek(0)
    while unpacker.error is None and (
            piece := packed.read(_PIECE if packed.tell() < fine else 1)):
        unpacked.write(unpacker.unpack(piece))
    return unpacker
