"""
One child frame's samples over time.

A sample is a stamp, a parent and ``parent_T_child`` at that stamp. What a frame
is called, who hangs on whom and who may insert is the business of ``tree``.
"""

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
import struct

import numpy as np

from ..errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from ..geometry.se3 import interpolate_pair, PoseTuple
from ..geometry.so3 import Array
from ..stamp import format_span, from_seconds, LATEST
from ..times import Stamps

_POSE_FLOATS = 7
POSE_BYTES = 56
pack_pose = struct.Struct('=7d').pack
unpack_pose = struct.Struct('=7d').unpack_from
_unpack_pair = struct.Struct('=14d').unpack_from

_BEGINNING, _NEVER = -2**63, 2**63

# Fewer expired samples than this are not worth moving the rest for.
_MIN_BLOCK = 64

# An edge is silent when nothing of it came for that long, and for so many of its periods.
_SILENCE = from_seconds(1.0)
_SILENT_PERIODS = 3

# A parent, and the stretch of time it is one: from a stamp to one that is no longer part.
_Stretch = tuple[str, int, int]


class StaticHistory:
    """
    An edge that is valid at all times: one sample, no stamp.

    :ivar authority: who sent it.
    """

    __slots__ = ('child', 'parent', 'pose', 'authority')

    is_static = True
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

    def parent_at(self, stamp: int) -> str:
        """Return the parent, the same at every stamp."""
        return self.parent

    def possible_parents(self, stamp: int) -> set[str]:
        """Return the only parent."""
        return {self.parent}

    def parents_between(self, begin: int, end: int) -> Iterator[_Stretch]:
        """Yield the only parent, for all time."""
        yield self.parent, _BEGINNING, _NEVER

    def has_named(self, parent: str) -> bool:
        """Return whether this is the parent."""
        return parent == self.parent

    def append(self, stamp: int, pose: bytes) -> bool:
        """Return False: a static edge has no next sample."""
        return False


