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
The covariances of one edge over time, beside its poses and only where there are some.

They have stamps of their own: the poses may come on /tf and the covariances with an
odometry. ``geometry.covariances`` says what a covariance means.
"""

from array import array
from bisect import bisect_left, bisect_right
from typing import cast, NamedTuple

import numpy as np

from .protocol import History
from .storage import Arrays, Facts, Stored
from ..geometry import se3, so3
from ..geometry.covariances import pack, PACKED_FLOATS, unpack
from ..geometry.so3 import Array
from ..times import Stamps

# Fewer expired ones than this are not removed yet.
_MIN_BLOCK = 64


class Around(NamedTuple):
    """
    The covariances of an edge around N stamps: what ``covariances.between`` takes.

    Before the first covariance, and after the last, both are the same one, at the ratio 0.
    """

    before: Array
    after: Array
    ratio: Array
    turn: Array


class Uncertainty:
    """
    The covariances of one edge's poses, over time.

    176 bytes a covariance. Between two stamps that have one it is interpolated; the first
    holds before its stamp, the last until another comes. Not safe for several threads:
    the buffer's lock is.

    :ivar parent: of the edge whose covariances they are; the child may change its parent.
    """

    __slots__ = ('parent', '_stamps', '_packed')

    def __init__(self, parent: str) -> None:
        self.parent = parent
        self._stamps = array('q')
        self._packed = array('d')

    def __len__(self) -> int:
        return len(self._stamps)

    def insert(self, stamp: int, covariance: Array, cache_time: int) -> None:
        """
        Take a covariance; it replaces one with the same stamp.

        :param covariance: (6, 6), checked.
        :param cache_time: how far behind the newest one they are kept, nanoseconds.
        """
        index = bisect_left(self._stamps, stamp)
        first = index * PACKED_FLOATS
        row = array('d', pack(covariance).tolist())
        if index < len(self._stamps) and self._stamps[index] == stamp:
            self._packed[first:first + PACKED_FLOATS] = row
            return
        self._stamps.insert(index, stamp)
        self._packed[first:first] = row
        self._tidy(self._stamps[-1] - cache_time)

    def _tidy(self, horizon: int) -> None:
        """Remove expired ones in blocks; the last one before the horizon still holds at it."""
        expired = bisect_right(self._stamps, horizon) - 1
        if expired >= max(_MIN_BLOCK, len(self._stamps) // 8):
            del self._stamps[:expired]
            del self._packed[:expired * PACKED_FLOATS]

    def around(self, stamps: Stamps, history: History) -> Around:
        """
        Return the covariances around stamps (N,), to be interpolated between.

        :param history: the edge's poses.
        """
        if history.is_static or len(self) == 1:
            last = np.tile(unpack(np.array(self._packed[-PACKED_FLOATS:])), (len(stamps), 1, 1))
            return Around(last, last, np.zeros(len(stamps)), np.zeros((len(stamps), 3)))
        begins, ends, rows = self._neighbours(stamps)
        pairs, place = np.unique(begins, return_index=True, return_inverse=True)[1:]
        turns = np.array([_turn(history, int(begins[pair]), int(ends[pair])) for pair in pairs])
        before, after = unpack(rows)
        ratio = np.where(begins < ends, (stamps - begins) / np.maximum(ends - begins, 1), 0.0)
        return Around(before, after, ratio, turns[place])

    def _neighbours(self, stamps: Stamps) -> tuple[Stamps, Stamps, Array]:
        """
        Return the stamps of the covariances before and after each, and these (2, N, 21).

        Before the first and after the last it is that one, twice.
        """
        # An array cannot grow while numpy has a view of it, so only copies leave this function.
        knots = np.frombuffer(self._stamps, dtype=np.int64)
        rows = np.frombuffer(self._packed).reshape(-1, PACKED_FLOATS)
        after = knots.searchsorted(stamps, side='right')
        before = np.maximum(after - 1, 0)
        after = np.where(after == 0, 0, np.minimum(after, len(knots) - 1))
        return knots[before], knots[after], rows[np.stack([before, after])]

    def copy(self) -> 'Uncertainty':
        """Return one of its own with the same covariances."""
        twin = Uncertainty(self.parent)
        twin._stamps, twin._packed = self._stamps[:], self._packed[:]
        return twin

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add to arrays what is kept."""
        arrays.add(self._stamps)
        arrays.add(self._packed)
        return {'parent': self.parent, 'count': len(self)}

    @classmethod
    def thawed(cls, stored: Stored) -> 'Uncertainty':
        """Return what was frozen, which uses the memory where it lies; nothing can be added."""
        one, count = cls(stored.one('parent', str)), stored.whole('count', 1)
        # For reading they are as good as arrays.
        one._stamps = cast('array[int]', stored.integers(count))
        one._packed = cast('array[float]', stored.floats(PACKED_FLOATS * count))
        return one


def _turn(history: History, first: int, last: int) -> so3.Vector3:
    """
    Return by how much an edge turns between two stamps, if it does so at a constant rate.

    Zero where poses lie between the two stamps, or where there is no pose: then the
    covariances are blended without a turn.
    """
    if first == last or history.next_stamp(first) < last or None in (
            history.parent_at(first), history.parent_at(last)):
        return (0.0, 0.0, 0.0)
    begin, end = history.sample(first), history.sample(last)
    return so3.log(se3.compose(end, se3.inverse(begin))[3:])
