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
The bytes of a ``tf2_msgs/msg/TFMessage``, read and written without ROS.

``layout`` knows how they are laid out. A bag and a subscription give the same bytes, so both
are read here.

A publisher sends the same frame names over and over. So the first message is read
field by field, and a ``Layout`` is kept: one struct for the whole message, and the
names that it has to contain. A later message with the same names takes one comparison
of the names and one unpack of the numbers.
"""

from collections.abc import Collection
import struct
import sys

from .cursor import ENCAPSULATION_BYTES, WireError
from .frame_names import as_published, Rename
from .incidents import Incident, Kind
from .layout import find_layout, FindLayout, Key, key_of, Layout
from .sample import as_sec_nanosec, Batch, Sample
from ..edges.packed import POSE_BYTES
from ..geometry import se3
from ..stamp import LATEST

_HEAD_BYTES = 8  # encapsulation and count
_STAMP = struct.Struct('<iI')
# Bytes that all layouts together may take: a swarm of robots has hundreds of transforms.
_MAX_REMEMBERED = 8_000_000
# Layouts with one key; a message is compared with one after the other.
_MAX_ALIKE = 64


class WireReader:
    """
    Turns messages into batches, and remembers the layouts of the last ones.

    Not safe for several threads: each subscription has a reader of its own.
    """

    def __init__(self, rename: Rename = as_published, find: FindLayout = find_layout) -> None:
        """
        Start with no layouts.

        :param rename: takes (parent, child) and returns their new names, or None to leave
            the transform out. It is called once for each layout, so a transform that is
            left out costs nearly nothing.
        :param find: reads a message field by field: ``find_layout`` those of ROS 2,
            ``find_ros1_layout`` those of ROS 1.
        """
        self._rename = rename
        self._find = find
        self._layouts: dict[Key, list[Layout]] = {}
        self._remembered = 0

    def read(self, data: bytes) -> Batch:
        """
        Return the transforms of a serialized TFMessage, in its order.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(key_of(data), ()):
            batch = layout.read(data)
            if batch is not None:
                return batch
        batch = self._found(data).read(data)
        assert batch is not None
        return batch

    def layout_of(self, data: bytes) -> Layout:
        """
        Return where the numbers of a message stand; a layout reads many such messages at once.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(key_of(data), ()):
            if layout.fits(data):
                return layout
        return self._found(data)

    def _found(self, data: bytes) -> Layout:
        layout = self._find(data, self._rename)
        self._remember(layout)
        return layout

    def read_or_refuse(self, data: bytes, authority: str) -> Batch | Incident:
        """Return the transforms of a message, or an incident if it is none."""
        try:
            return self.read(data)
        except WireError as error:
            return Incident(Kind.MALFORMED, '', '', LATEST, authority, str(error))

    def _remember(self, layout: 'Layout') -> None:
        if layout.size > _MAX_REMEMBERED:
            return
        if self._remembered + layout.size > _MAX_REMEMBERED:
            # So many names come only from a hostile publisher. Forget all layouts.
            self._layouts.clear()
            self._remembered = 0
        alike = self._layouts.setdefault(layout.key, [])
        if len(alike) >= _MAX_ALIKE:
            self._remembered -= sum(other.size for other in alike)
            alike.clear()
        alike.append(layout)
        self._remembered += layout.size


def write(samples: Collection[Sample]) -> bytes:
    """
    Return a TFMessage of these transforms, serialized; of whole batches a ``WireWriter`` does.

    :raises InvalidArgumentException: a stamp that no message can hold.
    """
    return bytes(_laid_out(samples)[0])


def _laid_out(samples: Collection[Sample]) -> tuple[bytearray, list[int], list[int]]:
    """Return a message, and where in it each stamp and each pose begins."""
    data, stamps_at, poses_at = bytearray(_HEAD_BYTES), list[int](), list[int]()
    struct.pack_into('<4sI', data, 0, b'\0\1\0\0', len(samples))
    for parent, child, stamp, pose in samples:
        _align(data, 4)
        stamps_at.append(len(data))
        data += _STAMP.pack(*as_sec_nanosec(stamp))
        for name in (parent.encode() + b'\0', child.encode() + b'\0'):
            _align(data, 4)
            data += struct.pack('<I', len(name)) + name
        _align(data, 8)
        poses_at.append(len(data))
        data += struct.pack('<7d', *pose)
    return data, stamps_at, poses_at


class WireWriter:
    """Writes batches of few layouts: of each the names are laid out once."""

    def __init__(self) -> None:
        # Of each layout a message, and where in it each stamp and each pose begins.
        self._layouts: dict[
            tuple[tuple[str, str], ...], tuple[bytearray, list[int], list[int]]] = {}

    def write(self, batch: Batch) -> bytes:
        """
        Return a batch as a TFMessage, serialized.

        :raises InvalidArgumentException: a stamp that no message can hold.
        """
        if sys.byteorder != 'little':
            return write(batch.samples())
        edges = tuple(batch.edges)
        if edges not in self._layouts:
            self._layouts[edges] = _laid_out(
                [Sample(*edge, LATEST, se3.IDENTITY) for edge in edges])
        pattern, stamps_at, poses_at = self._layouts[edges]
        data = bytearray(pattern)
        for place, stamp in zip(stamps_at, batch.stamps, strict=True):
            _STAMP.pack_into(data, place, *as_sec_nanosec(stamp))
        for place, pose in zip(poses_at, batch.poses, strict=True):
            data[place:place + POSE_BYTES] = pose
        return bytes(data)


def _align(data: bytearray, size: int) -> None:
    data += bytes(-(len(data) - ENCAPSULATION_BYTES) % size)


def read(data: bytes) -> Batch:
    """
    Return the transforms of one serialized TFMessage; for many, keep a ``WireReader``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return WireReader().read(data)
