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
Where the numbers stand in the bytes of a TFMessage with certain names.

A uint32 count, then for each transform int32 sec, uint32 nanosec, string frame_id, string
child_frame_id and 7 doubles (translation x y z, rotation x y z w). ROS 1 has a uint32 seq
before each stamp, whose seconds have no sign. ``cursor`` knows how both write numbers and
strings.
"""

from collections.abc import Callable, Iterable, Sequence
import struct
import sys
from typing import Any

from .block import Block, Place
from .cursor import cdr_cursor, Cursor, ros1_cursor, WireError
from .frame_names import Rename
from .sample import Batch
from ..edges.packed import pack_pose, POSE_BYTES
from ..stamp import NANOSECONDS_PER_SECOND

# The first parent's name. ROS 1 has a seq where CDR has its encapsulation, so both agree.
_FIRST_LENGTH, _FIRST_NAME = 16, 20
# The smallest transform: a stamp, two empty names, a pose, without padding.
_MIN_TRANSFORM_BYTES = 72
# A serialized message may be padded to the next boundary.
_MAX_PADDING = 7
# Memory of a layout, for each transform and for each byte of its names. A name is kept as bytes
# and as text, and in a text one odd character makes all characters four bytes wide.
_TRANSFORM_BYTES = 500
_NAME_BYTES = 5
NATIVE = {'little': '<', 'big': '>'}[sys.byteorder]
"""The byte order of this machine, as struct writes it."""

Key = tuple[int, bytes]
_Unpack = Callable[[bytes], tuple[Any, ...]]


def key_of(data: bytes) -> Key:
    """Return the size and the first parent's name: they differ for most layouts."""
    if len(data) <= _FIRST_NAME:
        return len(data), b''
    # This byte is one of the four of the name's length. Whichever it is, all messages of one
    # layout have the same.
    return len(data), data[_FIRST_NAME:_FIRST_NAME + data[_FIRST_LENGTH]]


class Layout:
    """
    Where the numbers stand in the bytes of a message with certain names.

    :ivar key: of its messages; see ``key_of``.
    :ivar size: how much memory it takes, about.
    :ivar edges: (parent, child) of each transform that is wanted.
    """

    __slots__ = ('key', 'size', 'edges', '_slashed', '_fixed', '_names', '_unpack_names',
                 '_unpack_numbers', '_wanted', '_order', '_stamp', '_block')

    def __init__(self, cursor: Cursor, places: Sequence[Place],
                 edges: Sequence[tuple[str, str] | None], slashed: Sequence[str]) -> None:
        """
        Make the layout of a message that was read.

        :param cursor: what it was read with.
        :param places: where each of its transforms stands.
        :param edges: (parent, child) of each; None: it is left out.
        :param slashed: the names that begin with a slash in the message.
        """
        self._slashed = slashed
        data, self._order, self._stamp = cursor.data, cursor.order, cursor.stamp
        self.key = key_of(data)
        self.edges = tuple(edge for edge in edges if edge is not None)
        self._wanted = [place for place, edge in zip(places, edges, strict=True)
                        if edge is not None]
        self._fixed = [slice(0, cursor.head), *(
            name for place in places for name in (place.parent, place.child))]
        self._unpack_names = _fields(self._order, len(data), [
            (part.start, f'{part.stop - part.start}s') for part in self._fixed])
        self._names = self._unpack_names(data)
        self.size = (_TRANSFORM_BYTES * (1 + len(places))
                     + _NAME_BYTES * sum(map(len, (*self._names, *slashed))))
        self._unpack_numbers = _fields(self._order, len(data), [
            field for place in self._wanted
            for field in ((place.stamp, self._stamp), (place.pose, f'{POSE_BYTES}s'))])
        self._block: Block | None = None

    def fits(self, data: bytes) -> bool:
        """Return whether a message with the same key has these names."""
        return self._unpack_names(data) == self._names

    @property
    def block(self) -> Block:
        """Return what reads many of its messages together."""
        if self._block is None:
            self._block = Block(self.key[0], self._fixed, b''.join(self._names), self._wanted,
                                self._order, self._stamp)
        return self._block

    def read(self, data: bytes) -> Batch | None:
        """Return the transforms, or None when the message has other names."""
        if not self.fits(data):
            return None
        values = self._unpack_numbers(data)
        poses: Sequence[bytes] = values[2::3]
        if self._order != NATIVE:
            poses = [pack_pose(*struct.unpack(f'{self._order}7d', pose)) for pose in poses]
        return Batch(self.edges, _stamps(values[::3], values[1::3]), poses, self._slashed)


def _stamps(secs: Sequence[int], nanosecs: Sequence[int]) -> list[int]:
    """Return stamps in nanoseconds. Usually all of one message are equal: that is faster."""
    count = len(secs)
    if count > 1 and secs.count(secs[0]) == nanosecs.count(nanosecs[0]) == count:
        return [secs[0] * NANOSECONDS_PER_SECOND + nanosecs[0]] * count
    return [sec * NANOSECONDS_PER_SECOND + nanosec
            for sec, nanosec in zip(secs, nanosecs, strict=True)]


def _fields(order: str, size: int, fields: Iterable[tuple[int, str]]) -> _Unpack:
    """
    Return a function that unpacks fields of a message.

    :param size: of the message, bytes.
    :param fields: for each its first byte and struct's format.
    """
    form, position = order, 0
    for begin, kind in fields:
        # struct aligns nothing by itself after an explicit byte order.
        form += f'{begin - position}x{kind}'
        position = begin + struct.calcsize(order + kind)
    return struct.Struct(f'{form}{size - position}x').unpack


# --- reading field by field

FindLayout = Callable[[bytes, Rename], Layout]


def find_layout(data: bytes, rename: Rename) -> Layout:
    """
    Read a message of ROS 2 field by field, and return its layout.

    :raises WireError: the bytes are not a TFMessage.
    """
    return _layout(cdr_cursor(data), rename)


def find_ros1_layout(data: bytes, rename: Rename) -> Layout:
    """
    Read a message of ROS 1 field by field, and return its layout.

    :raises WireError: the bytes are not a TFMessage.
    """
    return _layout(ros1_cursor(data), rename)


def _layout(cursor: Cursor, rename: Rename) -> Layout:
    size = len(cursor.data)
    count = cursor.take_uint32()
    if count * _MIN_TRANSFORM_BYTES > size:
        raise WireError(f'{size} bytes cannot hold {count} transforms')
    places, edges, slashed = [], [], dict[str, None]()
    for _ in range(count):
        stamp = cursor.skip_stamp()
        parent, parent_bytes = cursor.take_string()
        child, child_bytes = cursor.take_string()
        pose = cursor.skip(POSE_BYTES, alignment=8)
        places.append(Place(stamp, parent_bytes, child_bytes, pose))
        edges.append(rename(parent, child))
        slashed |= dict.fromkeys(name for name in (parent, child) if name.startswith('/'))
    if size - cursor.position > _MAX_PADDING:
        raise WireError(f'{size - cursor.position} bytes are left over after {count} transforms')
    return Layout(cursor, places, edges, tuple(slashed))
