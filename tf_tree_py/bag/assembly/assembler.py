# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds the histories of a tree from messages, by the rules of a buffer; and summarizes anomalies.

Samples that only extend edges cannot affect other edges: those of a whole window are inserted edge
by edge. All other messages (new edges, static ones, unreadable ones, another parent) are inserted
in order, one by one.

An anomaly is reported once by reason and edge, not once a message: also repeated stamps, stamps
out of order, and jumps back.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
import math
from typing import NamedTuple

import numpy as np
from tf_tree_py.beyond.uncertainty.insertion import (
    EdgeEstimate,
    insert_estimate,
    insert_estimated_pose,
)
from tf_tree_py.core import fork_locks
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.guards import FutureGuard
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observers
from tf_tree_py.core.messages.sample import Batch, checked, Sample, SampleTrack
from tf_tree_py.core.stamp import FOREVER, format_span, format_stamp, from_seconds, LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.tree import Tree

from .decoding import decode, Decoder, Edge, MessageWindow, Samples
from .lone_samples import ArrivalOrder, LONE_STAMP
from ..files.connections import RecordedMessage

# A longer text would not be read; ``oddities`` has the rest as data.
_MAX_LINES = 20


class BagWarning(UserWarning):
    """A bag has anomalies; one warning lists all of them."""


class Anomaly(NamedTuple):
    """
    All anomalies of one reason on one edge.

    :ivar reason: a few words, such as ``out of order``.
    :ivar parent: of the edge; '' for the anomaly of a file or a message.
    :ivar times: the number of samples, messages or files.
    :ivar first: their oldest stamp, nanoseconds; ``LATEST`` if there is none.
    :ivar last: the newest.
    :ivar detail: about the first of them, or the worst.
    """

    reason: str
    parent: str
    child: str
    times: int
    first: int
    last: int
    detail: str

    def __str__(self) -> str:
        edge = f' {self.parent!r} -> {self.child!r}' if self.child else ''
        when = '' if self.first == LATEST else f', at {format_stamp(self.first)} s'
        if self.first != self.last:
            when = f', from {format_stamp(self.first)} to {format_stamp(self.last)} s'
        times = f'{self.times} times' if self.times > 1 else 'once'
        return f'{self.reason}{edge}: {times}{when}: {self.detail}'


class Anomalies:
    """Summarizes anomalies while a bag is read."""

    def __init__(self) -> None:
        self._sums: dict[tuple[str, str, str], Anomaly] = {}

    def note(self, reason: str, detail: str, edge: tuple[str, str] = ('', ''), *,
             times: int = 1, first: int = LATEST, last: int | None = None) -> None:
        """Add anomalies of one reason; the detail of the first is kept."""
        last = first if last is None else last
        key = (reason, *edge)
        known = self._sums.get(key, Anomaly(*key, 0, first, last, detail))
        self._sums[key] = Anomaly(*key, known.times + times, min(known.first, first),
                                  max(known.last, last), known.detail)

    def note_incidents(self, incidents: Iterable[Incident]) -> None:
        """Add the incidents that the tree returned."""
        for incident in incidents:
            self.note(incident.kind.value, incident.detail, (incident.parent, incident.child),
                      first=incident.stamp)

    def summed(self) -> tuple[Anomaly, ...]:
        """Return the anomalies, the most frequent first."""
        return tuple(sorted(self._sums.values(), key=lambda oddity: -oddity.times))


def as_text(path: object, oddities: Sequence[Anomaly]) -> str:
    """Return the anomalies of a bag as text: one a line."""
    lines = [f'  {oddity}' for oddity in oddities[:_MAX_LINES]]
    more = len(oddities) - len(lines)
    if more:
        lines.append(f'  and {more} more, in the .oddities of the buffer')
    return '\n'.join([f'{path}: readable, with anomalies:', *lines])


# --- the order of stamps

# A larger step back means another run, or another clock: no message is delayed that long.
_JUMP = from_seconds(1.0)


