# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How long a wait lasts by the clock that a buffer follows.

With simulated time a timeout follows ``/clock``, and does not pass while that stands still; the
log reports this once. Otherwise it follows the monotonic system clock. Nothing polls.

The thread of a tick calls ``start`` and ``reach``, perhaps with locks of ``clock`` held: they only
set fields, and wake. Who waits says first how it is to be woken, and looks then whether the time
is over: otherwise a tick between the two would be lost.
"""

from collections.abc import Callable
import math
import threading
import time

from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import as_seconds

from .clock import ClockWatch, STOPPED_S

_NO_LISTENER = 'Given up: the listener was closed, or ROS was shut down'


class ClockDeadline:
    """
    A timeout for a thread that sleeps in ``wait``, or for a wait that an alarm ends.

    With simulated time it ends at the first tick that reaches its end.

    :ivar wall_end: its end by the monotonic system clock, seconds; inf: never.
    :ivar why_early: why the wait ended before its timeout; '' if it did not.
    """

    def __init__(self, watch: ClockWatch, timeout: int | None, wall_guard_s: float | None, *,
                 by_wall: bool = False, why_nothing_arrives: Callable[[], str] = str) -> None:
        """
        Begin now.

        :param timeout: nanoseconds of the clock; None: it never ends.
        :param wall_guard_s: with simulated time, the longest wait in seconds of wall time;
            None: without a limit.
        :param by_wall: follow the monotonic system clock also with simulated time.
        :param why_nothing_arrives: returns at the end why no data arrives, '' if it is not known.
        """
        self.why_early = ''
        self._why_nothing_arrives = why_nothing_arrives
        self._watch = watch
        self._released = watch.released
        self._wake: Callable[[], object] = _nothing
        self._reached = False
        self._wall_begin = time.monotonic()
        self._begin = self._now = None if by_wall else watch.begin(self, timeout)
        wall_s = wall_guard_s
        if self._begin is None:
            wall_s = None if timeout is None else as_seconds(timeout)
        self.wall_end = math.inf if wall_s is None else self._wall_begin + wall_s

    def start(self, now: int) -> None:
        """Begin now: before that, no time had been received."""
        self._begin = now

    def reach(self, now: int | None) -> None:
        """End, because the clock has reached the end, or is no longer received (None)."""
        self._now = now
        self._reached = True
        self._wake()

    def wait(self, event: threading.Event) -> bool:
        """Block until the event is set (True) or the time is over (False)."""
        # First: whatever ends the wait from now on sets the event.
        self._wake = event.set
        with self._watch.waking(event.set):
            if self._is_over():
                return event.is_set()
            if self._begin is not None and self._watch.may_report and self._left_s() > STOPPED_S:
                before = self._watch.simulated_now()
                if event.wait(STOPPED_S):
                    return True
                self._watch.report_if_stopped(before)
            if event.wait(self._left_s()):
                return True
            if self._begin is not None:
                self.why_early = (f'Given up after {time.monotonic() - self._wall_begin:.3f} s of '
                                  'wall time, the wall_guard: is any node publishing /clock?')
            return False

    def explain(self, error: TransformException) -> None:
        """Replace the hint of the error with which the wait ends, if there is a better one."""
        why = self.why_early
        if not why and error.blocked_on is not None:
            why = self._why_nothing_arrives()
        error.hint = why or error.hint

    def _left_s(self) -> float:
        """Return the seconds that may be waited by the wall clock."""
        return min(max(0.0, self.wall_end - time.monotonic()), threading.TIMEOUT_MAX)

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began, of simulated time where that is in use."""
        if self._begin is None or self._now is None:
            return time.monotonic() - self._wall_begin
        return as_seconds(self._now - self._begin)

    @property
    def released(self) -> bool:
        """Return whether the last listener has gone."""
        return self._watch.released != self._released

    def _is_over(self) -> bool:
        if self.released:
            self.why_early = _NO_LISTENER
            return True
        if self._begin is None:
            return False
        if not self._reached:
            self._now = self._watch.simulated_now()
        if self._now is None and self._watch.has_ended():
            # The listener that releases all waits may only notice this later.
            self.why_early = _NO_LISTENER
        return self._reached or self._now is None

    # --- without a thread

    @property
    def is_simulated(self) -> bool:
        """Return whether it follows simulated time."""
        return self._begin is not None

    def call(self, wake: Callable[[], object]) -> None:
        """Call a function when simulated time reaches the end, or now if it has."""
        self._wake = wake
        if self._reached:
            wake()

    def is_over(self) -> bool:
        """Return whether the wait is over; ``why_early`` is the reason if it ended early."""
        if self._is_over():
            return True
        if time.monotonic() < self.wall_end:
            return False
        if self._begin is not None:
            self.why_early = 'Given up because of the wall_guard: is any node publishing /clock?'
        return True


def _nothing() -> None:
    """Wake nothing, because nothing waits yet."""
