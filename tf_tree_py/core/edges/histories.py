# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The histories of an edge: static; or sampled at stamps, and interpolated or held between them.

``tree`` handles frame names, the structure, and the rules for insertion.
"""

from array import array
from bisect import bisect_right
from collections.abc import Iterator

import numpy as np

from .packed import PackedSamples, POSE_BYTES, POSE_FLOATS, unpack_pair, unpack_pose
from .protocol import ConstantTrack, EdgeTrack, HeldTrack, InterpolatedTrack, Stretch
from .storage import Arrays, Facts, Stored
from ..errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from ..geometry.chain import between_samples, PoseTuple
from ..geometry.so3 import Array
from ..stamp import (
    BEGINNING,
    FOREVER,
    format_span,
    LATEST,
    mean_interval,
    SILENCE,
    silence_allowed,
    unit_that_fits,
)
from ..times import Stamps

_SPANNED = 'stamps_at_rate returns stamps for which all edges have data'


class StaticHistory:
    """One edge that never moves; see ``History``."""

    __slots__ = ('child', 'parent', 'pose', 'authority')

    kind = 'static'
    is_static = True
    takes_samples = True
    fixed_parent = True
    oldest_stamp = LATEST
    latest_stamp = LATEST

    def __init__(self, child: str, parent: str, pose: PoseTuple, authority: str = '') -> None:
        self.child = child
        self.parent = parent
        self.pose = pose
        self.authority = authority

    def __len__(self) -> int:
        return 1

    def sample(self, stamp: int) -> PoseTuple:
        """Return ``parent_T_child``, the same at every stamp."""
        return self.pose

    def neighbours(self, first: int, last: int) -> tuple[float, ...]:
        """Return the pose twice."""
        return self.pose + self.pose

    def track(self, first: int, last: int) -> ConstantTrack:
        """Return a track with the pose for any stamps."""
        return ConstantTrack(self.pose)

    def twists(self, stamps: Stamps) -> Array:
        """Return zeros, because it does not move."""
        return np.zeros((len(stamps), 6))

    def parent_at(self, stamp: int) -> str:
        """Return the parent, the same at every stamp."""
        return self.parent

    def possible_parents(self, stamp: int) -> set[str]:
        """Return the only parent."""
        return {self.parent}

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """Yield the only parent, for all time."""
        yield self.parent, BEGINNING, FOREVER

    def has_named(self, parent: str) -> bool:
        """Return whether this is the parent."""
        return parent == self.parent

    def append(self, stamp: int, pose: bytes, unpacked: PoseTuple | None = None) -> bool:
        """Return False: a static edge has no next sample."""
        return False

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether a sample equals the stored one, as static broadcasters repeat it."""
        return parent == self.parent and pose == self.pose

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Replace the stored sample, regardless of the stamp."""
        self.parent, self.pose = parent, pose
        return True

    def is_too_old(self, stamp: int) -> bool:
        """Return False: it is valid at all times."""
        return False

    def next_stamp(self, stamp: int) -> int:
        """Return ``FOREVER``: there is no newer sample."""
        return FOREVER

    def clear(self) -> None:
        """Keep the sample: a static edge stays, as in tf2."""

    def copy(self) -> 'StaticHistory':
        """Return an independent copy."""
        return StaticHistory(self.child, self.parent, self.pose, self.authority)

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the pose to arrays."""
        arrays.add(array('d', self.pose))
        return {'parent': self.parent}

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> 'StaticHistory':
        """Return the frozen history."""
        x, y, z, qx, qy, qz, qw = stored.floats(7)
        return cls(child, stored.one('parent', str), (x, y, z, qx, qy, qz, qw))


# --- sampled

