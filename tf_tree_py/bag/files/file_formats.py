# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Selects the reader for a file: rosbags, or a scan for files that rosbags refuses.

It refuses those that are truncated, never finished, without an index, or not of ROS 2. Each kind
of file has a scan of its own.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from tf_tree_py.core.stamp import FOREVER, format_stamp

from .connections import Connection, RecordedMessage, Scan, Storage
from .mcap_scan import McapScan
from .ros1_scan import Ros1Scan
from .rosbags_file import RosbagsFile, salvaged, UNREADABLE
from .scanning import NOTHING_MISSING, NotOfRos2, UNKNOWN_MISSING, WITHOUT_INDEX
from .sqlite_scan import SqliteScan
from .unpacking import PlainFile


class SalvagedFile:
    """The readable part of one file."""

    def __init__(self, file: PlainFile, scan: Callable[[Path], Scan], why: object) -> None:
        """
        Read it once, to count its messages.

        :param why: the error of the regular reader.
        :raises ValueError: nothing can be read.
        """
        self._file = file
        self._scan = scan
        first = scan(file.path)
        self.counts: Counter[Connection] = Counter()
        begin, end = FOREVER, 0
        self._is_ordered = True
        self._unordered: set[Connection] = set()
        last: dict[Connection, int] = {}
        for arrival in first:
            received, connection = arrival.received, arrival.connection
            self.counts[connection] += 1
            self._is_ordered = self._is_ordered and received + 1 >= end
            if received < last.get(connection, 0):
                self._unordered.add(connection)
            last[connection] = received
            begin, end = min(begin, received), max(end, received + 1)
        self.span = begin, end
        self.definitions = first.definitions
        when = '' if begin > end else (
            f', received from {format_stamp(begin)} to {format_stamp(end - 1)} s')
        # What could not be unpacked is more than an index.
        lost = (UNKNOWN_MISSING if file.fault is not None and first.lost == WITHOUT_INDEX
                else first.lost)
        state = ('could not be opened as usual' if lost.startswith(NOTHING_MISSING)
                 else 'is not whole')
        another = isinstance(why, NotOfRos2)  # which is no fault
        reason = '' if another else f' ({file.reason(why)})'
        self.damage = [] if another and first.lost == NOTHING_MISSING else [
            f'{file.name} {state}{reason}: {self.counts.total()} messages could be '
            f'read{when}, {lost}']

    def arrivals(self, connections: Collection[Connection], start: int | None,
                 stop: int | None) -> Iterator[RecordedMessage]:
        """Yield the messages of some of its connections, in order of arrival."""
        messages = salvaged(self._scan(self._file.path), connections, start, stop)
        # The messages of a file may have any order. One topic that has gigabytes is rarely sorted.
        alone = len(connections) == 1 and self._unordered.isdisjoint(connections)
        return messages if self._is_ordered or alone else iter(
            sorted(messages, key=lambda arrival: arrival.received))

    def close(self) -> None:
        """Remove the copy of the file, if there is one; no file is open."""
        self._file.close()


_SCANS: dict[str, Callable[[Path], Scan]] = {
    '.mcap': McapScan, '.bag': Ros1Scan, '.db3': SqliteScan}


def open_file(path: Path) -> Storage:
    """
    Open one file.

    :raises Exception: one of ``UNREADABLE``.
    """
    file = PlainFile(path)
    scan = _SCANS[file.path.suffix]
    try:
        if file.fault is not None:
            raise file.fault
        if file.path.suffix == '.mcap':
            scanned = McapScan(file.path)
            scanned.check_sizes()
            scanned.check_is_of_ros2()
        return RosbagsFile(file, scan)
    except UNREADABLE as error:
        try:
            return SalvagedFile(file, scan, error)
        except UNREADABLE:
            file.close()
            raise ValueError(file.reason(error)) from None