def _fault(before: int, stamp: int) -> tuple[str, str]:
    """Return the reason and a detail for a stamp that is not newer than the one before."""
    if stamp == before:
        return 'repeated stamp', (f'{format_stamp(stamp)} twice in a row; lookups use the last '
                                  'sample')
    reason = 'jump back' if before - stamp > _JUMP else 'out of order'
    return reason, (f'{format_stamp(stamp)} arrived after {format_stamp(before)}, '
                    f'which is {format_span(before - stamp)} newer')


# --- assembly

# Of a window: enough samples of each edge for numpy, and small compared with the histories.
WINDOW_BYTES = 16_000_000


class Assembler:
    """
    A tree that is being filled with recorded messages.

    :ivar tree: its present content.
    :ivar intake: inserts samples, and counts them.
    :ivar oddities: the anomalies so far.
    """

    def __init__(self, decoder: Decoder, cache_time: int) -> None:
        self.tree = Tree(cache_time, DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES)
        self.intake = Intake(self.tree, Waiting(fork_locks.rlock()), Observers(),
                             FutureGuard(None, None), None)
        self.oddities = Anomalies()
        self._decoder = decoder
        self._arrived = ArrivalOrder()
        # The number of messages to insert one by one before the next search for a group.
        self._stride = 0

    def assemble(self, arrivals: Iterable[RecordedMessage],
                 tell: Callable[[int], None] = lambda _: None) -> None:
        """
        Insert messages in their order.

        :param tell: called from time to time with the number of messages inserted since.
        """
        for window in _windows(arrivals):
            self._insert_window(window)
            tell(len(window))
        for edge, stamps in self._arrived.stamps().items():
            self._note_order(edge, stamps)
        for edge, stamps, detail in self._arrived.lone():
            self.oddities.note(LONE_STAMP, detail, edge, times=len(stamps),
                               first=int(stamps.min()), last=int(stamps.max()))

    def insert_track(self, track: SampleTrack, authority: str) -> None:
        """Insert all samples of an edge that was not received itself, in order of arrival."""
        self._insert(track, authority)
        self._note_order((track.parent, track.child), track.stamps)

    def _note_order(self, edge: Edge, stamps: Stamps) -> None:
        """Compare each stamp of an edge with the one that arrived before it."""
        for place in np.flatnonzero(stamps[1:] <= stamps[:-1]).tolist():
            before, stamp = int(stamps[place]), int(stamps[place + 1])
            self.oddities.note(*_fault(before, stamp), edge, first=stamp)

    def insert_estimate(self, estimate: EdgeEstimate, with_pose: bool, authority: str) -> None:
        """Insert the covariance of an edge from a topic, and its pose if requested."""
        insert = insert_estimated_pose if with_pose else insert_estimate
        self.oddities.note_incidents(insert(self.intake, estimate, authority))

    def refuse(self, incident: Incident) -> None:
        """Count and record a message that cannot be inserted."""
        self.intake.refuse(incident)
        self.oddities.note_incidents([incident])

    def _insert_window(self, arrivals: Sequence[RecordedMessage]) -> None:
        window = decode(arrivals, self._decoder)
        begin = 0
        while begin < len(arrivals):
            end = self._first_other(arrivals, window, begin)
            self._insert_together(arrivals, window, begin, end)
            # If nearly no messages fit a group, the search would cost more than it saves.
            self._stride = 1 if end - begin >= self._stride else 2 * self._stride
            begin = min(end + self._stride, len(arrivals))
            for arrival in arrivals[end:begin]:
                self._insert_one(arrival)

    # --- edge by edge

    def _first_other(self, arrivals: Sequence[RecordedMessage], window: MessageWindow,
                     begin: int) -> int:
        """Return the number of the first message that has to be inserted in order."""
        end = next((number for number in _since(window.others, begin)
                    if not self._is_repeated(arrivals[number])), len(arrivals))
        for edge, samples in window.edges.items():
            end = self._first_that_does_not_go_on(edge, samples.between(begin, end), end)
        return end

    def _first_that_does_not_go_on(self, edge: Edge, samples: Samples, end: int) -> int:
        """Return the message of the first sample that does not only extend its edge's history."""
        if not len(samples.messages):
            return end
        # As if its stamp were the last of all: whether older ones fit is checked below.
        history = self.tree.history_to_extend(*edge, FOREVER)
        if history is None or history.oldest_stamp is None:
            return int(samples.messages[0])
        older = samples.stamps < history.oldest_stamp
        return int(samples.messages[older.argmax()]) if older.any() else end

    def _insert_together(self, arrivals: Sequence[RecordedMessage], window: MessageWindow,
                         begin: int, end: int) -> None:
        """Insert messages that only extend histories."""
        for number in _since(window.others, begin):
            if number >= end:
                break
            self._insert_one(arrivals[number])
        for edge, samples in window.edges.items():
            some = samples.between(begin, end)
            if not len(some.messages):
                continue
            authority = arrivals[some.messages[-1]].connection.authority
            self._arrived.add_many(edge, window.received[some.messages], some.stamps, authority)
            self._insert(SampleTrack(*edge, some.stamps, some.poses), authority)

    def _insert(self, track: SampleTrack, authority: str) -> None:
        self.oddities.note_incidents(self.intake.insert_track(track, authority))

    # --- message by message

    def _insert_one(self, arrival: RecordedMessage) -> None:
        connection = arrival.connection
        batch = self._decoder.read(arrival)
        if isinstance(batch, Incident):
            self.refuse(batch)
            return
        if connection.static:
            self._note_changes(batch)
        else:
            for edge, stamp in zip(batch.edges, batch.stamps, strict=True):
                self._arrived.add(edge, arrival.received, stamp, connection.authority)
        self.oddities.note_incidents(
            self.intake.insert_batch(batch, connection.authority, connection.static))

    def _is_repeated(self, arrival: RecordedMessage) -> bool:
        """Return whether a static message only repeats values in the tree."""
        batch = self._decoder.read(arrival) if arrival.connection.static else None
        return isinstance(batch, Batch) and all(map(self._is_known, batch.samples()))

    def _is_known(self, sample: Sample) -> bool:
        sound = checked(sample, '')
        if isinstance(sound, Incident):
            return False
        history = self.tree.histories.get(sound.child)
        return history is not None and history.is_static and history.continues(
            sound.parent, sound.stamp, sound.pose)

    def _note_changes(self, batch: Batch) -> None:
        """Record static edges that are sent again with another value."""
        for sample in batch.samples():
            history = self.tree.histories.get(sample.child)
            if history is None or not history.is_static:
                continue
            was = history.sample(LATEST)
            if history.parent != sample.parent or not _same(was, sample.pose):
                self.oddities.note(
                    'static edge sent again with another value',
                    f'it was {_shown(was)} below {history.parent!r}, and is now '
                    f'{_shown(sample.pose)}; lookups at any time use the last one',
                    (sample.parent, sample.child))


def _since(numbers: Sequence[int], begin: int) -> Iterator[int]:
    """Yield the numbers from one on, of those that are sorted."""
    return (numbers[place] for place in range(bisect_left(numbers, begin), len(numbers)))


def _windows(arrivals: Iterable[RecordedMessage]) -> Iterator[list[RecordedMessage]]:
    """Yield messages in lists of about the same size."""
    window: list[RecordedMessage] = []
    size = 0
    for arrival in arrivals:
        window.append(arrival)
        size += len(arrival.data)
        if size > WINDOW_BYTES:
            yield window
            window, size = [], 0
    if window:
        yield window


def _same(pose: PoseTuple, other: PoseTuple) -> bool:
    """Return whether two poses are equal, with quaternions of any length."""
    return all(math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-12)
               for a, b in zip(pose, _unit(other), strict=True))


def _unit(pose: PoseTuple) -> PoseTuple:
    length = math.hypot(*pose[3:])
    x, y, z, qx, qy, qz, qw = pose
    if not length:
        return pose
    return x, y, z, qx / length, qy / length, qz / length, qw / length


def _shown(pose: PoseTuple) -> str:
    return f'({", ".join(f"{value:.6g}" for value in pose)})'
