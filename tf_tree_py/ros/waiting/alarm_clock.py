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

"""Calling back when the clock that a buffer goes by reaches a time: one thread for all."""

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

from .clock import ClockDeadline, ClockWatch
from ..threads.complaint import Complaint

_LINGER_S = 1.0
_MIN_DEAD = 64


class AlarmDeadline(ClockDeadline):
    """A ``ClockDeadline`` for those who do not sleep by it: an alarm calls them back."""

    @property
    def ends(self) -> tuple[float, float]:
        """Return the monotonic time and the simulated one when it is over; inf: never."""
        return math.inf if self._wall_end is None else self._wall_end, self._end

    @property
    def released(self) -> bool:
        """Whether whoever was to deliver what is waited for is gone."""
        return self._watch.released != self._released

    def is_over(self) -> bool:
        """Return whether there is no more to wait for; ``why_early`` then tells."""
        if self._is_over():
            return True
        if time.monotonic() < self.ends[0]:
            return False
        if self._begin is not None:
            self.why_early = 'Given up by the wall_guard: is anybody publishing /clock?'
        return True


class Sleeper(Protocol):
    """Who can be called back; known by weak reference, so it may die before."""

    def expire(self) -> None:
        """Give up: time is up."""


_Entry = tuple[float, int, 'weakref.ref[Sleeper]']


class Alarms:
    """
    The deadlines of any number of sleepers, and one daemon thread that watches them.

    The thread begins with the first alarm, and ends a second after the last is gone.
    Setting an alarm costs O(log n), forgetting it O(1) amortised; what is kept is
    proportional to the alarms that are set.
    """

    def __init__(self, watch: ClockWatch, on_wake: Callable[[], None]) -> None:
        """
        Watch nothing yet.

        :param watch: the clock to go by.
        :param on_wake: called by the thread whenever it looks around.
        """
        self._watch = watch
        self._on_wake = on_wake
        self._lock = threading.Lock()
        self._bell = _Bell()
        self._numbers = itertools.count()
        self._by_wall: list[_Entry] = []
        self._by_simulation: list[_Entry] = []
        self._pending: set[int] = set()
        self._thread: threading.Thread | None = None
        self._complaint = Complaint(rclpy.logging.get_logger('tf_tree_py'))

    def __len__(self) -> int:
        return len(self._pending)

    def add(self, sleeper: Sleeper, deadline: AlarmDeadline) -> int:
        """
        Call a sleeper's ``expire`` when its deadline is over.

        :return: the number by which to forget it.
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
        """Let an alarm be; it may have rung already."""
        with self._lock:
            self._pending.discard(number)
            kept = sum(map(len, self._heaps()))
            if kept > 4 * len(self._pending) + _MIN_DEAD or (kept and not self._pending):
                for heap in self._heaps():
                    heap[:] = [entry for entry in heap if entry[1] in self._pending]
                    heapq.heapify(heap)
                self._bell.ring()

    def ring(self) -> None:
        """Make the thread look around, if there is one; takes no lock."""
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
            # Whatever it was, the next alarm gets another thread.
            with self._lock:
                self._thread = None
            raise

    def _is_done(self) -> bool:
        """Linger while there is nothing to do; return whether that was long enough."""
        if self._pending or self._bell.wait(_LINGER_S):
            return False
        with self._lock:
            if self._pending:
                return False
            self._thread = None
            return True

    def _sleep(self) -> None:
        with self._lock:
            wall_end, simulated_end = (heap[0][0] if heap else math.inf for heap in self._heaps())
        with self._watch.waking(self._bell.ring, simulated_end):
            # The clock may have ticked before it knew of us.
            if not self._simulation_reached(simulated_end):
                self._bell.wait(wall_end - time.monotonic())

    def _simulation_reached(self, end: float) -> bool:
        """Return whether the simulated time is there, or nobody drives it any more."""
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
            except BaseException:  # noqa: B902 - whatever it is, the next must be called back
                self._complaint.write('a callback after a timeout')


class _Bell:
    """
    What an ``Event`` is for one thread; it can be rung in a finalizer.

    A finalizer may run in the middle of ``Event.set``, whose lock it would then wait
    for; ``SimpleQueue`` is made for that.
    """

    def __init__(self) -> None:
        self._rings: SimpleQueue[Any] = SimpleQueue()

    def ring(self) -> None:
        self._rings.put(None)

    def wait(self, timeout_s: float) -> bool:
        """Sleep until it rings (True) or time is up (False)."""
        try:
            self._rings.get(timeout=min(max(0.0, timeout_s), threading.TIMEOUT_MAX))
        except Empty:
            return False
        while not self._rings.empty():
            self._rings.get_nowait()
        return True
