"""
The bytes of a ``tf2_msgs/msg/TFMessage``, read and written without ROS.

CDR: 4 bytes of encapsulation, a uint32 count, then for each transform int32
sec, uint32 nanosec, string frame_id, string child_frame_id and 7 doubles
(translation x y z, rotation x y z w); everything is aligned relative to the
byte after the encapsulation, and a string is a uint32 length that counts its
closing NUL. Both byte orders are read. A bag and a subscription give the same
bytes, so both are read here.

A publisher sends the same frame names over and over. So the first message is read
field by field, and a ``_Layout`` is kept: one struct for the whole message, and the
names that it has to contain. A later message with the same names takes one comparison
of the names and one unpack of the numbers.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
import struct
import sys
from typing import Any, NamedTuple

from .frame_names import as_published, Rename
from .incidents import Incident, Kind
from .sample import as_sec_nanosec, Batch, Sample
from ..edges.packed import pack_pose, POSE_BYTES
from ..stamp import LATEST, NANOSECONDS_PER_SECOND

_BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
_ENCAPSULATION_BYTES = 4
_HEAD_BYTES = 8  # encapsulation and count
_FIRST_LENGTH, _FIRST_NAME = 16, 20  # behind encapsulation, count, sec, nanosec
# The smallest transform: a stamp, two empty names, a pose, without padding.
_MIN_TRANSFORM_BYTES = 72
# A serialized message may be padded to the next boundary.
_MAX_PADDING = 7
# Bytes that all layouts together may take: a swarm of robots has hundreds of transforms.
_MAX_REMEMBERED = 8_000_000
# Memory of a layout, for each transform and for each byte of its names. A name is kept as bytes
# and as text, and in a text one odd character makes all characters four bytes wide.
_TRANSFORM_BYTES = 500
_NAME_BYTES = 5
# An error about a name that is no text shows this number of its bytes.
_TOLD_BYTES = 60
# Layouts with one key; a message is compared with one after the other.
_MAX_ALIKE = 64
# The byte order of this machine, as struct writes it.
_NATIVE = {'little': '<', 'big': '>'}[sys.byteorder]

_Key = tuple[int, bytes]
_Unpack = Callable[[bytes], tuple[Any, ...]]


class WireError(ValueError):
    """The bytes are not a TFMessage, or only a part of one."""


class WireReader:
    """
    Turns messages into batches, and remembers the layouts of the last ones.

    Not safe for several threads: each subscription has a reader of its own.
    """

    def __init__(self, rename: Rename = as_published) -> None:
        """
        Start with no layouts.

        :param rename: takes (parent, child) and returns their new names, or None to leave
            the transform out. It is called once for each layout, so a transform that is
            left out costs nearly nothing.
        """
        self._rename = rename
        self._layouts: dict[_Key, list[_Layout]] = {}
        self._remembered = 0

    def read(self, data: bytes) -> Batch:
        """
        Return the transforms of a serialized TFMessage, in its order.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(_key(data), ()):
            batch = layout.read(data)
            if batch is not None:
                return batch
        layout = _find_layout(data, self._rename)
        self._remember(layout)
        batch = layout.read(data)
        assert batch is not None
        return batch

    def read_or_refuse(self, data: bytes, authority: str) -> Batch | Incident:
        """Return the transforms of a message, or why it is none, for who counts and logs."""
        try:
            return self.read(data)
        except WireError as error:
            return Incident(Kind.MALFORMED, '', '', LATEST, authority, str(error))

    def _remember(self, layout: '_Layout') -> None:
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
    Return a TFMessage of these transforms, serialized.

    :raises InvalidArgumentException: a stamp that no message can hold.
    """
    data = bytearray(_HEAD_BYTES)
    struct.pack_into('<4sI', data, 0, b'\0\1\0\0', len(samples))
    for parent, child, stamp, pose in samples:
        _align(data, 4)
        data += struct.pack('<iI', *as_sec_nanosec(stamp))
        for name in (parent.encode() + b'\0', child.encode() + b'\0'):
            _align(data, 4)
            data += struct.pack('<I', len(name)) + name
        _align(data, 8)
        data += struct.pack('<7d', *pose)
    return bytes(data)


def _align(data: bytearray, size: int) -> None:
    data += bytes(-(len(data) - _ENCAPSULATION_BYTES) % size)


def read(data: bytes) -> Batch:
    """
    Return the transforms of one serialized TFMessage; for many, keep a ``WireReader``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return WireReader().read(data)


