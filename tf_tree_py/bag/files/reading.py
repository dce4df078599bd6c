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
What was recorded, message by message, from the files of one bag.

The lowest level: nothing is filtered, and nothing is judged. ``opening`` makes a buffer
of it.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import closing
import heapq
import os
from pathlib import Path

from .finding import files_of
from .source import Arrival, Source, Storage
from ..errors import BagError, needs_extra

PathLike = str | os.PathLike[str]


class Bag:
    """
    One bag, open: a file, or a folder with its splits.

    Close it, or use it in a ``with``.

    :ivar path: of the file or folder.
    :ivar sources: of transforms: every topic of type TFMessage, or those that were asked for.
    :ivar everything: the sources of all types.
    """

    def __init__(self, path: PathLike, topics: Sequence[str] | None = None) -> None:
        """
        Open a bag.

        :param topics: read these and no others; None: every topic of type TFMessage.
        :raises BagError: it cannot be read at all, or does not have one of the topics.
        """
        self.path = Path(path)
        self._damage: list[str] = []
        self._storages = _open_all(self.path, self._damage)
        self.everything = list(dict.fromkeys(
            source for storage in self._storages for source in storage.counts))
        try:
            self.sources = _chosen(self.path, self.everything, topics)
        except BagError:
            self.close()
            raise

    @property
    def damage(self) -> list[str]:
        """Return what is wrong with the files, one sentence each; complete when all was read."""
        return self._damage + [sentence for storage in self._storages
                               for sentence in storage.damage]

    def arrivals(self, start: int | None = None, stop: int | None = None) -> Iterator[Arrival]:
        """
        Yield every message of ``sources``, as they were received.

        :param start: leave out moving transforms that were received before, nanoseconds;
            None: none. What is static is valid at all times, so it is never left out.
        :param stop: leave out moving transforms that were received then or later.
        """
        if start is None and stop is None:
            yield from self._read(self.sources, None, None)
            return
        static = self._read([source for source in self.sources if source.static], None, None)
        # Both read the same files, but not at once: what is static is little.
        moving = self._read([source for source in self.sources if not source.static], start, stop)
        yield from heapq.merge(list(static), moving, key=lambda arrival: arrival.received)

    def sources_of(self, topic: str) -> list[Source]:
        """
        Return the sources of one topic, of whatever type.

        :raises BagError: the bag does not have it.
        """
        return _of_topic(self.path, self.everything, topic)

    def messages(self, topic: str, start: int | None = None,
                 stop: int | None = None) -> Iterator[Arrival]:
        """
        Yield every message of one topic, of whatever type.

        :param start: leave out what was received before, nanoseconds; None: nothing.
        :param stop: leave out what was received then or later.
        :raises BagError: the bag does not have it.
        """
        yield from self._read(self.sources_of(topic), start, stop)

    def first_field(self, source: Source) -> str:
        """Return the type of the first field of a source's messages; '' if nobody knows it."""
        return next(filter(None, (storage.first_field(source) for storage in self._storages)), '')

    @property
    def span(self) -> tuple[int, int]:
        """Return when the first message was received, and the nanosecond after the last."""
        begins, ends = zip(*(storage.span for storage in self._storages), strict=True)
        return min(begins), max(ends)

    def expected(self, others: Collection[Source] = ()) -> int:
        """Return how many messages of ``sources`` and of others there should be."""
        return sum(count for storage in self._storages for source, count
                   in storage.counts.items() if source in self.sources or source in others)

    def _read(self, sources: Sequence[Source], start: int | None,
              stop: int | None) -> Iterator[Arrival]:
        for storage in self._storages:
            yield from storage.arrivals(sources, start, stop)

    def close(self) -> None:
        """Close its files."""
        for storage in self._storages:
            storage.close()

    def __enter__(self) -> 'Bag':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_arrivals(path: PathLike, topics: Sequence[str] | None = None, *,
                  start: int | None = None, stop: int | None = None) -> Iterator[Arrival]:
    """
    Yield every message with transforms in a bag, as it was received, with its bytes.

    ``Decoder`` makes transforms of the bytes. For what is wrong with the files themselves,
    open a ``Bag`` and look at its ``damage``.

    :param topics: read these and no others; None: every topic of type TFMessage.
    :param start: leave out moving transforms that were received before, nanoseconds.
    :param stop: leave out moving transforms that were received then or later.
    :raises BagError: it cannot be read at all, or does not have one of the topics.
    """
    with closing(Bag(path, topics)) as bag:
        yield from bag.arrivals(start, stop)


def _open_all(path: Path, damage: list[str]) -> list[Storage]:
    """Open the files of a bag, in the order in which they were recorded."""
    try:
        from .kinds import open_file, UNREADABLE
    except ImportError as error:
        raise needs_extra(error) from error
    files = files_of(path)
    damage += [f'{name}, which the index of the bag lists, is missing' for name in files.missing]
    storages: list[Storage] = []
    for file in files.present:
        try:
            storages.append(open_file(file))
        except UNREADABLE as error:
            damage.append(f'{file.name} cannot be read: {error}')
    if not storages:
        raise BagError(f'{path} is no bag that can be read: {"; ".join(damage)}')
    return sorted(storages, key=lambda storage: storage.span)


def _chosen(path: Path, everything: Sequence[Source],
            topics: Sequence[str] | None) -> list[Source]:
    if isinstance(topics, str):
        raise BagError(f'topics are a list of names, such as [{topics!r}]')
    if topics is None:
        return [source for source in everything if source.has_transforms]
    chosen = [source for topic in topics for source in _of_topic(path, everything, topic)]
    for source in chosen:
        if not source.has_transforms:
            raise BagError(f'{path}: {source.topic} has messages of type {source.type_name}, '
                           'not transforms')
    return chosen


def _of_topic(path: Path, everything: Sequence[Source], topic: str) -> list[Source]:
    found = [source for source in everything if source.topic == topic]
    if not found:
        there = ', '.join(sorted({source.topic for source in everything})) or 'none'
        raise BagError(f'{path} has no topic {topic}; it has: {there}')
    return found
