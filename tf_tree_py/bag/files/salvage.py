# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads files that rosbags refuses: truncated, never finished, without an index, or not of ROS 2.

Each kind of file has a scan of its own.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from tf_tree_py.core.stamp import FOREVER, format_stamp

from .connections import Connection, RecordedMessage, Scan
from .plain_file import PlainFile
from .rosbags_file import salvaged
from .scanning import NOTHING_MISSING, OtherProfile, UNKNOWN_MISSING, WITHOUT_INDEX


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
        for arrival in first:
            self.counts[arrival.connection] += 1
            begin, end = min(begin, arrival.received), max(end, arrival.received + 1)
        self.span = begin, end
        self.definitions = first.definitions
        received = '' if begin > end else (
            f', received from {format_stamp(begin)} to {format_stamp(end - 1)} s')
        # What could not be unpacked is more than an index.
        lost = (UNKNOWN_MISSING if file.fault is not None and first.lost == WITHOUT_INDEX
                else first.lost)
        state = ('could not be opened as usual' if lost.startswith(NOTHING_MISSING)
                 else 'is not whole')
        another = isinstance(why, OtherProfile)  # which is no fault
        reason = '' if another else f' ({file.reason(why)})'
        self.damage = [] if another and first.lost == NOTHING_MISSING else [
            f'{file.name} {state}{reason}: {self.counts.total()} messages could be '
            f'read{received}, {lost}']

    def arrivals(self, connections: Collection[Connection], start: int | None,
                 stop: int | None) -> Iterator[RecordedMessage]:
        """Yield the messages of some of its connections, in the order of the file."""
        return salvaged(self._scan(self._file.path), connections, start, stop)

    def close(self) -> None:
        """Remove the copy of the file, if there is one; no file is open."""
        self._file.close()