def _key(data: bytes) -> _Key:
    """Return the size and the first parent's name: they differ for most layouts."""
    if len(data) <= _FIRST_NAME:
        return len(data), b''
    # This byte is one of the four of the name's length. Whichever it is, all messages of one
    # layout have the same.
    return len(data), data[_FIRST_NAME:_FIRST_NAME + data[_FIRST_LENGTH]]


class _Layout:
    """Where the numbers stand in the bytes of a message with certain names."""

    __slots__ = ('key', 'size', 'edges', '_slashed', '_names', '_unpack_names', '_unpack_numbers',
                 '_order')

    def __init__(self, data: bytes, order: str, places: Sequence['_Place'],
                 edges: Sequence[tuple[str, str] | None], slashed: Sequence[str]) -> None:
        """
        Make the layout of a message that was read.

        :param order: struct's letter for its byte order.
        :param places: where each of its transforms stands.
        :param edges: (parent, child) of each; None: it is left out.
        :param slashed: the names that begin with a slash in the message.
        """
        self._slashed = slashed
        self.key = _key(data)
        self.edges = tuple(edge for edge in edges if edge is not None)
        wanted = [place for place, edge in zip(places, edges, strict=True) if edge is not None]
        self._unpack_names = _fields(order, len(data), [
            (0, f'{_HEAD_BYTES}s'),
            *((name.start, f'{name.stop - name.start}s')
              for place in places for name in (place.parent, place.child))])
        self._names = self._unpack_names(data)
        self.size = (_TRANSFORM_BYTES * (1 + len(places))
                     + _NAME_BYTES * sum(map(len, (*self._names, *slashed))))
        self._unpack_numbers = _fields(order, len(data), [
            field for place in wanted
            for field in ((place.stamp, 'iI'), (place.pose, f'{POSE_BYTES}s'))])
        self._order = order

    def read(self, data: bytes) -> Batch | None:
        """Return the transforms, or None when the message has other names."""
        if self._unpack_names(data) != self._names:
            return None
        values = self._unpack_numbers(data)
        poses: Sequence[bytes] = values[2::3]
        if self._order != _NATIVE:
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


class _Place(NamedTuple):
    """Where one transform stands: its stamp, its names with their lengths, its pose."""

    stamp: int
    parent: slice
    child: slice
    pose: int


def _find_layout(data: bytes, rename: Rename) -> _Layout:
    """Read a message field by field, and return its layout."""
    order = _BYTE_ORDERS.get(data[:2])
    if order is None:
        raise WireError(f'not CDR: it begins with the bytes {data[:4].hex(" ")}')
    cursor = _Cursor(data, order)
    count = cursor.take_uint32()
    if count * _MIN_TRANSFORM_BYTES > len(data):
        raise WireError(f'{len(data)} bytes cannot hold {count} transforms')
    places, edges, slashed = [], [], dict[str, None]()
    for _ in range(count):
        stamp = cursor.skip(8, alignment=4)
        parent, parent_bytes = cursor.take_string()
        child, child_bytes = cursor.take_string()
        pose = cursor.skip(POSE_BYTES, alignment=8)
        places.append(_Place(stamp, parent_bytes, child_bytes, pose))
        edges.append(rename(parent, child))
        slashed |= dict.fromkeys(name for name in (parent, child) if name.startswith('/'))
    if len(data) - cursor.position > _MAX_PADDING:
        raise WireError(
            f'{len(data) - cursor.position} bytes are left over after {count} transforms')
    return _Layout(data, order, places, edges, tuple(slashed))


class _Cursor:
    """A position in the bytes, and methods that read on from there."""

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.order = order
        self.position = _ENCAPSULATION_BYTES

    def skip(self, size: int, alignment: int) -> int:
        """Go past an aligned field; return where it began."""
        begin = self.position + -(self.position - _ENCAPSULATION_BYTES) % alignment
        if begin + size > len(self.data):
            raise WireError(f'truncated at byte {begin} of {len(self.data)}')
        self.position = begin + size
        return begin

    def take_uint32(self) -> int:
        """Read a number."""
        begin = self.skip(4, alignment=4)
        (number,) = struct.unpack_from(self.order + 'I', self.data, begin)
        return int(number)

    def take_string(self) -> tuple[str, slice]:
        """Read a string; return it, and where it stands, its length included."""
        length = self.take_uint32()
        begin = self.skip(length, alignment=1)
        text = self.data[begin:self.position]
        if length and text[-1]:
            raise WireError(f'the name at byte {begin} does not end with NUL')
        try:
            return text[:-1].decode(), slice(begin - 4, self.position)
        except UnicodeDecodeError:
            raise WireError(f'the name at byte {begin} is not UTF-8: '
                            f'{text[:_TOLD_BYTES]!r}') from None
