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
Waiting for a limited time without a thread of one's own: one query, until it ends.

A ``Wait`` stands in the buffer's line of those who wait, as a sleeping thread does. Whoever
changes what blocks it asks again on its behalf. Nothing polls.
"""

from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Any, Generic, Protocol, TypeVar
import weakref

from tf_tree_py.core.arrivals.observers import Observers
from tf_tree_py.core.buffer.waiting import Inquiry, Pending, Waiting
from tf_tree_py.core.errors import TransformException

from .alarm_clock import AlarmDeadline, Alarms
from .clock import ClockDeadline, ClockWatch

Answer = TypeVar('Answer')
Taken = TypeVar('Taken', contravariant=True)

# Nanoseconds, 146 years.
_FOREVER = 2**62


class Timeouts:
    """
    How long waits at a buffer may last: by its clock, and by its wall guard.

    :ivar waiting: the line that they stand in.
    :ivar watch: the clock to go by.
    :ivar observers: those of the buffer.
    """

    def __init__(self, waiting: Waiting, watch: ClockWatch, wall_guard_s: float | None,
                 observers: Observers) -> None:
        """
        Begin with nobody.

        :param wall_guard_s: with simulated time, the longest wait by the wall, seconds.
        """
        self.waiting = waiting
        self.watch = watch
        self.observers = observers
        self._wall_guard_s = wall_guard_s
        self._alarms = Alarms(watch, self.forget_orphans)
        # The remains of waits that nobody refers to any more.
        self._orphans: deque[tuple[Inquiry[Any], int | None]] = deque()

    @property
    def alarms(self) -> int:
        """Return how many alarms are set."""
        return len(self._alarms)

    def deadline(self, timeout: int) -> ClockDeadline:
        """Return a deadline for a thread that sleeps by it, from now on, nanoseconds."""
        return ClockDeadline(self.watch, timeout, self._wall_guard_s)

    def deadline_without_thread(self, timeout: int | None) -> AlarmDeadline:
        """Return a deadline for one who does not sleep by it; None: as long as it takes."""
        if timeout is None:
            return AlarmDeadline(self.watch, _FOREVER, None)
        return AlarmDeadline(self.watch, timeout, self._wall_guard_s)

    def set_alarm(self, wait: 'Wait[Any]', deadline: AlarmDeadline) -> int:
        """Let a wait expire at its deadline; return the alarm's number."""
        return self._alarms.add(wait, deadline)

    def forget_alarm(self, number: int) -> None:
        """Let an alarm be; it may have rung already."""
        self._alarms.forget(number)

    def leave_orphan(self, inquiry: Inquiry[Any], alarm: int | None) -> None:
        """Note the remains of a wait; takes no lock, for finalizers call it."""
        self._orphans.append((inquiry, alarm))
        if alarm is not None:
            self._alarms.ring()

    def forget_orphans(self) -> None:
        """Take waits out of the line that nobody refers to any more."""
        with suppress(IndexError):
            while True:
                inquiry, alarm = self._orphans.popleft()
                inquiry.end()
                if alarm is not None:
                    self._alarms.forget(alarm)


class Asker(Protocol[Taken]):
    """The one that a wait is for; it ends the wait in both methods."""

    def answered(self, answer: Taken) -> None:
        """Take the answer; in the thread that asked."""

    def failed(self, error: TransformException) -> None:
        """Take the reason why there will be no answer; likewise."""


class Wait(Generic[Answer]):
    """
    A query that is asked until it has an answer, cannot have one any more, or time is up.

    The first time it is asked by ``ask``; then by whoever inserts what blocked it, in
    their thread, without the buffer's lock. It is over once ``end`` was called.

    The buffer keeps neither it nor its asker alive; the asker has to keep it. A wait that
    nobody refers to is forgotten, at the latest when the next one is made, unless
    ``keep_alive`` was called.
    """

    # Whether something may be left behind in the line or among the alarms.
    _made = False

    def __init__(self, timeouts: Timeouts, asker: Asker[Answer], query: Callable[[], Answer],
                 timeout: int | None,
                 lock: AbstractContextManager[Any] | None = None) -> None:
        """
        Take a query.

        :param query: raises a ``TransformException`` as long as it has no answer.
        :param timeout: nanoseconds of the buffer's clock; None: as long as it takes.
        :param lock: held while it is asked and answered, and taken before the buffer's.
        """
        self._timeouts = timeouts
        self._asker = weakref.ref(asker)
        self._kept: Asker[Answer] | None = None
        self._timeout = timeout
        self._lock = lock or nullcontext()
        self._deadline: AlarmDeadline | None = None
        self._alarm: int | None = None
        self._inquiry = Inquiry(timeouts.waiting, query, _ask_if_alive(self))
        self._made = True

    @property
    def released(self) -> bool:
        """Return whether whoever was to deliver what is waited for is gone."""
        return self._deadline is not None and self._deadline.released

    @property
    def is_being_woken(self) -> bool:
        """Return whether what blocked it has changed and it has not asked again yet."""
        return not self._inquiry.waits

    def ask(self, *, once_more: bool = True) -> None:
        """
        Answer the query, or stand under what blocks it.

        :param once_more: stand; otherwise what blocks it is the reason to fail.
        """
        asker = self._asker()
        if asker is None:
            return
        with self._lock:
            deadline = self._deadline
            if deadline is not None and deadline.is_over():
                once_more = False
            try:
                # Observers are told when a lookup begins, and not whenever it tries again.
                with self._timeouts.observers.quiet():
                    answer = self._inquiry.ask(once_more=once_more, may_wait=self._may_wait)
            except TransformException as error:
                if deadline is not None:
                    error.waited_s = deadline.elapsed_s()
                    error.hint = deadline.why_early or error.hint
                # The traceback leads back here: a cycle, which only a collection would find.
                asker.failed(error.with_traceback(None))
            else:
                if not isinstance(answer, Pending):
                    asker.answered(answer)

    def expire(self) -> None:
        """Ask for the last time."""
        self.ask(once_more=False)

    def _may_wait(self) -> bool:
        """Set the deadline, if there is none yet; return whether there is one to wait for."""
        timeout = self._timeout
        if self._deadline is None and (timeout is None or timeout > 0):
            self._deadline = self._timeouts.deadline_without_thread(timeout)
            if timeout is not None:
                self._alarm = self._timeouts.set_alarm(self, self._deadline)
        return self._deadline is not None

    def end(self) -> bool:
        """Stop waiting; return whether nobody else did so before."""
        first = self._inquiry.end()
        self._kept = None
        if first and self._alarm is not None:
            self._timeouts.forget_alarm(self._alarm)
        return first

    def keep_alive(self) -> None:
        """Let the buffer keep it and its asker alive until it is over."""
        self._kept = self._asker()
        if not self._inquiry.wake_by(self.ask):
            self._kept = None

    def __del__(self) -> None:
        if self._made and not self._inquiry.over:
            self._timeouts.leave_orphan(self._inquiry, self._alarm)


def _ask_if_alive(wait: Wait[Any]) -> Callable[[], None]:
    reference = weakref.ref(wait)

    def ask() -> None:
        alive = reference()
        if alive is not None:
            alive.ask()

    return ask
