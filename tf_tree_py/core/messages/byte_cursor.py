# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reading the bytes of messages field by field.

ROS 2 uses CDR, in either byte order: 4 bytes of encapsulation, then numbers that are aligned
relative to the byte after the encapsulation, and strings with a uint32 length that includes
the closing NUL. A subclass reads another format: see ``bag.files.connections``.
"""

import struct

import numpy as np

from ..geometry.so3 import Array
from ..stamp import NANOSECONDS_PER_SECOND

_BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
ENCAPSULATION_BYTES = 4
# An error about a name that is not UTF-8 shows at most this number of its bytes.
_BYTES_IN_ERROR = 60


class WireError(ValueError):
    """The bytes are not a complete message of the type."""


def cdr_cursor(data: bytes) -> 'ByteCursor':
    """
    Return a cursor at the beginning of a message of ROS 2.

    :raises WireError: the bytes do not begin with the encapsulation of CDR.
    """
    order = _BYTE_ORDERS.get(data[:2])
    if order is None:
        raise WireError(f'not CDR: it begins with the bytes {data[:4].hex(" ")}')
    return ByteCursor(data, order)


class ByteCursor:
    """
    A position in the bytes of CDR, and methods that read the fields that follow.

    :cvar head: bytes before the first stamp of a TFMessage, including its count.
    :cvar stamp: struct's format of a stamp.
    """

    head = ENCAPSULATION_BYTES + 4
    stamp = 'iI'

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.order = order
        self.position = ENCAPSULATION_BYTES

    def skip(self, size: int, alignment: int) -> int:
        """Skip an aligned field, and return its position."""
        begin = self.position + (ENCAPSULATION_BYTES - self.position) % alignment
        if begin + size > len(self.data):
            raise WireError(f'truncated at byte {begin} of {len(self.data)}')
        self.position = begin + size
        return begin

    def skip_stamp(self) -> int:
        """Skip the stamp of a header, and return its position."""
        return self.skip(8, alignment=4)

    def read_stamp(self) -> int:
        """Read the stamp of a header, in nanoseconds."""
        return self._time_at(self.skip_stamp())

    def read_time(self) -> int:
        """Read a time that is not in a header, in nanoseconds."""
        return self._time_at(self.skip(8, alignment=4))

    def _time_at(self, position: int) -> int:
        sec, nanosec = struct.unpack_from(self.order + self.stamp, self.data, position)
        return int(sec * NANOSECONDS_PER_SECOND + nanosec)

    def read_doubles(self, count: int) -> Array:
        """Read numbers, (count,)."""
        begin = self.skip(8 * count, alignment=8)
        return np.frombuffer(self.data, f'{self.order}f8', count, begin).astype(float)

    def read_uint32(self) -> int:
        """Read a number."""
        begin = self.skip(4, alignment=4)
        (number,) = struct.unpack_from(self.order + 'I', self.data, begin)
        return int(number)

    def read_text(self) -> str:
        """Read a string."""
        return self.read_string()[0]

    def read_string(self) -> tuple[str, slice]:
        """Read a string; return it, and the slice of its bytes including the length field."""
        length = self.read_uint32()
        begin = self.skip(length, alignment=1)
        text = self.data[begin:self.position]
        return self._decoded(text, begin), slice(begin - 4, self.position)

    def _decoded(self, text: bytes, begin: int) -> str:
        if text and text[-1]:
            raise WireError(f'the name at byte {begin} does not end with NUL')
        return text_of(text[:-1], begin)


def text_of(text: bytes, begin: int) -> str:
    """
    Return the text of a string's bytes.

    :param begin: where they begin in the message.
    :raises WireError: they are not UTF-8.
    """
    try:
        return text.decode()
    except UnicodeDecodeError:
        raise WireError(f'the name at byte {begin} is not UTF-8: '
                        f'{text[:_BYTES_IN_ERROR]!r}') from None
