"""
The buffer: a tree behind one lock, with queries and waits, and no ROS.

Every public method may be called from any thread. Nothing of a caller's, and no
long computation, runs while the lock is held.
"""

from collections.abc import Callable, Iterable
import threading
from typing import NamedTuple, TypeVar

from . import se3
from .deadline import Deadline, WallDeadline
from .errors import TransformException
from .incidents import Incident, Statistics
from .pose import Pose
from .sample import Batch, checked, Sample, unit_poses
from .se3 import PoseTuple
from .stamp import from_seconds, LATEST
from .tree import Tree
from .waiters import Waiter, Waiters, wake_all

Answer = TypeVar('Answer')

DEFAULT_CACHE_TIME = from_seconds(10.0)
DEFAULT_MAX_FRAMES = 20_000
DEFAULT_AUTHORITY = 'default_authority'


class EdgeInfo(NamedTuple):
    """What is stored of one edge: names, who sent it last, stamps in nanoseconds."""

    parent: str
    child: str
    authority: str
    static: bool
    samples: int
    oldest: int
    latest: int


class BufferCore:
    """
    Transforms between frames, over a window of time.

    ``lookup('map', 'camera', stamp)`` gives ``map_T_camera``: it takes coordinates
    in camera to coordinates in map, as everything was at the stamp. Stamps are
    integer nanoseconds; ``LATEST`` (0) is the newest time that every edge between
    the two frames has data for.

    A lookup costs O(depth log n), an insertion O(1) amortised when it is the
    newest of its edge.

    :param cache_time: how much history each edge keeps, nanoseconds.
    :param max_frames: how many frame names are let in, against a hostile publisher.
    """

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES) -> None:
        # Re-entrant, so that a wait can hold it across a query and its own registration.
        self._lock = threading.RLock()
        self._tree = Tree(DEFAULT_CACHE_TIME if cache_time is None else cache_time, max_frames)
        self._waiters = Waiters()
        self._statistics = Statistics()

    @property
    def cache_time(self) -> int:
        """How much history each edge keeps, nanoseconds."""
        return self._tree.cache_time

    # --- inserting

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False) -> list[Incident]:
        """
        Take one transform.

        :param pose: ``parent_T_child``: a ``Pose`` or seven floats, metres, quaternion x y z w.
        :param stamp: nanoseconds; of no meaning when static.
        :param static: valid at all times.
        :return: what was refused or is worth telling: empty when all is well.
        """
        x, y, z, qx, qy, qz, qw = map(float, pose)
        sample = Sample(parent, child, stamp, (x, y, z, qx, qy, qz, qw))
        return self.insert_many([sample], authority, static)

    def insert_many(self, samples: Iterable[Sample], authority: str = DEFAULT_AUTHORITY,
                    static: bool = False) -> list[Incident]:
        """Take transforms under one lock; see ``insert``."""
        samples = list(samples)
        with self._lock:
            version = self._tree.version
            incidents = self._insert_each(samples, authority, static)
            ready = self._take_ready((sample.child for sample in samples), version)
        wake_all(ready)
        return incidents

    def insert_batch(self, batch: Batch, authority: str = DEFAULT_AUTHORITY,
                     static: bool = False) -> list[Incident]:
        """Take a whole message under one lock; see ``insert``."""
        poses = None if static else unit_poses(batch.poses)
        if poses is None:
            return self.insert_many(batch.samples(), authority, static)
        packed = poses.tobytes()
        incidents: list[Incident] = []
        with self._lock:
            version = self._tree.version
            rest = self._tree.append_batch(batch, packed, authority)
            self._statistics.accepted += len(batch.edges) - len(rest)
            if rest:
                samples = batch.samples()
                incidents = self._insert_each([samples[i] for i in rest], authority, False)
            ready = self._take_ready((child for _, child in batch.edges), version)
        wake_all(ready)
        return incidents

    def _insert_each(self, samples: Iterable[Sample], authority: str,
                     static: bool) -> list[Incident]:
        incidents: list[Incident] = []
        tree, accepted = self._tree, 0
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
        self._count(accepted, incidents)
        return incidents

    def record(self, incident: Incident) -> None:
        """Count something that went wrong before there was a sample to insert."""
        with self._lock:
            self._count(0, [incident])

    def _count(self, accepted: int, incidents: list[Incident]) -> None:
        self._statistics.accepted += accepted
        for incident in incidents:
            self._statistics.incidents[incident.kind] += 1

    def _take_ready(self, touched: Iterable[str], version: int) -> list[Waiter]:
        """Take out the waiters for whom these insertions may have changed something."""
        if not self._waiters:
            return []
        if self._tree.version != version:
            return self._waiters.take_all()
        ready: list[Waiter] = []
        for child in touched:
            history = self._tree.histories.get(child.removeprefix('/'))
            if history is not None:
                ready += self._waiters.take_reached(history.child, history.latest_stamp or LATEST)
        return ready

    # --- asking

    def lookup(self, target_frame: str, source_frame: str, stamp: int = LATEST) -> Pose:
        """
        Return ``target_T_source`` at a stamp.

        :param stamp: nanoseconds, or ``LATEST``.
        :raises InvalidArgumentException: a name that cannot be a frame.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        :raises ExtrapolationException: an edge between them has no data for the stamp.
        """
        return Pose._make(self.lookup_stamped(target_frame, source_frame, stamp)[1])

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: int = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp that ``LATEST`` came to, and the pose; see ``lookup``."""
        try:
            with self._lock:
                if target_frame == source_frame:
                    return self._own_stamp(target_frame, stamp), se3.IDENTITY
                path = self._tree.path(target_frame, source_frame, stamp)
                if stamp == LATEST:
                    stamp = path.latest_common_time()
                    if not path.fixed:
                        path = self._tree.path(target_frame, source_frame, stamp)
                return stamp, path.pose_at(stamp)
        except TransformException as error:
            error.target_frame, error.source_frame = target_frame, source_frame
            raise

    def lookup_full(self, target_frame: str, target_stamp: int, source_frame: str,
                    source_stamp: int, fixed_frame: str) -> Pose:
        """
        Return ``target_T_source`` between two times, through a frame that stays put.

        (target <- fixed at target_stamp) (fixed <- source at source_stamp): where a
        thing seen from the source then is for the target now, if it did not move in
        the fixed frame. Raises as ``lookup`` does.
        """
        return Pose._make(self.lookup_full_stamped(
            target_frame, target_stamp, source_frame, source_stamp, fixed_frame)[1])

    def lookup_full_stamped(self, target_frame: str, target_stamp: int, source_frame: str,
                            source_stamp: int, fixed_frame: str) -> tuple[int, PoseTuple]:
        """Return what ``target_stamp`` came to, and the pose; see ``lookup_full``."""
        with self._lock:
            self._tree.check_frame('target_frame', target_frame)
            self._tree.check_frame('source_frame', source_frame)
            self._tree.check_frame('fixed_frame', fixed_frame)
            _, fixed_T_source = self.lookup_stamped(fixed_frame, source_frame, source_stamp)
            stamp, target_T_fixed = self.lookup_stamped(target_frame, fixed_frame, target_stamp)
        return stamp, se3.compose(target_T_fixed, fixed_T_source)

    def latest_common_time(self, target_frame: str, source_frame: str) -> int:
        """
        Return what ``LATEST`` comes to between two frames, nanoseconds.

        ``LATEST`` itself when nothing between them moves. Raises as ``lookup`` does,
        but for extrapolation.
        """
        with self._lock:
            self._tree.check_frame('target_frame', target_frame)
            self._tree.check_frame('source_frame', source_frame)
            if target_frame == source_frame:
                return self._own_stamp(target_frame, LATEST)
            return self._tree.path(target_frame, source_frame, LATEST).latest_common_time()

    def _own_stamp(self, frame: str, stamp: int) -> int:
        """Return the stamp of a frame's transform to itself: as asked, or its own newest."""
        if stamp != LATEST or frame not in self._tree.histories:
            return stamp
        return self._tree.histories[frame].latest_stamp or LATEST

    # --- waiting

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """
        Return a query's answer as soon as it has one.

        Sleeps until what blocks the query arrives; nothing is polled.

        :param query: such as ``lambda: buffer.lookup('map', 'camera', stamp)``.
        :param deadline: how long to wait.
        :raises TransformException: the query's own error, with ``waited_s``, when time
            is up; or at once when waiting cannot help (older than the buffer keeps).
        """
        event = threading.Event()
        waiter = Waiter(event.set)
        try:
            while True:
                with self._lock:
                    if waiter.failure is not None:
                        raise waiter.failure
                    event.clear()
                    try:
                        return query()
                    except TransformException as error:
                        if error.blocked_on is None:
                            raise
                        self._waiters.add(waiter, error.blocked_on)
                        reason = error
                if not deadline.wait(event):
                    reason.waited_s = deadline.elapsed_s()
                    raise reason
        finally:
            with self._lock:
                self._waiters.discard(waiter)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> Pose:
        """Return ``lookup``, waiting for the data for so many seconds of wall time."""
        return self.wait_for(lambda: self.lookup(target_frame, source_frame, stamp),
                             WallDeadline(timeout_s))

    def fail_waiters(self, failure: TransformException) -> None:
        """Make everybody who waits give up with an error."""
        with self._lock:
            waiters = self._waiters.take_all()
            for waiter in waiters:
                waiter.failure = failure
        wake_all(waiters)

    # --- looking around, forgetting

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge that has data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [EdgeInfo(history.parent, history.child, history.authority, history.is_static,
                             len(history), history.oldest_stamp or 0, history.latest_stamp or 0)
                    for history in histories if history.parent is not None]

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        with self._lock:
            counts = self._statistics
            return Statistics(counts.accepted, dict(counts.incidents), len(self._tree.frames))

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        with self._lock:
            self._tree.clear()

    def remove_frame(self, frame: str) -> bool:
        """
        Forget a frame's edge, and its name unless another hangs on it.

        :return: whether it was known.
        """
        with self._lock:
            return self._tree.remove(frame)
