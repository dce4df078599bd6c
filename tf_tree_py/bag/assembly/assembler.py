# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds the histories of a tree from messages, by the rules of a buffer.

Samples that only extend edges cannot affect other edges: those of a whole window are inserted edge
by edge. All other messages (new edges, static ones, unreadable ones, another parent) are inserted
in order, one by one.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
import math

from tf_tree_py.beyond.uncertainty.insertion import EdgeEstimate, take_estimate
from tf_tree_py.core import fork_locks
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_FRAMES, DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.guards import FutureGuard
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observers
from tf_tree_py.core.messages.sample import Batch, checked, Sample, SampleTrack
from tf_tree_py.core.stamp import FOREVER, LATEST
from tf_tree_py.core.tree.tree import Tree

from .anomalies import Anomalies
from .decoding import Decoder
from .message_window import decode, Edge, MessageWindow, Samples
from .stamp_order import StampOrder
from ..files.message_source import RecordedMessage

# Of a window: enough samples of each edge for numpy, and small compared with the histories.
_WINDOW_BYTES = 16_000_000


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
        self._order = StampOrder(self.oddities)
        # The number of messages to insert one by one before the next search for a group.
        self._stride = 0

    def take(self, arrivals: Iterable[RecordedMessage],
             tell: Callable[[int], None] = lambda _: None) -> None:
        """
        Insert messages in their order.

        :param tell: called from time to time with the number of messages inserted since.
        """
        for window in _windows(arrivals):
            self._take_window(window)
            tell(len(window))

    def take_estimate(self, estimate: EdgeEstimate, with_pose: bool, authority: str) -> None:
        """Insert the covariance of an edge from a topic, and its pose if requested."""
        self.oddities.note_incidents(
            take_estimate(self.intake, estimate, with_pose, authority))

    def refuse(self, incident: Incident) -> None:
        """Count and record a message that cannot be inserted."""
        self.intake.refuse(incident)
        self.oddities.note_incidents([incident])

    def _take_window(self, arrivals: Sequence[RecordedMessage]) -> None:
        window = decode(arrivals, self._decoder)
        begin = 0
        while begin < len(arrivals):
            end = self._first_other(arrivals, window, begin)
            self._take_together(arrivals, window, begin, end)
            # If nearly no messages fit a group, the search would cost more than it saves.
            self._stride = 1 if end - begin >= self._stride else 2 * self._stride
            begin = min(end + self._stride, len(arrivals))
            for arrival in arrivals[end:begin]:
                self._take_one(arrival)

    # --- edge by edge

    def _first_other(self, arrivals: Sequence[RecordedMessage], window: MessageWindow,
                     begin: int) -> int:
        """Return the number of the first message that has to be inserted in order."""
        end = next((number for number in window.others if number >= begin
                    and not self._is_repeated(arrivals[number])), len(arrivals))
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

    def _take_together(self, arrivals: Sequence[RecordedMessage], window: MessageWindow,
                       begin: int, end: int) -> None:
        """Insert messages that only extend histories."""
        for number in window.others:
            if begin <= number < end:
                self._take_one(arrivals[number])
        for edge, samples in window.edges.items():
            some = samples.between(begin, end)
            if not len(some.messages):
                continue
            self.take_track(some.as_track(edge), arrivals[some.messages[-1]].source.authority)

    def take_track(self, track: SampleTrack, authority: str) -> None:
        """Insert samples of one moving edge, in order of arrival."""
        self._order.note_many((track.parent, track.child), track.stamps)
        self.oddities.note_incidents(self.intake.take_track(track, authority))

    # --- message by message

    def _take_one(self, arrival: RecordedMessage) -> None:
        source = arrival.source
        batch = self._decoder.read(arrival)
        if isinstance(batch, Incident):
            self.refuse(batch)
            return
        if source.static:
            self._note_changes(batch)
        else:
            for edge, stamp in zip(batch.edges, batch.stamps, strict=True):
                self._order.note(edge, stamp)
        self.oddities.note_incidents(
            self.intake.take_batch(batch, source.authority, source.static))

    def _is_repeated(self, arrival: RecordedMessage) -> bool:
        """Return whether a static message only repeats values in the tree."""
        batch = self._decoder.read(arrival) if arrival.source.static else None
        return isinstance(batch, Batch) and all(map(self._is_known, batch.samples()))

    def _is_known(self, sample: Sample) -> bool:
        sound = checked(sample, '')
        if isinstance(sound, Incident):
            return False
        history = self.tree.histories.get(sound.child)
        return history is not None and history.is_static and history.goes_on(
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


def _windows(arrivals: Iterable[RecordedMessage]) -> Iterator[list[RecordedMessage]]:
    """Yield messages in lists of about the same size."""
    window: list[RecordedMessage] = []
    size = 0
    for arrival in arrivals:
        window.append(arrival)
        size += len(arrival.data)
        if size > _WINDOW_BYTES:
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
