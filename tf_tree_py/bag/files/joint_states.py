# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The bytes of a JointState, of ROS 2 and of ROS 1, as a stamp, names and positions."""

import struct

import numpy as np
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.urdf import JointState

# After CDR's encapsulation, from which its numbers are aligned; and after the seq of ROS 1.
_CDR_BEGIN, _ROS1_BEGIN = 4, 4
_STAMP_BYTES = 8


class JointStateReader:
    """
    Reads the messages of one source.

    Nearly all messages have the same names as the previous one, which are recognised by their
    bytes.

    :param ros1: whether they are ROS 1's bytes; otherwise they are CDR.
    """

    def __init__(self, ros1: bool) -> None:
        self._ros1 = ros1
        self._known = b''
        self._names: tuple[str, ...] = ()

    def read(self, data: bytes) -> JointState:
        """
        Return the joint states of a message.

        :raises ValueError: it ends too soon, or its names are not text.
        """
        order = '<' if self._ros1 or data[1:2] == b'\1' else '>'
        at = _ROS1_BEGIN if self._ros1 else _CDR_BEGIN
        try:
            sec, nanosec = struct.unpack_from(order + ('II' if self._ros1 else 'iI'), data, at)
            cursor = _Cursor(data, at + _STAMP_BYTES, order, aligned=not self._ros1)
            names = self._names_at(cursor)
            count = cursor.number()
        except struct.error as error:
            raise ValueError(str(error)) from error
        cursor.align(8)
        # Without positions the aligned offset may be beyond the end, which numpy refuses.
        positions = np.frombuffer(data, f'{order}f8', count, cursor.at) if count else np.empty(0)
        return JointState(sec * NANOSECONDS_PER_SECOND + nanosec, names, positions)

    def _names_at(self, cursor: '_Cursor') -> tuple[str, ...]:
        """Return the names after the stamp, and move past them."""
        begin = cursor.at
        end = begin + len(self._known)
        if self._known and cursor.data[begin:end] == self._known:
            cursor.at = end
            return self._names
        cursor.text()  # frame_id, which has no meaning here
        self._names = tuple([cursor.text() for _ in range(cursor.number())])
        self._known = bytes(cursor.data[begin:cursor.at])
        return self._names


class _Cursor:
    """A position in the bytes of a message."""

    def __init__(self, data: bytes, at: int, order: str, aligned: bool) -> None:
        self.data, self.at = data, at
        self._number = struct.Struct(f'{order}I')
        self._aligned = aligned

    def align(self, size: int) -> None:
        """Move to the next position where a number of that size may be."""
        if self._aligned:
            self.at += -(self.at - _CDR_BEGIN) % size

    def number(self) -> int:
        """Return the next integer, which is a length."""
        self.align(4)
        value: int = self._number.unpack_from(self.data, self.at)[0]
        self.at += 4
        return value

    def text(self) -> str:
        """Return the next string."""
        end = self.number() + self.at
        if end > len(self.data):
            raise ValueError('the message ends inside a string')
        raw = bytes(self.data[self.at:end])
        self.at = end
        return raw.removesuffix(b'\0').decode()
