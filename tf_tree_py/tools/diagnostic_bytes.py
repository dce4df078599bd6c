# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reading the bytes of a DiagnosticArray without ROS.

The message has a header and a count of statuses. Each status has a byte level, the strings
name, message and hardware_id, and a count of pairs of strings: key and value.
"""

from collections.abc import Iterator

from tf_tree_py.core.messages.byte_cursor import ByteCursor, cdr_cursor, ros1_cursor


def read_statuses(data: bytes, ros1: bool) -> Iterator[tuple[str, dict[str, str]]]:
    """
    Yield the name of each status, and its values by their keys.

    :param ros1: whether these are the bytes of ROS 1; otherwise they are CDR.
    :raises WireError: the bytes are not a DiagnosticArray.
    """
    cursor = ros1_cursor(data) if ros1 else cdr_cursor(data)
    cursor.skip_stamp()
    _text(cursor)  # frame_id
    for _ in range(cursor.take_uint32()):
        cursor.skip(1, alignment=1)  # level
        name, _message, _hardware = [_text(cursor) for _ in range(3)]
        yield name, {_text(cursor): _text(cursor) for _ in range(cursor.take_uint32())}


def _text(cursor: ByteCursor) -> str:
    return cursor.take_string()[0]
