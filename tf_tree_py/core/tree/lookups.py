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
The questions for one pose, and for the way between two frames.

Those about many stamps, and all that goes beyond poses, are in ``queries``.
"""

from collections.abc import Callable
import threading
from typing import Any

import numpy.typing as npt

from .outline import EdgeInfo, info_at
from .tree import Tree
from ..arrivals.observers import asked, halves, NOBODY, Observers
from ..errors import Blocker, TransformException
from ..geometry import se3
from ..geometry.pose import Pose
from ..geometry.se3 import PoseTuple
from ..stamp import LATEST
from ..times import checked_stamp, checked_stamps, Stamps


class Lookups:
    """
    Lookups on a tree, from any thread.

    ``lookup('map', 'camera', stamp)`` gives ``map_T_camera``: it takes coordinates
    in camera to coordinates in map, as everything was at the stamp. Stamps are
    integer nanoseconds. In ``lookup`` and other questions for one pose the stamp 0 is
    ``LATEST``, as in tf2: the newest time that every edge between the two frames has data
    for. In ``lookup_at``, and in all that takes many stamps, 0 is a time like any other,
    for data whose time begins at 0.
    """

    def __init__(self, tree: Tree) -> None:
        # Re-entrant, so that a wait can hold it across a query and its own registration.
        self._lock = threading.RLock()
        self._tree = tree

    # Nobody watches a snapshot.
    observers: Observers = NOBODY
    """Who is told of every lookup; see ``Observer``."""

    # Makes integers of callers' stamps; ``ros`` takes ROS times as well.
    _stamp_of: Callable[[Any], int] = staticmethod(checked_stamp)

    def _stamps_of(self, stamps: npt.ArrayLike) -> Stamps:
        return checked_stamps(stamps, self._stamp_of)

    @property
    def cache_time(self) -> int:
        """Return how much history each edge keeps, nanoseconds."""
        return self._tree.cache_time

    # --- one pose

    def lookup(self, target_frame: str, source_frame: str, stamp: int = LATEST) -> Pose:
        """
        Return ``target_T_source`` at a stamp.

        :param stamp: nanoseconds, or ``LATEST``.
        :raises InvalidArgumentException: a name that cannot be a frame, or a stamp that is
            no integer.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        :raises ExtrapolationException: an edge between them has no data for the stamp.
        """
        return Pose._make(self.lookup_stamped(target_frame, source_frame, stamp)[1])

    def lookup_stamped(self, target_frame: str, source_frame: str,
                       stamp: int = LATEST) -> tuple[int, PoseTuple]:
        """Return the stamp that ``LATEST`` came to, and the pose; see ``lookup``."""
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

    def lookup_at(self, target_frame: str, source_frame: str, stamp: int) -> Pose:
        """
        Return ``target_T_source`` at a stamp, where 0 is a time and not ``LATEST``.

        Otherwise as ``lookup``.
        """
        stamp = self._stamp_of(stamp)
        if self.observers.hear_lookups():
            return self.observers.watch([(target_frame, source_frame, stamp)],
                                        self.lookup_at, target_frame, source_frame, stamp)
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return Pose._make(se3.IDENTITY)
            return Pose._make(self._tree.ways.pose_at(target_frame, source_frame, stamp))

    def lookup_full(self, target_frame: str, target_stamp: int, source_frame: str,
                    source_stamp: int, fixed_frame: str) -> Pose:
        """
        Return ``target_T_source`` between two times, through a frame that does not move.

        (target <- fixed at target_stamp) (fixed <- source at source_stamp): a thing was
        seen from the source at source_stamp; this gives where it is in the target at
        target_stamp, if it did not move in the fixed frame. Raises as ``lookup`` does.
        """
        return Pose._make(self.lookup_full_stamped(
            target_frame, target_stamp, source_frame, source_stamp, fixed_frame)[1])

    def lookup_full_stamped(self, target_frame: str, target_stamp: int, source_frame: str,
                            source_stamp: int, fixed_frame: str) -> tuple[int, PoseTuple]:
        """Return what ``target_stamp`` came to, and the pose; see ``lookup_full``."""
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
        """Return the answers of two lookups, or raise what one of them lacks."""
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
                # This half may lose its data during the wait for the other.
                watched += () if stamp == LATEST else self._tree.ways.blockers(
                    target_frame, source_frame, stamp)
        if not errors:
            return answers
        for hopeless in errors:
            if hopeless.blocked_on is None:
                raise hopeless
        errors[0].blocked_on = tuple(watched)
        raise errors[0]

    def latest_common_time(self, target_frame: str, source_frame: str) -> int:
        """
        Return what ``LATEST`` comes to between two frames, nanoseconds.

        ``LATEST`` itself when nothing between them moves. Raises as ``lookup`` does,
        but for extrapolation.
        """
        with self._lock, Naming(target_frame, source_frame):
            self._tree.ways.check_frame('target_frame', target_frame)
            self._tree.ways.check_frame('source_frame', source_frame)
            if target_frame == source_frame:
                return self._own_stamp(target_frame, LATEST)
            return self._tree.ways.newest_path(target_frame, source_frame).latest_common_time()

    def _own_stamp(self, frame: str, stamp: int) -> int:
        """Return the stamp of a frame's transform to itself: as asked, or its own newest."""
        if stamp != LATEST or frame not in self._tree.histories:
            return stamp
        return self._tree.histories[frame].latest_stamp or LATEST

    def frames_between(self, target_frame: str, source_frame: str,
                       stamp: int = LATEST) -> list[str]:
        """
        Return the frames from the source up to the common ancestor and down to the target.

        Both ends are among them. Raises as ``lookup`` does.
        """
        stamp = self._stamp_of(stamp)
        moment = None if stamp == LATEST else stamp
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return [source_frame]
            return self._tree.ways.branches(target_frame, source_frame, moment).frames()

    def edges_between(self, target_frame: str, source_frame: str,
                      stamp: int = LATEST) -> list[EdgeInfo]:
        """
        Return the edges from the source up to the common ancestor and down to the target.

        In that order, each with its parent at the stamp, and the stamps from and to which
        that is its parent. Raises as ``lookup`` does.
        """
        stamp = self._stamp_of(stamp)
        return self._edges_between(
            target_frame, source_frame, None if stamp == LATEST else stamp)

    def _edges_between(self, target_frame: str, source_frame: str,
                       moment: int | None) -> list[EdgeInfo]:
        """Return them at a stamp, 0 among them; None goes by the newest samples."""
        with self._lock, Naming(target_frame, source_frame):
            if target_frame == source_frame:
                return []
            links = self._tree.ways.branches(target_frame, source_frame, moment).links()
            return [info_at(parent, history, moment) for parent, history in links]


class Naming:
    """Puts the frames of a question into its error."""

    __slots__ = ('frames',)

    def __init__(self, target_frame: str, source_frame: str | None) -> None:
        self.frames = target_frame, source_frame

    def __enter__(self) -> None:
        """Nothing is to be done before."""

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, TransformException):
            error.target_frame, error.source_frame = self.frames
