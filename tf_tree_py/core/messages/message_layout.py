# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The positions of the numbers in the bytes of a TFMessage with certain names.

A TFMessage is a uint32 count, then for each transform int32 sec, uint32 nanosec, string
frame_id, string child_frame_id and 7 doubles (translation x y z, rotation x y z w).
``byte_cursor`` reads the numbers and strings.
"""

from collections.abc import Callable, Generator, Iterable, Sequence
import struct
import sys
from typing import Any, NamedTuple

from .byte_cursor import ByteCursor, cdr_cursor, WireError
from .sample import Batch, Edge, Edges, ImpossibleStamp
from ..edges.packed import pack_pose, POSE_BYTES
from ..stamp import NANOSECONDS_PER_SECOND


class TransformPlace(NamedTuple):
    """The positions of one transform: its stamp, its names with their lengths, its pose."""

    stamp: int
    parent: slice
    child: slice
    pose: int


# Positions of the first parent's name, equal in both formats: the seq of ROS 1 is as long as
# the encapsulation of CDR.
_FIRST_LENGTH, _FIRST_NAME = 16, 20
# The smallest transform: a stamp, two empty names, a pose, without padding.
_MIN_TRANSFORM_BYTES = 72
# A serialized message may be padded to the next boundary.
_MAX_PADDING = 7
# Memory of a layout, for each transform and for each byte of its names. A name is kept as bytes
# and as a str, in which a single wide character makes all characters four bytes wide.
_TRANSFORM_BYTES = 500
_NAME_BYTES = 5
STEP = 500
"""The transforms of a large message that are processed at a time, some milliseconds."""
_NATIVE = {'little': '<', 'big': '>'}[sys.byteorder]
"""The byte order of this machine, as struct's letter."""

Key = tuple[int, bytes]
_Unpack = Callable[[bytes], tuple[Any, ...]]


def key_of(data: bytes) -> Key:
    """Return the size and the first parent's name: they differ for most layouts."""
    if len(data) <= _FIRST_LENGTH:
        return len(data), b''
    # Depending on the byte order, this is the lowest or the highest byte of the name's length.
    # All messages of one layout have the same value there.
    return len(data), data[_FIRST_NAME:_FIRST_NAME + data[_FIRST_LENGTH]]


class MessageLayout:
    """
    The positions of the numbers in the bytes of a message with certain names.

    :ivar key: of its messages; see ``key_of``.
    :ivar size: the approximate memory that it takes, bytes.
    :ivar edges: (parent, child) of each wanted transform.
    :ivar wanted: the positions of each wanted transform.
    :ivar fixed: the positions of the bytes that all messages share: the head, the names.
    :ivar names: the bytes at these positions.
    :ivar order: struct's letter for the byte order; ``stamp``: its format of a stamp.
    """

    __slots__ = ('key', 'size', 'edges', 'wanted', 'fixed', 'names', 'order', 'stamp',
                 '_slashed', '_unpack_names', '_unpack_numbers', '__weakref__')

    def __init__(self, cursor: ByteCursor, places: Sequence[TransformPlace],
                 edges: Sequence[Edge | None], slashed: Sequence[str]) -> None:
        """
        Make the layout of a message that was read.

        :param cursor: the cursor that read it.
        :param places: the positions of each of its transforms.
        :param edges: (parent, child) of each; None: it is dropped.
        :param slashed: the names that begin with a slash in the message.
        """
        self._slashed = slashed
        data, self.order, self.stamp = cursor.data, cursor.order, cursor.stamp
        self.key = key_of(data)
        self.edges = Edges(edge for edge in edges if edge is not None)
        self.wanted = [place for place, edge in zip(places, edges, strict=True)
                       if edge is not None]
        self.fixed = [slice(0, cursor.head), *(
            name for place in places for name in (place.parent, place.child))]
        self._unpack_names = _fields(self.order, len(data), [
            (part.start, f'{part.stop - part.start}s') for part in self.fixed])
        self.names = self._unpack_names(data)
        self.size = (_TRANSFORM_BYTES * (1 + len(places))
                     + _NAME_BYTES * sum(map(len, (*self.names, *slashed))))
        self._unpack_numbers = _fields(self.order, len(data), [
            field for place in self.wanted
            for field in ((place.stamp, self.stamp), (place.pose, f'{POSE_BYTES}s'))])

    def fits(self, data: bytes) -> bool:
        """Return whether a message with the same key has these names."""
        return self._unpack_names(data) == self.names

    def read(self, data: bytes, static: bool = False) -> Batch | None:
        """
        Return the transforms, or None if the message has other names.

        :param static: keep all, because the stamps mean nothing.
        """
        if not self.fits(data):
            return None
        if not self.wanted:
            return Batch((), (), (), self._slashed)
        values = self._unpack_numbers(data)
        poses: Sequence[bytes] = values[2::3]
        if self.order != _NATIVE:
            poses = [pack_pose(*struct.unpack(f'{self.order}7d', pose)) for pose in poses]
        secs, nanosecs = values[::3], values[1::3]
        stamps, worst = _stamps(secs, nanosecs)
        batch = Batch(self.edges, stamps, poses, self._slashed)
        if worst < NANOSECONDS_PER_SECOND or static:
            return batch
        return _without_impossible(batch, secs, nanosecs)


