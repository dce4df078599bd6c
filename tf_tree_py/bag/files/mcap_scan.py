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
MCAP files without an end, record by record.

The format: https://mcap.dev/spec. A record is its kind (one byte), its length (uint64)
and its content; chunks hold records, mostly compressed.
"""

from collections.abc import Iterator
from pathlib import Path
import zlib

from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import MessageDefinition, Qos
from rosbags.rosbag2.metadata import parse_qos

from .rosbags_file import (
    decompressor,
    is_reliable,
    is_transient_local,
    is_volatile,
    UNREADABLE,
)
from .salvage import Bytes, Cut, definition, lost_bytes, mapped
from .source import Arrival, Source

_MAGIC = b'\x89MCAP0\r\n'
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 2, 3, 4, 5, 6, 15
# The last record, and the magic word behind it.
_FOOTER_BYTES = 9 + 20 + len(_MAGIC)


class McapScan:
    """Reads one file; see ``Scan``."""

    def __init__(self, path: Path) -> None:
        """
        Begin with nothing read.

        :raises ValueError: it is no MCAP file.
        """
        self._data = mapped(path, _MAGIC, 'MCAP')
        self.definitions: dict[Source, MessageDefinition] = {}
        self.lost = ''
        self._schemas: dict[int, tuple[str, MessageDefinition]] = {}
        self._channels: dict[int, Source] = {}
        self._lost_bytes = 0
        self._ended = False

    def __iter__(self) -> Iterator[Arrival]:
        """Yield every message, in the order in which they stand in the file."""
        self._read_summary()
        file = Bytes(self._data)
        file.take(len(_MAGIC))
        yield from self._records(file)
        self.lost = lost_bytes(self._lost_bytes, len(self._data), self._ended)

    def _read_summary(self) -> None:
        """Read what the end of a whole file tells of its topics: their chunk may be damaged."""
        footer = Bytes(self._data[-_FOOTER_BYTES:])
        if self._data[-len(_MAGIC):] != _MAGIC or footer.number('B') != _FOOTER:
            return
        footer.take(8)
        summary = Bytes(self._data)
        summary.position = footer.number('Q') or len(self._data)
        try:
            while summary:
                kind = summary.number('B')
                self._describe(kind, Bytes(summary.take(summary.number('Q'))))
        except Cut:  # the magic word, which is no record
            return

    def _records(self, data: Bytes) -> Iterator[Arrival]:
        while data:
            begin = data.position
            try:
                kind, length = data.number('B'), data.number('Q')
                if kind == _DATA_END:
                    self._ended = True
                    return
                content = Bytes(data.take(min(length, data.left)))
                if kind == _CHUNK:
                    yield from self._chunk(content)
                if length > len(content.data):
                    raise Cut
                if kind == _MESSAGE:
                    yield from self._message(content)
                else:
                    self._describe(kind, content)
            except Cut:
                self._lost_bytes += len(data.data) - begin
                return

    def _chunk(self, chunk: Bytes) -> Iterator[Arrival]:
        """Yield the messages of a chunk, or of the first part of it that is there."""
        begin = chunk.position
        chunk.take(8 + 8 + 8)  # times of the first and last message, size
        checksum, compression, length = chunk.number('I'), chunk.text(), chunk.number('Q')
        packed = chunk.take(min(length, chunk.left))
        try:
            unpacked = _unpack(compression, packed)
            if checksum and len(packed) == length and zlib.crc32(unpacked) != checksum:
                raise ValueError('the checksum of a chunk is wrong')
        except UNREADABLE:
            self._lost_bytes += chunk.position - begin
            return
        yield from self._records(Bytes(memoryview(unpacked)))

    def _describe(self, kind: int, content: Bytes) -> None:
        if kind == _SCHEMA:
            number, name, encoding = content.number('H'), content.text(), content.text()
            self._schemas[number] = name, definition(content.text(), encoding)
        elif kind == _CHANNEL:
            number, schema = content.number('H'), content.number('H')
            topic, encoding = content.text(), content.text()
            name, fields = self._schemas.get(schema, ('', definition('', '')))
            profiles = _profiles(Bytes(content.sized()))
            source = Source(topic, name, is_transient_local(profiles), '', encoding == 'ros1',
                            is_reliable(profiles), is_volatile(profiles))
            self._channels[number] = source
            self.definitions[source] = fields

    def _message(self, content: Bytes) -> Iterator[Arrival]:
        source = self._channels.get(content.number('H'))
        content.take(4)  # a sequence number
        received = content.number('Q')
        content.take(8)  # when it was published
        if source is not None:
            yield Arrival(received, source, bytes(content.take(content.left)))


def _profiles(metadata: Bytes) -> list[Qos]:
    """Return the quality of service that a channel's publishers offered."""
    while metadata:
        name, value = metadata.text(), metadata.text()
        if name == 'offered_qos_profiles':
            return parse_qos(value)
    return []


def _unpack(compression: str, packed: memoryview) -> bytes | memoryview:
    """Return as much of a chunk as can be decompressed."""
    if compression == 'zstd':
        return decompressor().decompress(packed)
    if compression == 'lz4':
        return bytes(LZ4FrameDecompressor().decompress(packed))
    if compression:
        raise ValueError(f'a chunk is compressed with {compression}')
    return packed
