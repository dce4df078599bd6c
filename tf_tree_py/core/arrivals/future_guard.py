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
Stamps from the far future: after one of them, good data is refused as too old.

The clock is the caller's.
"""

from collections.abc import Callable, Iterable, Mapping

from .incidents import Incident, Kind
from .sample import Sample
from ..edges.protocol import History
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp, from_seconds, LATEST

FAR = from_seconds(10.0)
"""Without a limit, stamps that are further ahead of the clock are reported: tf2's window."""

_LIKELY = ("Most likely a publisher's clock is wrong (chrony or NTP set it), or one side goes by "
           'simulated time and the other does not (use_sim_time)')
_CURE = 'Buffer(max_future=...) refuses such stamps'


class FutureGuard:
    """
    Compares stamps with a clock, and reads the clock as rarely as possible.

    The clock only goes on, so a stamp that was allowed when it was last read is allowed
    now. A good stamp therefore costs one comparison, and the clock is read only when a
    stamp is beyond the last limit. After a clock has jumped back a new guard is needed:
    see ``renewed``.

    The guard is used without the buffer's lock, by several threads at once.

    :ivar limit: stamps up to here are good; for later ones call ``is_too_far``.
    """

    def __init__(self, now: Callable[[], int] | None, max_future: int | None) -> None:
        """
        Make a guard that has not read the clock yet.

        :param now: the clock, nanoseconds; while it returns 0 it has not begun, and no
            stamp is too far ahead. None: no stamp ever is.
        :param max_future: how far ahead of the clock a stamp may be; what is further is
            refused. None: nothing is refused, and what is further than ``FAR`` is
            reported.
        """
        if max_future is not None and max_future < 0:
            raise ValueError(f'max_future is {max_future} ns, and cannot be negative')
        if max_future is not None and now is None:
            raise ValueError('max_future needs a clock to go by: pass now, such as time.time_ns')
        self._now = now
        self._max_future = max_future
        self._span = FAR if max_future is None else max_future
        self.limit = FOREVER if now is None else BEGINNING

    def renewed(self) -> 'FutureGuard':
        """Return one that has not read the clock yet."""
        return FutureGuard(self._now, self._max_future)

    def is_too_far(self, stamp: int) -> bool:
        """Return whether a stamp is too far ahead of the clock."""
        return stamp > self.limit and self._is_still_too_far(stamp)

    def _is_still_too_far(self, stamp: int) -> bool:
        now = self._now() if self._now else 0
        if now <= 0:
            return False
        self.limit = now + self._span
        return stamp > self.limit

    def part(self, samples: Iterable[Sample], authority: str, histories: Mapping[str, History]
             ) -> tuple[list[Sample], list[Incident]]:
        """
        Return the samples to insert, and incidents for those that are too far ahead.

        The clock is not read again. Where nothing is refused, only the first sample of an
        edge that is too far ahead is reported, not all that follow.

        :param histories: what the buffer holds.
        """
        taken, remarks = [], []
        for sample in samples:
            far = sample.stamp > self.limit
            if far and (self._max_future is not None or not self._was_reported(sample, histories)):
                remarks.append(self._incident(sample, authority))
            if not far or self._max_future is None:
                taken.append(sample)
        return taken, remarks

    def _was_reported(self, sample: Sample, histories: Mapping[str, History]) -> bool:
        history = histories.get(sample.child)
        return history is not None and (history.latest_stamp or LATEST) > self.limit

    def _incident(self, sample: Sample, authority: str) -> Incident:
        stamp = sample.stamp
        edge = sample.parent, sample.child
        ahead = f'its stamp {format_stamp(stamp)} is {self._ahead(stamp)} ahead of the clock'
        if self._max_future is not None:
            return Incident(
                Kind.FAR_FUTURE, *edge, stamp, authority,
                f'{ahead}, and max_future allows {format_span(self._span)}. {_LIKELY}')
        return Incident(
            Kind.AHEAD_OF_CLOCK, *edge, stamp, authority,
            f'{ahead}: all good data of this edge is older, and will be refused if it is so by '
            f'more than the buffer keeps. {_LIKELY}. {_CURE}')

    def why_old(self, newest: int) -> str:
        """Return why good data is older than the newest stamp of its edge, '' if not known."""
        if not self._is_still_too_far(newest):
            return ''
        return (f'The newest stamp of this edge is {self._ahead(newest)} ahead of the clock: that '
                'one is wrong, and good data is refused until the clock gets there. '
                f'{_CURE}; clear() forgets it')

    def _ahead(self, stamp: int) -> str:
        return format_span(stamp - (self.limit - self._span))