class DynamicHistory:
    """
    The samples of a moving edge inside a window of time, sorted by stamp.

    Stamps are an ``array('q')``, poses one ``array('d')`` of seven floats each:
    64 bytes a sample, which ``struct`` reads as floats and numpy sees without a
    copy. Nearly all edges have one parent for ever; only when a second appears is
    a parent kept for every sample. Expired samples are skipped at once and
    dropped when an eighth of the window has passed, so a sample costs at most 72
    bytes and some growth of the arrays.

    Appending is amortised O(1), inserting in the middle O(n) (a memmove), a
    lookup O(log n). Not safe for several threads: the buffer's lock is.

    :ivar parent: the newest sample's parent; None while there is no sample, and after
        ``end``.
    :ivar latest_stamp: the newest stamp, nanoseconds; None while there is no sample.
    :ivar authority: who sent the last sample that was taken.
    """

    __slots__ = ('child', 'parent', 'latest_stamp', 'authority', 'cache_time',
                 '_latest_pose', '_stamps', '_poses', '_parents', '_ends', '_start',
                 '_horizon', '_tidy_after')

    is_static = False

    def __init__(self, child: str, cache_time: int, authority: str = '') -> None:
        self.child = child
        self.cache_time = cache_time
        self.authority = authority
        self.clear()

    def clear(self) -> None:
        """Forget every sample."""
        self.parent: str | None = None
        self.latest_stamp: int | None = None
        # The newest sample unpacked, once somebody asked for it.
        self._latest_pose: PoseTuple | None = None
        self._stamps = array('q')
        self._poses = array('d')
        self._parents: list[str] | None = None
        # Behind samples with these stamps there is nothing, until the next sample. Where
        # there are any, there are parents too.
        self._ends: set[int] = set()
        # What is older than the horizon has expired. The start is moved past it when
        # somebody looks, and memory is tidied up once in a while.
        self._start = 0
        self._horizon = _BEGINNING
        self._tidy_after = _BEGINNING

    def __len__(self) -> int:
        return len(self._stamps) - self._first()

    @property
    def fixed_parent(self) -> bool:
        """Return whether one parent holds from end to end: a path through it can be kept."""
        return self._parents is None

    @property
    def oldest_stamp(self) -> int | None:
        """Return the oldest stamp in the window, nanoseconds; None while there is no sample."""
        return self._stamps[self._first()] if self._stamps else None

    def append(self, stamp: int, pose: bytes) -> bool:
        """
        Take the next sample of the parent that all before it name: the common case.

        :param pose: seven doubles in the machine's byte order.
        :return: False, with nothing done, when it is another case: see ``insert``.
        """
        latest = self.latest_stamp
        if latest is None or stamp < latest or self._parents is not None:
            return False
        self._horizon = latest - self.cache_time
        if latest > self._tidy_after:
            self._tidy(latest)
        self._stamps.append(stamp)
        self._poses.frombytes(pose)
        self.latest_stamp = stamp
        self._latest_pose = None
        return True

    def goes_on(self, parent: str, stamp: int) -> bool:
        """Return whether with a sample the child has the parents that it had, when it had them."""
        return (parent == self.parent and self._parents is None
                and stamp >= self._stamps[self._first()])

    def is_too_old(self, stamp: int) -> bool:
        """Return whether ``insert`` would refuse a stamp."""
        return self.latest_stamp is not None and stamp < self.latest_stamp - self.cache_time

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """
        Take a sample, unless it is older than the window.

        As tf2 does it: the window hangs on the newest stamp *before* this one, also
        when this one is refused; a sample exactly at its edge is kept, and of several
        with one stamp the last to arrive is found.

        :return: False when the sample was refused.
        """
        latest = self.latest_stamp
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
        if stamp >= latest:
            if stamp == latest:
                self._ends.discard(latest)
            self._append(stamp, parent, pose)
        else:
            self._insert_between(stamp, parent, pose)
        return True

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """
        Take many samples of the parent that all before them name, as ``insert`` one by one.

        O(n) where they are sorted and continue what is there, else a stable sort more.

        :param stamps: (n,) in order of arrival, n > 0; none is older than the window when
            its turn comes.
        :param poses: (n, 7) ``parent_T_child``, with unit quaternions.
        """
        assert self.latest_stamp is not None
        latest = max(self.latest_stamp, int(stamps[:-1].max(initial=_BEGINNING)))
        self._horizon = latest - self.cache_time
        if (stamps[1:] < stamps[:-1]).any():
            stamps, poses = _in_order(stamps, poses)
        if stamps[0] < self.latest_stamp:
            # What is newer than the first goes among them.
            index = bisect_right(self._stamps, int(stamps[0]), self._first())
            newer = np.array(self._poses[index * _POSE_FLOATS:]).reshape(-1, _POSE_FLOATS)
            stamps, poses = _in_order(np.concatenate([self._stamps[index:], stamps]),
                                      np.concatenate([newer, poses]))
            del self._stamps[index:]
            del self._poses[index * _POSE_FLOATS:]
        self._stamps.frombytes(memoryview(np.ascontiguousarray(stamps)).cast('B'))
        self._poses.frombytes(memoryview(np.ascontiguousarray(poses)).cast('B'))
        self.latest_stamp = self._stamps[-1]
        self._latest_pose = None
        if latest > self._tidy_after:
            self._tidy(latest)

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
        pair = _unpack_pair(self._poses, (after - 1) * POSE_BYTES)
        if stamp == older_stamp:
            return pair[:_POSE_FLOATS]
        parents = self._parents
        if parents is not None:
            if older_stamp in self._ends:
                raise self.extrapolation(stamp)
            if parents[after - 1] != parents[after]:
                return pair[:_POSE_FLOATS]
        ratio = (stamp - older_stamp) / (stamps[after] - older_stamp)
        return interpolate_pair(pair, ratio, True)

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

        Those that it ever had, as long as a sample for the stamp may still come; none once
        it would be too old.

        :return: None while there is no sample: it may be any.
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

        Either because it reaches the stamp, or because what is known of it leaves the
        window. So may a sample that is older than all that are stored, at any time.
        """
        latest, index = self.latest_stamp, self._index_at(stamp)
        if latest is None:
            return _NEVER
        if index is not None:
            # What has expired by the newest stamp goes when the next sample comes.
            return max(self._stamps[index] + self.cache_time + 1, latest)
        if self.is_too_old(stamp):
            return _NEVER
        return stamp if stamp > latest else stamp + self.cache_time + 1

    def parents_between(self, begin: int, end: int) -> Iterator[_Stretch]:
        """
        Yield who is the parent in a stretch of time, and from when to when.

        The first may begin before it, and the last end after it: the newest sample's parent
        goes on being it, unless the edge has ended.
        """
        if self.latest_stamp is None:
            return
        first = self._first()
        if self._parents is None:
            assert self.parent is not None
            yield self.parent, self._stamps[first], _NEVER
            return
        begun: _Stretch | None = None
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
        """Return from when on the parent that a sample names is no longer known to be it."""
        stamp = self._stamps[index]
        if stamp in self._ends:
            return stamp + 1
        return self._stamps[index + 1] if index + 1 < len(self._stamps) else _NEVER

    def _index_at(self, stamp: int) -> int | None:
        """Return the index of the sample that counts at a stamp; None where none does."""
        if self.latest_stamp is None or stamp > self.latest_stamp:
            return None
        first = self._first()
        index = bisect_right(self._stamps, stamp, first) - 1
        if index < first:
            return None
        older_stamp = self._stamps[index]
        return None if stamp > older_stamp in self._ends else index

    def next_stamp(self, stamp: int) -> int:
        """Return the stamp of the first sample that is newer; 2**63 if there is none."""
        after = bisect_right(self._stamps, stamp, self._first())
        return self._stamps[after] if after < len(self._stamps) else _NEVER

    def copy_between(self, first: int, last: int) -> tuple[Stamps, Array]:
        """
        Return the samples that it takes to answer from one stamp to another.

        :return: stamps (n,) and poses (n, 7), n > 0.
        """
        start = self._first()
        begin = max(start, bisect_right(self._stamps, first, start) - 1)
        end = max(begin + 1, bisect_right(self._stamps, last, begin) + 1)
        stamps = np.array(self._stamps[begin:end])
        poses = np.array(self._poses[begin * _POSE_FLOATS:end * _POSE_FLOATS])
        return stamps, poses.reshape(-1, _POSE_FLOATS)

    def copy(self) -> 'DynamicHistory':
        """Return a history of its own with the same samples."""
        twin = DynamicHistory(self.child, self.cache_time, self.authority)
        twin.parent, twin.latest_stamp = self.parent, self.latest_stamp
        twin._latest_pose, twin._start = self._latest_pose, self._start
        twin._stamps, twin._poses = self._stamps[:], self._poses[:]
        twin._parents = None if self._parents is None else self._parents[:]
        twin._ends = set(self._ends)
        twin._horizon, twin._tidy_after = self._horizon, self._tidy_after
        return twin

    def has_named(self, parent: str) -> bool:
        """Return whether a stored sample names a parent."""
        return parent in self._named()

    def _named(self) -> list[str]:
        """Return the parents that stored samples name."""
        if self._parents is not None:
            return self._parents
        return [] if self.parent is None else [self.parent]

    def _write_parents(self) -> None:
        """Keep a parent for every sample from now on."""
        if self._parents is None:
            self._parents = self._named() * len(self._stamps)

    def _unpack_latest(self) -> PoseTuple:
        self._latest_pose = pose = unpack_pose(self._poses, (len(self._stamps) - 1) * POSE_BYTES)
        return pose

    def _append(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        self._stamps.append(stamp)
        self._poses.frombytes(pack_pose(*pose))
        if self._parents is not None:
            self._parents.append(parent)
        self.latest_stamp = stamp
        self._latest_pose = pose
        self.parent = parent

    def _insert_between(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        index = bisect_right(self._stamps, stamp, self._first())
        self._stamps.insert(index, stamp)
        first = index * _POSE_FLOATS
        self._poses[first:first] = array('d', pose)
        if self._parents is not None:
            self._parents.insert(index, parent)

    def _first(self) -> int:
        """Return the index of the oldest sample that has not expired; 0 while there is none."""
        if self._stamps and self._stamps[self._start] < self._horizon:
            self._start = bisect_left(self._stamps, self._horizon, self._start)
        return self._start

    def _tidy(self, latest: int) -> None:
        """Drop expired samples, and come back when an eighth of the window has passed."""
        start = self._first()
        if start >= _MIN_BLOCK:
            del self._stamps[:start]
            del self._poses[:start * _POSE_FLOATS]
            if self._parents is not None:
                del self._parents[:start]
                self._ends = {end for end in self._ends if end >= self._stamps[0]}
                if len(set(self._parents)) == 1 and not self._ends:
                    self._parents = None
            self._start = 0
        self._tidy_after = latest + self.cache_time // 8

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return what to raise for a stamp that there is no data for."""
        latest, oldest, child = self.latest_stamp, self.oldest_stamp, self.child
        if latest is None or oldest is None:
            return NoDataException(child=child, requested=stamp)
        kind: type[ExtrapolationException] = PastExtrapolationException
        if stamp > latest:
            kind = FutureExtrapolationException
            hint = ("Pass the stamp of the sensor's own message, not the present time, or a "
                    'timeout that lasts until the data comes')
        elif stamp < latest - self.cache_time:
            hint = (f'The buffer keeps {format_span(self.cache_time)}: ask sooner, or give it a '
                    'longer cache_time (UNLIMITED keeps everything)')
        elif stamp < oldest:
            hint = ('Nothing older of this edge has arrived: its publisher, or who listens, began '
                    'later')
        else:
            kind = ExtrapolationException
            hint = 'The edge had ended then: it was silent, and another one turned it round'
        # An edge that has ended has no parent, but its samples name one.
        return kind(parent=self._named()[-1], child=child, requested=stamp, oldest=oldest,
                    latest=latest, hint=hint)


def _in_order(stamps: Stamps, poses: Array) -> tuple[Stamps, Array]:
    """Return samples sorted by stamp; those of one stamp keep their order."""
    order = np.argsort(stamps, kind='stable')
    return stamps[order], poses[order]


History = StaticHistory | DynamicHistory
