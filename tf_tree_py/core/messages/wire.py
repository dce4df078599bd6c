# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reading and writing the bytes of a ``tf2_msgs/msg/TFMessage`` without ROS.

``message_layout`` describes the format. Bags and subscriptions deliver the same bytes, so both
use this file.

A publisher sends the same frame names repeatedly. So only the first message is read field by
field. Its ``MessageLayout`` is kept: one struct for the whole message, and the names that a
message must contain. A later message with the same names takes one comparison of the names
and one unpacking of the numbers.
"""

from collections.abc import Collection, Generator
import struct
import sys

from .byte_cursor import ENCAPSULATION_BYTES, WireError
from .incidents import Incident, Kind
from .message_layout import (
    as_published,
    find_layout,
    find_layout_in_steps,
    FindLayout,
    Key,
    key_of,
    MessageLayout,
    Rename,
)
from .sample import as_sec_nanosec, Batch, Sample
from ..edges.packed import pack_pose, POSE_BYTES
from ..geometry import se3
from ..stamp import LATEST

_HEAD_BYTES = 8  # encapsulation and count
# Both byte orders are CDR. Messages are written in that of this machine, as poses are packed.
_ENCAPSULATION = {'little': b'\0\1\0\0', 'big': b'\0\0\0\0'}[sys.byteorder]
_STAMP = struct.Struct('=iI')
DEFAULT_REMEMBERED = 8_000_000
"""Maximum bytes of a reader's layouts, enough for the hundreds of transforms of a swarm."""
# The most layouts with one key; a message is compared with each of them in turn.
_MAX_ALIKE = 64


class WireReader:
    """
    Turns messages into batches, and remembers their layouts.

    Not thread-safe: each subscription has its own reader.

    :ivar remembered: the approximate number of bytes that its layouts take.
    """

    def __init__(self, rename: Rename = as_published, find: FindLayout = find_layout,
                 most: int = DEFAULT_REMEMBERED, static: bool = False) -> None:
        """
        Start with no layouts.

        :param rename: takes (parent, child) and returns their new names, or None to drop
            the transform. It is called once for each layout, so a dropped transform costs
            almost nothing.
        :param find: reads a message field by field; ``find_layout`` reads those of ROS 2.
        :param most: maximum bytes of its layouts; when they exceed it, all are forgotten.
        :param static: whether the transforms are valid at all times. Their stamps mean nothing,
            so no stamp is impossible.
        """
        self._rename = rename
        self._find = find
        self._most = most
        self._static = static
        self._layouts: dict[Key, list[MessageLayout]] = {}
        self.remembered = 0

    def read(self, data: bytes) -> Batch:
        """
        Return the transforms of a serialized TFMessage, in its order.

        :raises WireError: the bytes are not a TFMessage.
        """
        return self.read_known(data) or self._read_new(self._find(data, self._rename), data)

    def read_known(self, data: bytes) -> Batch | None:
        """Return the transforms of a message if its layout is known, otherwise None."""
        for layout in self._layouts.get(key_of(data), ()):
            batch = layout.read(data, self._static)
            if batch is not None:
                return batch
        return None

    def read_in_steps(self, data: bytes, authority: str
                      ) -> Generator[None, None, Batch | Incident]:
        """Do the same as ``read_or_refuse``, in steps between which others may be read."""
        try:
            # Another message may have brought the layout since this one arrived.
            return self.read_known(data) or self._read_new(
                (yield from find_layout_in_steps(data, self._rename)), data)
        except WireError as error:
            return malformed(error, authority)

    def _read_new(self, layout: MessageLayout, data: bytes) -> Batch:
        self._remember(layout)
        batch = layout.read(data, self._static)
        assert batch is not None
        return batch

    def layout_of(self, data: bytes) -> MessageLayout:
        """
        Return the layout of a message, which can read many such messages at once.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(key_of(data), ()):
            if layout.fits(data):
                return layout
        layout = self._find(data, self._rename)
        self._remember(layout)
        return layout

    def read_or_refuse(self, data: bytes, authority: str) -> Batch | Incident:
        """Return the transforms of a message, or an incident if the bytes are not a TFMessage."""
        try:
            return self.read(data)
        except WireError as error:
            return malformed(error, authority)

    def _remember(self, layout: MessageLayout) -> None:
        if layout.size > self._most:
            return
        if self.remembered + layout.size > self._most:
            # So many names come only from a hostile publisher. Forget all layouts.
            self._layouts.clear()
            self.remembered = 0
        alike = self._layouts.setdefault(layout.key, [])
        if len(alike) >= _MAX_ALIKE:
            self.remembered -= sum(other.size for other in alike)
            alike.clear()
        alike.append(layout)
        self.remembered += layout.size


def malformed(error: WireError, authority: str) -> Incident:
    """Return the incident of bytes that cannot be decoded."""
    return Incident(Kind.MALFORMED, '', '', LATEST, authority, str(error))


def write(samples: Collection[Sample]) -> bytes:
    """
    Return a serialized TFMessage of these transforms; for batches, use a ``WireWriter``.

    :raises InvalidArgumentException: a stamp that no message can hold.
    """
    return bytes(_laid_out(samples)[0])


def _laid_out(samples: Collection[Sample]) -> tuple[bytearray, list[int], list[int]]:
    """Return a message, and the positions of each stamp and each pose in it."""
    data, stamps_at, poses_at = bytearray(_HEAD_BYTES), list[int](), list[int]()
    struct.pack_into('=4sI', data, 0, _ENCAPSULATION, len(samples))
    for parent, child, stamp, pose in samples:
        stamps_at.append(len(data))
        data += _STAMP.pack(*as_sec_nanosec(stamp))
        for name in (parent.encode() + b'\0', child.encode() + b'\0'):
            _align(data, 4)
            data += struct.pack('=I', len(name)) + name
        _align(data, 8)
        poses_at.append(len(data))
        data += pack_pose(*pose)
    return data, stamps_at, poses_at


class WireWriter:
    """Writes batches; the names of each layout are written once and then reused."""

    def __init__(self) -> None:
        # For the edges of each layout a message, and the positions of its stamps and poses.
        self._layouts: dict[
            tuple[tuple[str, str], ...], tuple[bytearray, list[int], list[int]]] = {}

    def write(self, batch: Batch) -> bytes:
        """
        Return a batch as a TFMessage, serialized.

        :raises InvalidArgumentException: a stamp that no message can hold.
        """
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
    data += bytes((ENCAPSULATION_BYTES - len(data)) % size)


def read(data: bytes) -> Batch:
    """
    Return the transforms of one serialized TFMessage; for many, keep a ``WireReader``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return WireReader().read(data)
