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
The way into a buffer: tell observers, compare with the clock, insert, and wake who waits.

One way for all: a sample by hand, a message off the wire, a track of many stamps. What
callers give was checked before, in ``buffer_core`` and ``arrivals``.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from .waiting import Waiting
from ..arrivals.estimate import Estimate
from ..arrivals.future_guard import FutureGuard
from ..arrivals.incidents import Incident, Kind, Statistics
from ..arrivals.jump_back import CURE, JumpBack, WHY_OLD
from ..arrivals.observers import Observers
from ..arrivals.sample import Batch, checked, Sample, sound_poses
from ..arrivals.track import Judged, Track
from ..edges.spline import Spline
from ..errors import ClockJumpException
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..times import Stamps
from ..tree.tree import Tree


class Intake:
    """
    Takes what arrives, and forgets it when another time begins.

    All methods may be called from any thread, without the buffer's lock; what they
    return is what was refused or is worth telling.
    """

    def __init__(self, tree: Tree, waiting: Waiting, observers: Observers, guard: FutureGuard,
                 jump_back: JumpBack | None) -> None:
        """
        Begin with nothing.

        :param tree: what to fill, with the lock of those who wait for it.
        :param guard: what is too far ahead of the clock.
        :param jump_back: recognises that another run has begun; None: nobody looks for that.
        """
        self._tree = tree
        self._waiting = waiting
        self._lock = waiting.lock
        self._observers = observers
        self._guard = guard
        self._jump_back = jump_back
        self._statistics = Statistics()

    # --- taking

    def take(self, samples: list[Sample], authority: str, static: bool,
             insert: Callable[..., list[Incident]] | None = None) -> list[Incident]:
        """
        Take samples under one lock.

        :param insert: what to do with those whose stamps are good; ``insert_each`` unless given.
        """
        remarks: list[Incident] = []
        if samples and not static:
            stamps = [sample.stamp for sample in samples]
            if (self._jump_back or self._observers.of_arrivals
                    or max(stamps) > self._guard.limit):
                samples, remarks = self._screen(samples, stamps, authority)
        return self._insert(remarks, lambda: [sample.child for sample in samples],
                            insert or self.insert_each, samples, authority, static)

    def take_uncertain(self, sample: Sample, covariance: Array, authority: str,
                       static: bool) -> list[Incident]:
        """Take a sample and its covariance (6, 6) under one lock; neither if one is refused."""
        def insert(samples: list[Sample], authority: str, static: bool) -> list[Incident]:
            incidents = self.insert_each(samples, authority, static)
            if samples and not any(incident.refused for incident in incidents):
                refused = self._tree.set_covariance(*sample[:3], covariance, authority)
                self.count(0, refused)
                incidents += refused
            return incidents

        return self.take([sample], authority, static, insert)

    def take_covariance(self, parent: str, child: str, stamp: int, covariance: Array,
                        authority: str) -> list[Incident]:
        """Take the covariance (6, 6) of an edge whose poses come another way."""
        with self._lock:
            refused = self._tree.set_covariance(parent, child, stamp, covariance, authority)
            self.count(0, refused)
        return refused

    def take_estimate(self, estimate: Estimate, with_pose: bool,
                      authority: str) -> list[Incident]:
        """Take the covariance that a topic tells of an edge; its pose only if that is wanted."""
        parent, child, stamp, pose, covariance = estimate
        if with_pose:
            return self.take_uncertain(
                Sample(parent, child, stamp, pose), covariance, authority, False)
        return self.take_covariance(parent, child, stamp, covariance, authority)

    def take_rates(self, child: str, stamps: Stamps, rates: Array) -> int:
        """Take angular velocities (N, 3) at stamps (N,), sorted; see ``BufferCore.aid``."""
        with self._lock:
            return self._tree.aid(child, stamps, rates)

    def take_batch(self, batch: Batch, authority: str, static: bool) -> list[Incident]:
        """Take a whole message under one lock."""
        poses = None
        if not static and not self._guard.is_too_far(max(batch.stamps, default=LATEST)):
            poses = sound_poses(batch.poses)
        if poses is None:
            return self.take(batch.samples(), authority, static)
        if poses is not batch.poses:
            batch = batch._replace(poses=poses)
        remarks: list[Incident] = []
        if self._jump_back or self._observers.of_arrivals:
            remarks = self._arrived(batch.edges, batch.stamps, authority)
        return self._insert(remarks, lambda: [child for _, child in batch.edges],
                            self._append, batch, authority)

    def take_track(self, track: Track, authority: str) -> list[Incident]:
        """Take many samples of one moving edge."""
        if self._jump_back or (len(track.stamps)
                               and self._guard.is_too_far(int(track.stamps.max()))):
            return [incident for sample in track.samples()
                    for incident in self.take([sample], authority, False)]
        if self._observers.of_arrivals:
            self._arrived([(track.parent, track.child)] * len(track.stamps),
                          track.stamps.tolist(), authority)
        return self._insert([], lambda: [track.child],
                            self._track, track, track.judged(authority), authority)

    def take_spline(self, parent: str, child: str, spline: Spline,
                    authority: str) -> list[Incident]:
        """Let an edge move on a spline; its newest pose is told, and compared with the clock."""
        newest = Sample(parent, child, spline.latest, spline.sample(spline.latest))
        remarks: list[Incident] = []
        if (self._jump_back or self._observers.of_arrivals
                or newest.stamp > self._guard.limit):
            taken, remarks = self._screen([newest], [newest.stamp], authority)
            if not taken:
                return remarks
        return self._insert(remarks, lambda: [child], self._spline, newest, spline, authority)

    def refuse(self, incident: Incident) -> None:
        """Count something that went wrong before there was a sample to insert."""
        with self._lock:
            self.count(0, [incident])

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        with self._lock:
            counts = self._statistics
            return Statistics(counts.accepted, dict(counts.incidents), len(self._tree.frames))

    # --- before anything is inserted

    def _arrived(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int],
                 authority: str) -> list[Incident]:
        """Tell who watches, and forget what was before if another run has begun."""
        if not edges:
            return []
        self._observers.tell_arrived(edges, stamps)
        return self._judge_stamps(edges, stamps, authority)

    def _screen(self, samples: list[Sample], stamps: list[int],
                authority: str) -> tuple[list[Sample], list[Incident]]:
        """Return the samples that are not refused for their stamps, and what to tell."""
        guard = self._guard
        edges = [(sample.parent, sample.child) for sample in samples]
        if not guard.is_too_far(max(stamps)):
            return samples, self._arrived(edges, stamps, authority)
        self._observers.tell_arrived(edges, stamps)
        with self._lock:
            samples, remarks = guard.part(samples, authority, self._tree.histories)
            self.count(0, remarks)
        return samples, remarks + self._judge_stamps(
            [(sample.parent, sample.child) for sample in samples],
            [sample.stamp for sample in samples], authority)

    def _judge_stamps(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int],
                      authority: str) -> list[Incident]:
        if not self._jump_back or not edges:
            return []
        with self._lock:
            incident = self._jump_back.judge(edges, stamps, authority, self._tree.histories)
            if incident is None:
                return []
            self.count(0, [incident])
            self._forget()
        self._give_up('All stamps went back, as those of a bag that loops,')
        return [incident]

    # --- inserting, with the lock

    def _insert(self, remarks: list[Incident], children: Callable[[], Iterable[str]],
                insert: Callable[..., list[Incident]], *arguments: Any) -> list[Incident]:
        incidents = self._waiting.change(self._tree, children, insert, *arguments)
        return remarks + self._explained(incidents) if remarks or incidents else incidents

    def insert_each(self, samples: Iterable[Sample], authority: str,
                    static: bool) -> list[Incident]:
        """Insert samples one by one; the lock is held."""
        incidents: list[Incident] = []
        tree, accepted = self._tree, 0
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
        taken = self._tree.append_batch(batch, authority)
        self._statistics.accepted += taken
        if taken == len(batch.edges):
            return []
        return self.insert_each(batch.samples()[taken:], authority, False)

    def _track(self, track: Track, judged: Judged, authority: str) -> list[Incident]:
        incidents: list[Incident] = []
        tree, number = self._tree, 0
        if not len(track.stamps):
            return incidents
        history = tree.history_to_extend(track.parent, track.child, int(track.stamps.min()))
        # One by one until there is an edge that only needs more samples; nearly always after one.
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

    def _spline(self, newest: Sample, spline: Spline, authority: str) -> list[Incident]:
        sound = checked(newest, authority)
        incidents = [sound] if isinstance(sound, Incident) else self._tree.insert_spline(
            newest.parent, newest.child, spline, authority)
        self.count(not (incidents and incidents[-1].refused), incidents)
        return incidents

    def count(self, accepted: int, incidents: list[Incident]) -> None:
        """Count what was taken and what happened, and tell who watches; the lock is held."""
        self._statistics.accepted += accepted
        for incident in incidents:
            self._statistics.incidents[incident.kind] += 1
        if incidents:
            self._observers.tell_incidents(incidents)

    # --- afterwards

    def _explained(self, incidents: list[Incident]) -> list[Incident]:
        """Return incidents that say why data is old."""
        return [replace(incident, detail=f'{incident.detail}. {self._why_old(incident.newest)}')
                if incident.kind is Kind.OLD_DATA else incident for incident in incidents]

    def _why_old(self, newest: int) -> str:
        return self._guard.why_old(newest) or (
            WHY_OLD if self._jump_back else f'{WHY_OLD}. {CURE}')

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay."""
        with self._lock:
            self._forget()
            if self._jump_back:
                self._jump_back.begin()
        self._waiting.ask_again()

    def start_anew(self, why: str) -> None:
        """Forget what moves, because another time has begun, and tell everybody who waits."""
        self.clear()
        self._give_up(why)

    def read_clock_anew(self) -> None:
        """Forget what the clock was: it jumped back, or is another one now."""
        # A new guard: a thread that has just read the old clock may still write into the old one.
        self._guard = self._guard.renewed()

    def _forget(self) -> None:
        self._tree.clear()
        self.read_clock_anew()

    def _give_up(self, why: str) -> None:
        self._waiting.fail(ClockJumpException(
            f'{why} while this was waited for; the buffer was cleared'))
