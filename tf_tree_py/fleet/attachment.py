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
What rmw_zenoh attaches to each message: its number, when it was sent, and by whom.

In Zenoh's serialization three names, each followed by its value. Source:
``attachment_helpers.cpp`` of rmw_zenoh.
"""

import struct
from typing import NamedTuple

# A text and the bytes of an id begin with their length.
_LAYOUT = struct.Struct('<16sq17sq11s17s')
_NAMES = b'\x0fsequence_number', b'\x10source_timestamp', b'\x0asource_gid'


class Attachment(NamedTuple):
    """
    What is attached to a message.

    :ivar number: one more than that of the publisher's message before.
    :ivar sent: nanoseconds since 1970 by the sender's clock.
    :ivar gid: of the publisher, in hexadecimal digits.
    """

    number: int
    sent: int
    gid: str


def read_attachment(data: bytes) -> Attachment | None:
    """Return what is attached; None: it is something else."""
    if len(data) != _LAYOUT.size:
        return None
    first, number, second, sent, third, gid = _LAYOUT.unpack(data)
    return Attachment(number, sent, gid[1:].hex()) if (first, second, third) == _NAMES else None


def write_attachment(attachment: Attachment) -> bytes:
    """Return the bytes of an attachment."""
    gid = bytes.fromhex(attachment.gid)
    return _LAYOUT.pack(_NAMES[0], attachment.number, _NAMES[1], attachment.sent, _NAMES[2],
                        bytes([len(gid)]) + gid)
