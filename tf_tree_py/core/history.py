"""
One child frame's samples over time.

A sample is a stamp, a parent and ``parent_T_child`` at that stamp. What a frame
is called, who hangs on whom and who may insert is the business of ``tree``.
"""

from array import array
from bisect import bisect_left, bisect_right
import struct

import numpy as np

from .errors import (
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from .many import Stamps
from .se3 import interpolate_pair, PoseTuple
from .so3 import Array
from .stamp import format_span, LATEST

_POSE_FLOATS = 7
POSE_BYTES = 56
pack_pose = struct.Struct('=7d').pack
unpack_pose = struct.Struct('=7d').unpack_from
_unpack_pair = struct.Struct('=14d').unpack_from

_BEGINNING = -2**63

# Fewer expired samples than this are not worth moving the rest for.
_MIN_BLOCK = 64


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

    nearest_parent = parent_at

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

    :ivar parent: the newest sample's parent; None while there is no sample.
    :ivar latest_stamp: the newest stamp, nanoseconds; None while there is no sample.
    :ivar authority: who sent the last sample that was taken.
    """

    __slots__ = ('child', 'parent', 'latest_stamp', 'authority', 'cache_time',
                 '_latest_pose', '_stamps', '_poses', '_parents', '_start', '_horizon',
                 '_tidy_after')

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
        # What is older than the horizon has expired. The start is moved past it when
        # somebody looks, and memory is tidied up once in a while.
        self._start = 0
        self._horizon = _BEGINNING
        self._tidy_after = _BEGINNING

    def __len__(self) -> int:
        return len(self._stamps) - self._first()

    @property
    def fixed_parent(self) -> bool:
        """Return whether all samples name one parent, so that a path through it can be kept."""
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
        if parent != self.parent and self._parents is None:
            assert self.parent is not None
            self._parents = [self.parent] * len(self._stamps)
        if stamp >= latest:
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

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp, interpolated between its two neighbours.

        Where the neighbours name different parents, the older one holds until the
        newer begins. O(log n) in the number of stored samples.

        :param stamp: nanoseconds, or ``LATEST``.
        :return: ``parent_T_child``, metres and unit quaternion.
        :raises ExtrapolationException: the stamp lies outside the stored span.
        """
        if stamp == self.latest_stamp:
            return self._latest_pose or self._unpack_latest()
        stamps, start = self._stamps, self._start
        after = bisect_right(stamps, stamp, start)
        if (not start < after < len(stamps) or stamp == LATEST
                or (older_stamp := stamps[after - 1]) < self._horizon):
            self._check_span(stamp)
            return self._unpack_latest()
        pair = _unpack_pair(self._poses, (after - 1) * POSE_BYTES)
        parents = self._parents
        if stamp == older_stamp or (parents and parents[after - 1] != parents[after]):
            return pair[:_POSE_FLOATS]
        ratio = (stamp - older_stamp) / (stamps[after] - older_stamp)
        return interpolate_pair(pair, ratio, True)

    def parent_at(self, stamp: int) -> str:
        """
        Return the parent at a stamp, that of the sample at or before it.

        :raises ExtrapolationException: the stamp lies outside the stored span.
        """
        self._check_span(stamp)
        parent = self.nearest_parent(stamp)
        assert parent is not None
        return parent

    def nearest_parent(self, stamp: int) -> str | None:
        """Return the parent at a stamp, or beyond the stored span that of its end."""
        if self._parents is None or stamp == LATEST:
            return self.parent
        first = self._first()
        return self._parents[max(first, bisect_right(self._stamps, stamp, first) - 1)]

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
        twin._horizon, twin._tidy_after = self._horizon, self._tidy_after
        return twin

    def has_named(self, parent: str) -> bool:
        """Return whether a stored sample names a parent."""
        return parent == self.parent or parent in (self._parents or ())

    def _check_span(self, stamp: int) -> None:
        """Raise unless the stored span holds a stamp."""
        stamps = self._stamps
        if not stamps or (stamp != LATEST and not stamps[self._first()] <= stamp <= stamps[-1]):
            raise self._extrapolation(stamp)

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
                if len(set(self._parents)) == 1:
                    self._parents = None
            self._start = 0
        self._tidy_after = latest + self.cache_time // 8

    def _extrapolation(self, stamp: int) -> Exception:
        latest, oldest, child = self.latest_stamp, self.oldest_stamp, self.child
        if latest is None or oldest is None:
            return NoDataException(child=child, requested=stamp, blocked_on=(child, LATEST))
        if stamp > latest:
            return FutureExtrapolationException(
                parent=self.parent, child=child, requested=stamp, oldest=oldest, latest=latest,
                hint="Pass the stamp of the sensor's own message, not the present time, "
                     'or a timeout that lasts until the data comes',
                blocked_on=(child, stamp))
        expired = stamp < latest - self.cache_time
        if expired:
            hint = (f'The buffer keeps {format_span(self.cache_time)}: ask sooner, '
                    'or give it a longer cache_time (UNLIMITED keeps everything)')
        else:
            hint = ('Nothing older of this edge has arrived: its publisher, or who listens, '
                    'began later')
        return PastExtrapolationException(
            parent=self.parent, child=child, requested=stamp, oldest=oldest, latest=latest,
            hint=hint, blocked_on=None if expired else (child, LATEST))


def _in_order(stamps: Stamps, poses: Array) -> tuple[Stamps, Array]:
    """Return samples sorted by stamp; those of one stamp keep their order."""
    order = np.argsort(stamps, kind='stable')
    return stamps[order], poses[order]


History = StaticHistory | DynamicHistory
