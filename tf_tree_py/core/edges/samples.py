# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge that moves: samples, and an interpolation between them.

``tree`` handles frame names, the structure, and the rules for insertion.

``interpolate_by`` is the only way to change the interpolation, because ``latest_stamp`` and the
fast way for ``Linear`` depend on it. Whatever changes samples that are not the newest calls
``Interpolation.forget``: an interpolation may have computed something from them.
"""

from bisect import bisect_right
from collections.abc import Iterator
from typing import TypeVar

from .interpolation import Interpolation, is_linear, LINEAR
from .packed import PackedSamples, POSE_BYTES, unpack_pair, unpack_pose
from .protocol import EdgeTrack, History, Stretch
from .tracks import HeldTrack
from ..errors import ExtrapolationException, InvalidArgumentException
from ..geometry.chain import between_samples, PoseTuple
from ..geometry.so3 import Array
from ..hints import no_sample
from ..stamp import FOREVER, mean_interval, silence_allowed
from ..times import Stamps

_Samples = TypeVar('_Samples', bound='Samples')


class Samples(PackedSamples):
    """
    The samples of a moving edge within a window of time; see ``MovingHistory``.

    :ivar interpolation: defines the poses between samples, and how long the newest is valid.
    """

    __slots__ = ('interpolation', '_is_linear')

    described_as = 'dynamic'
    is_static = False
    takes_samples = True

    def __init__(self, child: str, cache_time: int, authority: str = '',
                 interpolation: Interpolation = LINEAR) -> None:
        super().__init__(child, cache_time, authority)
        self.interpolate_by(interpolation)

    def interpolate_by(self, interpolation: Interpolation) -> None:
        """Use another interpolation, for the samples that are stored, too."""
        self.interpolation = interpolation
        # Nearly all are linear: these need no call of the object.
        self._is_linear = is_linear(interpolation)
        self._holds_for = interpolation.holds_for
        if self.newest_stamp is not None and self.newest_stamp not in self._ends:
            self.latest_stamp = self._last_held()

    @property
    def fixed_parent(self) -> bool:
        """Return whether the parent never changes, so that paths through it can be cached."""
        return self.parents is None

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether inserting a sample leaves the parent the same at every time."""
        return (parent == self.parent and self.parents is None
                and stamp >= self.stamps[self.first()])

    def is_too_old(self, stamp: int) -> bool:
        """Return whether ``insert`` would refuse a stamp."""
        return self.newest_stamp is not None and stamp < self.newest_stamp - self.cache_time

    def end(self) -> None:
        """
        End the edge at its newest sample, until the next sample arrives.

        Lookups of stored data do not change; after it the child has no parent.
        """
        if self.newest_stamp is not None:
            self._write_parents()
            self._ends.add(self.newest_stamp)
            self.parent, self.latest_stamp = None, self.newest_stamp

    def fell_silent(self, stamp: int) -> bool:
        """
        Return whether the edge was silent so long before a stamp that it may have ended.

        The limit is that of silent edges everywhere, or the window if that is shorter.
        """
        if self.parent is None:
            return False
        assert self.newest_stamp is not None
        interval = mean_interval(self.newest_stamp - self.stamps[self.first()], len(self))
        return stamp - self.newest_stamp > min(silence_allowed(interval), self.cache_time)

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp, interpolated between the samples around it.

        If these have different parents, the older sample is valid until the newer begins. After
        the newest sample, its pose is returned for as long as the interpolation holds it. The
        cost is O(log n) in the number of stored samples. ``tree/path_in_c.c`` repeats the usual
        cases.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp is outside the stored span, or the edge had
            ended then.
        """
        if stamp == self.newest_stamp:
            return unpack_pose(self.poses, -POSE_BYTES)
        stamps = self.stamps
        after = bisect_right(stamps, stamp)
        if (not 0 < after < len(stamps)
                or (older_stamp := stamps[after - 1]) < self._horizon):
            if self.index_at(stamp) is None:
                raise self.extrapolation(stamp)
            return self.pose(-1)  # it is held
        first = (after - 1) * POSE_BYTES
        if stamp == older_stamp:
            return unpack_pose(self.poses, first)
        parents = self.parents
        if parents is not None:
            if older_stamp in self._ends:
                raise self.extrapolation(stamp)
            if parents[after - 1] != parents[after]:
                return unpack_pose(self.poses, first)
        if self._is_linear:
            return between_samples(
                unpack_pair(self.poses, first), stamp, older_stamp, stamps[after])
        return self.interpolation.pose(self, after - 1, stamp)

    def neighbours(self, first: int, last: int) -> tuple[float, ...] | None:
        """Return the poses at two stamps; None without data, or with a sample between."""
        index = self.index_at(first)
        if index is None:
            return None
        around = self.stamps[index:index + 3].tolist()
        if around[:2] == [first, last] and around[2:] != [last]:
            return unpack_pair(self.poses, index * POSE_BYTES)  # the common case
        if self.next_stamp(first) < last or self.parent_at(last) is None:
            return None
        return self.sample(first) + self.sample(last)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        track = self.interpolation.track(self, first, last)
        assert self.newest_stamp is not None
        return track if last <= self.newest_stamp else HeldTrack(track)

    def twists(self, stamps: Stamps) -> None:
        """Return None: samples have no velocities; ``twist`` averages over time."""

    def parent_at(self, stamp: int) -> str | None:
        """
        Return the parent at a stamp, that of the sample at or before it.

        It is None if ``sample`` would raise.
        """
        if self.parents is None:
            within = (self.latest_stamp is not None
                      and self.stamps[self.first()] <= stamp <= self.latest_stamp)
            return self.parent if within else None
        index = self.index_at(stamp)
        return None if index is None else self.parents[index]

    def possible_parents(self, stamp: int) -> set[str] | None:
        """
        Return the parents that later samples may give the child at a stamp.

        Without data for the stamp these are all that it ever had, and none if a new sample for
        the stamp would be too old.

        :return: None while there is no sample: any frame may be the parent.
        """
        if self.newest_stamp is None:
            return None
        parent = self.parent_at(stamp)
        if parent is not None:
            return {parent}
        if self.is_too_old(stamp):
            return set()
        return set(self._named())

    def next_turn(self, stamp: int) -> int:
        """
        Return what ``latest_stamp`` must reach to change the result at a stamp.

        It changes the result if it reaches the stamp, or if the samples around the stamp leave
        the window. A sample older than all stored ones may change it at any time.
        """
        latest = self.latest_stamp
        if latest is None:
            return FOREVER
        if stamp > latest:
            return stamp
        index = self.index_at(stamp)
        if index is not None:
            # A new sample moves the window, according to the newest stamp before that sample.
            return max(self.stamps[index] + self.cache_time + 1, latest)
        return FOREVER if self.is_too_old(stamp) else stamp + self.cache_time + 1

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """
        Yield each parent in an interval of time, and the interval in which it is the parent.

        The first may begin before the interval, and the last may end after it: the newest
        sample's parent stays the parent, unless the edge has ended.
        """
        if self.newest_stamp is None:
            return
        first = self.first()
        if self.parents is None:
            assert self.parent is not None
            yield self.parent, self.stamps[first], FOREVER
            return
        begun: Stretch | None = None
        for index in range(max(first, bisect_right(self.stamps, begin, first) - 1),
                           len(self.stamps)):
            parent, since, until = self.parents[index], self.stamps[index], self._until(index)
            if since >= end:
                break
            if since == until:  # a later arrival has this stamp, too
                continue
            if begun is not None and begun[0] == parent and begun[2] == since:
                since = begun[1]
            elif begun is not None:
                yield begun
            begun = parent, since, until
        if begun is not None:
            yield begun

    def _until(self, index: int) -> int:
        """Return the stamp up to which the parent of a sample is valid."""
        stamp = self.stamps[index]
        following = self.stamps[index + 1] if index + 1 < len(self.stamps) else FOREVER
        return min(following, stamp + 1) if stamp in self._ends else following

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp without data."""
        # An edge that has ended has no parent, but its samples have one.
        parents = self._named()
        return no_sample(parents[-1] if parents else None, self.child, stamp, self.oldest_stamp,
                         self.newest_stamp, self.cache_time)

    # --- when samples change

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Insert many samples; see ``MovingHistory.extend``."""
        super().extend(stamps, poses)
        self.interpolation.forget()

    def set_poses(self, poses: Array) -> None:
        """Replace the poses (n, 7) of all n samples in the window."""
        super().set_poses(poses)
        self.interpolation.forget()

    def _insert_between(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        super()._insert_between(stamp, parent, pose)
        self.interpolation.forget()

    def clear(self) -> None:
        """Remove all samples, and the data of the interpolation."""
        super().clear()
        self.interpolation.clear()

    # --- copies

    def copy(self: _Samples) -> _Samples:
        """Return an independent history with the same samples."""
        return self.copied_into(type(self)(
            self.child, self.cache_time, self.authority, self.interpolation.copy()))


def interpolated(history: History | None, child: str, cache_time: int,
                 interpolation: Interpolation) -> Samples:
    """
    Return an edge's history, new if it has none, after changing its interpolation.

    :raises InvalidArgumentException: the edge has no samples to interpolate between.
    """
    if history is None:
        history = Samples(child, cache_time)
    if not isinstance(history, Samples):
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} is {history.described_as}, and has no samples '
            'to interpolate between. Insert it as a moving edge, with stamps')
    history.interpolate_by(history.interpolation.followed_by(interpolation))
    return history
