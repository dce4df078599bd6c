# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the scans of damaged files have in common.

MCAP and ROS 1 are read from the beginning, record by record, as far as possible.
"""

from collections.abc import Iterator
import mmap
from pathlib import Path
import struct

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

from .connections import Connection, RecordedMessage

NOTHING_MISSING = 'and nothing is missing'
WITHOUT_INDEX = f'{NOTHING_MISSING} except the index at its end'
UNKNOWN_MISSING = 'and it is unknown how many are missing'


def mapped(path: Path, magic: bytes, form: str) -> memoryview:
    """
    Return the bytes of a file.

    :param magic: its expected first bytes.
    :param form: of the file, for the error.
    :raises ValueError: it begins with other bytes, or it is empty.
    """
    with path.open('rb') as file:
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if data[:len(magic)] != magic:
        raise ValueError(f'it does not begin like {form}')
    return data


def definition(text: str, encoding: str = 'ros2msg') -> MessageDefinition:
    """Return a message definition, from its text and encoding in a file."""
    form = {'ros2msg': MessageDefinitionFormat.MSG, 'ros1msg': MessageDefinitionFormat.MSG,
            'ros2idl': MessageDefinitionFormat.IDL}.get(encoding, MessageDefinitionFormat.NONE)
    return MessageDefinition(form, text)


def lost_bytes(lost: int, size: int, ended: bool = False, more: int = 0) -> str:
    """
    Return in words how much of a file could not be read.

    :param lost: the unreadable bytes in the file.
    :param ended: whether the file has an end record.
    :param more: the missing bytes of its last record.
    """
    behind = f'; behind it at least {more:,} more bytes are missing' if more else ''
    if not lost and not more:
        return NOTHING_MISSING if ended else WITHOUT_INDEX
    return f'and {lost:,} of its {size:,} bytes could not{behind}'


def ros1_type(name: str) -> str:
    """Return the name of a ROS 1 type as rosbags has it, such as std_msgs/msg/Header."""
    package, _, message = name.rpartition('/')
    return f'{package.removesuffix("/msg")}/msg/{message}'


class NotOfRos2(ValueError):
    """An MCAP file is not of ROS 2, so rosbags refuses it; this is no damage: a scan reads it."""


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

    def read(self, size: int) -> memoryview:
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
        (value,) = struct.unpack('<' + letter, self.read(struct.calcsize(letter)))
        return int(value)

    def sized(self) -> memoryview:
        """Return the bytes that follow their length."""
        return self.read(self.number('I'))

    def text(self) -> str:
        """Return the string that follows its length in bytes."""
        return bytes(self.sized()).decode(errors='replace')


class RecordScan:
    """
    A scan of a file of records, some of which are chunks of others; see ``Scan``.

    A subclass reads the records, and counts the bytes that it could not.
    """

    def __init__(self, path: Path, magic: bytes, form: str) -> None:
        """
        Open the file, and read nothing yet.

        :raises ValueError: it begins with other bytes than those of its kind.
        """
        self._data = mapped(path, magic, form)
        self._begin = len(magic)
        self.definitions: dict[Connection, MessageDefinition] = {}
        self.lost = ''
        self._lost_bytes = self._more_bytes = self._unknown_bytes = 0
        self._ended = False

    def __iter__(self) -> Iterator[RecordedMessage]:
        """Yield every message, in the order of the file."""
        self._read_summary()
        file = self._file()
        yield from self._records(file)
        self._lost_bytes += self._unknown_bytes + (0 if self._ended else file.left)
        self.lost = lost_bytes(self._lost_bytes, len(self._data), self._ended, self._more_bytes)

    def _file(self) -> Bytes:
        """Return the records of the file."""
        file = Bytes(self._data)
        file.read(self._begin)
        return file

    def _records_in_chunk(self, packed: int, used: int,
                          unpacked: bytes | memoryview) -> Iterator[RecordedMessage]:
        """
        Yield the messages of a chunk, and count its share of what cannot be read.

        :param packed: its bytes in the file; ``used``: those that could be unpacked.
        """
        inner, before = Bytes(memoryview(unpacked)), self._unknown_bytes
        yield from self._records(inner, in_chunk=True)
        unread = inner.left + self._unknown_bytes - before
        self._unknown_bytes = before
        share = round(packed * unread / len(unpacked)) if unpacked else packed
        self._lost_bytes += packed - used + share

    def _read_summary(self) -> None:
        """Read the topics at the end of an intact file: their chunk may be damaged."""
        raise NotImplementedError

    def _records(self, data: Bytes, *, in_chunk: bool = False) -> Iterator[RecordedMessage]:
        """Yield the messages of records; if they end too soon, ``data`` stays at that position."""
        raise NotImplementedError
