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

import struct
from typing import Any

from .sample import Sample
from .se3 import PoseTuple
from .stamp import NANOSECONDS_PER_SECOND

_BYTE_ORDERS = {b'\x00\x01': '<', b'\x00\x00': '>'}
_ENCAPSULATION_BYTES = 4
_FIRST_NAME = 16  # encapsulation, count, sec, nanosec
# The smallest transform: a stamp, two empty names, a pose, without padding.
_MIN_TRANSFORM_BYTES = 72
# A serialized message may be padded to the next boundary.
_MAX_PADDING = 7
_MAX_LAYOUTS = 256


class WireError(ValueError):
    """Bytes that are no TFMessage: truncated, or never one."""


class WireReader:
    """
    Turns messages into samples, remembering how the last ones were laid out.

    Not safe for several threads: one reader a subscription.
    """

    def __init__(self) -> None:
        self._layouts: dict[int, list[_Layout]] = {}
        self._count = 0

    def read(self, data: bytes) -> list[Sample]:
        """
        Return the transforms of a serialized TFMessage, in its order.

        :raises WireError: the bytes are not a TFMessage.
        """
        for layout in self._layouts.get(len(data), ()):
            samples = layout.read(data)
            if samples is not None:
                return samples
        samples, layout = _read_fields(data)
        self._remember(layout)
        return samples

    def _remember(self, layout: '_Layout') -> None:
        if self._count >= _MAX_LAYOUTS:
            # Names that change all the time: somebody hostile, or a swarm. Start afresh.
            self._layouts.clear()
            self._count = 0
        self._layouts.setdefault(layout.struct.size, []).append(layout)
        self._count += 1


class _Layout:
    """How a message with these very names lies in its bytes."""

    __slots__ = ('struct', '_first_name', '_names', '_edges', '_starts')

    def __init__(self, head: bytes, order: str, names: list[tuple[bytes, int, bytes, int]],
                 edges: list[tuple[str, str]], padding: int) -> None:
        """
        Take what was found in a message.

        :param head: the encapsulation and the count.
        :param names: for each transform the bytes of both names, lengths included,
            and the padding behind each.
        """
        parts = [f'{order}{len(head)}s']
        for parent, gap, child, rest in names:
            parts.append(f'iI{len(parent)}s{gap}x{len(child)}s{rest}x7d')
        # Byte order '<' or '>' also turns struct's own alignment off.
        self.struct = struct.Struct(''.join(parts) + f'{padding}x')
        self._first_name = names[0][0] if names else b''
        self._names = (head, *(part for parent, _, child, _ in names for part in (parent, child)))
        self._edges = edges
        self._starts = range(1, 1 + 11 * len(edges), 11)

    def read(self, data: bytes) -> list[Sample] | None:
        """Return the samples, or None when the message has other names."""
        if not data.startswith(self._first_name, _FIRST_NAME):
            return None
        values: Any = self.struct.unpack(data)
        names = [values[0]]
        for i in self._starts:
            names += values[i + 2:i + 4]
        if (*names,) != self._names:
            return None
        return [
            Sample(parent, child, values[i] * NANOSECONDS_PER_SECOND + values[i + 1],
                   values[i + 4:i + 11])
            for i, (parent, child) in zip(self._starts, self._edges, strict=True)
        ]


def read(data: bytes) -> list[Sample]:
    """
    Return the transforms of one serialized TFMessage; for many, keep a ``WireReader``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return _read_fields(data)[0]


def _read_fields(data: bytes) -> tuple[list[Sample], _Layout]:
    """Read a message field by field, and note how it lay."""
    order = _BYTE_ORDERS.get(bytes(data[:2]))
    if order is None:
        raise WireError(f'not CDR: it begins with the bytes {bytes(data[:4]).hex(" ")}')
    cursor = _Cursor(data, order)
    (count,) = cursor.take('I', 4)
    if count * _MIN_TRANSFORM_BYTES > len(data):
        raise WireError(f'{len(data)} bytes cannot hold {count} transforms')
    samples, names = [], []
    for _ in range(count):
        sec, nanosec = cursor.take('iI', 4)
        parent, parent_bytes = cursor.take_string()
        gap = cursor.align(4)
        child, child_bytes = cursor.take_string()
        rest = cursor.align(8)
        pose: PoseTuple = cursor.take('7d', 8)
        samples.append(Sample(parent, child, sec * NANOSECONDS_PER_SECOND + nanosec, pose))
        names.append((parent_bytes, gap, child_bytes, rest))
    padding = len(data) - cursor.position
    if padding > _MAX_PADDING:
        raise WireError(f'{padding} bytes are left over after {count} transforms')
    head = bytes(data[:8])
    edges = [(sample.parent, sample.child) for sample in samples]
    return samples, _Layout(head, order, names, edges, padding)


class _Cursor:
    """A place in the bytes, and how to read on from there."""

    def __init__(self, data: bytes, order: str) -> None:
        self.data = data
        self.order = order
        self.position = _ENCAPSULATION_BYTES

    def align(self, size: int) -> int:
        """Skip to a multiple of a size, and return how many bytes that took."""
        gap = -(self.position - _ENCAPSULATION_BYTES) % size
        self.position += gap
        return gap

    def take(self, fields: str, alignment: int) -> Any:
        """Read numbers, given as struct's letters."""
        self.align(alignment)
        begin = self.position
        try:
            values = struct.unpack_from(self.order + fields, self.data, begin)
        except struct.error:
            raise WireError(f'truncated at byte {begin} of {len(self.data)}') from None
        self.position += struct.calcsize(self.order + fields)
        return values

    def take_string(self) -> tuple[str, bytes]:
        """Read a string; return it, and its bytes with the length in front."""
        (length,) = self.take('I', 4)
        begin, end = self.position, self.position + length
        if end > len(self.data):
            raise WireError(f'a name of {length} bytes at byte {begin} of {len(self.data)}')
        text = bytes(self.data[begin:end])
        if length and text[-1]:
            raise WireError(f'the name at byte {begin} does not end with NUL')
        self.position = end
        try:
            return text[:-1].decode(), bytes(self.data[begin - 4:end])
        except UnicodeDecodeError:
            raise WireError(f'the name at byte {begin} is not UTF-8: {text!r}') from None
