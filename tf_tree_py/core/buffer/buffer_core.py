"""
The buffer: a tree behind one lock, fed, asked and waited for, without ROS.

Every public method may be called from any thread. No long computation runs while
the lock is held, and nothing of a caller's but the query that ``wait_for`` is given.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any, NoReturn, TypeVar
import warnings

import numpy.typing as npt

from .deadline import Deadline, WallDeadline
from .waiting import Waiting
from ..arrivals.future_guard import FutureGuard
from ..arrivals.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from ..arrivals.jump_back import CURE, JumpBack, WHY_OLD
from ..arrivals.observers import asked, Observers
from ..arrivals.sample import admitted, Batch, checked, Sample, sound_poses
from ..arrivals.track import checked_track, Judged, Track
from ..errors import ClockJumpException
from ..geometry.pose import Pose
from ..geometry.poses import checked_pose
from ..geometry.se3 import PoseTuple
from ..stamp import from_seconds, LATEST
from ..times import checked_cache_time
from ..tree.queries import Queries
from ..tree.tree import Tree

Answer = TypeVar('Answer')

DEFAULT_CACHE_TIME = from_seconds(10.0)
DEFAULT_MAX_FRAMES = 20_000
DEFAULT_MAX_NAME_BYTES = 1024
DEFAULT_AUTHORITY = 'default_authority'

_stamp_of = attrgetter('stamp')


class BufferCore(Queries):
    """
    Transforms between frames, over a window of time; what to ask it stands in ``Queries``.

    A lookup costs O(depth log n), an insertion O(1) amortised when it is the
    newest of its edge.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s unless given,
        and with ``UNLIMITED`` everything.
    :param max_frames: how many frame names are let in, against a hostile publisher.
    :param max_name_bytes: how long a frame name may be in UTF-8, likewise.
    :param now: the clock that stamps go by, nanoseconds, such as ``time.time_ns``; what
        is far ahead of it is told. None: stamps may be of any time.
    :param max_future: how far ahead of it a stamp may be, nanoseconds; what is further
        is refused. None: it is taken, as tf2 does.
    :param clear_on_jump_back: forget what moves when stamps jump back by more than so
        many nanoseconds, as those of a looping bag do: see ``JumpBack``. None: refuse
        what is older than the window, as tf2 does.
    """

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 now: Callable[[], int] | None = None,
                 max_future: int | None = None, clear_on_jump_back: int | None = None) -> None:
        super().__init__(Tree(
            DEFAULT_CACHE_TIME if cache_time is None else checked_cache_time(cache_time),
            max_frames, max_name_bytes))
        self.waiting = Waiting(self._lock)
        """All who wait for data; its length is how many."""
        self._statistics = Statistics()
        self._guard = FutureGuard(now, max_future)
        self._jump_back = None if clear_on_jump_back is None else JumpBack(clear_on_jump_back)
        self.observers = Observers()
        # What a program that inserts by itself was warned of.
        self._warned: set[Hashable] = set()

    def __reduce__(self) -> NoReturn:
        raise TypeError(f'a {type(self).__name__} can be neither pickled nor copied, for others '
                        'may wait in it: its snapshot() can')

    # --- inserting

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None) -> list[Incident]:
        """
        Take one transform.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; of no meaning when static.
        :param static: valid at all times.
        :param strict: True raises what is refused; None warns of it, once for each kind;
            False does neither, for programs that look at what is returned.
        :return: what was refused or is worth telling: empty when all is well.
        :raises InvalidArgumentException: what is no stamp, no pose, or a name that is no
            string.
        :raises RefusedException: with ``strict``, after all that is good was taken.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self._told(self._insert([sample], [sample.stamp], authority, static), strict)

    def insert_many(self, samples: Iterable[Sample], authority: str = DEFAULT_AUTHORITY,
                    static: bool = False, *, strict: bool | None = None) -> list[Incident]:
        """
        Take transforms under one lock; see ``insert``.

        Where a name or a stamp is none, nothing is taken.
        """
        samples = [admitted(sample) for sample in samples]
        return self._told(self._insert(
            samples, [sample.stamp for sample in samples], authority, static), strict)

    def insert_track(self, parent: str, child: str, stamps: npt.ArrayLike, poses: Any, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Take many samples of one moving edge, as ``insert`` would one by one.

        At the speed of memory, where they are not older than what the buffer keeps.

        :param stamps: (N,) nanoseconds, in order of arrival.
        :param poses: ``parent_T_child``: (N, 7) metres and quaternion x y z w, (N, 4, 4)
            matrices, or N poses of any kind that ``insert`` takes.
        :param strict: as ``insert`` has it; unless it is False, samples that the buffer
            does not keep are warned of too.
        :return: what was refused or is worth telling: empty when all is well.
        :raises InvalidArgumentException: what are no stamps, no poses, or not as many.
        :raises RefusedException: with ``strict``, after all that is good was taken.
        """
        track = checked_track(parent, child, self._stamps_of(stamps), poses)
        incidents = self._take_track(track, authority)
        if strict is not False and track.span > self.cache_time:
            self._warn('window', track.gone(self.cache_time), 2)
        return self._told(incidents, strict)

    def _take_track(self, track: Track, authority: str) -> list[Incident]:
        if self._jump_back or (len(track.stamps)
                               and self._guard.is_too_far(int(track.stamps.max()))):
            return [incident for sample in track.samples()
                    for incident in self._insert([sample], [sample.stamp], authority, False)]
        if self.observers.of_arrivals and len(track.stamps):
            self.observers.tell_arrived(
                [(track.parent, track.child)] * len(track.stamps), track.stamps.tolist())
        return self._explained(self.waiting.change(
            self._tree, lambda: (track.child,),
            self._insert_track, track, track.judged(authority), authority))

    def _insert_track(self, track: Track, judged: Judged, authority: str) -> list[Incident]:
        incidents: list[Incident] = []
        tree, earliest, history = self._tree, track.earliest_after(), None
        # One by one until there is an edge that only needs more samples: one, nearly always.
        for number in range(len(track.stamps)):
            history = tree.history_to_extend(track.parent, track.child, earliest[number])
            if history is not None:
                break
            incidents += self._insert_each([track.sample(number)], authority, False)
        if history is None:
            return incidents
        rest, refused = judged.after(number)
        if not rest.is_within(history):
            return incidents + self._insert_each(track.samples(number), authority, False)
        if len(rest.stamps):
            tree.extend(history, rest.stamps, rest.poses, authority)
        self._count(len(rest.stamps), refused)
        return incidents + refused

    def _told(self, incidents: list[Incident], strict: bool | None) -> list[Incident]:
        """Return what happened, having told a caller of it who may not look at that."""
        if not incidents or strict is False:
            return incidents
        refused = [incident for incident in incidents if incident.refused]
        if strict and refused:
            more = f' ({len(refused)} were refused)' if len(refused) > 1 else ''
            raise RefusedException(f'{refused[0]}{more}', incidents=refused)
        for incident in incidents:
            self._warn(incident.kind, f'{incident}. Of this kind that was the first, and no more '
                                      'are told here: the call returns them, and statistics() '
                                      'counts them; strict=True raises them', 3)
        return incidents

    def _warn(self, what: Hashable, text: str, callers: int) -> None:
        """Warn of something for the first time, where it is called from by so many calls."""
        if what not in self._warned:
            self._warned.add(what)
            warnings.warn(text, TransformWarning, stacklevel=callers + 1)

    def insert_batch(self, batch: Batch, authority: str = DEFAULT_AUTHORITY,
                     static: bool = False) -> list[Incident]:
        """Take a whole message under one lock; see ``insert``."""
        poses = None
        if not static and not self._guard.is_too_far(max(batch.stamps, default=LATEST)):
            poses = sound_poses(batch.poses)
        if poses is None:
            return self._insert(batch.samples(), batch.stamps, authority, static)
        if poses is not batch.poses:
            batch = batch._replace(poses=poses)
        told: list[Incident] = []
        if batch.edges and self.observers.of_arrivals:
            self.observers.tell_arrived(batch.edges, batch.stamps)
        if self._jump_back:
            told = self._follow(batch.edges, batch.stamps, authority)
        incidents = self.waiting.change(
            self._tree, lambda: [child for _, child in batch.edges],
            self._append, batch, authority)
        return told + self._explained(incidents) if told or incidents else incidents

    def _append(self, batch: Batch, authority: str) -> list[Incident]:
        taken = self._tree.append_batch(batch, authority)
        self._statistics.accepted += taken
        if taken == len(batch.edges):
            return []
        return self._insert_each(batch.samples()[taken:], authority, False)

    def _insert(self, samples: list[Sample], stamps: Sequence[int], authority: str,
                static: bool) -> list[Incident]:
        told: list[Incident] = []
        if stamps and not static and (self._jump_back or self.observers.of_arrivals
                                      or max(stamps) > self._guard.limit):
            samples, told = self._in_time(samples, authority)
        incidents = self.waiting.change(
            self._tree, lambda: [sample.child for sample in samples],
            self._insert_each, samples, authority, static)
        return told + self._explained(incidents) if told or incidents else incidents

    def _insert_each(self, samples: Iterable[Sample], authority: str,
                     static: bool) -> list[Incident]:
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
                told = tree.insert(*sound, authority, static)
                incidents += told
                accepted += not (told and told[-1].refused)
        finally:
            self._count(accepted, incidents)
        return incidents

    def _in_time(self, samples: list[Sample],
                 authority: str) -> tuple[list[Sample], list[Incident]]:
        """Return the samples that are not refused for their stamps, and what to tell."""
        told: list[Incident] = []
        if self.observers.of_arrivals:
            self.observers.tell_arrived(
                _edges_of(samples), [sample.stamp for sample in samples])
        guard = self._guard
        if guard.is_too_far(max(map(_stamp_of, samples))):
            with self._lock:
                samples, told = guard.part(samples, authority, self._tree.histories)
                self._count(0, told)
        if self._jump_back:
            told += self._follow(_edges_of(samples), [sample.stamp for sample in samples],
                                 authority)
        return samples, told

    def _follow(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int],
                authority: str) -> list[Incident]:
        """Forget what moves if these stamps show that another run has begun, and tell it."""
        if not self._jump_back or not edges:
            return []
        with self._lock:
            incident = self._jump_back.follow(edges, stamps, authority, self._tree.histories)
            if incident is None:
                return []
            self._count(0, [incident])
            self._forget()
        self._give_up('All stamps went back, as those of a bag that loops,')
        return [incident]

    def _explained(self, incidents: list[Incident]) -> list[Incident]:
        """Return incidents that say why data is old."""
        return [replace(incident, detail=f'{incident.detail}. {self._why_old(incident.newest)}')
                if incident.kind is Kind.OLD_DATA else incident for incident in incidents]

    def _why_old(self, newest: int) -> str:
        return self._guard.why_old(newest) or (
            WHY_OLD if self._jump_back else f'{WHY_OLD}. {CURE}')

    def _record(self, incident: Incident) -> None:
        """Count something that went wrong before there was a sample to insert."""
        with self._lock:
            self._count(0, [incident])

    def _count(self, accepted: int, incidents: list[Incident]) -> None:
        self._statistics.accepted += accepted
        for incident in incidents:
            self._statistics.incidents[incident.kind] += 1
        if incidents:
            self.observers.tell_incidents(incidents)

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        with self._lock:
            counts = self._statistics
            return Statistics(counts.accepted, dict(counts.incidents), len(self._tree.frames))

    # --- waiting

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """
        Return a query's answer as soon as it has one.

        Sleeps until what blocks the query arrives; nothing is polled.

        :param query: such as ``lambda: buffer.lookup('map', 'camera', stamp)``; with the
            lock held, so that nothing arrives between its failure and the wait.
        :param deadline: how long to wait.
        :raises TransformException: the query's own error, with ``waited_s``, when time
            is up; or at once when waiting cannot help (older than the buffer keeps).
        """
        return self.waiting.wait_for(query, deadline)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> Pose:
        """Return ``lookup``, waiting for the data for so many seconds of wall time."""
        return self.observers.watch(
            [asked(target_frame, source_frame, stamp)], lambda: self.wait_for(
                lambda: self.lookup(target_frame, source_frame, stamp), WallDeadline(timeout_s)))

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        with self._lock:
            self._forget()
            if self._jump_back:
                self._jump_back.begin()
        self.waiting.ask_again()

    def start_anew(self, why: str) -> None:
        """
        Forget what moves, because another time has begun, and tell everybody who waits.

        :param why: the beginning of a sentence.
        """
        self.clear()
        self._give_up(why)

    def _forget(self) -> None:
        self._tree.clear()
        self._read_clock_anew()

    def _read_clock_anew(self) -> None:
        """Forget what the clock was: it jumped back, or is another one now."""
        # A new one, so that a thread that just read the clock does not spoil it.
        self._guard = self._guard.renewed()

    def _give_up(self, why: str) -> None:
        self.waiting.fail(ClockJumpException(
            f'{why} while this was waited for; the buffer was cleared'))

    def remove_frame(self, frame: str) -> bool:
        """
        Forget a frame's edge, and its name unless another hangs on it.

        :return: whether it was known.
        """
        with self._lock:
            known = self._tree.remove(frame)
        if known:
            self.waiting.ask_again()
        return known


def _edges_of(samples: Iterable[Sample]) -> list[tuple[str, str]]:
    return [(sample.parent, sample.child) for sample in samples]
