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
The bytes of a DiagnosticArray, read without ROS.

A header, and a count of statuses: byte level, string name, message and hardware_id, and a
count of pairs of strings, key and value.
"""

from collections.abc import Iterator

from .cursor import cdr_cursor, Cursor, ros1_cursor


def read_statuses(data: bytes, ros1: bool) -> Iterator[tuple[str, dict[str, str]]]:
    """
    Yield the name of each status, and its values by their keys.

    :param ros1: whether these are ROS 1's bytes; else they are CDR.
    :raises WireError: the bytes are no such message.
    """
    cursor = ros1_cursor(data) if ros1 else cdr_cursor(data)
    cursor.skip_stamp()
    _text(cursor)  # frame_id
    for _ in range(cursor.take_uint32()):
        cursor.skip(1, alignment=1)  # level
        name, _message, _hardware = [_text(cursor) for _ in range(3)]
        yield name, {_text(cursor): _text(cursor) for _ in range(cursor.take_uint32())}


def _text(cursor: Cursor) -> str:
    return cursor.take_string()[0]
