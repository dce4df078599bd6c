# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorded tree: the messages of a bag, in the order of their arrival."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from tf_tree_py.bag import Bag, BagError, CovarianceTopics, Decoder, RecordedMessage
from tf_tree_py.bag.files.connections import cursor_of, decode
from tf_tree_py.bag.opening import no_transforms, progress_bar
from tf_tree_py.beyond.uncertainty.insertion import insert_estimate
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.command.endings import Cannot, cannot_after
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Endpoint, Observer, ReceivedMessage
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.reports.switch_status import DIAGNOSTICS_TOPIC, SwitchReports

from .inputs import note_switches, TreeInput

_CLOCK = '/clock'
# The number of messages between two updates of the progress bar.
_STRIDE = 500
_TF_TOPIC, _TF_STATIC_TOPIC = '/tf', '/tf_static'


class RecordedTree(TreeInput):
    """A buffer that a bag is read into, at full speed; see ``TreeInput``."""

    hint = 'its transform topics contain no messages'

    def __init__(self, arguments: Namespace, observers: Sequence[Observer],
                 cache_time: int) -> None:
        """
        Open a bag.

        :raises Cannot: it cannot be read, or holds no transforms.
        """
        self.name = str(arguments.bag)
        with cannot_after(BagError, OSError):
            self._bag = Bag(arguments.bag, topics_of(arguments))
        if not self._bag.connections:
            sentence = no_transforms(self._bag)
            self._bag.close()
            raise Cannot(sentence)
        self.buffer = BufferCore(cache_time)
        for observer in observers:
            self.buffer.observers.add(observer)
        self._insert_covariances(alone=topics_of(arguments) is not None)
        self._note_sources()
        self._decoder = Decoder()
        self._time_of = _clock_of(self._bag)
        self._arrivals = self._bag.arrivals()
        self._now = 0
        # The end of the last period that was watched, by the time of receiving.
        self._end: int | None = None

    def close(self) -> None:
        """Close the bag."""
        self._bag.close()

    def watch(self, seconds: float | None) -> bool:
        """Read the transforms of so many recorded seconds; None: all that are left."""
        if seconds is not None:
            return self._watch(from_seconds(seconds))
        with progress_bar(self._bag.path.name, self._bag.expected()) as tell:
            for number, arrival in enumerate(self._arrivals, start=1):
                self._insert(arrival)
                if number % _STRIDE == 0:
                    tell(_STRIDE)
        return False

    def _watch(self, span: int) -> bool:
        end = None if self._end is None else self._end + span
        for arrival in self._arrivals:
            self._insert(arrival)
            end = arrival.received + span if end is None else end
            if arrival.received >= end:
                self._end = end
                return True
        return False

    def endpoints(self) -> list[Endpoint]:
        """Return the publishers, as far as the bag contains them."""
        return [Endpoint(each.topic, each.static, each.publisher, True, each.reliable,
                         not each.volatile) for each in self._bag.connections]

    def now(self) -> int:
        """Return the time when the last message was received, by the clock of the stamps."""
        return self._now

    def damage(self) -> list[str]:
        """Return what cannot be read, one sentence each; complete after all was read."""
        clocks = [] if self._time_of is not _as_received else [
            f'{each.topic} has {each.contents}, so ages follow the time of receiving'
            for each in self._bag.everything if each.topic == _CLOCK and not each.is_of_ros]
        return self._bag.damage + self._bag.unread + clocks

    def _insert_covariances(self, alone: bool) -> None:
        """Insert the covariances of static edges first, because they are valid at all times."""
        for found, _, authority in CovarianceTopics(self._bag, None, alone).heard(self.buffer):
            if isinstance(found, Incident):
                self.buffer.intake.refuse(found)
            else:
                insert_estimate(self.buffer.intake, found, authority)

    def _note_sources(self) -> None:
        """Notify observers of what the robot's buffers reported of their sources, all at once."""
        if not _has(self._bag, DIAGNOSTICS_TOPIC):
            return
        reports = SwitchReports()
        for arrival in self._bag.messages(DIAGNOSTICS_TOPIC):
            try:
                statuses = decode(arrival.connection, arrival.data).status
            except WireError:
                continue  # an unreadable diagnostics message is not a fault of the transforms
            note_switches(reports, statuses, self.buffer)

    def _insert(self, arrival: RecordedMessage) -> None:
        self._now = self._time_of(arrival.received)
        connection = arrival.connection
        batch = self._decoder.read(arrival)
        if isinstance(batch, Incident):
            self.buffer.intake.refuse(replace(batch, authority=connection.publisher))
            return
        self.buffer.observers.notify_received(ReceivedMessage(
            batch, self._now, connection.topic, connection.static, connection.publisher))
        self.buffer.insert_batch(batch, connection.publisher, connection.static, announced=True)


def topics_of(arguments: Namespace) -> list[str] | None:
    """Return the requested topics; None: all topics of the bag."""
    if arguments.tf_topic is None and arguments.tf_static_topic is None:
        return None
    return [arguments.tf_topic or _TF_TOPIC, arguments.tf_static_topic or _TF_STATIC_TOPIC]


def _clock_of(bag: Bag) -> Callable[[int], int]:
    """
    Return a function from the time of receiving to the time by the clock of the stamps.

    If ``/clock`` was recorded, its messages determine the function.
    """
    times = list(_ticks(bag.messages(_CLOCK))) if _has(bag, _CLOCK) else []
    if not times:
        return _as_received
    received, shown = np.array(times, dtype=np.int64).T
    begin, first = int(received[0]), int(shown[0])
    # Near zero a float is exact to the nanosecond.
    ticks, progress = (received - begin).astype(float), (shown - first).astype(float)
    return lambda moment: first + round(float(np.interp(moment - begin, ticks, progress)))


def _as_received(received: int) -> int:
    return received


def _has(bag: Bag, topic: str) -> bool:
    """Return whether a bag has a topic with messages of ROS."""
    return any(each.topic == topic and each.is_of_ros for each in bag.everything)


def _ticks(arrivals: Iterator[RecordedMessage]) -> Iterator[tuple[int, int]]:
    """Yield the time of receiving of each message on ``/clock``, and the time in it."""
    for arrival in arrivals:
        with suppress(WireError):  # a damaged message says nothing about the clock
            yield arrival.received, cursor_of(arrival.data, arrival.connection.ros1).read_time()
