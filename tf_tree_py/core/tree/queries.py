# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The queries of a tree: one pose, many poses, and the contents.

The buffer, whose tree changes, and a snapshot, whose tree does not, share them.

The rules:

- Each public method may be called from any thread, and takes the lock itself. A snapshot has a
  lock, too, since histories have caches.
- Nothing that is returned refers to the tree.
- Observers are notified before and after, without the lock, unless the caller holds it, as the
  query of a wait does.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager

from .edge_info import EdgeInfo, info_at, info_of, samples_around, stamps_of, summary
from .tree import Tree
from .. import fork_locks
from ..errors import Blocker, TransformException
from ..geometry import se3
from ..geometry.pose import Pose, pose_of
from ..geometry.se3 import PoseTuple
from ..messages.observers import asked, halves, NO_OBSERVERS, Observers
from ..stamp import LATEST
from ..times import checked_stamp, checked_stamps, Stamp, Stamps, StampsLike


class FramesInErrors:
    """Adds the frames of a lookup to its error, and the hint for its kind of buffer."""

    __slots__ = ('tree', 'frames')

    def __init__(self, tree: Tree, target_frame: str, source_frame: str | None) -> None:
        self.tree = tree
        self.frames = target_frame, source_frame

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, TransformException):
            self.tree.complete(error, *self.frames)


