# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups of one pose, and of the path between two frames.

``queries`` has the lookups at many stamps, and all other queries.
"""

from collections.abc import Callable
from typing import Any

from .outline import EdgeInfo, info_at
from .tree import Tree
from .. import fork_locks
from ..errors import Blocker, TransformException
from ..geometry import se3
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple
from ..messages.observers import asked, halves, NOBODY, Observers
from ..stamp import LATEST
from ..times import checked_stamp, checked_stamps, Stamp, Stamps, StampsLike


class Lookups:
    """
    Thread-safe lookups on a tree.

    ``lookup('map', 'camera', stamp)`` returns ``map_T_camera``: it transforms coordinates in
    camera to coordinates in map, at the stamp. Stamps are integer nanoseconds. In ``lookup``
    and other lookups of one pose, the stamp 0 is ``LATEST``, as in tf2: the newest time for
    which every edge between the two frames has data. In ``lookup_at``, and in all lookups at
    many stamps, 0 is an ordinary stamp, for data whose time begins at 0.
    """

    def __init__(self, tree: Tree) -> None:
        # Re-entrant, so that a wait can hold it during both a query and its own registration.
        self._lock = fork_locks.rlock()
        self._tree = tree

    # A snapshot has no observers.
    observers: Observers = NOBODY
    """The observers of lookups; see ``Observer``."""

    # Converts callers' stamps to integers; ``ros`` also accepts ROS times.
    _stamp_of: Callable[[Any], int] = staticmethod(checked_stamp)

    def _stamps_of(self, stamps: StampsLike) -> Stamps:
        return checked_stamps(stamps, self._stamp_of)

    @property
    def cache_time(self) -> int:
        """Return how much history each edge keeps, nanoseconds."""
        return self._tree.cache_time

    # --- one pose

    def lookup(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST) -> Pose:
        """
        Return ``target_T_source`` at a stamp.

        :param stamp: nanoseconds, or ``LATEST``.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer.
        :raises LookupException: an unknown frame.
        :raises ConnectivityException: the two frames are not connected.
        :raises ExtrapolationException: an edge between them has no data for the stamp.
        """
        return Pose._make(self.lookup_stamped(target_frame, source_frame, stamp)[1])

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp, with ``LATEST`` resolved, and the pose; see ``lookup``."""
        if type(stamp) is not int:
            stamp = self._stamp_of(stamp)
        if self.observers.of_lookups and self.observers.hear_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.lookup_stamped, target_frame, source_frame, stamp)
        try:
            with self._lock:
                if target_frame == source_frame:
                    return self._own_stamp(target_frame, stamp), se3.IDENTITY
                if stamp == LATEST:
                    return self._tree.ways.newest_pose(target_frame, source_frame)
                return stamp, self._tree.ways.pose_at(target_frame, source_frame, stamp)
        except TransformException as error:
            error.target_frame, error.source_frame = target_frame, source_frame
            raise

    def lookup_at(self, target_frame: str, source_frame: str, stamp: Stamp) -> Pose:
        """
        Return ``target_T_source`` at a stamp; here 0 is an ordinary stamp, not ``LATEST``.

        Otherwise this is the same as ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        if self.observers.hear_lookups():
            return self.observers.watch([(target_frame, source_frame, stamp)],
                                        self.lookup_at, target_frame, source_frame, stamp)
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return Pose._make(se3.IDENTITY)
            return Pose._make(self._tree.ways.pose_at(target_frame, source_frame, stamp))

    def lookup_full(self, target_frame: str, target_stamp: Stamp, source_frame: str,
                    source_stamp: Stamp, fixed_frame: str) -> Pose:
        """
        Return ``target_T_source`` between two times, through a frame that does not move.

        (target <- fixed at target_stamp) (fixed <- source at source_stamp): it transforms an
        object that was seen from the source at source_stamp to the target at target_stamp,
        provided that it did not move in the fixed frame. It raises the errors of ``lookup``.
        """
        return Pose._make(self.lookup_full_stamped(
            target_frame, target_stamp, source_frame, source_stamp, fixed_frame)[1])

    def lookup_full_stamped(self, target_frame: str, target_stamp: Stamp, source_frame: str,
                            source_stamp: Stamp, fixed_frame: str) -> tuple[int, PoseTuple]:
        """Return ``target_stamp``, with ``LATEST`` resolved, and the pose; see ``lookup_full``."""
        if self.observers.hear_lookups():
            return self.observers.watch(
                halves(target_frame, self._stamp_of(target_stamp), source_frame,
                       self._stamp_of(source_stamp), fixed_frame),
                self.lookup_full_stamped, target_frame, target_stamp, source_frame,
                source_stamp, fixed_frame)
        with self._lock, Naming(target_frame, source_frame):
            self._tree.ways.check_frame('target_frame', target_frame)
            self._tree.ways.check_frame('source_frame', source_frame)
            self._tree.ways.check_frame('fixed_frame', fixed_frame)
            both = [(fixed_frame, source_frame, self._stamp_of(source_stamp)),
                    (target_frame, fixed_frame, self._stamp_of(target_stamp))]
            (_, fixed_T_source), (stamp, target_T_fixed) = self._lookup_both(both)
        return stamp, se3.compose(target_T_fixed, fixed_T_source)

    def _lookup_both(self, halves: list[tuple[str, str, int]]) -> list[tuple[int, PoseTuple]]:
        """Return the results of two lookups, or raise the error of one of them."""
        answers: list[tuple[int, PoseTuple]] = []
        errors: list[TransformException] = []
        watched: list[Blocker] = []
        for target_frame, source_frame, stamp in halves:
            try:
                answers.append(self.lookup_stamped(target_frame, source_frame, stamp))
            except TransformException as error:
                errors.append(error)
                watched += error.blocked_on or ()
            else:
                # This half may lose its data while the caller waits for the other.
                watched += () if stamp == LATEST else self._tree.ways.blockers(
                    target_frame, source_frame, stamp)
        if not errors:
            return answers
        # Raise the first error, as tf2 does; but if either can never succeed, do not wait.
        hopeless = next((error for error in errors if error.blocked_on is None), None)
        if hopeless is None:
            errors[0].blocked_on = tuple(watched)
            raise errors[0]
        if hopeless is errors[0]:
            raise hopeless
        errors[0].blocked_on = None
        raise errors[0] from hopeless

    def latest_common_time(self, target_frame: str, source_frame: str) -> int:
        """
        Return the stamp to which ``LATEST`` resolves between two frames, nanoseconds.

        This is ``LATEST`` itself if all edges between them are static. It raises the errors of
        ``lookup`` except for extrapolation.
        """
        with self._lock, Naming(target_frame, source_frame):
            self._tree.ways.check_frame('target_frame', target_frame)
            self._tree.ways.check_frame('source_frame', source_frame)
            if target_frame == source_frame:
                return self._own_stamp(target_frame, LATEST)
            return self._tree.ways.newest_path(target_frame, source_frame).latest_common_time()

    def _own_stamp(self, frame: str, stamp: int) -> int:
        """Return the stamp of a frame's transform to itself; ``LATEST`` is its newest."""
        if stamp != LATEST or frame not in self._tree.histories:
            return stamp
        return self._tree.histories[frame].latest_stamp or LATEST

    def frames_between(self, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> list[str]:
        """
        Return the frames from the source up to the common ancestor and down to the target.

        Both ends are included. It raises the errors of ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        moment = None if stamp == LATEST else stamp
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return [source_frame]
            return self._tree.ways.branches(target_frame, source_frame, moment).frames()

    def edges_between(self, target_frame: str, source_frame: str,
                      stamp: Stamp = LATEST) -> list[EdgeInfo]:
        """
        Return the edges from the source up to the common ancestor and down to the target.

        They are in that order. Each has its parent at the stamp, and the interval of stamps
        with that parent. It raises the errors of ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        return self._edges_between(
            target_frame, source_frame, None if stamp == LATEST else stamp)

    def _edges_between(self, target_frame: str, source_frame: str,
                       moment: int | None) -> list[EdgeInfo]:
        """Return the edges at a stamp, which may be 0; None: by the newest samples."""
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return []
            links = self._tree.ways.branches(target_frame, source_frame, moment).links()
            return [info_at(parent, history, moment) for parent, history in links]


class Naming:
    """Adds the frames of a lookup to its error."""

    __slots__ = ('frames',)

    def __init__(self, target_frame: str, source_frame: str | None) -> None:
        self.frames = target_frame, source_frame

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, TransformException):
            error.target_frame, error.source_frame = self.frames
