"""
The bytes of a ``tf2_msgs/msg/TFMessage``, read without ROS.

CDR: 4 bytes of encapsulation, a uint32 count, then for each transform int32
sec, uint32 nanosec, string frame_id, string child_frame_id and 7 doubles
(translation x y z, rotation x y z w); everything is aligned relative to the
byte after the encapsulation, and a string is a uint32 length that counts its
closing NUL. Both byte orders are read. A bag and a subscription give the same
bytes, so both are read here.

A publisher sends the same frame names over and over. So a message that was
once read field by field leaves a ``_Layout``: one struct for the whole message,
and the names that must be found in it. The next of its kind is one unpack and
one comparison.
"""

from collections.abc import Sequence
import struct
from typing import Any, NamedTuple

import numpy as np

from .history import POSE_BYTES
from .sample import Batch
from .stamp import NANOSECONDS_PER_SECOND

_BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
_ENCAPSULATION_BYTES = 4
_HEAD_BYTES = 8  # encapsulation and count
_FIRST_NAME = 16  # encapsulation, count, sec, nanosec
# The smallest transform: a stamp, two empty names, a pose, without padding.
_MIN_TRANSFORM_BYTES = 72
# A serialized message may be padded to the next boundary.
_MAX_PADDING = 7
_MAX_LAYOUTS = 256
# Up to so many transforms plain floats are cheaper than an array.
_FEW = 6


class WireError(ValueError):
    """Bytes that are no TFMessage: truncated, or never one."""


class WireReader:
    """
    Turns messages into batches, remembering how the last ones were laid out.

    Not safe for several threads: one reader a subscription.
    """

    def __init__(self) -> None:
        self._layouts: dict[int, list[_Layout]] = {}
        self._count = 0

    def read(self, data: bytes) -> Batch:
        """
        Return the transforms of a serialized TFMessage, in its order.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(len(data), ()):
            batch = layout.read(data)
            if batch is not None:
                return batch
        layout = _find_layout(data)
        self._remember(layout)
        batch = layout.read(data)
        assert batch is not None
        return batch

    def _remember(self, layout: '_Layout') -> None:
        if self._count >= _MAX_LAYOUTS:
            # Names that change all the time: somebody hostile, or a swarm. Start afresh.
            self._layouts.clear()
            self._count = 0
        self._layouts.setdefault(layout.size, []).append(layout)
        self._count += 1


def read(data: bytes) -> Batch:
    """
    Return the transforms of one serialized TFMessage; for many, keep a ``WireReader``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return WireReader().read(data)


class _Layout:
    """Where the numbers of a message with these very names lie in its bytes."""

    __slots__ = ('size', '_edges', '_names', '_first_name', '_unpack', '_step', '_doubles',
                 '_poses')

    def __init__(self, data: bytes, order: str, places: Sequence['_Place']) -> None:
        """
        Take what was found in a message.

        :param order: struct's letter of its byte order.
        :param places: where each of its transforms lies.
        """
        self.size = len(data)
        self._edges = tuple((place.parent, place.child) for place in places)
        # A few poses are unpacked with the rest, of many numpy takes care.
        few = len(places) <= _FEW
        pose, self._step = ('7d', 11) if few else (f'{POSE_BYTES}x', 4)
        fields = [f'{order}{_HEAD_BYTES}s']
        for place in places:
            parent, child = place.parent_bytes, place.child_bytes
            gap, rest = child.start - parent.stop, place.pose - child.stop
            # struct aligns nothing by itself after an explicit byte order.
            fields.append(f'iI{parent.stop - parent.start}s{gap}x'
                          f'{child.stop - child.start}s{rest}x{pose}')
        fields.append(f'{len(data) - struct.calcsize("".join(fields))}x')
        self._unpack = struct.Struct(''.join(fields)).unpack
        self._names = self._names_in(self._unpack(data))
        self._first_name = data[places[0].parent_bytes] if places else b''
        # Doubles are aligned relative to the encapsulation's end. Which of them are poses:
        self._doubles = np.dtype(f'{order}f8')
        firsts = [(place.pose - _ENCAPSULATION_BYTES) // 8 for place in places]
        self._poses = None if few else np.array(firsts)[:, None] + np.arange(7)

    def read(self, data: bytes) -> Batch | None:
        """Return the transforms, or None when the message has other names."""
        if self._first_name and not data.startswith(self._first_name, _FIRST_NAME):
            return None
        values = self._unpack(data)
        if self._names_in(values) != self._names:
            return None
        step = self._step
        stamps = [sec * NANOSECONDS_PER_SECOND + nanosec
                  for sec, nanosec in zip(values[1::step], values[2::step], strict=True)]
        if self._poses is None:
            return Batch(self._edges, stamps,
                         [values[begin:begin + 7] for begin in range(5, len(values), step)])
        count = (len(data) - _ENCAPSULATION_BYTES) // 8
        doubles = np.frombuffer(data, self._doubles, count, _ENCAPSULATION_BYTES)
        return Batch(self._edges, stamps, doubles.take(self._poses).astype(float, copy=False))

    def _names_in(self, values: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return what must not differ: encapsulation and count, parents, children."""
        return values[0], values[3::self._step], values[4::self._step]


class _Place(NamedTuple):
    """Where one transform lies: slices of its names' bytes, lengths included, and its pose."""

    parent: str
    child: str
    parent_bytes: slice
    child_bytes: slice
    pose: int


def _find_layout(data: bytes) -> _Layout:
    """Read a message field by field, and note how it lies."""
    order = _BYTE_ORDERS.get(data[:2])
    if order is None:
        raise WireError(f'not CDR: it begins with the bytes {data[:4].hex(" ")}')
    cursor = _Cursor(data, order)
    count = cursor.take_uint32()
    if count * _MIN_TRANSFORM_BYTES > len(data):
        raise WireError(f'{len(data)} bytes cannot hold {count} transforms')
    places = []
    for _ in range(count):
        cursor.skip(8, alignment=4)
        parent, parent_bytes = cursor.take_string()
        child, child_bytes = cursor.take_string()
        pose = cursor.skip(POSE_BYTES, alignment=8)
        places.append(_Place(parent, child, parent_bytes, child_bytes, pose))
    if len(data) - cursor.position > _MAX_PADDING:
        raise WireError(
            f'{len(data) - cursor.position} bytes are left over after {count} transforms')
    return _Layout(data, order, places)


class _Cursor:
    """A place in the bytes, and how to read on from there."""

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
        """Read a string; return it, and where it lies with its length in front."""
        length = self.take_uint32()
        begin = self.skip(length, alignment=1)
        text = self.data[begin:self.position]
        if length and text[-1]:
            raise WireError(f'the name at byte {begin} does not end with NUL')
        try:
            return text[:-1].decode(), slice(begin - 4, self.position)
        except UnicodeDecodeError:
            raise WireError(f'the name at byte {begin} is not UTF-8: {text!r}') from None
