# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Insertion into a buffer: notify observers, compare stamps with the clock, insert, wake waiters.

Single samples, received messages and tracks of many stamps are all inserted here. Arguments
of callers have already been checked in ``buffer_core``.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from .waiting import Waiting
from ..edges.packed import pack_pose
from ..errors import ClockJumpException
from ..messages.guards import CURE, FutureGuard, JumpBack, WHY_OLD
from ..messages.incidents import Incident, Kind, Statistics
from ..messages.observers import Observers, ReceivedMessage
from ..messages.sample import Batch, checked, JudgedTrack, Sample, SampleTrack, sound_poses
from ..stamp import LATEST
from ..tree.tree import Tree

_ALL_WENT_BACK = 'all stamps went back, as in a bag that loops'


Insert = Callable[[list[Sample], str, bool], list[Incident]]
"""Inserts samples of an authority, static or not, with the lock held, and counts them."""


class Intake:
    """
    Inserts what arrives, and clears it when time restarts.

    All methods are thread-safe, are called without the buffer's lock, and return the
    incidents.

    :ivar tree: the tree that the samples are inserted into.
    :ivar lock: the buffer's lock.
    """

    def __init__(self, tree: Tree, waiting: Waiting, observers: Observers, guard: FutureGuard,
                 jump_back: JumpBack | None) -> None:
        """
        Start with counts of zero.

        :param tree: the tree to insert into.
        :param guard: recognises stamps too far ahead of the clock.
        :param jump_back: recognises a new run; None: this is not checked.
        """
        self.tree = tree
        self._waiting = waiting
        self.lock = waiting.lock
        self._observers = observers
        self._guard = guard
        self._jump_back = jump_back
        self._statistics = Statistics()

    # --- inserting, from outside

    def insert(self, samples: list[Sample], authority: str, static: bool = False,
               insert: Insert | None = None, *, announced: bool = False) -> list[Incident]:
        """
        Insert samples, or something else in their place, under one hold of the lock.

        :param insert: inserts the samples with good stamps; ``insert_each`` by default.
        :param announced: whether observers know of the samples, or ``insert`` notifies them.
        """
        if not announced:
            self.announce(samples, authority, static)
        remarks: list[Incident] = []
        if samples and not static:
            stamps = [sample.stamp for sample in samples]
            if self._jump_back or max(stamps) > self._guard.limit:
                samples, remarks = self._screen(samples, stamps, authority)
        return self._insert(remarks, lambda: [sample.child for sample in samples],
                            insert or self.insert_each, samples, authority, static)

    def announce(self, samples: Iterable[Sample], authority: str, static: bool = False) -> None:
        """Notify observers of samples that a program inserts by hand, one by one."""
        if self._observers.of_messages:
            for parent, child, stamp, pose in samples:
                self._announce_batch(
                    Batch([(parent, child)], [stamp], [pack_pose(*pose)]), authority, static)

    def _announce_batch(self, batch: Batch, authority: str, static: bool) -> None:
        if self._observers.of_messages:
            self._observers.notify_received(ReceivedMessage(
                batch, self._guard.now(), '', static, authority))

    def insert_batch(self, batch: Batch, authority: str, static: bool,
                     announced: bool = False) -> list[Incident]:
        """Insert a whole message; ``announced``: observers were already notified of it."""
        if batch.impossible:
            refused = [stamp.incident(authority) for stamp in batch.impossible]
            self.refuse(*refused)
            return refused + self.insert_batch(
                batch._replace(impossible=()), authority, static, announced)
        if not announced:
            self._announce_batch(batch, authority, static)
        poses = None
        if not static and not self._guard.is_too_far(max(batch.stamps, default=LATEST)):
            poses = sound_poses(batch.poses)
        if poses is None:
            return self.insert(batch.samples(), authority, static, announced=True)
        if poses is not batch.poses:
            batch = batch._replace(poses=poses)
        remarks: list[Incident] = []
        if self._jump_back:
            remarks = self._judge_stamps(batch.edges, batch.stamps, authority)
        return self._insert(remarks, lambda: [child for _, child in batch.edges],
                            self._append, batch, authority)

    def insert_track(self, track: SampleTrack, authority: str) -> list[Incident]:
        """Insert many samples of one moving edge."""
        if self._jump_back or (len(track.stamps)
                               and self._guard.is_too_far(int(track.stamps.max()))):
            return [incident for sample in track.samples()
                    for incident in self.insert([sample], authority)]
        if self._observers.of_messages:
            self.announce(track.samples(), authority)
        return self._insert([], lambda: [track.child],
                            self._track, track, track.judged(authority), authority)

    def is_too_far(self, stamp: int) -> bool:
        """Return whether a stamp is so far ahead of the clock that it is refused."""
        return self._guard.is_too_far(stamp)

    def refuse(self, *incidents: Incident) -> None:
        """Count incidents that occurred before there was a sample to insert."""
        with self.lock:
            self.count(0, list(incidents))

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        with self.lock:
            counts = self._statistics
            return Statistics(counts.accepted, dict(counts.incidents), len(self.tree.frames))

    # --- before anything is inserted

    def _screen(self, samples: list[Sample], stamps: list[int],
                authority: str) -> tuple[list[Sample], list[Incident]]:
        """Return the samples that are not refused for their stamps, and the incidents."""
        guard = self._guard
        remarks: list[Incident] = []
        if guard.is_too_far(max(stamps)):
            with self.lock:
                samples, remarks = guard.part(samples, authority, self.tree.histories)
                self.count(0, remarks)
        return samples, remarks + self._judge_stamps(
            [(sample.parent, sample.child) for sample in samples],
            [sample.stamp for sample in samples], authority)

    def _judge_stamps(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int],
                      authority: str) -> list[Incident]:
        """Forget what was before if another run has begun."""
        if not self._jump_back or not edges:
            return []
        with self.lock:
            incident = self._jump_back.judge(edges, stamps, authority, self.tree.histories)
            if incident is None:
                return []
            self.count(0, [incident])
            self._forget(_ALL_WENT_BACK)
        self._give_up(_ALL_WENT_BACK)
        return [incident]

    # --- inserting, with the lock

    def _insert(self, remarks: list[Incident], children: Callable[[], Iterable[str]],
                insert: Callable[..., list[Incident]], *arguments: object) -> list[Incident]:
        incidents = self._waiting.change(self.tree, children, insert, *arguments)
        return remarks + self._explained(incidents) if remarks or incidents else incidents

    def insert_each(self, samples: Iterable[Sample], authority: str,
                    static: bool) -> list[Incident]:
        """Insert samples one by one; the lock is held."""
        incidents: list[Incident] = []
        tree, accepted = self.tree, 0
        try:
            for sample in samples:
                if not static and tree.append(sample, authority):
                    accepted += 1
                    continue
                sound = checked(sample, authority)
                if isinstance(sound, Incident):
                    incidents.append(sound)
                    continue
                remarks = tree.insert(*sound, authority, static)
                incidents += remarks
                accepted += not (remarks and remarks[-1].refused)
        finally:
            self.count(accepted, incidents)
        return incidents

    def _append(self, batch: Batch, authority: str) -> list[Incident]:
        taken = self.tree.append_batch(batch, authority)
        self._statistics.accepted += taken
        if taken == len(batch.edges):
            return []
        return self.insert_each(batch.samples()[taken:], authority, False)

    def _track(self, track: SampleTrack, judged: JudgedTrack, authority: str) -> list[Incident]:
        incidents: list[Incident] = []
        tree, number = self.tree, 0
        if not len(track.stamps):
            return incidents
        history = tree.history_to_extend(track.parent, track.child, int(track.stamps.min()))
        # Insert one by one until the edge exists and takes the rest; usually that is one sample.
        earliest = track.earliest_after() if history is None else ()
        for number, stamp in enumerate(earliest):
            history = tree.history_to_extend(track.parent, track.child, int(stamp))
            if history is not None:
                break
            incidents += self.insert_each([track.sample(number)], authority, False)
        if history is None:
            return incidents
        rest, refused = judged.after(number)
        if not rest.is_within(history):
            return incidents + self.insert_each(track.samples(number), authority, False)
        if len(rest.stamps):
            tree.extend(history, rest.stamps, rest.poses, authority)
        self.count(len(rest.stamps), refused)
        return incidents + refused

    def count(self, accepted: int, incidents: list[Incident]) -> None:
        """Count transforms and incidents, and notify observers; the lock is held."""
        self._statistics.accepted += accepted
        for incident in incidents:
            self._statistics.incidents[incident.kind] += 1
        if incidents:
            self._observers.notify_incidents(incidents)

    # --- afterwards

    def _explained(self, incidents: list[Incident]) -> list[Incident]:
        """Return the incidents, with the reason added to those about old data."""
        return [replace(incident, detail=f'{incident.detail}. {self._why_old(incident.newest)}')
                if incident.kind is Kind.OLD_DATA else incident for incident in incidents]

    def _why_old(self, newest: int) -> str:
        return self._guard.why_old(newest) or (
            WHY_OLD if self._jump_back else f'{WHY_OLD}. {CURE}')

    # --- forgetting

    def clear(self, why: str = 'clear() was called') -> None:
        """
        Clear all moving edges; frame names and static edges stay.

        :param why: the reason as a clause, for the errors of lookups.
        """
        with self.lock:
            self._forget(why)
            if self._jump_back:
                self._jump_back.begin()
        self._waiting.ask_again()

    def start_anew(self, why: str) -> None:
        """Clear all moving edges, because time has restarted, and make all waiters fail."""
        self.clear(why)
        self._give_up(why)

    def read_clock_anew(self) -> None:
        """Forget the last reading of the clock, which jumped back or was replaced."""
        # A new guard, because a thread that has just read the old clock may still write into
        # the old guard.
        self._guard = self._guard.renewed()

    def _forget(self, why: str) -> None:
        self.tree.clear(why)
        self.read_clock_anew()

    def _give_up(self, why: str) -> None:
        self._waiting.fail(ClockJumpException(
            f'During the wait {why}; the buffer was cleared'))