class DynamicHistory(PackedSamples):
    """
    The samples of a moving edge within a window of time, interpolated as in tf2.

    See ``MovingHistory`` and ``PackedSamples``.
    """

    __slots__ = ()

    kind = 'dynamic'
    is_static = False
    takes_samples = True

    @property
    def fixed_parent(self) -> bool:
        """Return whether the parent never changes, so that paths through it can be cached."""
        return self._parents is None

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether inserting a sample leaves the parent the same at every time."""
        return (parent == self.parent and self._parents is None
                and stamp >= self._stamps[self._first()])

    def is_too_old(self, stamp: int) -> bool:
        """Return whether ``insert`` would refuse a stamp."""
        return self.latest_stamp is not None and stamp < self.latest_stamp - self.cache_time

    def end(self) -> None:
        """
        End the edge at its newest sample, until the next sample arrives.

        Lookups of stored data do not change; after it the child has no parent.
        """
        if self.latest_stamp is not None:
            self._write_parents()
            self._ends.add(self.latest_stamp)
            self.parent = None

    def fell_silent(self, stamp: int) -> bool:
        """
        Return whether the edge was silent so long before a stamp that it may have ended.

        The limit is that of silent edges everywhere, or the window if that is shorter.
        """
        if self.latest_stamp is None or self.parent is None:
            return False
        interval = mean_interval(self.latest_stamp - self._stamps[self._first()], len(self))
        return stamp - self.latest_stamp > min(silence_allowed(interval), self.cache_time)

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp, interpolated between the samples around it.

        If these have different parents, the older sample is valid until the newer begins. The
        cost is O(log n) in the number of stored samples.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp is outside the stored span, or the edge had
            ended then.
        """
        if stamp == self.latest_stamp:
            latest = self._latest_pose
            if latest is None:
                latest = self._latest_pose = unpack_pose(self._poses, -POSE_BYTES)
            return latest
        stamps, start = self._stamps, self._start
        after = bisect_right(stamps, stamp, start)
        if (not start < after < len(stamps)
                or (older_stamp := stamps[after - 1]) < self._horizon):
            raise self.extrapolation(stamp)
        pair = unpack_pair(self._poses, (after - 1) * POSE_BYTES)
        if stamp == older_stamp:
            return pair[:POSE_FLOATS]
        parents = self._parents
        if parents is not None:
            if older_stamp in self._ends:
                raise self.extrapolation(stamp)
            if parents[after - 1] != parents[after]:
                return pair[:POSE_FLOATS]
        return between_samples(pair, stamp, older_stamp, stamps[after])

    def neighbours(self, first: int, last: int) -> tuple[float, ...] | None:
        """Return the poses at two stamps; None without data, or with a sample between."""
        stamps, after = self._stamps, bisect_right(self._stamps, first, self._start)
        if (self._parents is None and self._start < after < len(stamps)
                and self._horizon <= first == stamps[after - 1] and last == stamps[after]
                and (after + 1 == len(stamps) or last < stamps[after + 1])):
            return unpack_pair(self._poses, (after - 1) * POSE_BYTES)  # the common case
        if self.next_stamp(first) < last or None in (self.parent_at(first), self.parent_at(last)):
            return None
        return self.sample(first) + self.sample(last)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        return InterpolatedTrack(*self.copy_between(first, last))

    def twists(self, stamps: Stamps) -> None:
        """Return None: samples have no velocities; ``twist`` averages over time."""

    def parent_at(self, stamp: int) -> str | None:
        """
        Return the parent at a stamp, that of the sample at or before it.

        It is None if ``sample`` would raise.
        """
        if self._parents is None:
            within = (self.latest_stamp is not None
                      and self._stamps[self._first()] <= stamp <= self.latest_stamp)
            return self.parent if within else None
        index = self._index_at(stamp)
        return None if index is None else self._parents[index]

    def possible_parents(self, stamp: int) -> set[str] | None:
        """
        Return the parents that later samples may give the child at a stamp.

        Without data for the stamp these are all that it ever had, and none if a new sample for
        the stamp would be too old.

        :return: None while there is no sample: any frame may be the parent.
        """
        if self.latest_stamp is None:
            return None
        parent = self.parent_at(stamp)
        if parent is not None:
            return {parent}
        if self.is_too_old(stamp):
            return set()
        return set(self._named())

    def next_turn(self, stamp: int) -> int:
        """
        Return how new the newest sample must be to change the result at a stamp.

        It changes the result if it reaches the stamp, or if the samples around the stamp leave
        the window. A sample older than all stored ones may change it at any time.
        """
        latest = self.latest_stamp
        if latest is None:
            return FOREVER
        if stamp > latest:
            return stamp
        index = self._index_at(stamp)
        if index is not None:
            # A new sample moves the window, according to the newest stamp before that sample.
            return max(self._stamps[index] + self.cache_time + 1, latest)
        return FOREVER if self.is_too_old(stamp) else stamp + self.cache_time + 1

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """
        Yield each parent in an interval of time, and the interval in which it is the parent.

        The first may begin before the interval, and the last may end after it: the newest
        sample's parent stays the parent, unless the edge has ended.
        """
        if self.latest_stamp is None:
            return
        first = self._first()
        if self._parents is None:
            assert self.parent is not None
            yield self.parent, self._stamps[first], FOREVER
            return
        begun: Stretch | None = None
        for index in range(max(first, bisect_right(self._stamps, begin, first) - 1),
                           len(self._stamps)):
            parent, since, until = self._parents[index], self._stamps[index], self._until(index)
            if since >= end:
                break
            if begun is not None and begun[0] == parent and begun[2] == since:
                since = begun[1]
            elif begun is not None:
                yield begun
            begun = parent, since, until
        if begun is not None:
            yield begun

    def _until(self, index: int) -> int:
        """Return the stamp up to which the parent of a sample is valid."""
        stamp = self._stamps[index]
        if stamp in self._ends:
            return stamp + 1
        return self._stamps[index + 1] if index + 1 < len(self._stamps) else FOREVER

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp without data."""
        latest, oldest, child = self.latest_stamp, self.oldest_stamp, self.child
        if latest is None or oldest is None:
            return NoDataException(child=child, requested=stamp)
        kind: type[ExtrapolationException] = PastExtrapolationException
        live_hint = ''
        if stamp > latest:
            kind = FutureExtrapolationException
            hint = f'This edge has no newer sample: look up an earlier stamp. {_SPANNED}'
            live_hint = ('Use a timeout that is long enough for the data to arrive. If this is '
                         "the present time, pass the stamp of the sensor's own message instead")
            if stamp - latest > SILENCE:
                live_hint += ('. This edge has no samples in that interval: tf_doctor reports '
                              'whether it is late, silent, or stamped by another clock')
        elif stamp < latest - self.cache_time:
            keeps = f'The buffer keeps {format_span(self.cache_time)}'
            longer = 'use a longer cache_time (UNLIMITED keeps everything)'
            hint, live_hint = f'{keeps}: {longer}', f'{keeps}: look up sooner, or {longer}'
        elif stamp < oldest:
            hint = f'This edge has no older sample: look up a later stamp. {_SPANNED}'
            live_hint = ('No older sample of this edge has arrived: its publisher or the '
                         'listener started later')
        else:
            kind = ExtrapolationException
            hint = ('The edge had ended at that time: it was silent, and another edge reversed '
                    'it; tf_doctor names the publishers of both')
        unit = unit_that_fits(stamp, oldest, latest)
        first = f'{unit}. ' if unit else ''
        # An edge that has ended has no parent, but its samples have one.
        return kind(parent=self._named()[-1], child=child, requested=stamp, oldest=oldest,
                    latest=latest, hint=first + hint,
                    live_hint=first + live_hint if live_hint else '')


class HeldHistory(DynamicHistory):
    """
    The samples of an edge that jumps: each is valid until the next, without interpolation.

    It is for data without motion between samples, such as a localiser's correction, or a
    gripper that is open or closed. At its ends and beyond it behaves like ``DynamicHistory``.
    """

    __slots__ = ()

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the pose of the last sample at or before a stamp.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp is outside the stored span, or the edge had
            ended then.
        """
        index = self._index_at(stamp)
        if index is None:
            raise self.extrapolation(stamp)
        return unpack_pose(self._poses, index * POSE_BYTES)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        return HeldTrack(*self.copy_between(first, last))
