"""
The buffer: a tree behind one lock, fed, asked and waited for, without ROS.

Every public method may be called from any thread. While the lock is held, no long
computation runs, and of callers' code only the query that ``wait_for`` was given.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from operator import attrgetter
import threading
from typing import Any, NoReturn, TypeVar
import warnings

import numpy.typing as npt

from .deadline import Deadline, WallDeadline
from .waiters import Waiter, Waiters, wake_all
from ..arrivals.future_guard import FutureGuard
from ..arrivals.incidents import Incident, Kind, RefusedException, Statistics, TransformWarning
from ..arrivals.jump_back import CURE, JumpBack, WHY_OLD
from ..arrivals.meters import Meter
from ..arrivals.sample import admitted, Batch, checked, Sample, sound_poses
from ..arrivals.track import checked_track, Judged, Track
from ..errors import ClockJumpException, TransformException
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
    Transforms between frames, over a window of time. ``Queries`` has the lookups.

    A lookup costs O(depth log n), an insertion O(1) amortised when it is the
    newest of its edge.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s unless given,
        and with ``UNLIMITED`` everything.
    :param max_frames: how many frame names are taken: a hostile publisher may send any
        number.
    :param max_name_bytes: how many bytes of UTF-8 a frame name may have, likewise.
    :param now: the clock that the stamps are taken from, nanoseconds, such as
        ``time.time_ns``; stamps far ahead of it are reported. None: stamps may be of any
        time.
    :param max_future: how far ahead of the clock a stamp may be, nanoseconds; what is
        further is refused. None: it is taken, as in tf2.
    :param clear_on_jump_back: forget what moves when stamps jump back by more than this,
        nanoseconds, as those of a looping bag do: see ``JumpBack``. None: refuse what is
        older than the window, as tf2 does.
    """

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 now: Callable[[], int] | None = None,
                 max_future: int | None = None, clear_on_jump_back: int | None = None) -> None:
        super().__init__(Tree(
            DEFAULT_CACHE_TIME if cache_time is None else checked_cache_time(cache_time),
            max_frames, max_name_bytes))
        self._waiters = Waiters()
        self._statistics = Statistics()
        self._guard = FutureGuard(now, max_future)
        self._jump_back = None if clear_on_jump_back is None else JumpBack(clear_on_jump_back)
        self._meters: tuple[Meter, ...] = ()
        # Whether more is to be done about a message than to insert it.
        self._attentive = self._jump_back is not None
        # What a program that inserts by itself was warned of.
        self._warned: set[Hashable] = set()
        # Why everybody who waited was last made to give up: who began with another one.
        self._failure: TransformException | None = None

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
        if self._attentive or (len(track.stamps)
                               and self._guard.is_too_far(int(track.stamps.max()))):
            return [incident for sample in track.samples()
                    for incident in self._insert([sample], [sample.stamp], authority, False)]
        judged = track.judged(authority)
        ready: list[Waiter] = []
        try:
            with self._lock:
                version = self._tree.version
                try:
                    incidents = self._insert_track(track, judged, authority)
                finally:
                    ready = self._take_ready((track.child,), version)
        finally:
            wake_all(ready)
        return self._explained(incidents)

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
        incidents: list[Incident] = []
        told: list[Incident] = []
        if self._attentive:
            self._measure(batch.edges, batch.stamps)
            told = self._follow(batch.edges, batch.stamps, authority)
        ready: list[Waiter] = []
        try:
            with self._lock:
                version = self._tree.version
                try:
                    taken = self._tree.append_batch(batch, authority)
                    self._statistics.accepted += taken
                    if taken < len(batch.edges):
                        incidents = self._insert_each(batch.samples()[taken:], authority, static)
                finally:
                    ready = self._take_ready((child for _, child in batch.edges), version)
        finally:
            wake_all(ready)
        return told + self._explained(incidents) if told or incidents else incidents

    def _insert(self, samples: list[Sample], stamps: Sequence[int], authority: str,
                static: bool) -> list[Incident]:
        told: list[Incident] = []
        if stamps and not static and (self._attentive or max(stamps) > self._guard.limit):
            samples, told = self._in_time(samples, authority)
        ready: list[Waiter] = []
        try:
            with self._lock:
                version = self._tree.version
                try:
                    incidents = self._insert_each(samples, authority, static)
                finally:
                    ready = self._take_ready((sample.child for sample in samples), version)
        finally:
            wake_all(ready)
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
        if self._attentive:
            self._measure(_edges_of(samples), [sample.stamp for sample in samples])
        guard = self._guard
        if guard.is_too_far(max(map(_stamp_of, samples))):
            with self._lock:
                samples, told = guard.part(samples, authority, self._tree.histories)
                self._count(0, told)
        if self._jump_back:
            told += self._follow(_edges_of(samples), [sample.stamp for sample in samples],
                                 authority)
        return samples, told

    def _measure(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int]) -> None:
        for meter in self._meters:
            meter.arrived(edges, stamps)

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
            for meter in self._meters:
                meter.told(incidents)

    def _observe(self, meter: Meter) -> None:
        """Let a meter count what arrives from now on."""
        with self._lock:
            self._meters += (meter,)
            self._attentive = True

    def _unobserve(self, meter: Meter) -> None:
        """Let a meter go."""
        with self._lock:
            self._meters = tuple(other for other in self._meters if other is not meter)
            self._attentive = bool(self._meters or self._jump_back)

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        with self._lock:
            counts = self._statistics
            return Statistics(counts.accepted, dict(counts.incidents), len(self._tree.frames))

    def _take_ready(self, touched: Iterable[str], version: int) -> list[Waiter]:
        """Take out the waiters for whom these insertions may have changed something."""
        tree, waiters = self._tree, self._waiters
        if not waiters:
            return []
        if tree.version != version:
            return waiters.take_all()
        ready: list[Waiter] = []
        for child in touched:
            history = tree.histories.get(child)
            if history is not None and history.latest_stamp is not None:
                ready += waiters.take_reached(child, history.latest_stamp)
        return ready

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
        event = threading.Event()
        waiter = Waiter(event.set)
        slept = over = False
        before = None
        try:
            while True:
                with self._lock:
                    if slept:
                        self._raise_failure_since(before)
                    before = self._failure
                    event.clear()
                    try:
                        return query()
                    except TransformException as error:
                        if over or error.blocked_on is None:
                            raise
                        self._waiters.add(waiter, error.blocked_on)
                slept = True
                over = not deadline.wait(event)
        except TransformException as error:
            if slept:
                error.waited_s = deadline.elapsed_s()
            raise
        finally:
            with self._lock:
                self._waiters.discard(waiter)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> Pose:
        """Return ``lookup``, waiting for the data for so many seconds of wall time."""
        return self.wait_for(lambda: self.lookup(target_frame, source_frame, stamp),
                             WallDeadline(timeout_s))

    def _sleep_until_waited_for(self, timeout_s: float) -> None:
        """Sleep, but not while anybody waits for data: for those who deliver it."""
        self._waiters.somebody.wait(timeout_s)

    def _fail_waiters(self, failure: TransformException) -> None:
        """Make everybody who waits give up with an error."""
        with self._lock:
            self._failure = copy(failure)
            waiters = self._waiters.take_all()
        wake_all(waiters)

    def _raise_failure_since(self, before: TransformException | None) -> None:
        """Raise why everybody was made to give up, if that was since another time."""
        if self._failure is not None and self._failure is not before:
            # A copy, for the same one may be raised in several threads.
            raise copy(self._failure)

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        with self._lock:
            self._forget()
            if self._jump_back:
                self._jump_back.begin()
            ready = self._waiters.take_all()
        wake_all(ready)

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
        self._fail_waiters(ClockJumpException(
            f'{why} while this was waited for; the buffer was cleared'))

    def remove_frame(self, frame: str) -> bool:
        """
        Forget a frame's edge, and its name unless another hangs on it.

        :return: whether it was known.
        """
        with self._lock:
            known = self._tree.remove(frame)
            ready = self._waiters.take_all() if known else []
        wake_all(ready)
        return known


def _edges_of(samples: Iterable[Sample]) -> list[tuple[str, str]]:
    return [(sample.parent, sample.child) for sample in samples]
