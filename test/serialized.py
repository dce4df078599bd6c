# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A TFMessage as CDR bytes, in either byte order, as other publishers send it; and as ROS 1's.

It shares no code with ``core.messages.message_layout``, so that it cannot repeat a fault there.
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


def serialize_ros1(transforms):
    """Write (parent, child, sec, nanosec, pose) in ROS 1's format, field by field."""
    data = bytearray(struct.pack('<I', len(transforms)))
    for seq, (parent, child, sec, nanosec, pose) in enumerate(transforms):
        data += struct.pack('<III', 1_000_000 + seq, sec, nanosec)
        for text in (parent, child):
            encoded = text.encode()
            data += struct.pack('<I', len(encoded)) + encoded
        data += struct.pack('<7d', *pose)
    return bytes(data)
