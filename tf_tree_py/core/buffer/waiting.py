# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for a buffer's answers: run a query, wait for what blocks it, run it again, or give up.

Blocked threads, futures and messages in a filter all wait here. Each waiter has its own
timeout: deadlines by the wall clock are here; ``ros.waiting`` has those by a ROS clock.

Waiters do not poll. A waiter is queued under every edge that may change the answer of its
query (``errors.Blocker``). When one of these edges has changed, the waiter is removed, and
its query runs again. The queues neither sleep nor read a clock, and the buffer's lock protects
them.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterable
from copy import copy
from enum import Enum
import itertools
import threading
import time
from typing import Any, Generic, Protocol, TypeVar

from .. import fork_locks
from ..errors import Blocker, TransformException
from ..tree.tree import Tree


def call_all(calls: Iterable[Callable[[], object]]) -> None:
    """
    Call all, even if one of them raises an exception, including ``SystemExit``.

    :raises BaseException: the first exception, after all were called.
    """
    first: BaseException | None = None
    for call in calls:
        try:
            call()
        except BaseException as error:  # noqa: B902 - it is raised below
            first = first or error
    if first is not None:
        raise first


# --- deadlines

class Deadline(Protocol):
    """Blocks a thread until an event is set or the time is up."""

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began, by the deadline's own clock."""


