# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Callbacks at times of the clock that a buffer follows: one thread serves them all."""

from collections.abc import Callable
import heapq
import itertools
import math
from queue import Empty, SimpleQueue
import threading
import time
from typing import Any, Protocol
import weakref

import rclpy.logging
from tf_tree_py.core import fork_locks

from .clock import ClockDeadline, ClockWatch, STOPPED_S
from ..threads.internal_node import CallbackFailures

_LINGER_S = 1.0
_MIN_DEAD = 64


class AlarmDeadline(ClockDeadline):
    """A ``ClockDeadline`` for waits without a thread: an alarm ends them."""

    @property
    def ends(self) -> tuple[float, float]:
        """Return the monotonic time and the simulated time of its end; inf: never."""
        return math.inf if self._wall_end is None else self._wall_end, self._end

    @property
    def released(self) -> bool:
        """Return whether the last source of the awaited data has gone."""
        return self._watch.released != self._released

    def is_over(self) -> bool:
        """Return whether the wait is over; ``why_early`` is the reason if it ended early."""
        if self._is_over():
            return True
        if time.monotonic() < self.ends[0]:
            return False
        if self._begin is not None:
            self.why_early = 'Given up because of the wall_guard: is any node publishing /clock?'
        return True


class Sleeper(Protocol):
    """The owner of an alarm; the reference to it is weak, so it may be gone by then."""

    def expire(self) -> None:
        """Give up, since the time is over."""


_Entry = tuple[float, int, 'weakref.ref[Sleeper]']


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
        self._by_wall: list[_Entry] = []
        self._by_simulation: list[_Entry] = []
        self._pending: set[int] = set()
        self._thread: threading.Thread | None = None
        fork_locks.repair(self)
        self._failures = CallbackFailures(rclpy.logging.get_logger('tf_tree_py'))

    def __len__(self) -> int:
        return len(self._pending)

    def run_in(self, thread: threading.Thread) -> bool:
        """Return whether a thread is the one that calls ``expire``."""
        return thread is self._thread

    def repair_in_child(self) -> None:
        """Forget the thread, which exists only in the parent: the next alarm starts another."""
        self._thread = None
        self._bell = _Bell()

    def add(self, sleeper: Sleeper, deadline: AlarmDeadline) -> int:
        """
        Call a sleeper's ``expire`` when its deadline is over.

        :return: the number that cancels it.
        """
        reference = weakref.ref(sleeper)
        with self._lock:
            number = next(self._numbers)
            self._pending.add(number)
            first = False
            for heap, end in zip(self._heaps(), deadline.ends, strict=True):
                if end < math.inf:
                    heapq.heappush(heap, (end, number, reference))
                    first = first or heap[0][1] == number
            if self._thread is None:
                self._begin()
            elif first:
                self._bell.ring()
        return number

    def forget(self, number: int) -> None:
        """Cancel an alarm; it may have fired already."""
        with self._lock:
            self._pending.discard(number)
            kept = sum(map(len, self._heaps()))
            if kept > 4 * len(self._pending) + _MIN_DEAD or (kept and not self._pending):
                for heap in self._heaps():
                    heap[:] = [entry for entry in heap if entry[1] in self._pending]
                    heapq.heapify(heap)
                self._bell.ring()

    def ring(self) -> None:
        """Wake the thread, if there is one; takes no lock."""
        self._bell.ring()

    def _heaps(self) -> tuple[list[_Entry], list[_Entry]]:
        return self._by_wall, self._by_simulation

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
        if self._pending or self._bell.wait(_LINGER_S):
            return False
        self._failures.write_counts()
        with self._lock:
            if self._pending:
                return False
            self._thread = None
            return True

    def _sleep(self) -> None:
        with self._lock:
            wall_end, simulated_end = (heap[0][0] if heap else math.inf for heap in self._heaps())
        with self._watch.waking(self._bell.ring, simulated_end):
            # The clock may have ticked before the bell was registered.
            if not self._simulation_reached(simulated_end):
                self._wait_for_bell(wall_end, simulated_end)

    def _wait_for_bell(self, wall_end: float, simulated_end: float) -> None:
        left_s = wall_end - time.monotonic()
        before = self._watch.simulated_now()
        if simulated_end < math.inf and self._watch.may_report and left_s > STOPPED_S:
            if not self._bell.wait(STOPPED_S):
                self._watch.report_if_stopped(before)
        else:
            self._bell.wait(left_s)

    def _simulation_reached(self, end: float) -> bool:
        """Return whether the simulated time has been reached, or is no longer published."""
        if end == math.inf:
            return False
        now = self._watch.simulated_now()
        return now is None or now >= end

    def _expire_due(self) -> None:
        simulated = self._watch.simulated_now()
        nows = time.monotonic(), math.inf if simulated is None else simulated
        due: list[weakref.ref[Sleeper]] = []
        with self._lock:
            for heap, now in zip(self._heaps(), nows, strict=True):
                while heap and heap[0][0] <= now:
                    _, number, reference = heapq.heappop(heap)
                    if number in self._pending:
                        self._pending.discard(number)
                        due.append(reference)
        for reference in due:
            sleeper = reference()
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
        self._rings: SimpleQueue[Any] = SimpleQueue()

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
