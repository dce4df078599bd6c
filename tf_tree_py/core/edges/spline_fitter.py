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
A spline that grows with the poses of a running sensor.

What the spline is used for, such as an edge of a buffer, is not known here.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from .spline import Spline
from .spline_samples import checked_rate, checked_samples, first_guess, places
from ..errors import InvalidArgumentException
from ..geometry.so3 import Array
from ..geometry.spline import SE3, SPLIT
from ..geometry.spline_fit import fitted, ORDER
from ..stamp import format_stamp, from_seconds, NANOSECONDS_PER_SECOND
from ..times import checked_cache_time, Stamps

_CACHE_TIME = from_seconds(10.0)
# A knot this many behind the newest moves by 3e-5 of how far a new pose moves the newest one: each
# knot moves by 2 - sqrt(3) of how far the next one moves.
_FREE_KNOTS = 8
# A longer gap between poses is a wrong stamp.
_MOST_NEW_KNOTS = 1_000_000


class SplineFitter:
    """
    Fits a spline to poses as they come, the last knots anew each time.

    The knots before those are frozen: there, before ``frozen_until``, no answer ever changes.
    The newest piece is the least certain, for its last knots have few poses yet; its pose
    is good where poses are, and its acceleration is rough.

    Adding costs as much as fitting the poses of the last eleven pieces, however long the
    spline is. Poses that come faster than that takes are better added several at a time.
    Not safe for several threads.

    :param knot_rate_hz: knots a second, at most half the rate of the poses if they are noisy.
    :param cache_time: how much of the spline is kept, nanoseconds; eight knots at least. After
        a longer time without a pose it begins anew.
    :param on_se3: as ``Spline.fit`` has it.
    :ivar spline: what was fitted last; None before the first pose.
    """

    def __init__(self, knot_rate_hz: float, *, cache_time: int = _CACHE_TIME,
                 on_se3: bool = False) -> None:
        self.cache_time = checked_cache_time(cache_time)
        self.spline: Spline | None = None
        self._period = max(1, round(NANOSECONDS_PER_SECOND / checked_rate(knot_rate_hz)))
        self._group = SE3 if on_se3 else SPLIT
        self._frozen = 0
        # The poses on pieces with a knot that is free.
        self._stamps: Stamps = np.empty(0, dtype=np.int64)
        self._poses: Array = np.empty((0, 7))

    @property
    def frozen_until(self) -> int | None:
        """Return the stamp before which the spline is final; None before the first pose."""
        if self.spline is None:
            return None
        return self.spline.begin + max(self._frozen - ORDER + 1, 0) * self._period

    def add(self, stamps: npt.ArrayLike, poses: Any) -> Spline:
        """
        Take poses, and return the spline with them in it.

        :param stamps: (N,) nanoseconds, in any order, after ``frozen_until``.
        :param poses: (N, 7), or whatever else ``Spline.fit`` takes.
        :raises InvalidArgumentException: what is older, or what ``Spline.fit`` refuses.
        """
        times, array = checked_samples(stamps, poses)
        spline = self.spline
        if spline is not None and int(times[0]) - spline.latest > max(
                self.cache_time, _FREE_KNOTS * self._period):
            self._start_anew()
            spline = None
        self._refuse_frozen(times)
        self._refuse_far(times, int(times[0]) if spline is None else spline.latest)
        times, array = np.concatenate([self._stamps, times]), np.concatenate([self._poses, array])
        order = np.argsort(times, kind='stable')
        times, array = times[order], array[order]
        self.spline = self._refitted(spline, times, array)
        self._forget(times, array)
        return self.spline

    def _refuse_frozen(self, times: Stamps) -> None:
        first, frozen = int(times[0]), self.frozen_until
        if frozen is not None and first < frozen:
            raise InvalidArgumentException(
                f'the pose at {format_stamp(first)} comes too late: the spline is final before '
                f'{format_stamp(frozen)}')

    def _refuse_far(self, times: Stamps, latest: int) -> None:
        new = (int(times[-1]) - latest) // self._period
        if new > _MOST_NEW_KNOTS:
            raise InvalidArgumentException(
                f'up to the pose at {format_stamp(int(times[-1]))} it takes {new} more knots: is '
                'its stamp right?')

    def _refitted(self, old: Spline | None, stamps: Stamps, poses: Array) -> Spline:
        """Return the spline through poses, the frozen knots as they are."""
        begin = int(stamps[0]) if old is None else old.begin
        latest = int(stamps[-1])
        pieces = max(1, -((begin - latest) // self._period))
        if old is not None:
            pieces = max(pieces, old.pieces)
        knots = first_guess(self._group, begin, self._period, pieces, stamps, poses,
                            None if old is None else old.knots)
        # Frozen knots have no pose left that could move them; the fit need not see them.
        unseen = max(self._frozen - ORDER + 1, 0)
        numbers, u = places(stamps, begin, self._period, pieces)
        knots[unseen:] = fitted(self._group, knots[unseen:], self._frozen - unseen,
                                numbers - unseen, u, poses)
        return Spline(begin, self._period, knots, latest, self._group)

    def _forget(self, stamps: Stamps, poses: Array) -> None:
        """Freeze all but the last knots, and drop what is older than is kept."""
        spline = self.spline
        assert spline is not None and self.frozen_until is not None
        self._frozen = max(self._frozen, len(spline) - _FREE_KNOTS)
        kept = stamps >= self.frozen_until
        self._stamps, self._poses = stamps[kept], poses[kept]
        expired = (spline.latest - self.cache_time - spline.begin) // self._period
        dropped = min(max(expired, 0), max(self._frozen - ORDER + 1, 0))
        if dropped:
            self._frozen -= dropped
            self.spline = Spline(spline.begin + dropped * self._period, self._period,
                                 spline.knots[dropped:], spline.latest, self._group)

    def _start_anew(self) -> None:
        self.spline, self._frozen = None, 0
        self._stamps, self._poses = self._stamps[:0], self._poses[:0]