def _stamps(secs: Sequence[int], nanosecs: Sequence[int]) -> tuple[list[int], int]:
    """
    Return stamps in nanoseconds, and the largest ``nanosec``.

    It is faster if all are equal, as is usual in one message.
    """
    sec, nanosec, count = secs[0], nanosecs[0], len(secs)
    if secs.count(sec) == nanosecs.count(nanosec) == count:
        return [sec * NANOSECONDS_PER_SECOND + nanosec] * count, nanosec
    return ([sec * NANOSECONDS_PER_SECOND + nanosec
             for sec, nanosec in zip(secs, nanosecs, strict=True)], max(nanosecs))


def _without_impossible(batch: Batch, secs: Sequence[int], nanosecs: Sequence[int]) -> Batch:
    """Return a batch without the transforms whose stamps are impossible."""
    possible = [place for place, nanosec in enumerate(nanosecs)
                if nanosec < NANOSECONDS_PER_SECOND]
    return batch.part(possible)._replace(impossible=[
        ImpossibleStamp(*edge, sec, nanosec)
        for edge, sec, nanosec in zip(batch.edges, secs, nanosecs, strict=True)
        if nanosec >= NANOSECONDS_PER_SECOND])


def _fields(order: str, size: int, fields: Iterable[tuple[int, str]]) -> _Unpack:
    """
    Return a function that unpacks fields of a message.

    :param size: of the message, bytes.
    :param fields: the first byte and struct's format of each.
    """
    form, position = order, 0
    for begin, code in fields:
        # With an explicit byte order, struct does not align fields.
        form += f'{begin - position}x{code}'
        position = begin + struct.calcsize(order + code)
    return struct.Struct(f'{form}{size - position}x').unpack


# --- reading field by field

Rename = Callable[[str, str], tuple[str, str] | None]
"""Takes (parent, child), and returns their new names, or None to drop the edge."""

FindLayout = Callable[[bytes, Rename], MessageLayout]


def as_published(parent: str, child: str) -> tuple[str, str] | None:
    """Return the names of an edge unchanged, except for leading slashes."""
    return parent.removeprefix('/'), child.removeprefix('/')


def find_layout(data: bytes, rename: Rename) -> MessageLayout:
    """
    Read a message of ROS 2 field by field, and return its layout.

    :raises WireError: the bytes are not a TFMessage.
    """
    return read_layout(cdr_cursor(data), rename)


def find_layout_in_steps(data: bytes, rename: Rename) -> Generator[None, None, MessageLayout]:
    """
    Do the same as ``find_layout``, in steps between which the caller can do other work.

    :raises WireError: the bytes are not a TFMessage.
    """
    return _steps(cdr_cursor(data), rename)


def read_layout(cursor: ByteCursor, rename: Rename) -> MessageLayout:
    """
    Read a message field by field, and return its layout.

    :param cursor: at its beginning.
    :raises WireError: the bytes are not a TFMessage.
    """
    steps = _steps(cursor, rename)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            found: MessageLayout = end.value
            return found


def _steps(cursor: ByteCursor, rename: Rename) -> Generator[None, None, MessageLayout]:
    size = len(cursor.data)
    count = cursor.read_uint32()
    if count * _MIN_TRANSFORM_BYTES > size:
        raise WireError(f'{size} bytes cannot hold {count} transforms')
    places, edges = [], []
    slashed: dict[str, None] = {}
    for number in range(count):
        if number % STEP == STEP - 1:
            yield
        stamp = cursor.skip_stamp()
        parent, parent_bytes = cursor.read_string()
        child, child_bytes = cursor.read_string()
        pose = cursor.skip(POSE_BYTES, alignment=8)
        places.append(TransformPlace(stamp, parent_bytes, child_bytes, pose))
        edges.append(rename(parent, child))
        slashed |= dict.fromkeys(name for name in (parent, child) if name.startswith('/'))
    if size - cursor.position > _MAX_PADDING:
        raise WireError(f'{size - cursor.position} bytes are left over after {count} transforms')
    return MessageLayout(cursor, places, edges, tuple(slashed))
