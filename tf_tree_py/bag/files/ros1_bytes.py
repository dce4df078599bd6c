# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The bytes of messages of ROS 1.

They have no encapsulation, no alignment and no NULs, and are little-endian. A header begins with a
uint32 seq, and seconds are unsigned.
"""

from tf_tree_py.core.messages.byte_cursor import ByteCursor, cdr_cursor, text_of
from tf_tree_py.core.messages.message_layout import MessageLayout, read_layout, Rename


class Ros1ByteCursor(ByteCursor):
    """A position in the bytes of a message of ROS 1."""

    head = 4
    stamp = 'II'

    def __init__(self, data: bytes) -> None:
        super().__init__(data, '<')
        self.position = 0

    def skip(self, size: int, alignment: int) -> int:
        """Skip a field, which is not aligned, and return its position."""
        return super().skip(size, 1)

    def skip_stamp(self) -> int:
        """Skip a seq and a stamp, and return the position of the stamp."""
        return self.skip(12, alignment=1) + 4

    def _decoded(self, text: bytes, begin: int) -> str:
        return text_of(text, begin)


def cursor_of(data: bytes, ros1: bool) -> ByteCursor:
    """
    Return a cursor at the beginning of a message.

    :param ros1: whether these are the bytes of ROS 1; otherwise they are CDR.
    :raises WireError: the bytes do not begin with the encapsulation of CDR.
    """
    return Ros1ByteCursor(data) if ros1 else cdr_cursor(data)


def find_ros1_layout(data: bytes, rename: Rename) -> MessageLayout:
    """
    Return the layout of a TFMessage of ROS 1; see ``find_layout``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return read_layout(Ros1ByteCursor(data), rename)
