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

"""Bag files as rosbags reads them; what it refuses, and what goes wrong in the middle."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
import shutil
import sqlite3
import struct
import sys
from tempfile import TemporaryDirectory
from typing import Any

import apsw
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag1,
    MessageDefinition,
    MessageDefinitionFormat,
    Nodetype,
    Qos,
    QosDurability,
    QosReliability,
)
from rosbags.rosbag1 import Reader as Reader1, ReaderError as Reader1Error
from rosbags.rosbag2 import Reader as Reader2, ReaderError as Reader2Error
from rosbags.typesys import (
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
    Stores,
    TypesysError,
)

from .finding import PACKED
from .source import Arrival, Scan, Source

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

_ZSTD = b'\x28\xb5\x2f\xfd'
"""How what zstd has compressed begins; no message of ROS does."""

decompressor = zstd.ZstdDecompressor
"""Decompresses what zstd compressed, or the first part of it."""

UNREADABLE = (Reader1Error, Reader2Error, apsw.Error, zstd.ZstdError, struct.error, sqlite3.Error,
              OSError, EOFError, RuntimeError, ValueError, TypeError, LookupError, AssertionError,
              OverflowError)
"""What rosbags, and what it is built on, raise where a file is not as it should be."""


class RosbagsFile:
    """One file, whole and with an index."""

    def __init__(self, path: Path, scan: Callable[[Path], Scan]) -> None:
        """
        Open it.

        :param scan: reads the rest of a file that turns out to be damaged in the middle.
        :raises Exception: one of ``UNREADABLE``.
        """
        self.path = path
        self._scan = scan
        self.damage: list[str] = []
        self._unpacked = TemporaryDirectory() if path.suffix == PACKED else None
        if self._unpacked is not None:
            path = _unpacked(path, Path(self._unpacked.name))
        self._file = path
        self._reader: Any = Reader1(path) if path.suffix == '.bag' else Reader2(path)
        self._reader.open()
        # A ROS 1 node that was started again has a second connection, of the same source.
        self._source_of = {each.id: _source(each) for each in self._reader.connections}
        self.counts: Counter[Source] = Counter()
        for each in self._reader.connections:
            self.counts[self._source_of[each.id]] += each.msgcount
        self.span = int(self._reader.start_time), int(self._reader.end_time)

    def arrivals(self, sources: Collection[Source], start: int | None,
                 stop: int | None) -> Iterator[Arrival]:
        """Yield the messages of some of its sources, as they were received."""
        connections = [each for each in self._reader.connections
                       if self._source_of[each.id] in sources]
        if not connections:
            return
        source_of, given, received = self._source_of, 0, None
        # What the class itself does to make one, without its checks: there are millions.
        make = partial(tuple.__new__, Arrival)
        try:
            for connection, received, data in self._reader.messages(connections, start, stop):
                if data.startswith(_ZSTD):
                    data = _decompressed(data)
                yield make((received, source_of[connection.id], data))
                given += 1
        except UNREADABLE as error:
            expected = sum(each.msgcount for each in connections)
            rest = salvaged(self._scan(self._file), sources,
                            start if received is None else received + 1, stop)
            for arrival in rest:
                yield arrival
                given += 1
            self.damage.append(f'{self.path.name} is damaged ({error}): {given} of {expected} '
                               'messages could be read')

    def first_field(self, source: Source) -> str:
        """Return the type of the first field of a source's messages; '' if it is not known."""
        return next((first_field_of(source, connection.msgdef)
                     for connection in self._reader.connections
                     if self._source_of[connection.id] == source), '')

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
        if self._unpacked is not None:
            self._unpacked.cleanup()


def salvaged(scan: Iterable[Arrival], sources: Collection[Source], start: int | None,
             stop: int | None) -> Iterator[Arrival]:
    """Yield what a scan finds of some sources, in a stretch of time; see ``Storage``."""
    for arrival in scan:
        if (arrival.source in sources and (start is None or arrival.received >= start)
                and (stop is None or arrival.received < stop)):
            yield arrival._replace(data=_decompressed(arrival.data))


def _decompressed(data: bytes) -> bytes:
    """Return a message that the recorder may have compressed, and a damaged one as it is."""
    try:
        return zstd.decompress(data) if data.startswith(_ZSTD) else data
    except zstd.ZstdError:
        return data


def _unpacked(path: Path, folder: Path) -> Path:
    """Decompress a file into a folder, and return it."""
    target = folder / path.stem
    with zstd.open(path) as packed, target.open('wb') as unpacked:
        shutil.copyfileobj(packed, unpacked)
    return target


def first_field_of(source: Source, definition: MessageDefinition) -> str:
    """Return the type of a message's first field; old bags have no definitions of messages."""
    try:
        if definition.format is MessageDefinitionFormat.MSG:
            types = get_types_from_msg(definition.data, source.type_name)
        elif definition.format is MessageDefinitionFormat.IDL:
            types = get_types_from_idl(definition.data.split('\n', 2)[-1])
        else:
            types = get_typestore(Stores.ROS2_JAZZY).fielddefs
    except TypesysError:
        return ''
    _, fields = types.get(source.type_name, ([], []))
    if not fields:
        return ''
    kind, of = fields[0][1]
    return str(of if kind is Nodetype.NAME else of[0] if kind is Nodetype.BASE else 'a sequence')


def _source(connection: Connection) -> Source:
    extension = connection.ext
    if isinstance(extension, ConnectionExtRosbag1):
        return Source(connection.topic, connection.msgtype, bool(extension.latching),
                      extension.callerid or '', True)
    profiles = extension.offered_qos_profiles
    return Source(connection.topic, connection.msgtype, is_transient_local(profiles), '',
                  extension.serialization_format == 'ros1', is_reliable(profiles),
                  is_volatile(profiles))


def is_transient_local(profiles: Sequence[Qos]) -> bool:
    """Return whether all publishers of a topic keep what they sent for those who come late."""
    return bool(profiles) and all(
        profile.durability is QosDurability.TRANSIENT_LOCAL for profile in profiles)


def is_reliable(profiles: Sequence[Qos]) -> bool:
    """Return whether all publishers of a topic send reliably, as far as that was recorded."""
    return all(profile.reliability is not QosReliability.BEST_EFFORT for profile in profiles)


def is_volatile(profiles: Sequence[Qos]) -> bool:
    """Return whether a publisher of a topic said that it keeps nothing for late listeners."""
    return any(profile.durability is QosDurability.VOLATILE for profile in profiles)
