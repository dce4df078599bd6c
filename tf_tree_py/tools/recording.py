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

"""A recorded tree: the messages of a bag, as they would arrive today."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
import struct

import numpy as np
from tf_tree_py.bag import Arrival, Bag, BagError, CovarianceTopics, Decoder, Source
from tf_tree_py.bag.progress import progress_bar
from tf_tree_py.core.arrivals.cursor import WireError
from tf_tree_py.core.arrivals.diagnostic_bytes import read_statuses
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.arrivals.received import Endpoint, Received
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.stamp import from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.telling.made_way import DIAGNOSTICS_TOPIC, Hearsay
from tf_tree_py.core.text import listed

from .endings import Cannot

_CLOCK = '/clock'
# How many messages the bar on the terminal goes on by.
_STRIDE = 500
_TF_TOPIC, _TF_STATIC_TOPIC = '/tf', '/tf_static'


class Recording:
    """A buffer that a bag is played into, at the speed of the disk; see ``source.TreeSource``."""

    hint = 'its topics hold no message'

    def __init__(self, arguments: Namespace, observers: Sequence[Observer],
                 cache_time: int) -> None:
        """
        Open a bag.

        :raises Cannot: it cannot be read, or holds no transforms.
        """
        self.name = str(arguments.bag)
        try:
            self._bag = Bag(arguments.bag, _topics(arguments))
        except (BagError, OSError) as error:
            raise Cannot(str(error)) from error
        if not self._bag.sources:
            there = listed(sorted({source.topic for source in self._bag.everything})) or 'nothing'
            self._bag.close()
            raise Cannot(f'{self.name} has no topic with transforms; it has: {there}')
        self.buffer = BufferCore(cache_time)
        for observer in observers:
            self.buffer.observers.add(observer)
        self._take_covariances(alone=_topics(arguments) is not None)
        self._hear_of_sources()
        self._decoder = Decoder()
        self._time_of = _clock_of(self._bag)
        self._arrivals = self._bag.arrivals()
        self._now = 0
        # Where the last stretch that was watched ended, by the time of receiving.
        self._end: int | None = None

    def __enter__(self) -> 'Recording':
        return self

    def __exit__(self, *_: object) -> None:
        self._bag.close()

    def watch(self, seconds: float | None) -> bool:
        """Let transforms arrive, those of so many recorded seconds; None: all that are left."""
        if seconds is not None:
            return self._watch(from_seconds(seconds))
        with progress_bar(self._bag.path.name, self._bag.expected()) as tell:
            for number, arrival in enumerate(self._arrivals, start=1):
                self._take(arrival)
                if number % _STRIDE == 0:
                    tell(_STRIDE)
        return False

    def _watch(self, span: int) -> bool:
        end = None if self._end is None else self._end + span
        for arrival in self._arrivals:
            self._take(arrival)
            end = arrival.received + span if end is None else end
            if arrival.received >= end:
                self._end = end
                return True
        return False

    def await_covariances(self) -> None:
        """Return at once: they were taken when the recording was opened."""

    def endpoints(self) -> list[Endpoint]:
        """Return who published, as far as the bag tells."""
        return [Endpoint(source.topic, source.static, source.publisher, True, source.reliable,
                         not source.volatile) for source in self._bag.sources]

    def now(self) -> int:
        """Return when the last message was received, by the clock of the stamps."""
        return self._now

    def damage(self) -> list[str]:
        """Return what is wrong with the files, one sentence each; complete when all was read."""
        return self._bag.damage

    def _take_covariances(self, alone: bool) -> None:
        """Take what is told of static edges, which holds at all times, before all else."""
        for found, _, authority in CovarianceTopics(self._bag, None, alone).heard(self.buffer):
            if isinstance(found, Incident):
                self.buffer.intake.refuse(found)
            else:
                self.buffer.intake.take_estimate(found, False, authority)

    def _hear_of_sources(self) -> None:
        """Tell who watches what the robot's buffers said of their sources, all at once."""
        if not any(source.topic == DIAGNOSTICS_TOPIC for source in self._bag.everything):
            return
        hearsay = Hearsay()
        for arrival in self._bag.messages(DIAGNOSTICS_TOPIC):
            try:
                statuses = list(read_statuses(arrival.data, arrival.source.ros1))
            except WireError:
                continue  # whatever it is, it is no transform
            for status in statuses:
                for incident in hearsay.news(*status):
                    self.buffer.intake.refuse(incident)

    def _take(self, arrival: Arrival) -> None:
        self._now = self._time_of(arrival.received)
        source = arrival.source
        batch = self._decoder.read(arrival)
        if isinstance(batch, Incident):
            self.buffer.intake.refuse(replace(
                batch, authority=source.publisher, detail=f'on {source.topic}: {batch.detail}'))
            return
        self.buffer.observers.tell_received(Received(
            batch, self._now, source.topic, source.static, source.publisher))
        self.buffer.insert_batch(batch, source.publisher, source.static)


def _topics(arguments: Namespace) -> list[str] | None:
    """Return the topics that were asked for; None: whatever the bag has."""
    if arguments.tf_topic is None and arguments.tf_static_topic is None:
        return None
    return [arguments.tf_topic or _TF_TOPIC, arguments.tf_static_topic or _TF_STATIC_TOPIC]


def _clock_of(bag: Bag) -> Callable[[int], int]:
    """
    Return what tells, of the time of receiving, the time by the clock of the stamps.

    That is what was said on ``/clock``, where somebody has recorded it.
    """
    if not any(source.topic == _CLOCK for source in bag.everything):
        return lambda received: received
    times = list(_ticks(bag.messages(_CLOCK)))
    if not times:
        return lambda received: received
    received, shown = np.array(times, dtype=np.int64).T
    begin, first = int(received[0]), int(shown[0])
    # Near zero a float is exact to the nanosecond.
    ticks, progress = (received - begin).astype(float), (shown - first).astype(float)
    return lambda moment: first + round(float(np.interp(moment - begin, ticks, progress)))


def _ticks(arrivals: Iterator[Arrival]) -> Iterator[tuple[int, int]]:
    """Yield of each message on ``/clock`` when it was received, and the time that it shows."""
    for arrival in arrivals:
        offset, form = _layout_of_clock(arrival.source, arrival.data)
        if len(arrival.data) >= offset + 8:
            sec, nanosec = struct.unpack_from(form, arrival.data, offset)
            yield arrival.received, sec * NANOSECONDS_PER_SECOND + nanosec


def _layout_of_clock(source: Source, data: bytes) -> tuple[int, str]:
    """Return where the time begins in a message, and its format."""
    if source.ros1:
        return 0, '<II'
    return 4, '<iI' if data[1:2] == b'\1' else '>iI'
