# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the scans of damaged files have in common.

MCAP and ROS 1 are read from the beginning, record by record, as far as possible.
"""

import mmap
from pathlib import Path
import struct

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

NOTHING_MISSING = 'and nothing is missing'
WITHOUT_INDEX = f'{NOTHING_MISSING} except the index at its end'
UNKNOWN_MISSING = 'and it is unknown how many are missing'


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
        return NOTHING_MISSING if ended else WITHOUT_INDEX
    return f'and {lost:,} of its {size:,} bytes could not{behind}'


def share(packed: int, unread: int, unpacked: int) -> int:
    """Return the number of bytes of a compressed chunk that correspond to the unread ones."""
    return round(packed * unread / unpacked) if unpacked else packed


def ros1_type(name: str) -> str:
    """Return the name of a ROS 1 type as rosbags has it, such as std_msgs/msg/Header."""
    package, _, kind = name.rpartition('/')
    return f'{package.removesuffix("/msg")}/msg/{kind}'


class OtherProfile(ValueError):
    """An MCAP file has a profile that rosbags refuses; this is not damage, and a scan reads it."""


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
