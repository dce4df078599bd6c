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
The bytes of messages, read field by field from the beginning.

CDR, as ROS 2 has it: 4 bytes of encapsulation, then numbers aligned relative to the byte
after it, and strings as a uint32 length that counts their closing NUL; in either byte
order. ROS 1 has no encapsulation, no alignment and no NULs, and is little-endian.
"""

import struct

import numpy as np

from ..geometry.so3 import Array
from ..stamp import NANOSECONDS_PER_SECOND

_BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
ENCAPSULATION_BYTES = 4
# An error about a name that is no text shows this number of its bytes.
_TOLD_BYTES = 60


class WireError(ValueError):
    """The bytes are not a message of the type, or only a part of one."""


def cdr_cursor(data: bytes) -> 'Cursor':
    """
    Begin to read a message of ROS 2.

    :raises WireError: it does not begin as CDR does.
    """
    order = _BYTE_ORDERS.get(data[:2])
    if order is None:
        raise WireError(f'not CDR: it begins with the bytes {data[:4].hex(" ")}')
    return Cursor(data, order)


def ros1_cursor(data: bytes) -> 'Cursor':
    """Begin to read a message of ROS 1."""
    return _Ros1Cursor(data, '<')


class Cursor:
    """
    A position in the bytes of CDR, and methods that read on from there.

    :cvar head: bytes before the first stamp of a TFMessage, its count included.
    :cvar stamp: struct's format of a stamp.
    """

    head = ENCAPSULATION_BYTES + 4
    stamp = 'iI'

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.order = order
        self.position = ENCAPSULATION_BYTES

    def skip(self, size: int, alignment: int) -> int:
        """Go past an aligned field; return where it began."""
        begin = self.position + -(self.position - ENCAPSULATION_BYTES) % alignment
        if begin + size > len(self.data):
            raise WireError(f'truncated at byte {begin} of {len(self.data)}')
        self.position = begin + size
        return begin

    def skip_stamp(self) -> int:
        """Go past a stamp; return where it began."""
        return self.skip(8, alignment=4)

    def take_stamp(self) -> int:
        """Read a stamp, nanoseconds."""
        sec, nanosec = struct.unpack_from(self.order + self.stamp, self.data, self.skip_stamp())
        return int(sec * NANOSECONDS_PER_SECOND + nanosec)

    def take_doubles(self, count: int) -> Array:
        """Read numbers (count,)."""
        begin = self.skip(8 * count, alignment=8)
        return np.frombuffer(self.data, f'{self.order}f8', count, begin).astype(float)

    def take_uint32(self) -> int:
        """Read a number."""
        begin = self.skip(4, alignment=4)
        (number,) = struct.unpack_from(self.order + 'I', self.data, begin)
        return int(number)

    def take_string(self) -> tuple[str, slice]:
        """Read a string; return it, and where it stands, its length included."""
        length = self.take_uint32()
        begin = self.skip(length, alignment=1)
        text = self.data[begin:self.position]
        return self._decoded(text, begin), slice(begin - 4, self.position)

    def _decoded(self, text: bytes, begin: int) -> str:
        if text and text[-1]:
            raise WireError(f'the name at byte {begin} does not end with NUL')
        return _text(text[:-1], begin)


class _Ros1Cursor(Cursor):
    """The same in the bytes of ROS 1."""

    head = 4
    stamp = 'II'

    def __init__(self, data: bytes, order: str) -> None:
        super().__init__(data, order)
        self.position = 0

    def skip(self, size: int, alignment: int) -> int:
        """Go past a field, which is not aligned; return where it began."""
        return super().skip(size, 1)

    def skip_stamp(self) -> int:
        """Go past a seq and a stamp; return where the stamp began."""
        return self.skip(12, alignment=1) + 4

    def _decoded(self, text: bytes, begin: int) -> str:
        return _text(text, begin)


def _text(text: bytes, begin: int) -> str:
    try:
        return text.decode()
    except UnicodeDecodeError:
        raise WireError(f'the name at byte {begin} is not UTF-8: '
                        f'{text[:_TOLD_BYTES]!r}') from None
