"""Bag files as rosbags reads them; what it refuses, and what goes wrong in the middle."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
import shutil
import struct
import sys
from tempfile import TemporaryDirectory
from typing import Any

import apsw
from rosbags.interfaces import Connection, ConnectionExtRosbag1, QosDurability, QosReliability
from rosbags.rosbag1 import Reader as Reader1, ReaderError as Reader1Error
from rosbags.rosbag2 import Reader as Reader2, ReaderError as Reader2Error

from .files import PACKED
from .source import Arrival, Source

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

_ZSTD = b'\x28\xb5\x2f\xfd'
"""How what zstd has compressed begins; no message of ROS does."""

UNREADABLE = (Reader1Error, Reader2Error, apsw.Error, zstd.ZstdError, struct.error, OSError,
              EOFError, RuntimeError, ValueError, TypeError, LookupError, AssertionError,
              OverflowError)
"""What rosbags, and what it is built on, raise where a file is not as it should be."""


class RosbagsFile:
    """One file, whole and with an index."""

    def __init__(self, path: Path) -> None:
        """
        Open it.

        :raises Exception: one of ``UNREADABLE``.
        """
        self.path = path
        self.damage: list[str] = []
        self._unpacked = TemporaryDirectory() if path.suffix == PACKED else None
        if self._unpacked is not None:
            path = _unpacked(path, Path(self._unpacked.name))
        self._reader: Any = Reader1(path) if path.suffix == '.bag' else Reader2(path)
        self._reader.open()
        # A ROS 1 node that was started again has a second connection, of the same source.
        self._source_of = {each.id: _source(each) for each in self._reader.connections}
        self.counts: Counter[Source] = Counter()
        for each in self._reader.connections:
            self.counts[self._source_of[each.id]] += each.msgcount
        self.began = int(self._reader.start_time)

    def arrivals(self, sources: Sequence[Source], start: int | None,
                 stop: int | None) -> Iterator[Arrival]:
        """Yield the messages of some of its sources, as they were received."""
        connections = [each for each in self._reader.connections
                       if self._source_of[each.id] in sources]
        if not connections:
            return
        given = 0
        try:
            for connection, received, data in self._reader.messages(connections, start, stop):
                if data[:4] == _ZSTD:  # a recorder may compress each message for itself
                    data = zstd.decompress(data)
                yield Arrival(received, self._source_of[connection.id], data)
                given += 1
        except UNREADABLE as error:
            expected = sum(each.msgcount for each in connections)
            self.damage.append(f'{self.path.name} is damaged behind message {given} of '
                               f'{expected}: {error}')

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
        if self._unpacked is not None:
            self._unpacked.cleanup()


def _unpacked(path: Path, folder: Path) -> Path:
    """Decompress a file into a folder, and return it."""
    target = folder / path.stem
    with zstd.open(path) as packed, target.open('wb') as unpacked:
        shutil.copyfileobj(packed, unpacked)
    return target


def _source(connection: Connection) -> Source:
    extension = connection.ext
    if isinstance(extension, ConnectionExtRosbag1):
        return Source(connection.topic, connection.msgtype, bool(extension.latching),
                      extension.callerid or '', True)
    profiles = extension.offered_qos_profiles
    latched = bool(profiles) and all(
        profile.durability is QosDurability.TRANSIENT_LOCAL for profile in profiles)
    reliable = all(profile.reliability is not QosReliability.BEST_EFFORT for profile in profiles)
    return Source(connection.topic, connection.msgtype, latched, '',
                  extension.serialization_format == 'ros1', reliable)
