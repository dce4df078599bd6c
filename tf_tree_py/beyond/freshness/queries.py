# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups of the latest that refuse a pose that is too old, and of the newest sample of each edge.

``_newest`` applies the default of a buffer to all of its lookups of the latest. It is called with
the lock held, so the age is that of the pose that is returned. The clock is read then, too: it
must be fast, and must not use the buffer.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple, SupportsIndex

from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.buffer.waiting import WallDeadline
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import (
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.chain import join_branches
from tf_tree_py.core.geometry.pose import Pose, pose_of
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.observers import asked
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.path import pose_in_c
from tf_tree_py.core.tree.queries import FramesInErrors
from tf_tree_py.many_stamps import ManyStampSnapshot

from .ages import check_ages, checked_max_age, held_back, newest_stamp_of
from ..uncertainty.queries import UncertainQueries
from ..uncertainty.uncertain import EdgeErrors, errors_at

# Stands for the limit of a buffer.
_OWN = -1


class NewestPose(NamedTuple):
    """
    A pose of samples with different stamps.

    :ivar pose: ``target_T_source``, composed of the newest sample of each edge.
    :ivar stamps: the stamps of these samples by child frame, nanoseconds; static edges have none.
    """

    pose: Pose
    stamps: dict[str, int]

    @property
    def oldest(self) -> int:
        """Return the oldest of the stamps; ``LATEST`` if all edges are static."""
        return min(self.stamps.values(), default=LATEST)


class FreshQueries(UncertainQueries):
    """Lookups of the latest with a limit for its age, thread-safe."""

    _max_age: int | None = None

    # The clock that the stamps follow; None: there is none.
    _clock: Callable[[], int] | None = None

    @property
    def max_age(self) -> int | None:
        """Return the limit of lookups that are given none, nanoseconds; None: any age."""
        return self._max_age

    @max_age.setter
    def max_age(self, max_age: SupportsIndex | None) -> None:
        self._max_age = None if max_age is None else self.checked_limit(max_age)

    def lookup(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST, *,
               max_age: SupportsIndex | None = None) -> Pose:
        """
        Return ``target_T_source`` at a stamp.

        :param stamp: nanoseconds, or ``LATEST``.
        :param max_age: how old the latest may be by the buffer's clock, nanoseconds. None: the
            ``max_age`` of the buffer; ``UNLIMITED``: any age. It does not concern other stamps.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer; or a limit for a buffer that has no clock.
        :raises LookupException: an unknown frame.
        :raises ConnectivityException: the two frames are not connected.
        :raises ExtrapolationException: an edge between them has no data for the stamp.
        :raises StaleException: the latest is older than the limit.
        """
        if max_age is None:
            return pose_of(self.lookup_stamped(target_frame, source_frame, stamp)[1])
        return pose_of(self.lookup_no_older(
            target_frame, source_frame, self._stamp_of(stamp), max_age)[1])

    def lookup_no_older(self, target_frame: str, source_frame: str, stamp: int,
                        max_age: SupportsIndex | None) -> tuple[int, PoseTuple]:
        """Return the stamp, with ``LATEST`` resolved, and the pose; see ``lookup``."""
        if max_age is None or stamp != LATEST:
            self.checked_limit(max_age, is_used=False)
            return self.lookup_stamped(target_frame, source_frame, stamp)
        question = target_frame, source_frame, self.checked_limit(max_age)
        if not self.observers.of_lookups:
            return self._lookup_no_older(*question)
        return self.observers.watch([asked(target_frame, source_frame, LATEST)],
                                    self._lookup_no_older, *question)

    def _lookup_no_older(self, target_frame: str, source_frame: str,
                         limit: int | None) -> tuple[int, PoseTuple]:
        try:
            with self._lock:
                if target_frame == source_frame:
                    return self._own_stamp(target_frame, LATEST), se3.IDENTITY
                return self._newest(target_frame, source_frame, limit)
        except TransformException as error:
            self._tree.complete(error, target_frame, source_frame)
            raise

    def _newest(self, target_frame: str, source_frame: str,
                limit: int | None = _OWN) -> tuple[int, PoseTuple]:
        paths, limit = self._tree.paths, self._max_age if limit == _OWN else limit
        if limit is not None:
            # First: without data for its time, the pose's own error would name another edge.
            check_ages(paths.newest_path(target_frame, source_frame).moving, self._now(), limit)
        try:
            return paths.newest_pose(target_frame, source_frame)
        except ExtrapolationException as error:
            held_back(error, paths.newest_path(target_frame, source_frame).moving)
            raise

    def lookup_newest(self, target_frame: str, source_frame: str, *,
                      max_age: SupportsIndex | None = None) -> NewestPose:
        """
        Return the pose composed of the newest sample of each edge, whatever their stamps.

        A fast edge is not held back by a slow one, as it is at ``LATEST``. So this pose mixes
        times: use it if the slow edges hardly move in the meantime, as for an arm on a base that
        stands; otherwise it is a pose that the robot never had.

        :param max_age: how old each edge's newest sample may be; see ``lookup``. An edge that
            holds its newest sample for a while gets older only after that.

        It raises the errors of ``lookup``; of the extrapolation errors, only ``StaleException``.
        """
        limit = self._max_age if max_age is None else self.checked_limit(max_age)
        return self.observers.watch([asked(target_frame, source_frame, LATEST)],
                                    self._lookup_newest, target_frame, source_frame, limit)

    def _lookup_newest(self, target_frame: str, source_frame: str,
                       limit: int | None) -> NewestPose:
        with self._lock, FramesInErrors(self._tree, target_frame, source_frame):
            if target_frame == source_frame:
                return NewestPose(Pose._make(se3.IDENTITY), {})
            path = self._tree.paths.newest_path(target_frame, source_frame)
            now = self._now() if self._clock else 0
            if limit is not None:
                check_ages(path.moving, now, limit)
            stamps = {edge.child: _newest_stamp(edge, now) for edge in path.moving}
            down, up = ([part.sample(stamps.get(part.child, LATEST)) for part in parts]
                        for parts in (path.source_parts, path.target_parts))
        pose = pose_in_c and pose_in_c(tuple(down), tuple(up), LATEST)
        return NewestPose(pose_of(pose or join_branches(down, up)), stamps)

    def lookup_tree(self, target_frame: str, stamp: Stamp = LATEST, *,
                    max_age: SupportsIndex | None = None) -> dict[str, Pose]:
        """
        Return ``target_T_frame`` for every frame that can be expressed in the target.

        This is one pass over the tree. A frame is omitted if it has another root, or if an
        edge between it and the target has no data for the stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time for which every moving edge
            of this tree has data.
        :param max_age: how old that may be; see ``lookup``.
        :raises LookupException: the target is unknown.
        :raises InvalidArgumentException: an invalid frame name, or a stamp that is not an
            integer.
        :raises StaleException: the latest is older than the limit.
        """
        is_latest = self._stamp_of(stamp) == LATEST
        limit = self._max_age if max_age is None else self.checked_limit(
            max_age, is_used=is_latest)
        if limit is None or not is_latest:
            return super().lookup_tree(target_frame, stamp)
        with self._lock:
            with FramesInErrors(self._tree, target_frame, None):
                check_ages(self._tree.spanning.moving(target_frame), self._now(), limit)
            return super().lookup_tree(target_frame, stamp)

    # --- with covariances

    def lookup_uncertain(self, target_frame: str, source_frame: str, stamp: Stamp = LATEST, *,
                         independent: bool = False, learnt_noise: bool = False,
                         max_age: SupportsIndex | None = None) -> tuple[Pose, Array]:
        """
        Return ``target_T_source`` and its covariance; see ``UncertainQueries``.

        :param max_age: how old the latest may be; see ``lookup``.
        """
        found = self._lookup_uncertain(
            target_frame, source_frame, stamp, independent, learnt_noise, max_age)
        return Pose._make(found.pose), found.covariance

    def _errors_at(self, target_frame: str, source_frame: str, stamp: Stamp, independent: bool,
                   max_age: SupportsIndex | None = None) -> tuple[int, PoseTuple, EdgeErrors]:
        if self._stamp_of(stamp) != LATEST or self._max_age is max_age is None:
            self.checked_limit(max_age, is_used=False)
            return super()._errors_at(target_frame, source_frame, stamp, independent)
        with self._lock:
            found, pose = self.lookup_no_older(target_frame, source_frame, LATEST, max_age)
            return found, pose, errors_at(
                self._tree, target_frame, source_frame, found, True, independent)

    def _newest_of(self, target_frame: str, source_frames: Sequence[str]) -> int:
        if self._max_age is not None:
            with self.observers.quiet():
                for source_frame in source_frames:
                    self.lookup_stamped(target_frame, source_frame)
        return super()._newest_of(target_frame, source_frames)

    # --- the clock

    def _now(self) -> int:
        """Return the time of the clock that the stamps follow; 0: it has not started."""
        assert self._clock is not None
        return self._clock()

    def checked_limit(self, max_age: SupportsIndex | None, *, is_used: bool = True) -> int | None:
        """
        Return a limit as a plain int, or None for any age; see ``lookup`` for the errors.

        :param is_used: whether it needs a clock.
        """
        limit = None if max_age is None else checked_max_age(max_age)
        if is_used and limit is not None and self._clock is None:
            raise InvalidArgumentException(
                f'max_age={limit} needs a clock: {self._how_to_get_one}')
        return limit

    _how_to_get_one = ('a recording has none, and a snapshot has the time at which it was taken '
                       'only if its buffer has a clock')

    def snapshot(self) -> ManyStampSnapshot:
        """Return a copy of the present state; ages in it are those at the present time."""
        still = super().snapshot()
        if isinstance(still, FreshQueries) and self._clock is not None:
            still._clock, still._max_age = partial(int, self._clock()), self._max_age
        return still


def _newest_stamp(edge: MovingHistory, now: int) -> int:
    stamp = newest_stamp_of(edge)
    if edge.takes_samples or now <= 0:
        return stamp
    # A curve may reach far into the future.
    return max(edge.oldest_stamp or LATEST, min(stamp, now))


class FreshBuffer(FreshQueries, PlainBuffer):
    """A buffer whose lookups of the latest may have a limit for its age."""

    _how_to_get_one = 'pass now, such as time.time_ns, when you make the buffer'

    def lookup_within(self, timeout_s: float, target_frame: str, source_frame: str,
                      stamp: Stamp = LATEST, *, max_age: SupportsIndex | None = None) -> Pose:
        """
        Return ``lookup``, after waiting at most this many seconds of wall time for data.

        :param max_age: see ``lookup``; it waits until the latest is not older.
        """
        if max_age is None:
            return super().lookup_within(timeout_s, target_frame, source_frame, stamp)
        checked = self._stamp_of(stamp)
        return self.observers.watch(
            [asked(target_frame, source_frame, checked)], lambda: self.wait_for(
                lambda: self.lookup(target_frame, source_frame, checked, max_age=max_age),
                WallDeadline(timeout_s)))