class Queries:
    """
    The queries of a tree, thread-safe.

    ``lookup('map', 'camera', stamp)`` returns ``map_T_camera``: it transforms coordinates in
    camera to coordinates in map, at the stamp. Stamps are integer nanoseconds. In ``lookup``
    and other lookups of one pose, the stamp 0 is ``LATEST``, as in tf2: the newest time for
    which every edge between the two frames has data. In ``lookup_at``, and in all lookups at
    many stamps, 0 is an ordinary stamp, for data whose time begins at 0.
    """

    def __init__(self, tree: Tree) -> None:
        # Re-entrant, so that a wait can hold it during both a query and its own registration.
        self._lock: AbstractContextManager[object] = fork_locks.rlock()
        self._tree = tree

    # A snapshot has no observers.
    observers: Observers = NO_OBSERVERS
    """The observers of lookups; see ``Observer``."""

    # Converts callers' stamps to integers; ``ros`` also accepts ROS times.
    _stamp_of: Callable[[object], int] = staticmethod(checked_stamp)

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
        return pose_of(self.lookup_stamped(target_frame, source_frame, stamp)[1])

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp, with ``LATEST`` resolved, and the pose; see ``lookup``."""
        if type(stamp) is not int:
            stamp = self._stamp_of(stamp)
        if self.observers.of_lookups and self.observers.watches_lookups():
            return self.observers.watch(
                [asked(target_frame, source_frame, stamp)],
                self.lookup_stamped, target_frame, source_frame, stamp)
        try:
            with self._lock:
                if target_frame == source_frame:
                    return self._own_stamp(target_frame, stamp), se3.IDENTITY
                if stamp == LATEST:
                    return self._newest(target_frame, source_frame)
                return stamp, self._tree.paths.pose_at(target_frame, source_frame, stamp)
        except TransformException as error:
            # Without the lock, for which others wait: this only gets single items.
            self._tree.complete(error, target_frame, source_frame)
            raise

    def _newest(self, target_frame: str, source_frame: str) -> tuple[int, PoseTuple]:
        return self._tree.paths.newest_pose(target_frame, source_frame)

    def lookup_at(self, target_frame: str, source_frame: str, stamp: Stamp) -> Pose:
        """
        Return ``target_T_source`` at a stamp; here 0 is an ordinary stamp, not ``LATEST``.

        Otherwise this is the same as ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        return self.observers.watch([(target_frame, source_frame, stamp)],
                                    self._lookup_at, target_frame, source_frame, stamp)

    def _lookup_at(self, target_frame: str, source_frame: str, stamp: int) -> Pose:
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            if target_frame == source_frame:
                return Pose._make(se3.IDENTITY)
            return Pose._make(self._tree.paths.pose_at(target_frame, source_frame, stamp))

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
        target_stamp, source_stamp = self._stamp_of(target_stamp), self._stamp_of(source_stamp)
        return self.observers.watch(
            halves(target_frame, target_stamp, source_frame, source_stamp, fixed_frame),
            self._lookup_full, target_frame, target_stamp, source_frame, source_stamp, fixed_frame)

    def _lookup_full(self, target_frame: str, target_stamp: int, source_frame: str,
                     source_stamp: int, fixed_frame: str) -> tuple[int, PoseTuple]:
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            self._tree.paths.check_frame('target_frame', target_frame)
            self._tree.paths.check_frame('source_frame', source_frame)
            self._tree.paths.check_frame('fixed_frame', fixed_frame)
            both = [(fixed_frame, source_frame, source_stamp),
                    (target_frame, fixed_frame, target_stamp)]
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
                watched += () if stamp == LATEST else self._tree.paths.blockers(
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
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            for argument, frame in (('target_frame', target_frame),
                                    ('source_frame', source_frame)):
                self._tree.paths.check_frame(argument, frame, 'get_latest_common_time')
            if target_frame == source_frame:
                return self._own_stamp(target_frame, LATEST)
            return self._tree.paths.newest_path(target_frame, source_frame).latest_common_time()

    def _own_stamp(self, frame: str, stamp: int) -> int:
        """Return the stamp of a frame's transform to itself; ``LATEST`` is its newest."""
        if stamp != LATEST or frame not in self._tree.histories:
            return stamp
        return self._tree.histories[frame].newest_stamp or LATEST

    def frames_between(self, target_frame: str, source_frame: str,
                       stamp: Stamp = LATEST) -> list[str]:
        """
        Return the frames from the source up to the common ancestor and down to the target.

        Both ends are included. It raises the errors of ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        moment = None if stamp == LATEST else stamp
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            if target_frame == source_frame:
                return [source_frame]
            return self._tree.paths.branches(target_frame, source_frame, moment).frames()

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
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            if target_frame == source_frame:
                return []
            links = self._tree.paths.branches(target_frame, source_frame, moment).links()
            return [info_at(parent, history, moment) for parent, history in links]

    def lookup_tree(self, target_frame: str, stamp: Stamp = LATEST) -> dict[str, Pose]:
        """
        Return ``target_T_frame`` for every frame that can be expressed in the target.

        This is one pass over the tree. A frame is omitted if it has another root, or if an
        edge between it and the target has no data for the stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time for which every moving edge
            of this tree has data.
        :raises LookupException: the target is unknown.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer.
        """
        stamp = self._stamp_of(stamp)
        with self._lock, FramesInErrors(self._tree, target_frame, None):
            if stamp == LATEST:
                stamp = self._tree.spanning.latest_of_all(target_frame)
            poses = self._tree.spanning.poses_from(target_frame, stamp)
        return {frame: pose_of(pose) for frame, pose in poses.items()}

    # --- contents

    def snapshot(self) -> 'PlainSnapshot':
        """
        Return a copy of the present state, for several lookups that must be consistent.

        It copies the samples, which takes about 20 us for each moving edge with 1,000 samples.
        """
        with self._lock:
            return self._snapshot_of(self._tree.copy())

    def _snapshot_of(self, tree: Tree) -> 'PlainSnapshot':
        return PlainSnapshot(tree)

    def frames(self) -> list[str]:
        """Return every frame name, in order of first appearance."""
        with self._lock:
            return list(self._tree.frames)

    def edges(self) -> list[EdgeInfo]:
        """Return every edge with data, in order of its child's first appearance."""
        with self._lock:
            histories = [self._tree.histories[frame] for frame in self._tree.frames
                         if frame in self._tree.histories]
            return [info_of(history.parent, history)
                    for history in histories if history.parent is not None]

    def parents_at(self, stamp: Stamp) -> dict[str, str]:
        """
        Return the parent of each frame at a stamp; frames without data for it have none.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        stamp = self._stamp_of(stamp)
        with self._lock:
            return {child: parent for child, history in self._tree.histories.items()
                    if (parent := history.parent_at(stamp)) is not None}

    def stamps_of(self, frame: str) -> Stamps:
        """
        Return the stamps of the samples of a frame's edge to its parent.

        :return: (N,) nanoseconds, sorted; none for a static edge or a root.
        """
        with self._lock:
            return stamps_of(self._tree.histories.get(frame))

    def samples_around(self, child_frame: str, stamp: Stamp) -> list[tuple[int, Pose]]:
        """
        Return the samples of a frame's edge at or next to a stamp, with their own stamps.

        There is one sample if it has exactly this stamp, or if the stamp is outside the stored
        span; there are two between two samples, and none for a static or unknown edge.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        """
        with self._lock:
            return samples_around(self._tree.histories.get(child_frame), self._stamp_of(stamp))

    def __repr__(self) -> str:
        return f'<{self._summary()}>'

    def _summary(self) -> str:
        # ROS's Buffer overrides edges(), and may query the graph for the publishers there.
        return f'{type(self).__name__}: {summary(len(self.frames()), Queries.edges(self))}'


class PlainSnapshot(Queries):
    """
    A buffer's contents at one moment, which never change.

    It supports all queries of a buffer. All its results are consistent with each other,
    regardless of new data in the buffer.
    """

    def snapshot(self) -> 'PlainSnapshot':
        """Return this snapshot, because it never changes."""
        return self
