# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How long a wait lasts by the clock that a buffer follows.

With simulated time a timeout follows ``/clock``, and does not pass while that stands still; the
log reports this once. Otherwise it follows the monotonic system clock. Nothing polls.

The thread of a tick calls ``start`` and ``reach``, perhaps with locks of ``clock`` held: they only
set fields, and wake. Who waits says first how it is to be woken, and looks then whether the time
is over: otherwise a tick between the two would be lost.

One thread serves all alarms: callbacks at times of that clock. The rules:

- The thread calls ``expire`` and ``on_wake`` without the lock: they take the buffer's, and the
  thread that holds that may be about to set an alarm.
- ``_thread`` changes only with the lock held, and the thread looks for alarms once more before it
  ends: no alarm is left without a thread.
- What ticks and finalizers call takes no lock, and only rings the bell: ``_end`` and ``ring``.
"""

from collections import deque
from collections.abc import Callable
from functools import partial
import heapq
import itertools
import math
from queue import Empty, SimpleQueue
import threading
import time
from typing import Protocol
import weakref

import rclpy.logging
from tf_tree_py.core import fork_locks
from tf_tree_py.core.errors import no_truth, TransformException
from tf_tree_py.core.stamp import as_seconds

from .clock import ClockWatch, STOPPED_S
from ..threads.internal_node import CallbackFailures

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


# --- alarms

LINGER_S = 1.0
_MIN_DEAD = 64


class Sleeper(Protocol):
    """The owner of an alarm; the reference to it is weak, so it may be gone by then."""

    def expire(self) -> None:
        """Give up, since the time is over."""


class Alarms:
    """
    The deadlines of any number of sleepers, and one daemon thread that waits for them.

    The thread starts with the first alarm and ends a second after the last one is gone.
    Setting an alarm costs O(log n), cancelling it O(1) amortised. Memory is proportional to
    the number of alarms that are set.
    """

    def __init__(self, watch: ClockWatch, on_wake: Callable[[], None]) -> None:
        """
        Begin without alarms.

        :param watch: the clock to follow.
        :param on_wake: called by the thread each time it wakes up.
        """
        self._watch = watch
        self._on_wake = on_wake
        self._lock = fork_locks.lock()
        self._bell = _Bell()
        self._numbers = itertools.count()
        self._pending: dict[int, weakref.ref[Sleeper]] = {}
        # The ends by the wall clock, with the numbers of their alarms; and the alarms that follow
        # simulated time, of which the watch calls those that are due.
        self._by_wall: list[tuple[float, int]] = []
        self._simulated: set[int] = set()
        self._due: deque[int] = deque()
        self._thread: threading.Thread | None = None
        fork_locks.repair(self)
        self._failures = CallbackFailures(rclpy.logging.get_logger('tf_tree_py'))

    def __len__(self) -> int:
        return len(self._pending)

    __bool__ = no_truth

    def run_in(self, thread: threading.Thread) -> bool:
        """Return whether a thread is the one that calls ``expire``."""
        return thread is self._thread

    def repair_in_child(self) -> None:
        """Forget the thread, which exists only in the parent: the next alarm starts another."""
        self._thread = None
        self._bell = _Bell()

    def add(self, sleeper: Sleeper, deadline: ClockDeadline) -> int:
        """
        Call a sleeper's ``expire`` when its deadline is over.

        :return: the number that cancels it.
        """
        with self._lock:
            number = next(self._numbers)
            self._pending[number] = weakref.ref(sleeper)
            if deadline.is_simulated:
                self._simulated.add(number)
            end = deadline.wall_end
            # Of the others the watch calls those that are due: here they would stay for ever.
            if end < math.inf:
                heapq.heappush(self._by_wall, (end, number))
            if self._thread is None:
                self._begin()
            elif end < math.inf and self._by_wall[0][1] == number:
                self._bell.ring()
        # Last: if the time is over already, this calls at once, and the alarm has to be known.
        deadline.call(partial(self._end, number))
        return number

    def forget(self, number: int) -> None:
        """Cancel an alarm; it may have fired already."""
        with self._lock:
            if self._discard(number) is None:
                return
            most = 4 * len(self._pending) + _MIN_DEAD
            if not self._pending or len(self._by_wall) > most:
                self._by_wall = [entry for entry in self._by_wall if entry[1] in self._pending]
                heapq.heapify(self._by_wall)
                self._bell.ring()

    def _discard(self, number: int) -> 'weakref.ref[Sleeper] | None':
        self._simulated.discard(number)
        return self._pending.pop(number, None)

    def _end(self, number: int) -> None:
        """Let the thread call a sleeper whose simulated time is over; takes no lock."""
        if number in self._pending:
            self._due.append(number)
            self._bell.ring()

    def ring(self) -> None:
        """Wake the thread, if there is one; takes no lock."""
        self._bell.ring()

    def _begin(self) -> None:
        self._thread = threading.Thread(target=self._run, name='tf_tree_py alarms', daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            while not self._is_done():
                self._expire_due()
                self._on_wake()
                if self._pending:
                    self._sleep()
        except BaseException:
            # After any error, the next alarm starts another thread.
            with self._lock:
                self._thread = None
            raise

    def _is_done(self) -> bool:
        """Wait a while for an alarm; return whether the thread may end."""
        if self._pending or self._bell.wait(LINGER_S):
            return False
        self._failures.write_counts()
        with self._lock:
            if self._pending:
                return False
            self._thread = None
            return True

    def _sleep(self) -> None:
        with self._lock:
            wall_end = self._by_wall[0][0] if self._by_wall else math.inf
            simulated = bool(self._simulated)
        left_s = wall_end - time.monotonic()
        if simulated and self._watch.may_report and left_s > STOPPED_S:
            before = self._watch.simulated_now()
            if not self._bell.wait(STOPPED_S):
                self._watch.report_if_stopped(before)
        else:
            self._bell.wait(left_s)

    def _expire_due(self) -> None:
        now = time.monotonic()
        due = []
        with self._lock:
            while self._by_wall and self._by_wall[0][0] <= now:
                due.append(self._discard(heapq.heappop(self._by_wall)[1]))
            while self._due:
                due.append(self._discard(self._due.popleft()))
        for reference in due:
            sleeper = None if reference is None else reference()
            try:
                if sleeper is not None:
                    sleeper.expire()
            except BaseException:  # noqa: B902 - no error may prevent the next callback
                self._failures.report('a callback after a timeout')


class _Bell:
    """
    An ``Event`` for one thread, which a finalizer may set.

    A finalizer may run in the middle of ``Event.set``, and would then wait for its lock without
    end. ``SimpleQueue.put`` is re-entrant.
    """

    def __init__(self) -> None:
        self._rings: SimpleQueue[None] = SimpleQueue()

    def ring(self) -> None:
        self._rings.put(None)

    def wait(self, timeout_s: float) -> bool:
        """Block until it rings (True) or the time is over (False)."""
        try:
            self._rings.get(timeout=min(max(0.0, timeout_s), threading.TIMEOUT_MAX))
        except Empty:
            return False
        while not self._rings.empty():
            self._rings.get_nowait()
        return True
