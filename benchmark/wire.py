"""A TFMessage as a publisher's middleware writes it: CDR, little endian."""

from collections.abc import Sequence
import struct

from .motion import Edge, Pose, pose_at


def message_at(edges: Sequence[Edge], sample: int) -> bytes:
    """Return the bytes of one message with the samples of these edges."""
    stamps = [edge.stamp_of(sample) for edge in edges]
    return message(edges, stamps, list(map(pose_at, edges, stamps)))


def message(edges: Sequence[Edge], stamps: Sequence[int], poses: Sequence[Pose]) -> bytes:
    """Return the bytes of one message."""
    data = bytearray(b'\x00\x01\x00\x00' + struct.pack('<I', len(edges)))
    for edge, stamp, pose in zip(edges, stamps, poses, strict=True):
        data += struct.pack('<iI', *divmod(stamp, 1_000_000_000))
        for name in edge.parent, edge.child:
            _align(data, 4)
            data += struct.pack('<I', len(name) + 1) + name.encode() + b'\x00'
        _align(data, 8)
        data += struct.pack('<7d', *pose)
        _align(data, 4)
    return bytes(data)


def _align(data: bytearray, size: int) -> None:
    # Relative to the byte after the encapsulation.
    data += bytes(-(len(data) - 4) % size)
