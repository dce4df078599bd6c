# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The buffer, without ROS: a tree with a lock, insertion, lookups and waiting.

Every public method is thread-safe. While the lock is held, no long computation of this package
runs. Of a caller's code, the query passed to ``wait_for``, observers, interpolations and curves
run then: all other threads wait as long as these take. If a program inserts a transform that is
refused, Python warnings and exceptions say so.
"""

from collections.abc import Callable, Hashable, Iterable
from typing import NoReturn, TypeVar

from .intake import Intake
from .waiting import Deadline, Waiting, WallDeadline
from ..edges.interpolation import checked_interpolation, Interpolation
from ..errors import warn
from ..geometry.pose import Pose
from ..geometry.poses import checked_pose, PoseLike, PosesLike
from ..messages.guards import FutureGuard, JumpBack
from ..messages.incidents import Incident, RefusedException, Statistics, TransformWarning
from ..messages.observers import asked, Observers
from ..messages.sample import admitted, Batch, checked_frame, checked_track, Sample
from ..stamp import from_seconds, LATEST
from ..times import checked_cache_time, Stamp, StampsLike
from ..tree.queries import Queries
from ..tree.tree import Tree

Answer = TypeVar('Answer')

DEFAULT_CACHE_TIME = from_seconds(10.0)
DEFAULT_MAX_FRAMES = 20_000
DEFAULT_MAX_NAME_BYTES = 1024
DEFAULT_AUTHORITY = 'default_authority'


class PlainBuffer(Queries):
    """
    Transforms between frames over a window of time. ``Queries`` has the lookups.

    A lookup costs O(depth log n). The insertion of an edge's newest sample costs O(1)
    amortised.

    :param cache_time: how much history each edge keeps, nanoseconds; 10 s by default;
        ``UNLIMITED`` keeps everything.
    :param max_frames: the maximum number of frame names, which limits the damage that a
        hostile publisher can do.
    :param max_name_bytes: the maximum bytes of a frame name in UTF-8, for the same reason.
    :param now: the clock that the stamps are taken from, nanoseconds, such as
        ``time.time_ns``; stamps far ahead of it are reported, and errors suggest a timeout.
        None: all stamps are accepted, and errors assume that no more data arrives.
    :param max_future: how far ahead of the clock a stamp may be, nanoseconds; later stamps
        are refused. None: they are accepted, as in tf2.
    :param clear_on_jump_back: clear all moving edges when stamps jump back by more than
        this, nanoseconds, as in a looping bag: see ``JumpBack``. None: refuse samples that
        are older than the window, as tf2 does.
    """

    tree_class: type[Tree] = Tree

    def __init__(self, cache_time: int | None = None, *,
                 max_frames: int = DEFAULT_MAX_FRAMES,
                 max_name_bytes: int = DEFAULT_MAX_NAME_BYTES,
                 now: Callable[[], int] | None = None,
                 max_future: int | None = None, clear_on_jump_back: int | None = None) -> None:
        tree = self.tree_class(
            DEFAULT_CACHE_TIME if cache_time is None else checked_cache_time(cache_time),
            max_frames, max_name_bytes)
        tree.live = now is not None
        super().__init__(tree)
        self.waiting = Waiting(self._lock)
        """The waiters for data; its length is their number."""
        self.observers = Observers()
        self.intake = Intake(
            tree, self.waiting, self.observers, FutureGuard(now, max_future),
            None if clear_on_jump_back is None else JumpBack(clear_on_jump_back))
        """Inserts samples that have already been checked."""
        self._refusals = RefusalWarnings()

    def __reduce__(self) -> NoReturn:
        raise TypeError(f'a {type(self).__name__} cannot be pickled or copied, because threads '
                        'may wait in it: pickle its snapshot()')

    # --- inserting

    def insert(self, parent: str, child: str, stamp: Stamp, pose: PoseLike, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None) -> list[Incident]:
        """
        Insert one transform.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; ignored for static transforms.
        :param static: whether the transform is valid at all times.
        :param strict: True raises an exception if a transform is refused; None issues a Python
            warning, once for each kind; False does neither, for callers that check the returned
            incidents.
        :return: the incidents: empty if the transform was inserted without a remark.
        :raises InvalidArgumentException: an invalid stamp or pose, or a name that is not a
            string.
        :raises RefusedException: with ``strict``, after all valid transforms were inserted.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        return self._refusals.report(self.intake.insert([sample], authority, static), strict)

    def insert_many(self, samples: Iterable[Sample], authority: str = DEFAULT_AUTHORITY,
                    static: bool = False, *, strict: bool | None = None) -> list[Incident]:
        """
        Insert transforms while holding the lock once; see ``insert``.

        If a name or a stamp is invalid, or something is not a pose, none is inserted.
        """
        samples = [admitted(Sample(parent, child, stamp, checked_pose(pose)))
                   for parent, child, stamp, pose in samples]
        return self._refusals.report(self.intake.insert(samples, authority, static), strict)

    def insert_track(self, parent: str, child: str, stamps: StampsLike, poses: PosesLike, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Insert many samples of one moving edge, with the result of single calls of ``insert``.

        It costs about as much as copying memory, unless some are older than the buffer keeps.

        :param stamps: (N,) nanoseconds, in order of arrival.
        :param poses: ``parent_T_child``: (N, 7) metres and quaternion x y z w, (N, 4, 4)
            matrices, or N poses of any kind that ``insert`` takes.
        :param strict: as in ``insert``; unless it is False, a warning also reports samples
            that the buffer does not keep.
        :return: the incidents: empty if all were inserted without a remark.
        :raises InvalidArgumentException: invalid stamps or poses, or different numbers of them.
        :raises RefusedException: with ``strict``, after all valid samples were inserted.
        """
        track = checked_track(parent, child, self._stamps_of(stamps), poses)
        incidents = self.intake.insert_track(track, authority)
        if strict is not False and track.span > self.cache_time:
            self._refusals.report_lost(track.gone(self.cache_time))
        return self._refusals.report(incidents, strict)

    def insert_batch(self, batch: Batch, authority: str = DEFAULT_AUTHORITY,
                     static: bool = False, *, announced: bool = False) -> list[Incident]:
        """
        Insert a whole message while holding the lock once; see ``insert``.

        :param announced: whether observers were already notified of the message, with its topic.
        """
        return self.intake.insert_batch(batch, authority, static, announced)

    def set_interpolation(self, child_frame: str, interpolation: Interpolation) -> None:
        """
        Choose how a frame's edge moves between its samples, in place of ``Linear``.

        It applies to samples that are stored, and that arrive later, until the frame is removed or
        its edge becomes static or a curve. A gyroscope of the edge keeps measuring rotations.

        :param child_frame: its samples may arrive later.
        :param interpolation: see ``Interpolation``; it may be used for several edges.
        :raises InvalidArgumentException: not an interpolation, or the edge is static or a curve.
        """
        child = checked_frame(child_frame)
        with self._lock:
            self._tree.interpolate(child, checked_interpolation(interpolation))
        self.waiting.ask_again()

    def statistics(self) -> Statistics:
        """Return a copy of the counts."""
        return self.intake.statistics()

    # --- waiting

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """
        Return a query's answer as soon as it has one.

        It sleeps until the data that the query lacks arrives; it does not poll.

        :param query: such as ``lambda: buffer.lookup('map', 'camera', stamp)``. It is called
            with the lock held, so that no data arrives between its failure and the wait.
        :param deadline: how long to wait.
        :raises TransformException: the query's own error, with ``waited_s``, at the deadline;
            or immediately if waiting cannot help, as for a stamp that is older than the
            buffer keeps.
        """
        return self.waiting.wait_for(query, lambda _: deadline)

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: Stamp = LATEST) -> Pose:
        """Return ``lookup``, after waiting at most this many seconds of wall time for data."""
        checked = self._stamp_of(stamp)
        return self.observers.watch(
            [asked(target_frame, source_frame, checked)], lambda: self.wait_for(
                lambda: self.lookup(target_frame, source_frame, checked),
                WallDeadline(timeout_s)))

    # --- forgetting

    def clear(self) -> None:
        """Clear all moving edges; frame names and static edges stay, as in tf2."""
        self.intake.clear()

    def start_anew(self, why: str) -> None:
        """
        Clear all moving edges, because time has restarted, and make all waiters fail.

        :param why: the reason as a clause, for their error and those of lookups.
        """
        self.intake.start_anew(why)

    def remove_frame(self, frame: str) -> bool:
        """
        Remove a frame's edge, and also its name unless the frame has children.

        :return: whether the frame was known.
        """
        with self._lock:
            known = self._tree.remove(frame)
        if known:
            self.waiting.ask_again()
        return known


# --- warnings

class RefusalWarnings:
    """Raises an exception about refused transforms, or warns once for each kind, or neither."""

    def __init__(self) -> None:
        # Without a lock: at worst, two threads warn of the same kind.
        self._warned: set[Hashable] = set()

    def report(self, incidents: list[Incident], strict: bool | None) -> list[Incident]:
        """
        Report incidents to the caller, and return them.

        :param strict: see ``BufferCore.insert``.
        :raises RefusedException: with ``strict``, if one of them was refused.
        """
        if not incidents or strict is False:
            return incidents
        refused = [incident for incident in incidents if incident.refused]
        if strict and refused:
            more = f' ({len(refused)} were refused)' if len(refused) > 1 else ''
            raise RefusedException(f'{refused[0]}{more}', incidents=refused)
        for incident in incidents:
            self._warn(incident.kind, f'{incident}. Later incidents of this kind cause no '
                                      'warning: the call returns them, and statistics() counts '
                                      'them. Pass strict=True to raise an exception instead')
        return incidents

    def report_lost(self, text: str) -> None:
        """Warn about samples that were older than the buffer keeps when they were inserted."""
        self._warn('window', text)

    def _warn(self, what: Hashable, text: str) -> None:
        if what not in self._warned:
            self._warned.add(what)
            warn(text, TransformWarning)
