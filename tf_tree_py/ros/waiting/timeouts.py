# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waits with a timeout that block no thread, for futures and message filters.

A ``Wait`` has a place in the buffer's queue of waiters, as a sleeping thread has. The thread that
inserts the missing data runs the query again. Nothing polls.

The rules:

- The lock of a wait is taken first, then the buffer's, then that of the alarms. The asker is
  called with the first only.
- Two threads may run the query at once, if data and the timeout come together. So an asker has to
  be able to be answered, or failed, twice.
- The buffer refers to a wait only weakly. A wait that is dropped takes no lock, because a garbage
  collection may drop it: it leaves an orphan, which another thread removes.
"""

from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Any, Generic, Protocol, TypeVar
import weakref

from rclpy.task import Future
from tf_tree_py.core.buffer.waiting import Inquiry, Waiting
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.messages.observers import Observers

from .clock import ClockWatch
from .deadlines import Alarms, ClockDeadline

Answer = TypeVar('Answer')
Taken = TypeVar('Taken', contravariant=True)


class Timeouts:
    """
    The deadlines of all waits at one buffer, by its clock and by its wall guard.

    :ivar waiting: the buffer's queue of waiters.
    :ivar watch: the clock that deadlines follow.
    :ivar alarms: end the waits whose time is over.
    :ivar observers: the buffer's observers.
    :ivar by_wall: whether timeouts follow the system's clock also with simulated time.
    :ivar call_back: calls a callback of a future that has ended, with the future, in whichever
        thread is right for it; this one, unless it is replaced.
    :ivar check_spinning: see ``AttachedListeners``; the buffer sets it.
    """

    def __init__(self, waiting: Waiting, watch: ClockWatch, wall_guard_s: float | None,
                 observers: Observers) -> None:
        """
        Begin without any wait.

        :param wall_guard_s: with simulated time, the longest wait in wall time, seconds.
        """
        self.waiting = waiting
        self.watch = watch
        self.observers = observers
        self.by_wall = False
        self.call_back: Callable[[Any, Callable[[Future], object]], object] = _call_here
        self.check_spinning: Callable[[], Callable[[], str]] = lambda: str
        self._wall_guard_s = wall_guard_s
        self.alarms = Alarms(watch, self.forget_orphans)
        self._orphans: deque[_Registration] = deque()

    def deadline(self, timeout: int | None) -> ClockDeadline:
        """Return a deadline, nanoseconds from now; None: it never ends."""
        guard_s = None if timeout is None else self._wall_guard_s
        return ClockDeadline(self.watch, timeout, guard_s, by_wall=self.by_wall,
                             why_nothing_arrives=self.check_spinning())

    def leave_orphan(self, registration: '_Registration') -> None:
        """Schedule a registration for removal; takes no lock, because finalizers call it."""
        self._orphans.append(registration)
        if registration.alarm is not None:
            self.alarms.ring()

    def forget_orphans(self) -> None:
        """Remove garbage-collected waits from the queue."""
        with suppress(IndexError):
            while True:
                self._orphans.popleft().end()


class Asker(Protocol[Taken]):
    """The owner of a wait. It has to end the wait in both methods."""

    def answered(self, answer: Taken) -> None:
        """Receive the answer, in the thread that ran the query."""

    def failed(self, error: TransformException) -> None:
        """Receive the reason why there will be no answer, in the same thread."""


class Wait(Generic[Answer]):
    """
    A query that runs until it has an answer, can no longer have one, or times out.

    ``ask`` runs it for the first time. After that, the thread that inserts the missing data runs
    it, without the buffer's lock. ``end`` ends the wait.

    The buffer keeps neither the wait nor its owner alive: the owner has to keep a reference to
    the wait. A wait without references is forgotten when the next one is made or earlier,
    unless ``keep_alive`` was called.
    """

    def __init__(self, timeouts: Timeouts, asker: Asker[Answer], query: Callable[[], Answer],
                 timeout: int | None,
                 lock: AbstractContextManager[object] | None = None) -> None:
        """
        Register a query.

        :param query: raises a ``TransformException`` as long as it has no answer.
        :param timeout: nanoseconds of the buffer's clock; None: without a limit.
        :param lock: held while the query runs and is answered; acquired before the buffer's.
        """
        self._timeouts = timeouts
        self._asker = weakref.ref(asker)
        self._timeout = timeout
        self._lock = lock or nullcontext()
        self._deadline: ClockDeadline | None = None
        self._inquiry = Inquiry(timeouts.waiting, query, _ask_if_alive(self))
        self._registration = _Registration(timeouts, self._inquiry)

    @property
    def released(self) -> bool:
        """Return whether the last listener has gone."""
        return self._deadline is not None and self._deadline.released

    @property
    def is_being_woken(self) -> bool:
        """Return whether the query is due to run again, because the missing data has arrived."""
        return not self._inquiry.places

    def ask(self, *, once_more: bool = True) -> None:
        """
        Run the query, and wait if it lacks data that may still arrive.

        :param once_more: whether it may wait; if not, the query's error is final.
        """
        asker = self._asker()
        if asker is None:
            return
        with self._lock:
            # Always called: the deadline records how long the wait has lasted, and why it ended.
            may_wait = not self._is_over() and once_more
            try:
                # Observers count a lookup once, however often its query runs.
                with self._timeouts.observers.quiet():
                    answered = self._inquiry.ask(once_more=may_wait,
                                                 before_waiting=self._set_deadline)
            except TransformException as error:
                self._add_waited_time(error)
                # The traceback refers to this frame: a cycle that only a collection would free.
                asker.failed(error.with_traceback(None))
            else:
                if answered is not None:
                    asker.answered(answered.value)

    def expire(self) -> None:
        """Run the query for the last time."""
        self.ask(once_more=False)

    def end(self) -> None:
        """Stop waiting."""
        self._registration.end()
        self._kept: Asker[Answer] | None = None

    def keep_alive(self) -> None:
        """Let the buffer keep the wait and its owner alive until the wait is over."""
        # In this order: a wait that ends between the two must not be kept for ever.
        self._kept = self._asker()
        if not self._inquiry.wake_by(self.ask):
            self._kept = None

    def __del__(self) -> None:
        # No ``weakref.finalize``: its registry would keep the query alive, and so the buffer.
        if hasattr(self, '_registration') and not self._registration.over:
            self._timeouts.leave_orphan(self._registration)

    def _is_over(self) -> bool:
        if self._deadline is not None:
            return self._deadline.is_over()
        return self._timeout is not None and self._timeout <= 0

    def _set_deadline(self) -> None:
        """Start the clock of the timeout, before the first wait."""
        if self._deadline is None:
            self._deadline = self._timeouts.deadline(self._timeout)
            if self._timeout is not None:
                self._registration.alarm = self._timeouts.alarms.add(self, self._deadline)

    def _add_waited_time(self, error: TransformException) -> None:
        deadline = self._deadline
        if deadline is not None:
            error.waited_s = deadline.elapsed_s()
            deadline.explain(error)


class _Registration:
    """The resources of a wait: its place in the queue, and an alarm. It outlives the wait."""

    __slots__ = ('_timeouts', '_inquiry', 'alarm')

    def __init__(self, timeouts: Timeouts, inquiry: Inquiry[Any]) -> None:
        self._timeouts = timeouts
        self._inquiry = inquiry
        self.alarm: int | None = None

    @property
    def over(self) -> bool:
        """Return whether both are released."""
        return self._inquiry.over

    def end(self) -> None:
        """Release both."""
        # In this order: an inquiry that is over begins no wait, and so sets no alarm.
        self._inquiry.end()
        if self.alarm is not None:
            self._timeouts.alarms.forget(self.alarm)


def _call_here(future: Future, callback: Callable[[Future], object]) -> None:
    callback(future)


def _ask_if_alive(wait: Wait[Answer]) -> Callable[[], None]:
    reference = weakref.ref(wait)

    def ask() -> None:
        alive = reference()
        if alive is not None:
            alive.ask()

    return ask
