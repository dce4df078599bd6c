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
The history of an edge that moves, known at single stamps and interpolated or held between.

What a frame is called, who hangs on whom and who may insert is the business of
``tree``.
"""

from bisect import bisect_right
from collections.abc import Iterator

from .columns import POSE_FLOATS
from .packed import PackedSamples, POSE_BYTES, unpack_pair, unpack_pose
from .protocol import Stretch
from .track import EdgeTrack, HeldTrack, InterpolatedTrack
from ..errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from ..geometry.se3 import interpolate_pair, PoseTuple
from ..stamp import FOREVER, format_span, from_seconds
from ..times import Stamps

# An edge is silent if no sample came for this long, and for this number of its periods.
_SILENCE = from_seconds(1.0)
_SILENT_PERIODS = 3


class DynamicHistory(PackedSamples):
    """
    The samples of a moving edge inside a window of time, interpolated as tf2 does it.

    See ``MovingHistory`` and ``PackedSamples``.
    """

    __slots__ = ()

    kind = 'dynamic'
    is_static = False

    @property
    def fixed_parent(self) -> bool:
        """Return whether one parent holds from end to end: a path through it can be kept."""
        return self._parents is None

    def goes_on(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return whether the child has the same parent at every time after a sample as before."""
        return (parent == self.parent and self._parents is None
                and stamp >= self._stamps[self._first()])

    def is_too_old(self, stamp: int) -> bool:
        """Return whether ``insert`` would refuse a stamp."""
        return self.latest_stamp is not None and stamp < self.latest_stamp - self.cache_time

    def end(self) -> None:
        """
        Let the edge end with its newest sample, until another comes.

        What is stored answers as before; behind it the child has no parent.
        """
        if self.latest_stamp is not None:
            self._write_parents()
            self._ends.add(self.latest_stamp)
            self.parent = None

    def fell_silent(self, stamp: int) -> bool:
        """
        Return whether nothing came for so long before a stamp that the edge may have ended.

        A second, three of its periods, or the window: the first two, or the last if that
        is shorter.
        """
        if self.latest_stamp is None or self.parent is None:
            return False
        first = self._first()
        period = (self.latest_stamp - self._stamps[first]) // max(len(self) - 1, 1)
        silence = min(max(_SILENCE, _SILENT_PERIODS * period), self.cache_time)
        return stamp - self.latest_stamp > silence

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp, interpolated between its two neighbours.

        Where the neighbours name different parents, the older one holds until the
        newer begins. O(log n) in the number of stored samples.

        :param stamp: nanoseconds; 0 is a time here.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp lies outside the stored span, or where the
            edge had ended.
        """
        if stamp == self.latest_stamp:
            return self._latest_pose or self._unpack_latest()
        stamps = self._stamps
        after = bisect_right(stamps, stamp, self._start)
        if (not self._start < after < len(stamps)
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
        ratio = (stamp - older_stamp) / (stamps[after] - older_stamp)
        return interpolate_pair(pair, ratio, True)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups from one stamp to another need."""
        return InterpolatedTrack(*self.copy_between(first, last))

    def twists(self, stamps: Stamps) -> None:
        """Return None: samples have no velocity; ``twist`` averages over time."""

    def parent_at(self, stamp: int) -> str | None:
        """
        Return the parent at a stamp, that of the sample at or before it.

        None where ``sample`` would raise.
        """
        if self._parents is None:
            within = (self.latest_stamp is not None
                      and self._stamps[self._first()] <= stamp <= self.latest_stamp)
            return self.parent if within else None
        index = self._index_at(stamp)
        return None if index is None else self._parents[index]

    def possible_parents(self, stamp: int) -> set[str] | None:
        """
        Return the parents that the child may still turn out to have had at a stamp.

        These are all that it ever had, as long as a sample for the stamp may still come, and
        none once such a sample would be too old.

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
        Return how new the newest sample has to be, to change what is known of a stamp.

        It changes that if it reaches the stamp, or if the samples around the stamp leave the
        window. A sample that is older than all that are stored may change it at any time.
        """
        latest = self.latest_stamp
        if latest is None:
            return FOREVER
        if stamp > latest:
            return stamp
        index = self._index_at(stamp)
        if index is not None:
            # The window moves when a sample comes, by the newest stamp before that sample.
            return max(self._stamps[index] + self.cache_time + 1, latest)
        return FOREVER if self.is_too_old(stamp) else stamp + self.cache_time + 1

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """
        Yield each parent in a stretch of time, and from when to when it is the parent.

        The first may begin before the stretch, and the last may end after it: the newest
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
        """Return the stamp up to which the parent that a sample names holds."""
        stamp = self._stamps[index]
        if stamp in self._ends:
            return stamp + 1
        return self._stamps[index + 1] if index + 1 < len(self._stamps) else FOREVER

    def _unpack_latest(self) -> PoseTuple:
        self._latest_pose = pose = unpack_pose(self._poses, (len(self._stamps) - 1) * POSE_BYTES)
        return pose

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp without data."""
        latest, oldest, child = self.latest_stamp, self.oldest_stamp, self.child
        if latest is None or oldest is None:
            return NoDataException(child=child, requested=stamp)
        kind: type[ExtrapolationException] = PastExtrapolationException
        if stamp > latest:
            kind = FutureExtrapolationException
            hint = ("Pass the stamp of the sensor's own message, not the present time, or a "
                    'timeout that lasts until the data comes')
            if stamp - latest > _SILENCE:
                hint += ('. For so long this edge has sent nothing: tf_doctor tells whether it '
                         'is late, silent, or stamped by another clock')
        elif stamp < latest - self.cache_time:
            hint = (f'The buffer keeps {format_span(self.cache_time)}: ask sooner, or give it a '
                    'longer cache_time (UNLIMITED keeps everything)')
        elif stamp < oldest:
            hint = ('Nothing older of this edge has arrived: its publisher, or who listens, began '
                    'later')
        else:
            kind = ExtrapolationException
            hint = ('The edge had ended then: it was silent, and another one turned it round; '
                    'tf_doctor names who sends them')
        # An edge that has ended has no parent, but its samples name one.
        return kind(parent=self._named()[-1], child=child, requested=stamp, oldest=oldest,
                    latest=latest, hint=hint)


class HeldHistory(DynamicHistory):
    """
    The samples of an edge that jumps: each holds until the next, and nothing lies between.

    For what has no motion between two samples: a correction of a localisation, a gripper
    that is open or shut. At and beyond its ends it answers as ``DynamicHistory`` does.
    """

    __slots__ = ()

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the pose of the last sample at or before a stamp.

        :param stamp: nanoseconds; 0 is a time here.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp lies outside the stored span, or where the
            edge had ended.
        """
        index = self._index_at(stamp)
        if index is None:
            raise self.extrapolation(stamp)
        return unpack_pose(self._poses, index * POSE_BYTES)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups from one stamp to another need."""
        return HeldTrack(*self.copy_between(first, last))
