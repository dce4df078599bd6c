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
ROS 1 bags without an index, record by record.

The format: http://wiki.ros.org/Bags/Format/2.0. A record is a header of fields and its
data, each behind its length; chunks hold records.
"""

import bz2
from collections.abc import Iterator
from pathlib import Path
import struct

from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import MessageDefinition

from .rosbags_file import UNREADABLE
from .salvage import Bytes, Cut, definition, lost_bytes, mapped
from .source import Arrival, Source

_MAGIC = b'#ROSBAG V2.0\n'
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7


class Ros1Scan:
    """Reads one file; see ``Scan``."""

    def __init__(self, path: Path) -> None:
        """
        Begin with nothing read.

        :raises ValueError: it is no bag of ROS 1.
        """
        self._data = mapped(path, _MAGIC, 'a bag of ROS 1')
        self.definitions: dict[Source, MessageDefinition] = {}
        self.lost = ''
        self._connections: dict[int, Source] = {}
        self._lost_bytes = 0

    def __iter__(self) -> Iterator[Arrival]:
        """Yield every message, in the order in which they stand in the file."""
        file = Bytes(self._data)
        file.take(len(_MAGIC))
        yield from self._records(file)
        self.lost = lost_bytes(self._lost_bytes, len(self._data))

    def _records(self, data: Bytes) -> Iterator[Arrival]:
        while data:
            begin = data.position
            try:
                header, length = _fields(Bytes(data.sized())), data.number('I')
                kind = header['op'][0]
                content = data.take(min(length, data.left))
                if kind == _CHUNK:
                    yield from self._chunk(header['compression'], content)
                if length > len(content):
                    raise Cut
                if kind == _CONNECTION:
                    self._connect(header, _fields(Bytes(content)))
                elif kind == _MESSAGE:
                    yield from self._message(header, content)
            except (Cut, LookupError):
                self._lost_bytes += len(data.data) - begin
                return

    def _chunk(self, compression: bytes, packed: memoryview) -> Iterator[Arrival]:
        """Yield the messages of a chunk, or of the first part of it that is there."""
        try:
            unpacked = _unpack(compression, packed)
        except UNREADABLE:
            self._lost_bytes += len(packed)
            return
        yield from self._records(Bytes(memoryview(unpacked)))

    def _connect(self, header: dict[str, bytes], fields: dict[str, bytes]) -> None:
        package, _, name = fields['type'].decode().rpartition('/')
        source = Source(
            header['topic'].decode(), f'{package.removesuffix("/msg")}/msg/{name}',
            fields.get('latching') == b'1', fields.get('callerid', b'').decode(), True)
        self._connections[_number(header['conn'])] = source
        self.definitions[source] = definition(fields['message_definition'].decode())

    def _message(self, header: dict[str, bytes], content: memoryview) -> Iterator[Arrival]:
        sec, nanosec = struct.unpack('<II', header['time'])
        source = self._connections.get(_number(header['conn']))
        if source is not None:
            yield Arrival(sec * 1_000_000_000 + nanosec, source, bytes(content))


def _fields(header: Bytes) -> dict[str, bytes]:
    fields = {}
    while header:
        name, _, value = bytes(header.sized()).partition(b'=')
        fields[name.decode(errors='replace')] = value
    return fields


def _number(field: bytes) -> int:
    return int.from_bytes(field, 'little')


def _unpack(compression: bytes, packed: memoryview) -> bytes | memoryview:
    """Return as much of a chunk as can be decompressed."""
    if compression == b'bz2':
        return bz2.BZ2Decompressor().decompress(packed)
    if compression == b'lz4':
        return bytes(LZ4FrameDecompressor().decompress(packed))
    return packed
