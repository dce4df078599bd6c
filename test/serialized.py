"""
A TFMessage as CDR bytes, in either byte order, as other publishers send it.

It shares no code with ``core.arrivals.wire``: a fault there must not be made here too.
"""

import struct


def serialize(transforms, order='<'):
    """Write (parent, child, sec, nanosec, pose) as CDR, field by field."""
    data = bytearray()

    def align(size):
        data.extend(bytes(-len(data) % size))

    def string(text):
        encoded = text.encode() + b'\0'
        align(4)
        data.extend(struct.pack(order + 'I', len(encoded)) + encoded)

    data.extend(struct.pack(order + 'I', len(transforms)))
    for parent, child, sec, nanosec, pose in transforms:
        align(4)
        data.extend(struct.pack(order + 'iI', sec, nanosec))
        string(parent)
        string(child)
        align(8)
        data.extend(struct.pack(order + '7d', *pose))
    return (b'\0\1\0\0' if order == '<' else b'\0\0\0\0') + bytes(data)
