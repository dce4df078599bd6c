# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A window of samples in packed memory, sorted by stamp.

A history or a file owns the memory. Subclasses define the poses between samples.

The rules:

- Stamps are sorted; those that are equal are in order of arrival. Each has seven numbers in
  ``poses`` and, where these exist, one parent. An exception between the changes of two arrays
  would shift all later samples.
- Samples before ``first()`` have expired, although they are still there: no lookup may find them.
- Reading changes nothing: a reader of a shared tree may have no lock.
- ``tree/path_in_c.c`` reads the slots and the memory of ``Samples``: see ``tree/path``.
- No view of the arrays outlives the lock: as long as one exists, they cannot grow, and the next
  insertion raises ``BufferError``. ``copy_between`` returns copies for that reason.
"""

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Collection, Sequence
import struct
from typing import cast, NamedTuple, TypeVar

import numpy as np

from ..errors import no_truth
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER
from ..times import Stamps

POSE_FLOATS = 7


class Columns(NamedTuple):
    """
    The memory of a history as columns for the same samples.

    :ivar stamps: int64 nanoseconds, sorted.
    :ivar poses: float64, seven per sample.
    :ivar parents: of each sample; None if all are that of the newest.
    :ivar ends: stamps of the samples at which the edge ended.
    """

    stamps: 'memoryview[int]'
    poses: 'memoryview[float]'
    parents: Sequence[str] | None
    ends: Collection[int]


POSE_BYTES = 56
pack_pose = struct.Struct('7d').pack
unpack_pose = struct.Struct('7d').unpack_from
unpack_pair = struct.Struct('14d').unpack_from

_Twin = TypeVar('_Twin', bound='PackedSamples')

# Expired samples are removed in blocks: for fewer than this, moving the rest costs too much.
_MIN_BLOCK = 64


class PackedSamples:
    """
    One child frame's samples: stamps, parents and poses.

    Stamps are an ``array('q')``, poses one ``array('d')`` of seven floats each: 64 bytes per
    sample, which ``struct`` reads as floats, and numpy without a copy. Nearly all edges always
    have the same parent; only when a second appears is a parent stored for every sample.
    Expired samples are skipped at once, and removed when an eighth of the window has passed;
    so a sample takes at most 72 bytes, plus spare capacity of the arrays.

    Appending is amortised O(1), inserting in the middle O(n) (a memmove), a search O(log n).

    :ivar child: the frame.
    :ivar cache_time: the length of the window, nanoseconds.
    :ivar authority: the publisher of the last accepted sample.
    :ivar parent: the newest sample's parent; None without samples, and after an end.
    :ivar newest_stamp: of the newest sample, nanoseconds; None without samples.
    :ivar latest_stamp: the last stamp for which the newest sample is valid: its own, or later.
    :ivar late: see ``MovingHistory``.
    :ivar stamps: of all samples in memory, nanoseconds; those before ``first()`` have expired.
    :ivar poses: likewise, seven floats for each.
    :ivar parents: likewise; None if all are ``parent``.
    """

    __slots__ = ('child', 'parent', 'newest_stamp', 'latest_stamp', 'authority', 'cache_time',
                 'late', 'stamps', 'poses', 'parents', '_holds_for', '_ends', '_horizon',
                 '_tidy_after')

    _holds_for: int  # set with the interpolation, by Samples

    def __init__(self, child: str, cache_time: int, authority: str = '') -> None:
        self.child = child
        self.cache_time = cache_time
        self.authority = authority
        self.late = FOREVER
        self._empty()

    def __len__(self) -> int:
        return len(self.stamps) - self.first()

    __bool__ = no_truth

    @property
    def oldest_stamp(self) -> int | None:
        """Return the oldest stamp in the window, nanoseconds; None without samples."""
        return self.stamps[self.first()] if self.stamps else None

    def clear(self) -> None:
        """Remove all samples."""
        self._empty()

    def _empty(self) -> None:
        self.parent: str | None = None
        self.newest_stamp: int | None = None
        self.latest_stamp: int | None = None
        self.stamps = array('q')
        self.poses = array('d')
        self.parents: list[str] | None = None
        # The edge ended at samples with these stamps: it has no data until the next sample. If
        # this set is not empty, parents are stored, too.
        self._ends: set[int] = set()
        # Samples older than the horizon have expired. Their memory is freed later, by _tidy.
        self._horizon = BEGINNING
        self._tidy_after = BEGINNING

    def append(self, stamp: int, pose: bytes) -> bool:
        """
        Insert the next sample with the same parent as all before it: the common case.

        :param pose: seven doubles in the machine's byte order.
        :return: False in other cases, without any change: see ``insert``.
        """
        latest = self.newest_stamp
        if latest is None or stamp < latest or self.parents is not None:
            return False
        self._horizon = latest - self.cache_time
        if latest > self._tidy_after:
            self._tidy(latest)
        self.stamps.append(stamp)
        self.poses.frombytes(pose)
        self.newest_stamp = self.latest_stamp = stamp
        if self._holds_for:
            self.latest_stamp = self._last_held()
        return True

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """
        Insert a sample, unless it is older than the window.

        As in tf2, the window ends at the newest stamp *before* this sample, even if this one is
        refused. A sample exactly at the beginning of the window is kept. Of several samples with
        one stamp, lookups find the last to arrive.

        :return: False if the sample was refused.
        """
        latest = self.newest_stamp
        if latest is None:
            self._append(stamp, parent, pose)
            return True
        self._horizon = latest - self.cache_time
        if latest > self._tidy_after:
            self._tidy(latest)
        if stamp < self._horizon:
            return False
        if parent != self.parent:
            self._write_parents()
        self._ends.discard(stamp)  # a sample at an end continues the edge from there
        if stamp >= latest:
            self._append(stamp, parent, pose)
        else:
            self._insert_between(stamp, parent, pose)
        return True

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """
        Insert many samples with the same parent as all before, as ``insert`` for each would.

        The cost is O(n) if they are sorted and newer than all stored ones; otherwise a stable
        sort is added.

        :param stamps: (n,) in order of arrival, n > 0; none is older than the window when
            its turn comes.
        :param poses: (n, 7) ``parent_T_child``, with unit quaternions.
        """
        assert self.newest_stamp is not None
        latest = max(self.newest_stamp, int(stamps[:-1].max(initial=BEGINNING)))
        self._horizon = latest - self.cache_time
        if (stamps[1:] < stamps[:-1]).any():
            stamps, poses = _in_order(stamps, poses)
        if stamps[0] < self.newest_stamp:
            self.late = min(self.late, int(stamps[0]))
            # Stored samples that are newer than the first new one are sorted with the new ones.
            index = bisect_right(self.stamps, int(stamps[0]), self.first())
            newer = np.array(self.poses[index * POSE_FLOATS:]).reshape(
                len(self.stamps) - index, POSE_FLOATS)
            stamps, poses = _in_order(np.concatenate([self.stamps[index:], stamps]),
                                      np.concatenate([newer, poses]))
            del self.stamps[index:]
            del self.poses[index * POSE_FLOATS:]
        self.stamps.frombytes(memoryview(np.ascontiguousarray(stamps)).cast('B'))
        self.poses.frombytes(memoryview(np.ascontiguousarray(poses)).cast('B'))
        self.newest_stamp = self.stamps[-1]
        self.latest_stamp = self._last_held()
        if latest > self._tidy_after:
            self._tidy(latest)

    def next_stamp(self, stamp: int) -> int:
        """Return the stamp of the first newer sample; ``FOREVER`` if there is none."""
        after = bisect_right(self.stamps, stamp, self.first())
        return self.stamps[after] if after < len(self.stamps) else FOREVER

    def part(self, index: int, last: int, beside: int) -> tuple['PackedSamples', int]:
        """
        Return a copy of some samples, and the index that a given sample has in it.

        :param index: of the first of these samples.
        :param last: the stamp up to which they are needed, with the sample after it.
        :param beside: how many more are wanted on either side, if there are so many.
        """
        begin = max(self.first(), index - beside)
        end = bisect_right(self.stamps, last, index) + 1 + beside
        few = PackedSamples(self.child, self.cache_time, self.authority)
        few.parent = self.parent
        few.newest_stamp, few.latest_stamp = self.newest_stamp, self.latest_stamp
        few.stamps = array('q', self.stamps[begin:end])
        few.poses = array('d', self.poses[begin * POSE_FLOATS:end * POSE_FLOATS])
        few.parents = None if self.parents is None else list(self.parents[begin:end])
        few._ends = set(self._ends)
        return few, index - begin

    def copied_into(self, twin: _Twin) -> _Twin:
        """Copy the samples to another object that has none, and return it."""
        twin.parent = self.parent
        twin.newest_stamp, twin.latest_stamp = self.newest_stamp, self.latest_stamp
        twin.stamps, twin.poses = self.stamps[:], self.poses[:]
        twin.parents = None if self.parents is None else self.parents[:]
        twin._ends, twin._horizon = set(self._ends), self._horizon
        return twin

    def columns(self) -> Columns:
        """Return the memory of the window; no sample can be added while it is referenced."""
        first = self.first()
        stamps = cast('memoryview[int]', memoryview(self.stamps))[first:]
        poses = cast('memoryview[float]', memoryview(self.poses))[first * POSE_FLOATS:]
        ends = {end for end in self._ends if end >= stamps[0]}
        return Columns(stamps, poses,
                       None if self.parents is None else self.parents[first:], ends)

    def lie_on(self, columns: Columns, parent: str | None, horizon: int = BEGINNING) -> None:
        """
        Use the memory of a file or of another process in place; nothing can be added.

        :param parent: that of the newest sample; None if there is none, or the edge has ended.
        :param horizon: samples older than this have expired, nanoseconds.
        """
        self.parents = cast('list[str] | None', columns.parents)
        self.parent, self._ends = parent, set(columns.ends)
        self.grow_to(columns.stamps, columns.poses, horizon)

    def grow_to(self, stamps: 'memoryview[int]', poses: 'memoryview[float]', horizon: int) -> None:
        """Use more of the memory that it lies on, if no sample has a parent of its own."""
        # Memory views are read like arrays and lists.
        self.stamps, self.poses = cast('array[int]', stamps), cast('array[float]', poses)
        self._horizon = horizon
        self.newest_stamp = self.latest_stamp = stamps[-1] if stamps else None

    def copy_between(self, first: int, last: int) -> tuple[Stamps, Array]:
        """
        Return the samples that lookups between two stamps need.

        :return: stamps (n,) and poses (n, 7), n > 0.
        """
        begin = self.index_before(first)
        end = bisect_right(self.stamps, last, begin) + 1
        # An array cannot grow while numpy has a view of it, so this function returns only copies.
        stamps = np.frombuffer(self.stamps, dtype=np.int64)
        poses = np.frombuffer(self.poses).reshape(len(stamps), POSE_FLOATS)
        return stamps[begin:end].copy(), poses[begin:end].copy()

    def index_before(self, stamp: int) -> int:
        """Return the index of the sample at or before a stamp; of the oldest if there is none."""
        first = self.first()
        return max(first, bisect_right(self.stamps, stamp, first) - 1)

    def pose(self, index: int) -> PoseTuple:
        """Return ``parent_T_child`` of a sample."""
        return unpack_pose(self.poses, index * POSE_BYTES)

    def joins(self, index: int) -> bool:
        """Return whether the edge moves from a sample to the next, and does not jump or end."""
        if index + 1 >= len(self.stamps) or self.stamps[index] == self.stamps[index + 1]:
            return False
        parents = self.parents
        return parents is None or (parents[index] == parents[index + 1]
                                   and self.stamps[index] not in self._ends)

    def set_poses(self, poses: Array) -> None:
        """Replace the poses (n, 7) of all n samples in the window."""
        # Not in place, because the memory of a file cannot be changed.
        self.poses = array('d', self.poses[:self.first() * POSE_FLOATS])
        self.poses.frombytes(poses.tobytes())

    def has_named(self, parent: str) -> bool:
        """Return whether a stored sample has a given parent."""
        return parent in self._named()

    def _named(self) -> list[str]:
        """Return the parents of the stored samples."""
        if self.parents is not None:
            return self.parents
        return [] if self.parent is None else [self.parent]

    def _write_parents(self) -> None:
        """Store a parent for every sample from now on."""
        if self.parents is None:
            self.parents = self._named() * len(self.stamps)

    def _append(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        self.stamps.append(stamp)
        self.poses.frombytes(pack_pose(*pose))
        if self.parents is not None:
            self.parents.append(parent)
        self.newest_stamp = stamp
        self.latest_stamp = self._last_held()
        self.parent = parent

    def _last_held(self) -> int:
        """Return the last stamp for which the newest sample is valid; the edge has not ended."""
        assert self.newest_stamp is not None
        return min(self.newest_stamp + self._holds_for, FOREVER - 1)

    def _insert_between(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        self.late = min(self.late, stamp)
        index = bisect_right(self.stamps, stamp, self.first())
        self.stamps.insert(index, stamp)
        first = index * POSE_FLOATS
        self.poses[first:first] = array('d', pose)
        if self.parents is not None:
            self.parents.insert(index, parent)

    def index_at(self, stamp: int) -> int | None:
        """Return the index of the sample at or before a stamp; None if there is no data for it."""
        if self.latest_stamp is None or stamp > self.latest_stamp:
            return None
        first = self.first()
        index = bisect_right(self.stamps, stamp, first) - 1
        if index < first:
            return None
        older_stamp = self.stamps[index]
        return None if stamp > older_stamp in self._ends else index

    def first(self) -> int:
        """Return the index of the oldest sample that has not expired; 0 without samples."""
        if self.stamps and self.stamps[0] < self._horizon:
            return bisect_left(self.stamps, self._horizon)
        return 0

    def _tidy(self, latest: int) -> None:
        """Remove expired samples; repeat after an eighth of the window."""
        start = self.first()
        if start >= _MIN_BLOCK:
            self._drop(start)
            if self.parents is not None:
                del self.parents[:start]
                self._ends = {end for end in self._ends if end >= self.stamps[0]}
                if len(set(self.parents)) == 1 and not self._ends:
                    self.parents = None
        self._tidy_after = latest + self.cache_time // 8

    def _drop(self, count: int) -> None:
        """Free the memory of the oldest samples."""
        del self.stamps[:count]
        del self.poses[:count * POSE_FLOATS]


def _in_order(stamps: Stamps, poses: Array) -> tuple[Stamps, Array]:
    """Return samples sorted by stamp; those with equal stamps keep their order."""
    order = np.argsort(stamps, kind='stable')
    return stamps[order], poses[order]
