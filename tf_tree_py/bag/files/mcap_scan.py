# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads MCAP files that rosbags refuses, record by record: those without an end, or not of ROS 2.

The format: https://mcap.dev/spec. A record is its opcode (one byte), its length (uint64) and its
content; chunks hold records, mostly compressed.
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
import zlib

from rosbags.interfaces import MessageDefinition
from tf_tree_py.core.stamp import FOREVER

from .connections import Connection, RecordedMessage, ROS1, too_large, unpacked_limit
from .rosbags_file import profiles_of, ros2_connection, UNREADABLE
from .scanning import Bytes, Cut, definition, NotOfRos2, RecordScan, ros1_type
from .unpacking import unpacked_part

_MAGIC = b'\x89MCAP0\r\n'
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 1, 2, 3, 4, 5, 6, 15
# Times have 64 bits without a sign, those of this package a sign.
_LAST = FOREVER - 1
# The last record, and the magic bytes after it.
_FOOTER_BYTES = 9 + 20 + len(_MAGIC)


class McapScan(RecordScan):
    """Reads one file."""

    def __init__(self, path: Path) -> None:
        """
        Open the file, and read nothing yet.

        :raises ValueError: it is not an MCAP file.
        """
        super().__init__(path, _MAGIC, 'MCAP')
        self._schemas: dict[int, tuple[str, MessageDefinition]] = {}
        self._channels: dict[int, Connection] = {}

    def check_sizes(self) -> None:
        """
        Check the sizes that the headers of the chunks declare.

        :raises TooLarge: one of them exceeds the limit.
        """
        file = self._file()
        try:
            while file:
                opcode, length = file.number('B'), file.number('Q')
                content = Bytes(file.read(length))
                if opcode == _DATA_END:
                    return
                if opcode == _CHUNK:
                    content.read(8 + 8)
                    if content.number('Q') > unpacked_limit(length):
                        raise too_large('a chunk', length)
        except Cut:
            return

    def check_is_of_ros2(self) -> None:
        """
        Check that the file is of ROS 2: its profile, and the encodings of the known topics.

        :raises NotOfRos2: the profile is another one, such as that of a converted ROS 1 bag, or
            none; or a topic is in another encoding, because of which rosbags refuses the file.
        """
        file = self._file()
        try:
            opcode, length = file.number('B'), file.number('Q')
            profile = Bytes(file.read(length)).text()
        except Cut:
            return
        if opcode == _HEADER and profile != 'ros2':
            raise NotOfRos2(f"its profile is {profile!r}, not 'ros2'")
        self._read_summary()
        for connection in self._channels.values():
            if not connection.is_of_ros:
                raise NotOfRos2(f'{connection.topic} is in {connection.encoding}')

    def _read_summary(self) -> None:
        footer = Bytes(self._data[-_FOOTER_BYTES:])
        if self._data[-len(_MAGIC):] != _MAGIC or footer.number('B') != _FOOTER:
            return
        footer.read(8)
        summary = Bytes(self._data)
        summary.position = footer.number('Q') or len(self._data)
        try:
            while summary:
                opcode = summary.number('B')
                if not opcode:
                    return  # not a record; gigabytes of zeros are not searched
                self._describe(opcode, Bytes(summary.read(summary.number('Q'))))
        except Cut:  # the magic bytes, which are not a record
            return

    def _records(self, data: Bytes, *, in_chunk: bool = False) -> Iterator[RecordedMessage]:
        while data:
            begin = data.position
            try:
                opcode, length = data.number('B'), data.number('Q')
                if not opcode:
                    raise Cut  # not a record; gigabytes of zeros are not searched
                if opcode == _DATA_END:
                    self._ended = True
                    return
                content = Bytes(data.read(min(length, data.left)))
                if opcode == _CHUNK:
                    yield from self._chunk(content)
                if length > len(content.data):
                    if not in_chunk:  # the chunk is counted itself
                        self._more_bytes += length - len(content.data)
                    if opcode == _CHUNK:
                        return
                    raise Cut
                if opcode == _MESSAGE:
                    yield from self._message(content)
                else:
                    self._describe(opcode, content)
            except Cut:
                data.position = begin
                return

    def _chunk(self, chunk: Bytes) -> Iterator[RecordedMessage]:
        """Yield the messages of a chunk, or of the part of it that exists."""
        begin = chunk.position
        chunk.read(8 + 8 + 8)  # times of the first and last message, size
        checksum, compression, length = chunk.number('I'), chunk.text(), chunk.number('Q')
        packed = chunk.read(min(length, chunk.left))
        try:
            unpacked, used = unpacked_part(compression, packed)
            if checksum and len(packed) == length and zlib.crc32(unpacked) != checksum:
                raise ValueError('the checksum of a chunk is wrong')
        except UNREADABLE:
            self._lost_bytes += chunk.position - begin
            return
        yield from self._records_in_chunk(len(packed), used, unpacked)

    def _describe(self, opcode: int, content: Bytes) -> None:
        if opcode == _SCHEMA:
            number, name, encoding = content.number('H'), content.text(), content.text()
            self._schemas[number] = name, definition(content.text(), encoding)
        elif opcode == _CHANNEL:
            number, schema = content.number('H'), content.number('H')
            topic, encoding = content.text(), content.text()
            name, fields = self._schemas.get(schema, ('', definition('', '')))
            metadata = _metadata(Bytes(content.sized()))
            if encoding == ROS1:
                connection = Connection(topic, ros1_type(name),
                                        metadata.get('latching') in ('1', 'true'),
                                        metadata.get('callerid', ''), ROS1)
            else:
                connection = ros2_connection(
                    topic, name, profiles_of(metadata.get('offered_qos_profiles', '')), encoding)
            self._channels[number] = connection
            self.definitions[connection] = fields

    def _message(self, content: Bytes) -> Iterator[RecordedMessage]:
        connection = self._channels.get(content.number('H'))
        content.read(4)  # a sequence number
        received = min(content.number('Q'), _LAST)
        content.read(8)  # the time of publishing
        if connection is None:
            self._unknown_bytes += content.left
        else:
            yield RecordedMessage(received, connection, bytes(content.read(content.left)))


def _metadata(data: Bytes) -> dict[str, str]:
    """Return what a channel says about its publishers, as far as it can be read."""
    found: dict[str, str] = {}
    with suppress(Cut):
        while data:
            name, value = data.text(), data.text()
            found[name] = value
    return found
