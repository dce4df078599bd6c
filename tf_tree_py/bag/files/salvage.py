# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads files that rosbags refuses: truncated, never finished, or without an index.

Each kind of file has a scan of its own; this file has their common parts. MCAP and ROS 1 are read
from the beginning, record by record, as far as possible.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
import mmap
from pathlib import Path
import struct

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from tf_tree_py.core.stamp import FOREVER, format_stamp

from .message_source import MessageSource, RecordedMessage, Scan
from .plain_file import PlainFile
from .rosbags_file import first_field_of, salvaged

NOTHING_MISSING = 'and nothing is missing'
_WITHOUT_INDEX = f'{NOTHING_MISSING} except the index at its end'
UNKNOWN_MISSING = 'and it is unknown how many are missing'


class SalvagedFile:
    """The readable part of one file."""

    def __init__(self, file: PlainFile, scan: Callable[[Path], Scan], why: object) -> None:
        """
        Read it once, to count its messages.

        :param why: the error of the regular reader.
        :raises ValueError: nothing can be read.
        """
        self._file = file
        self._scan = scan
        first = scan(file.path)
        self.counts: Counter[MessageSource] = Counter()
        begin, end = FOREVER, 0
        for arrival in first:
            self.counts[arrival.source] += 1
            begin, end = min(begin, arrival.received), max(end, arrival.received + 1)
        self.span = begin, end
        self._definitions = first.definitions
        received = '' if begin > end else (
            f', received from {format_stamp(begin)} to {format_stamp(end - 1)} s')
        # What could not be unpacked is more than an index.
        lost = (UNKNOWN_MISSING if file.fault is not None and first.lost == _WITHOUT_INDEX
                else first.lost)
        state = ('could not be opened as usual' if lost.startswith(NOTHING_MISSING)
                 else 'is not whole')
        self.damage = [
            f'{file.name} {state} ({file.reason(why)}): {self.counts.total()} messages could be '
            f'read{received}, {lost}']

    def arrivals(self, sources: Collection[MessageSource], start: int | None,
                 stop: int | None) -> Iterator[RecordedMessage]:
        """Yield the messages of some of its sources, in the order of the file."""
        return salvaged(self._scan(self._file.path), sources, start, stop)

    def first_field(self, source: MessageSource) -> str:
        """Return the type of the first field of a source's messages; '' if it is unknown."""
        if source not in self._definitions:
            return ''
        return first_field_of(source, self._definitions[source])

    def close(self) -> None:
        """Remove the copy of the file, if there is one; no file is open."""
        self._file.close()


def mapped(path: Path, magic: bytes, kind: str) -> memoryview:
    """
    Return the bytes of a file.

    :param magic: its expected first bytes.
    :param kind: of the file, for the error.
    :raises ValueError: it begins with other bytes, or it is empty.
    """
    with path.open('rb') as file:
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if data[:len(magic)] != magic:
        raise ValueError(f'it does not begin like {kind}')
    return data


def definition(text: str, encoding: str = 'ros2msg') -> MessageDefinition:
    """Return a message definition, from its text and encoding in a file."""
    kind = {'ros2msg': MessageDefinitionFormat.MSG, 'ros1msg': MessageDefinitionFormat.MSG,
            'ros2idl': MessageDefinitionFormat.IDL}.get(encoding, MessageDefinitionFormat.NONE)
    return MessageDefinition(kind, text)


def lost_bytes(lost: int, size: int, ended: bool = False, more: int = 0) -> str:
    """
    Return in words how much of a file could not be read.

    :param lost: the unreadable bytes in the file.
    :param ended: whether the file has an end record.
    :param more: the missing bytes of its last record.
    """
    behind = f'; behind it at least {more:,} more bytes are missing' if more else ''
    if not lost and not more:
        return NOTHING_MISSING if ended else _WITHOUT_INDEX
    return f'and {lost:,} of its {size:,} bytes could not{behind}'


def share(packed: int, unread: int, unpacked: int) -> int:
    """Return the number of bytes of a compressed chunk that correspond to the unread ones."""
    return round(packed * unread / unpacked) if unpacked else packed


class Cut(Exception):
    """The bytes end within a record or a field."""


class Bytes:
    """A position in bytes, with methods that read from there; numbers are little-endian."""

    def __init__(self, data: memoryview) -> None:
        self.data = data
        self.position = 0

    def __bool__(self) -> bool:
        return self.position < len(self.data)

    @property
    def left(self) -> int:
        """Return the number of bytes after the position."""
        return len(self.data) - self.position

    def take(self, size: int) -> memoryview:
        """
        Return the next bytes.

        :raises Cut: there are fewer bytes.
        """
        if size > self.left:
            raise Cut
        self.position += size
        return self.data[self.position - size:self.position]

    def number(self, letter: str) -> int:
        """Return the next number, in struct's format."""
        (value,) = struct.unpack('<' + letter, self.take(struct.calcsize(letter)))
        return int(value)

    def sized(self) -> memoryview:
        """Return the bytes that follow their length."""
        return self.take(self.number('I'))

    def text(self) -> str:
        """Return the string that follows its length in bytes."""
        return bytes(self.sized()).decode(errors='replace')
