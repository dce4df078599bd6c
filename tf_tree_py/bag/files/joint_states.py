# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The bytes of a JointState, of ROS 2 and of ROS 1, as a stamp, names and positions."""

from tf_tree_py.core.messages.byte_cursor import ByteCursor
from tf_tree_py.urdf import JointState

from .ros1_bytes import cursor_of


class JointStateReader:
    """
    Reads the messages of one connection.

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

        :raises WireError: it ends too soon, or its names are not text.
        """
        cursor = cursor_of(data, self._ros1)
        stamp = cursor.read_stamp()
        names = self._names_at(cursor)
        return JointState(stamp, names, cursor.read_doubles(cursor.read_uint32()))

    def _names_at(self, cursor: ByteCursor) -> tuple[str, ...]:
        """Return the names after the stamp, and move past them."""
        begin = cursor.position
        end = begin + len(self._known)
        if self._known and cursor.data[begin:end] == self._known:
            cursor.position = end
            return self._names
        cursor.read_text()  # frame_id, which has no meaning here
        self._names = tuple([cursor.read_text() for _ in range(cursor.read_uint32())])
        self._known = bytes(cursor.data[begin:cursor.position])
        return self._names
