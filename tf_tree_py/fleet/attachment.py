# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The data that rmw_zenoh attaches to each message: its number, the time of sending, the sender.

In Zenoh's serialization these are three names, each followed by its value. Source:
``attachment_helpers.cpp`` of rmw_zenoh.
"""

import struct
from typing import NamedTuple

# A text and the bytes of an id begin with their length.
_LAYOUT = struct.Struct('<16sq17sq11s17s')
_NAMES = b'\x0fsequence_number', b'\x10source_timestamp', b'\x0asource_gid'


class Attachment(NamedTuple):
    """
    The data attached to a message.

    :ivar number: one more than that of the publisher's previous message.
    :ivar sent: nanoseconds since 1970 by the sender's clock.
    :ivar gid: of the publisher, in hexadecimal digits.
    """

    number: int
    sent: int
    gid: str


def read_attachment(data: bytes) -> Attachment | None:
    """Return the attached data; None: it is something else."""
    if len(data) != _LAYOUT.size:
        return None
    first, number, second, sent, third, gid = _LAYOUT.unpack(data)
    return Attachment(number, sent, gid[1:].hex()) if (first, second, third) == _NAMES else None
