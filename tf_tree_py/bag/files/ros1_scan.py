# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads ROS 1 bags without an index, record by record.

The format: http://wiki.ros.org/Bags/Format/2.0. A record is a header of fields and its data, each
after its length; chunks hold records.
"""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
import struct

from .connections import Connection, RecordedMessage, ROS1
from .rosbags_file import UNREADABLE
from .scanning import Bytes, Cut, definition, RecordScan, ros1_type
from .unpacking import unpacked_part

_MAGIC = b'#ROSBAG V2.0\n'
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7


class Ros1Scan(RecordScan):
    """Reads one file."""

    def __init__(self, path: Path) -> None:
        """
        Open the file, and read nothing yet.

        :raises ValueError: it is not a bag of ROS 1.
        """
        super().__init__(path, _MAGIC, 'a bag of ROS 1')
        self._connections: dict[int, Connection] = {}

    def _read_summary(self) -> None:
        file = self._file()
        with suppress(Cut, LookupError, ValueError, struct.error):
            file.position = _number(_fields(Bytes(file.sized()))['index_pos']) or len(file.data)
            while file:
                header, content = _fields(Bytes(file.sized())), file.sized()
                if header['op'][0] != _CONNECTION:
                    return
                self._connect(header, _fields(Bytes(content)))

    def _records(self, data: Bytes, *, in_chunk: bool = False) -> Iterator[RecordedMessage]:
        while data:
            begin = data.position
            try:
                header, length = _fields(Bytes(data.sized())), data.number('I')
                opcode = header['op'][0]
                content = data.read(min(length, data.left))
                if opcode == _CHUNK:
                    yield from self._chunk(header['compression'], content)
                if length > len(content):
                    if not in_chunk:  # the chunk is counted itself
                        self._more_bytes += length - len(content)
                    if opcode == _CHUNK:
                        return
                    raise Cut
                if opcode == _CONNECTION:
                    self._connect(header, _fields(Bytes(content)))
                elif opcode == _MESSAGE:
                    yield from self._message(header, content)
            except (Cut, LookupError, ValueError, struct.error):
                data.position = begin
                return

    def _chunk(self, compression: bytes, packed: memoryview) -> Iterator[RecordedMessage]:
        """Yield the messages of a chunk, or of the part of it that exists."""
        try:
            unpacked, used = unpacked_part(compression.decode(errors='replace'), packed)
        except UNREADABLE:
            self._lost_bytes += len(packed)
            return
        yield from self._records_in_chunk(len(packed), used, unpacked)

    def _connect(self, header: dict[str, bytes], fields: dict[str, bytes]) -> None:
        connection = Connection(
            header['topic'].decode(), ros1_type(fields['type'].decode()),
            fields.get('latching') == b'1', fields.get('callerid', b'').decode(), ROS1)
        self._connections[_number(header['conn'])] = connection
        self.definitions[connection] = definition(fields['message_definition'].decode())

    def _message(self, header: dict[str, bytes], content: memoryview) -> Iterator[RecordedMessage]:
        sec, nanosec = struct.unpack('<II', header['time'])
        connection = self._connections.get(_number(header['conn']))
        if connection is None:
            self._unknown_bytes += len(content)
        else:
            yield RecordedMessage(sec * 1_000_000_000 + nanosec, connection, bytes(content))


def _fields(header: Bytes) -> dict[str, bytes]:
    fields = {}
    while header:
        name, _, value = bytes(header.sized()).partition(b'=')
        fields[name.decode(errors='replace')] = value
    return fields


def _number(field: bytes) -> int:
    return int.from_bytes(field, 'little')
