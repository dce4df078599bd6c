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

"""The bytes of a JointState, of ROS 2 and of ROS 1, as a stamp, names and positions."""

import struct

import numpy as np
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.urdf import JointState

# Behind CDR's encapsulation, from where its numbers are aligned; and behind the seq of ROS 1.
_CDR_BEGIN, _ROS1_BEGIN = 4, 4
_STAMP_BYTES = 8


class JointStateReader:
    """
    Reads the messages of one source.

    Nearly all have the names of the one before, which are recognised by their bytes.

    :param ros1: whether they are ROS 1's bytes; else they are CDR.
    """

    def __init__(self, ros1: bool) -> None:
        self._ros1 = ros1
        self._known = b''
        self._names: tuple[str, ...] = ()

    def read(self, data: bytes) -> JointState:
        """
        Return what a message says.

        :raises ValueError: it ends too soon, or its names are no text.
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
        # numpy reads nothing at all only where there is something behind it.
        positions = np.frombuffer(data, f'{order}f8', count, cursor.at) if count else np.empty(0)
        return JointState(sec * NANOSECONDS_PER_SECOND + nanosec, names, positions)

    def _names_at(self, cursor: '_Cursor') -> tuple[str, ...]:
        """Return the names behind the stamp, and go on behind them."""
        begin = cursor.at
        end = begin + len(self._known)
        if self._known and cursor.data[begin:end] == self._known:
            cursor.at = end
            return self._names
        cursor.text()  # frame_id, which means nothing here
        self._names = tuple([cursor.text() for _ in range(cursor.number())])
        self._known = bytes(cursor.data[begin:cursor.at])
        return self._names


class _Cursor:
    """A place in the bytes of a message."""

    def __init__(self, data: bytes, at: int, order: str, aligned: bool) -> None:
        self.data, self.at = data, at
        self._number = struct.Struct(f'{order}I')
        self._aligned = aligned

    def align(self, size: int) -> None:
        """Go on to where a number of that size may stand."""
        if self._aligned:
            self.at += -(self.at - _CDR_BEGIN) % size

    def number(self) -> int:
        """Return the next whole number, which is a length."""
        self.align(4)
        value: int = self._number.unpack_from(self.data, self.at)[0]
        self.at += 4
        return value

    def text(self) -> str:
        """Return the next text."""
        end = self.number() + self.at
        if end > len(self.data):
            raise ValueError('the message ends inside a text')
        raw = bytes(self.data[self.at:end])
        self.at = end
        return raw.removesuffix(b'\0').decode()
