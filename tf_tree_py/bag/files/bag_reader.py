# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads the recorded messages, one by one, from the files of one bag.

This is the lowest level: nothing is filtered or judged. ``opening`` makes a buffer of the
messages.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import closing
import heapq
import os
from pathlib import Path

from tf_tree_py.core.closable import Closable
from tf_tree_py.core.text import printable
from tf_tree_py.recording.errors import BagError, needs_extra

from .connections import Connection, RecordedMessage, Storage
from .discovery import files_of
from .foxglove import check_decoders

PathLike = str | os.PathLike[str]


class Bag(Closable):
    """
    One bag, open: a file, or a folder with its splits.

    Close it, or use it in a ``with``.

    :ivar path: of the file or folder.
    :ivar connections: of transforms: every topic with transforms, or the requested ones.
    :ivar everything: the connections of all types.
    """

    def __init__(self, path: PathLike, topics: Sequence[str] | None = None) -> None:
        """
        Open a bag.

        :param topics: read only these; None: every topic with transforms.
        :raises BagError: it cannot be read at all, does not have one of the topics, or a library
            that decodes its messages is missing.
        """
        self.path = Path(path)
        self._topics = topics
        self._damage: list[str] = []
        self._storages = _open_all(self.path, self._damage)
        self.everything = list(dict.fromkeys(
            connection for storage in self._storages for connection in storage.counts))
        try:
            self.connections = _chosen(self.path, self.everything, topics)
            check_decoders(self.path, self.connections)
        except BagError:
            self.close()
            raise

    @property
    def unread(self) -> list[str]:
        """Return which of the topics have transforms that cannot be read, one clause each."""
        return list(dict.fromkeys(
            f'{each.topic} has {each.contents}, not in {" or ".join(each.readable_encodings)}'
            for each in self.everything if each.readable_encodings and not each.has_transforms
            and (self._topics is None or each.topic in self._topics)))

    @property
    def damage(self) -> list[str]:
        """Return the faults of the files, one sentence each; complete after all was read."""
        return self._damage + [sentence for storage in self._storages
                               for sentence in storage.damage]

    def arrivals(self, start: int | None = None,
                 stop: int | None = None) -> Iterator[RecordedMessage]:
        """
        Yield every message of ``connections``, in order of arrival.

        :param start: skip moving transforms received before it, nanoseconds; None: read all.
            Static ones are valid at all times, so they are never skipped.
        :param stop: skip moving transforms that were received at this time or later.
        """
        if start is None and stop is None:
            yield from self._read(self.connections, None, None)
            return
        static = self._read([each for each in self.connections if each.static], None, None)
        # Both read the same files, but not at once: there are few static messages.
        moving = self._read([each for each in self.connections if not each.static], start, stop)
        yield from heapq.merge(list(static), moving, key=lambda arrival: arrival.received)

    def connections_of(self, topic: str) -> list[Connection]:
        """
        Return the connections of one topic, of any type, in an encoding of ROS.

        :raises BagError: the bag does not have it, or has it only in other encodings.
        """
        found = _of_topic(self.path, self.everything, topic)
        of_ros = [each for each in found if each.is_of_ros]
        if not of_ros:
            what = ('of which only the transforms can be read' if found[0].has_transforms
                    else 'which cannot be read')
            raise BagError(f'{self.path}: {topic} has {found[0].contents}, {what}')
        return of_ros

    def messages(self, topic: str, start: int | None = None,
                 stop: int | None = None) -> Iterator[RecordedMessage]:
        """
        Yield every message of one topic, of any type, in an encoding of ROS.

        :param start: skip messages received before it, nanoseconds; None: read all.
        :param stop: skip messages received at it or later; None: read all.
        :raises BagError: see ``connections_of``.
        """
        yield from self._read(self.connections_of(topic), start, stop)

    def first_field(self, connection: Connection) -> str:
        """Return the type of the first field of a connection's messages; '' if it is unknown."""
        from .rosbags_file import first_field_of  # here, because rosbags need not be installed
        known = [storage.definitions[connection] for storage in self._storages
                 if connection in storage.definitions]
        return next(filter(None, (first_field_of(connection, one) for one in known)), '')

    @property
    def span(self) -> tuple[int, int]:
        """Return when the first message was received, and one nanosecond after the last."""
        begins, ends = zip(*(storage.span for storage in self._storages), strict=True)
        return min(begins), max(ends)

    def expected(self, others: Collection[Connection] = ()) -> int:
        """Return the expected number of messages of ``connections`` and of others."""
        return sum(count for storage in self._storages for each, count
                   in storage.counts.items() if each in self.connections or each in others)

    def _read(self, connections: Sequence[Connection], start: int | None,
              stop: int | None) -> Iterator[RecordedMessage]:
        for storage in self._storages:
            yield from storage.arrivals(connections, start, stop)

    def close(self) -> None:
        """Close its files."""
        for storage in self._storages:
            storage.close()


def read_messages(path: PathLike, topics: Sequence[str] | None = None, *,
                  start: int | None = None, stop: int | None = None) -> Iterator[RecordedMessage]:
    """
    Yield every message with transforms in a bag, in order of arrival, with its bytes.

    ``Decoder`` decodes the bytes to transforms. For the faults of the files themselves, open a
    ``Bag`` and read its ``damage``.

    :param topics: read only these; None: every topic with transforms.
    :param start: skip moving transforms that were received earlier, nanoseconds.
    :param stop: skip moving transforms that were received at this time or later.
    :raises BagError: it cannot be read at all, or does not have one of the topics.
    """
    with closing(Bag(path, topics)) as bag:
        yield from bag.arrivals(start, stop)


def _open_all(path: Path, damage: list[str]) -> list[Storage]:
    """Open the files of a bag, in the order of their recording."""
    try:
        from .file_formats import open_file
        from .rosbags_file import UNREADABLE
    except ImportError as error:
        raise needs_extra(error) from error
    files = files_of(path)
    damage += [f'{name}, which the index or a log in the folder names, is missing'
               for name in files.missing]
    storages: list[Storage] = []
    for file in files.present:
        try:
            storages.append(open_file(file))
        except UNREADABLE as error:
            damage.append(f'{file.name} cannot be read: {printable(str(error))}')
    if not storages:
        raise BagError(f'{path} cannot be read as a bag: {"; ".join(damage)}')
    return sorted(storages, key=lambda storage: storage.span)


def _chosen(path: Path, everything: Sequence[Connection],
            topics: Sequence[str] | None) -> list[Connection]:
    if isinstance(topics, str):
        raise BagError(f'topics has to be a list of names, such as [{topics!r}]')
    if topics is None:
        return [each for each in everything if each.has_transforms]
    chosen: list[Connection] = []
    for topic in topics:
        found = _of_topic(path, everything, topic)
        readable = [each for each in found if each.has_transforms]
        if not readable:
            raise BagError(f'{path}: {topic} has {found[0].contents}, not transforms that can be '
                           'read')
        chosen += readable
    return chosen


def _of_topic(path: Path, everything: Sequence[Connection], topic: str) -> list[Connection]:
    found = [each for each in everything if each.topic == topic]
    if not found:
        there = ', '.join(sorted({each.topic for each in everything})) or 'none'
        raise BagError(f'{path} has no topic {topic}; it has: {there}')
    return found
