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
The history of an edge that is known in continuous time: one spline.

It takes no samples. Newer ones are fitted elsewhere, and the edge gets another spline.
"""

from array import array
from collections.abc import Iterator
from typing import TypeGuard

import numpy as np

from .columns import Columns
from .protocol import History, Stretch
from .spline import Spline
from .spline_track import SplineTrack
from .storage import Arrays, Facts, Stored
from ..errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import FOREVER, UNLIMITED
from ..times import Stamps

# With ten, a straight line between two of them has a hundredth of the error that a straight line
# from knot to knot would have.
_POSES_A_PIECE = 10


class SplineHistory:
    """
    One edge on a spline; see ``MovingHistory``.

    :ivar spline: None after ``clear``.
    """

    __slots__ = ('child', 'parent', 'authority', 'spline')

    kind = 'a spline'
    is_static = False
    fixed_parent = True
    # Whoever fits the spline decides how much of it is kept.
    cache_time = UNLIMITED

    def __init__(self, child: str, parent: str | None, spline: Spline | None,
                 authority: str = '') -> None:
        self.child = child
        self.parent = parent
        self.spline = spline
        self.authority = authority

    def __len__(self) -> int:
        return 0 if self.spline is None else len(self.spline)

    @property
    def oldest_stamp(self) -> int | None:
        """Return where the spline begins, nanoseconds."""
        return None if self.spline is None else self.spline.oldest

    @property
    def latest_stamp(self) -> int | None:
        """Return where the spline ends, nanoseconds."""
        return None if self.spline is None else self.spline.latest

    # --- answers

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp.

        :raises ExtrapolationException: the stamp lies outside the spline.
        """
        spline = self.spline
        if spline is None or not spline.oldest <= stamp <= spline.latest:
            raise self.extrapolation(stamp)
        x, y, z, qx, qy, qz, qw = spline.sample(stamp)
        return (x, y, z, qx, qy, qz, qw)

    def track(self, first: int, last: int) -> SplineTrack:
        """Return what it takes to answer many stamps: the spline, which never changes."""
        assert self.spline is not None
        return SplineTrack(self.spline, first, last)

    def twists(self, stamps: Stamps) -> Array:
        """Return how fast the child moves: the derivative of the spline."""
        assert self.spline is not None
        return self.spline.twists(stamps)

    # --- who is the parent

    def parent_at(self, stamp: int) -> str | None:
        """Return the parent, the same for as long as the spline is."""
        spline = self.spline
        return self.parent if spline and spline.oldest <= stamp <= spline.latest else None

    def possible_parents(self, stamp: int) -> set[str] | None:
        """Return the parent, unless the stamp is older than the spline; None without one."""
        if self.parent is None:
            return None
        return set() if self.is_too_old(stamp) else {self.parent}

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """Yield the parent, from the beginning of the spline on."""
        if self.spline is not None and self.parent is not None:
            yield self.parent, self.spline.oldest, FOREVER

    def has_named(self, parent: str) -> bool:
        """Return whether this is the parent."""
        return parent == self.parent

    def next_turn(self, stamp: int) -> int:
        """Return how far the spline has to reach, to change what is known of a stamp."""
        latest = self.latest_stamp
        if latest is None or self.is_too_old(stamp):
            return FOREVER
        # The next spline may begin later, so the time of this one may be gone.
        return max(stamp, latest + 1)

    # --- what arrives

    def append(self, stamp: int, pose: bytes) -> bool:
        """Return False: a spline takes no sample."""
        return False

    def goes_on(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return False: with a sample it would be another kind of edge."""
        return False

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Return False: a spline takes no sample."""
        return False

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Take no samples; nobody calls it, for ``append`` and ``insert`` refuse each."""

    def is_too_old(self, stamp: int) -> bool:
        """Return whether a stamp is older than the spline: the next one will not begin earlier."""
        return self.spline is not None and stamp < self.spline.oldest

    def next_stamp(self, stamp: int) -> int:
        """Return where the spline begins, if that is newer, else ``FOREVER``."""
        oldest = self.oldest_stamp
        return oldest if oldest is not None and stamp < oldest else FOREVER

    def fell_silent(self, stamp: int) -> bool:
        """Return False: a spline never counts as silent; ``remove_frame`` removes it."""
        return False

    def end(self) -> None:
        """Do nothing, for it never counts as silent."""

    def clear(self) -> None:
        """Forget the spline."""
        self.spline = self.parent = None

    def copy(self) -> 'SplineHistory':
        """Return a history of its own, with the same spline, which never changes."""
        return SplineHistory(self.child, self.parent, self.spline, self.authority)

    def columns(self) -> Columns:
        """Return poses on the spline, ten for each piece, for programs that interpolate."""
        spline = self.spline
        if spline is None:
            return Columns(memoryview(array('q')), memoryview(array('d')), None, ())
        stamps = spline.cuts(range(spline.pieces), _POSES_A_PIECE)
        poses = np.ascontiguousarray(spline.poses(stamps))
        return Columns(memoryview(stamps), memoryview(poses.ravel()), None, ())

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the spline to arrays."""
        return {'parent': self.parent,
                'spline': None if self.spline is None else self.spline.frozen(arrays)}

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> 'SplineHistory':
        """Return what was frozen, whose spline uses the memory where it lies."""
        if not stored.has('spline'):
            return cls(child, None, None)
        return cls(child, stored.one('parent', str), Spline.thawed(stored.part('spline')))

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp outside the spline."""
        spline = self.spline
        if spline is None:
            return NoDataException(child=self.child, requested=stamp)
        kind: type[ExtrapolationException] = PastExtrapolationException
        hint = 'The edge is a spline, which begins later'
        if stamp > spline.latest:
            kind = FutureExtrapolationException
            hint = ('The edge is a spline, and goes no further than the poses that it was fitted '
                    'to: wait for a longer one, with a timeout')
        return kind(parent=self.parent, child=self.child, requested=stamp, oldest=spline.oldest,
                    latest=spline.latest, hint=hint)


def is_spline(history: History | None) -> TypeGuard[SplineHistory]:
    """Return whether there is a history, and it is a spline's."""
    return history is not None and history.kind == SplineHistory.kind
