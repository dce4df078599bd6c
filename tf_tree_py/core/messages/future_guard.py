# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Stamps from the far future: after one of them, good data would be refused as too old.

The caller provides the clock.
"""

from collections.abc import Callable, Iterable, Mapping

from .incidents import Incident, Kind
from .sample import Sample
from ..edges.protocol import History
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp, from_seconds, LATEST

FAR = from_seconds(10.0)
"""Without a limit, stamps further ahead of the clock are reported; this is tf2's window."""

_LIKELY = ("Most likely a publisher's clock is wrong (set it with chrony or NTP), or one side "
           'uses simulated time and the other does not (use_sim_time)')
_CURE = 'Buffer(max_future=...) refuses such stamps'


class FutureGuard:
    """
    Compares stamps with a clock, and reads the clock as rarely as possible.

    The clock only advances, so a stamp that was allowed at the last reading is still allowed.
    A good stamp therefore costs one comparison, and the clock is read only when a stamp is
    beyond the last limit. After the clock has jumped back, a new guard is needed:
    see ``renewed``.

    Several threads use the guard concurrently, without the buffer's lock.

    :ivar limit: stamps up to this one are good; for later ones call ``is_too_far``.
    """

    def __init__(self, now: Callable[[], int] | None, max_future: int | None) -> None:
        """
        Make a guard that has not read the clock yet.

        :param now: the clock, nanoseconds. While it returns 0 it has not started, and no
            stamp is too far ahead. None: no stamp is ever too far ahead.
        :param max_future: how far ahead of the clock a stamp may be; later stamps are
            refused. None: no stamp is refused, and stamps further ahead than ``FAR`` are
            reported.
        """
        if max_future is not None and max_future < 0:
            raise ValueError(f'max_future is {max_future} ns, and cannot be negative')
        if max_future is not None and now is None:
            raise ValueError('max_future needs a clock: pass now, such as time.time_ns')
        self._now = now
        self._max_future = max_future
        self._span = FAR if max_future is None else max_future
        self.limit = FOREVER if now is None else BEGINNING

    def renewed(self) -> 'FutureGuard':
        """Return a guard with the same limits that has not read the clock yet."""
        return FutureGuard(self._now, self._max_future)

    def now(self) -> int:
        """Return the time by the clock, nanoseconds; 0: it has not begun, or there is none."""
        return self._now() if self._now else 0

    def is_too_far(self, stamp: int) -> bool:
        """Return whether a stamp is too far ahead of the clock."""
        return stamp > self.limit and self._is_still_too_far(stamp)

    def _is_still_too_far(self, stamp: int) -> bool:
        now = self.now()
        if now <= 0:
            return False
        self.limit = now + self._span
        return stamp > self.limit

    def part(self, samples: Iterable[Sample], authority: str, histories: Mapping[str, History]
             ) -> tuple[list[Sample], list[Incident]]:
        """
        Return the samples to insert, and incidents for those that are too far ahead.

        The clock is not read again. If no sample is refused, only the first sample of an
        edge that is too far ahead is reported, not those that follow it.

        :param histories: the content of the buffer.
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
            f'{ahead}: good data of this edge is older, and will be refused if it is older by '
            f'more than the buffer keeps. {_LIKELY}. {_CURE}')

    def why_old(self, newest: int) -> str:
        """Return why good data is older than the newest stamp of its edge, '' if not known."""
        if not self._is_still_too_far(newest):
            return ''
        return (f'The newest stamp of this edge is {self._ahead(newest)} ahead of the clock: that '
                'stamp is wrong, and good data is refused until the clock reaches it. '
                f'{_CURE}; clear() removes them')

    def _ahead(self, stamp: int) -> str:
        return format_span(stamp - (self.limit - self._span))
