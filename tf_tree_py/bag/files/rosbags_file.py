# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Bag files that rosbags reads; a scan reads the rest of a file that is damaged in the middle.

rosbags has no limit on unpacking chunks; here they have one.
"""

import bz2
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
import sqlite3
import struct

import apsw
from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import (
    Connection as RosbagsConnection,
    ConnectionExtRosbag1,
    MessageDefinition,
    MessageDefinitionFormat,
    Nodetype,
    Qos,
    QosDurability,
    QosReliability,
)
from rosbags.rosbag1 import Reader as Reader1, reader as rosbag1, ReaderError as Reader1Error
from rosbags.rosbag2 import Reader as Reader2, ReaderError as Reader2Error, storage_mcap
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import (
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
    Stores,
    TypesysError,
)
from tf_tree_py.core.errors import warn
from tf_tree_py.core.stamp import FOREVER, format_stamp

from .connections import (
    CDR,
    Connection,
    RecordedMessage,
    ROS1,
    Scan,
    too_large,
    unpacked_limit,
    VARIABLE,
)
from .unpacking import Decompressor, PlainFile, zstd


def _limit_chunks(reader: rosbag1.Reader) -> None:
    """Make an open reader of ROS 1 raise TooLarge for a chunk beyond the limit."""
    limited = {rosbag1.decompressors[name]: _limited(make) for name, make in (
        ('bz2', bz2.BZ2Decompressor), ('lz4', LZ4FrameDecompressor))}
    for position, chunk in reader.chunks.items():
        reader.chunks[position] = chunk._replace(
            decompressor=limited.get(chunk.decompressor, chunk.decompressor))


def _limited(make: Callable[[], Decompressor]) -> Callable[[bytes], bytes]:
    def unpack(packed: bytes) -> bytes:
        limit = unpacked_limit(len(packed))
        unpacked = unpacked_up_to(packed, make, limit)
        if len(unpacked) > limit:
            raise too_large('a chunk', len(packed))
        return unpacked
    return unpack


def _as_said(make: Callable[[], Decompressor]) -> Callable[[bytes, int], bytes]:
    """Return a function that unpacks a chunk of MCAP up to the size in its header."""
    def unpack(packed: bytes, size: int) -> bytes:
        return unpacked_up_to(packed, make, min(size, unpacked_limit(len(packed))))
    return unpack


def unpacked_up_to(packed: bytes, make: Callable[[], Decompressor], limit: int) -> bytes:
    """Unpack one or several frames, but at most one byte more than a limit."""
    parts, left = [], limit + 1
    while packed and left > 0:
        reader = make()
        parts.append(reader.decompress(packed, max_length=left))
        left -= len(parts[-1])
        if not reader.eof and left > 0:
            raise EOFError('a chunk ends too soon')
        packed = reader.unused_data if reader.eof else b''
    return b''.join(parts)


def limit_mcap(table: dict[str, object] | None) -> None:
    """
    Make rosbags unpack chunks of MCAP up to the size in their headers, and a limit.

    The only place for that is rosbags' own table. rosbags refuses a chunk of another size than in
    its header, so other users of rosbags get the same results, only without the memory for the
    rest.

    :param table: of rosbags; None: a version without one, which causes a warning.
    """
    if table is None:
        warn(f'rosbags {version("rosbags")} has no place for a limit on chunks of MCAP: they are '
             f'unpacked whole, and {VARIABLE} has no effect on them. rosbags 0.11 has one',
             RuntimeWarning)
        return
    table.update(zstd=_as_said(zstd.ZstdDecompressor), lz4=_as_said(LZ4FrameDecompressor))


limit_mcap(getattr(storage_mcap, 'DECOMPRESSORS', None))


# --- the files

_ZSTD = b'\x28\xb5\x2f\xfd'
"""The first bytes of zstd data; no message of ROS begins with them."""

UNREADABLE = (Reader1Error, Reader2Error, apsw.Error, zstd.ZstdError, struct.error, sqlite3.Error,
              OSError, EOFError, RuntimeError, ValueError, TypeError, LookupError, AssertionError,
              OverflowError, MemoryError)
"""The errors that rosbags and its dependencies raise for an invalid file."""


class RosbagsFile:
    """One intact file with an index."""

    def __init__(self, file: PlainFile, scan: Callable[[Path], Scan]) -> None:
        """
        Open it.

        :param scan: reads the rest of a file that turns out to be damaged in the middle.
        :raises Exception: one of ``UNREADABLE``.
        """
        self._file = file
        self._scan = scan
        self.damage: list[str] = []
        reader = Reader1 if file.path.suffix == '.bag' else Reader2
        self._reader: Reader1 | Reader2 = reader(file.path)
        self._reader.open()
        if isinstance(self._reader, Reader1):
            _limit_chunks(self._reader)
        # A ROS 1 node that was restarted has a second one, which is the same here.
        self._connection_of = {each.id: _connection(each) for each in self._reader.connections}
        self.counts: Counter[Connection] = Counter()
        self.definitions: dict[Connection, MessageDefinition] = {}
        for each in self._reader.connections:
            self.counts[self._connection_of[each.id]] += each.msgcount
            self.definitions[self._connection_of[each.id]] = each.msgdef
        self.span = int(self._reader.start_time), int(self._reader.end_time)

    def arrivals(self, connections: Collection[Connection], start: int | None,
                 stop: int | None) -> Iterator[RecordedMessage]:
        """Yield the messages of some of its connections, in order of arrival."""
        chosen = [each for each in self._reader.connections
                  if self._connection_of[each.id] in connections]
        if not chosen:
            return
        connection_of, given, received = self._connection_of, 0, None
        # The constructor of the class, without its checks: there are millions of messages.
        make = partial(tuple.__new__, RecordedMessage)
        try:
            for each, stamp, data in self._reader.messages(chosen, start, stop):
                # SQLite returns any type, and times of MCAP may exceed 63 bits.
                if type(data) is not bytes or type(stamp) is not int or stamp >= FOREVER:
                    raise ValueError('a message is damaged')
                received = stamp
                if data.startswith(_ZSTD):
                    data = _decompressed(data)
                yield make((received, connection_of[each.id], data))
                given += 1
        except UNREADABLE as error:
            expected = sum(each.msgcount for each in chosen)
            rest = salvaged(self._scan(self._file.path), connections,
                            start if received is None else received + 1, stop)
            behind: int | None = None
            for arrival in rest:
                behind = arrival.received if behind is None else behind
                yield arrival
                given += 1
            self.damage.append(
                f'{self._file.name} is damaged ({self._file.reason(error)}): {given} of '
                f'{expected} messages could be read{_hole(received, behind)}')

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
        self._file.close()


def salvaged(scan: Iterable[RecordedMessage], connections: Collection[Connection],
             start: int | None, stop: int | None) -> Iterator[RecordedMessage]:
    """Yield the messages of some connections in a scan, in a time range; see ``Storage``."""
    for arrival in scan:
        if (arrival.connection in connections and (start is None or arrival.received >= start)
                and (stop is None or arrival.received < stop)):
            yield arrival._replace(data=_decompressed(arrival.data))


def _hole(before: int | None, behind: int | None) -> str:
    """Return in words which time range is missing; None: from the start, or to the end."""
    since = '' if before is None else f' after {format_stamp(before)} s'
    until = '' if behind is None else f' before {format_stamp(behind)} s'
    both = since + (' and' if since and until else '') + until
    return f'; what is missing was received{both}' if both else ''


def _decompressed(data: bytes) -> bytes:
    """Return a message that the recorder may have compressed; a damaged one is unchanged."""
    try:
        if not data.startswith(_ZSTD):
            return data
        reader = zstd.ZstdDecompressor()
        unpacked = reader.decompress(data, max_length=unpacked_limit(len(data)))
        return unpacked if reader.eof else data
    except zstd.ZstdError:
        return data


def first_field_of(connection: Connection, definition: MessageDefinition) -> str:
    """Return the type of a message's first field; old bags have no message definitions."""
    try:
        if definition.format is MessageDefinitionFormat.MSG:
            types = get_types_from_msg(definition.data, connection.type_name)
        elif definition.format is MessageDefinitionFormat.IDL:
            types = get_types_from_idl(definition.data.split('\n', 2)[-1])
        else:
            types = get_typestore(Stores.ROS2_JAZZY).fielddefs
    except TypesysError:
        return ''
    _, fields = types.get(connection.type_name, ([], []))
    if not fields:
        return ''
    node, of = fields[0][1]
    return str(of if node is Nodetype.NAME else of[0] if node is Nodetype.BASE else 'a sequence')


def _connection(theirs: RosbagsConnection) -> Connection:
    extension = theirs.ext
    if isinstance(extension, ConnectionExtRosbag1):
        return Connection(theirs.topic, theirs.msgtype, bool(extension.latching),
                          extension.callerid or '', ROS1)
    return ros2_connection(theirs.topic, theirs.msgtype, extension.offered_qos_profiles,
                           extension.serialization_format)


def profiles_of(text: str) -> list[Qos]:
    """Return the quality of service that publishers offered; none if it cannot be read."""
    try:
        return list(parse_qos(text))
    except UNREADABLE:
        return []


def ros2_connection(topic: str, type_name: str, profiles: Sequence[Qos],
                    encoding: str = CDR) -> Connection:
    """
    Return a topic of rosbag2.

    :param profiles: the quality of service that its publishers offered, as far as it was recorded.
    :param encoding: of its messages, as the file names it.
    """
    durabilities = {profile.durability for profile in profiles}
    return Connection(
        topic, type_name, durabilities == {QosDurability.TRANSIENT_LOCAL}, '',
        encoding or CDR,
        all(profile.reliability is not QosReliability.BEST_EFFORT for profile in profiles),
        QosDurability.VOLATILE in durabilities)