class WallDeadline:
    """A timeout by the monotonic clock that begins when the object is made."""

    def __init__(self, timeout_s: float) -> None:
        self._begin = time.monotonic()
        self._end = self._begin + min(timeout_s, threading.TIMEOUT_MAX)

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""
        return event.wait(max(0.0, self._end - time.monotonic()))

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began."""
        return time.monotonic() - self._begin


# --- the queues

_Entry = tuple[int, int, 'Waiter']


class Waiter:
    """
    A waiter: its query failed, and may succeed later.

    :ivar wake: called without the lock when the query should run again.
    """

    __slots__ = ('wake', 'number', 'places')

    def __init__(self, wake: Callable[[], None]) -> None:
        self.wake = wake
        self.number = 0
        self.places: tuple[Blocker, ...] = ()

    @property
    def waits(self) -> bool:
        """Return whether it is in any queue."""
        return bool(self.places)


class Waiters:
    """
    All waiters: a queue for each edge, sorted by the stamp that the edge must reach.

    A waiter may be queued under several edges; when one of them is ready, it leaves all.
    Adding, removing and finding the ready ones cost O(log n) and a memmove for each
    edge.

    :ivar somebody: set while there is a waiter.
    """

    def __init__(self) -> None:
        self.somebody = threading.Event()
        self._lines: dict[str | None, list[_Entry]] = {}
        self._numbers = itertools.count()
        self._count = 0
        fork_locks.repair(self)

    def __bool__(self) -> bool:
        return self._count > 0

    def __len__(self) -> int:
        return self._count

    def repair_in_child(self) -> None:
        """Forget the waiters of the parent process, whose threads do not exist here."""
        for line in self._lines.values():
            for _, _, waiter in line:
                waiter.places = ()
        self._lines.clear()
        self._count = 0
        self.somebody = threading.Event()  # a thread may have held the lock inside the old one

    def add(self, waiter: Waiter, blockers: Iterable[Blocker]) -> None:
        """Queue a waiter under all its blockers, instead of where it was queued before."""
        self.discard(waiter)
        waiter.places = tuple(set(blockers))
        waiter.number = next(self._numbers)
        for child, stamp in waiter.places:
            insort(self._lines.setdefault(child, []), (stamp, waiter.number, waiter))
        self._count += 1
        self.somebody.set()

    def discard(self, waiter: Waiter) -> None:
        """Remove a waiter from all queues."""
        if not waiter.places:
            return
        for child, stamp in waiter.places:
            line = self._lines[child]
            del line[bisect_left(line, (stamp, waiter.number))]
            if not line:
                del self._lines[child]
        waiter.places = ()
        self._count -= 1
        if not self._count:
            self.somebody.clear()

    def take_reached(self, child: str, latest: int) -> list[Waiter]:
        """Remove and return the waiters for stamps that an edge has now reached."""
        line = self._lines.get(child)
        return [] if line is None else self._take(line[:bisect_left(line, (latest + 1,))])

    def take_all(self) -> list[Waiter]:
        """Remove and return all waiters: the structure changed, or their waits must fail."""
        return self._take([entry for line in self._lines.values() for entry in line])

    def _take(self, entries: Iterable[_Entry]) -> list[Waiter]:
        taken = list({number: waiter for _, number, waiter in entries}.values())
        for waiter in taken:
            self.discard(waiter)
        return taken


def wake_all(waiters: Iterable[Waiter]) -> None:
    """
    Wake waiters; the caller must not hold the buffer's lock.

    :raises BaseException: the first exception that one of them raised, after all were woken.
    """
    call_all(waiter.wake for waiter in waiters)


# --- waiting

Answer = TypeVar('Answer')


class Pending(Enum):
    """What an inquiry without an answer returns."""

    PENDING = 'pending'


PENDING = Pending.PENDING


class Waiting:
    """
    The queue of waiters of one buffer; its length is their number.

    Its methods may be called from any thread. It wakes waiters without holding the lock.

    :ivar lock: the buffer's lock.
    """

    def __init__(self, lock: Any) -> None:
        """
        Begin with an empty queue.

        :param lock: the buffer's lock, re-entrant.
        """
        self.lock = lock
        self._waiters = Waiters()
        # The last failure that was sent to all. A waiter compares it with the one at its start.
        self._failure: TransformException | None = None

    def __len__(self) -> int:
        return len(self._waiters)

    # --- for threads that wait

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """Block the thread until a query has an answer; see ``BufferCore.wait_for``."""
        event = threading.Event()
        inquiry = Inquiry(self, query, event.set)
        slept = over = False
        try:
            while True:
                event.clear()
                answer = inquiry.ask(once_more=not over)
                if not isinstance(answer, Pending):
                    return answer
                slept = True
                over = not deadline.wait(event)
        except TransformException as error:
            if slept:
                error.waited_s = deadline.elapsed_s()
            raise
        finally:
            inquiry.end()

    # --- for code that changes the tree

    def change(self, tree: Tree, children: Callable[[], Iterable[str]],
               insert: Callable[..., Answer], *arguments: Any) -> Answer:
        """
        Insert under the lock, then wake the waiters whose answer may have changed.

        They are woken even if the insertion raises, since part of it may have been inserted.

        :param children: returns the child frames of the inserted edges; called only if there
            are waiters.
        """
        ready: list[Waiter] = []
        try:
            with self.lock:
                version = tree.version
                try:
                    return insert(*arguments)
                finally:
                    if self._waiters:
                        ready = self._take_ready(tree, children(), version)
        finally:
            if ready:
                wake_all(ready)

    def _take_ready(self, tree: Tree, children: Iterable[str], version: int) -> list[Waiter]:
        if tree.version != version:
            return self._waiters.take_all()
        ready: list[Waiter] = []
        for child in children:
            history = tree.histories.get(child)
            if history is not None and history.latest_stamp is not None:
                ready += self._waiters.take_reached(child, history.latest_stamp)
        return ready

    def ask_again(self) -> None:
        """Run the queries of all waiters again, whatever blocks them."""
        with self.lock:
            waiters = self._waiters.take_all()
        wake_all(waiters)

    def fail(self, failure: TransformException) -> None:
        """Make all waiters give up with an error."""
        with self.lock:
            self._failure = copy(failure)
            waiters = self._waiters.take_all()
        wake_all(waiters)

    # --- for threads that receive messages

    def sleep_until_somebody(self, timeout_s: float) -> bool:
        """
        Block until there is a waiter: for threads that gather messages before they insert them.

        :return: whether there is a waiter, or ``end_sleep`` was called.
        """
        woken = self._waiters.somebody.wait(timeout_s)
        if woken and not self._waiters:
            with self.lock:
                if not self._waiters:
                    self._waiters.somebody.clear()
        return woken

    def end_sleep(self) -> None:
        """Let ``sleep_until_somebody`` return; takes no lock."""
        self._waiters.somebody.set()


class Inquiry(Generic[Answer]):
    """
    A query that runs until it has an answer or can no longer have one.

    Between two runs it stands in the queue of waiters.
    """

    __slots__ = ('_waiting', '_query', '_waiter', '_begun', '_failure_before', '_over')

    def __init__(self, waiting: Waiting, query: Callable[[], Answer],
                 wake: Callable[[], None]) -> None:
        """
        Register a query; the wait begins when it runs for the first time.

        :param query: raises a ``TransformException`` as long as it has no answer.
        :param wake: called, without the lock, when the query should run again.
        """
        self._waiting = waiting
        self._query = query
        self._waiter = Waiter(wake)
        self._begun = self._over = False
        self._failure_before: TransformException | None = None

    @property
    def waits(self) -> bool:
        """Return whether it stands in the queue: nothing that blocks it has changed."""
        return self._waiter.waits

    @property
    def over(self) -> bool:
        """Return whether it has ended."""
        return self._over

    def ask(self, *, once_more: bool = True,
            before_waiting: Callable[[], None] | None = None) -> Answer | Pending:
        """
        Return the answer, or ``PENDING`` if it waits or has ended.

        :param once_more: whether it waits for what is missing, if that may still arrive.
        :param before_waiting: called with the lock, just before it begins to wait.
        :raises TransformException: there is no answer and it does not wait for one, or all
            waiters have been made to give up since it began.
        """
        waiting = self._waiting
        with waiting.lock:
            if self._over:
                return PENDING
            failure = waiting._failure
            if not self._begun:
                self._begun, self._failure_before = True, failure
            if failure is not None and failure is not self._failure_before:
                # A copy, for the same one may be raised in several threads.
                raise copy(failure)
            try:
                return self._query()
            except TransformException as error:
                if error.blocked_on is None or not once_more:
                    raise
                if before_waiting is not None:
                    before_waiting()
                waiting._waiters.add(self._waiter, error.blocked_on)
                return PENDING

    def wake_by(self, wake: Callable[[], None]) -> bool:
        """Replace what wakes it; return False if it is over."""
        with self._waiting.lock:
            if not self._over:
                self._waiter.wake = wake
            return not self._over

    def end(self) -> None:
        """Leave the queue; later calls of ``ask`` return ``PENDING``."""
        with self._waiting.lock:
            self._over = True
            self._waiting._waiters.discard(self._waiter)
            self._waiter.wake = _nothing


def _nothing() -> None:
    """Replace what woke an inquiry that is over."""
