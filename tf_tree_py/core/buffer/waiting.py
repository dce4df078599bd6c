# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for a buffer's answers: run a query, wait for what blocks it, run it again, or give up.

Blocked threads, futures and messages in a filter all wait here. Each has its own timeout:
deadlines by the wall clock are here; ``ros.waiting`` has those by a ROS clock.

Nothing polls. An ``Inquiry`` whose query failed stands in the queues of all edges that may change
the answer (``errors.Blocker``). When one of them has changed, it leaves all queues, and is woken
to run its query again.

The rules:

- A query runs, and its inquiry enters the queues, under one hold of the buffer's lock. So no data
  arrives unseen between the failure and the wait.
- The queues change only with the lock held, and neither sleep nor read a clock.
- ``wake`` is called without the lock, in the thread that inserted the data; it must not block.
- An inquiry is in no queue while it is being woken; whoever runs it next puts it back.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from copy import copy
import itertools
import threading
import time
from typing import Generic, Protocol, TypeVar

from .. import fork_locks
from ..errors import Blocker, no_truth, TransformException
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

Answer = TypeVar('Answer', covariant=True)
_Entry = tuple[int, int, 'Inquiry[object]']


class Waiting:
    """
    The inquiries that wait in one buffer; its length is their number.

    There is a queue for each edge, sorted by the stamp that the edge must reach. An inquiry may
    stand in several; when one of the edges is ready, it leaves all. To enter, to leave and to find
    the ready ones costs O(log n) and a memmove for each edge.

    Its methods may be called from any thread, those that begin with an underscore with the lock
    held.

    :ivar lock: the buffer's lock, re-entrant.
    :ivar failure: the last that was sent to all; an inquiry compares it with the one at its start.
    """

    def __init__(self, lock: AbstractContextManager[object]) -> None:
        """Begin with empty queues."""
        self.lock = lock
        self._lines: dict[str | None, list[_Entry]] = {}
        self._numbers = itertools.count(1)  # zero: it has never waited
        self._count = 0
        # Set while somebody waits.
        self._somebody = threading.Event()
        self.failure: TransformException | None = None
        fork_locks.repair(self)

    def __len__(self) -> int:
        return self._count

    __bool__ = no_truth

    def repair_in_child(self) -> None:
        """Forget the inquiries of the parent process, whose threads do not exist here."""
        for line in self._lines.values():
            for _, _, inquiry in line:
                inquiry.places = ()
        self._lines.clear()
        self._count = 0
        self._somebody = threading.Event()  # a thread may have held the lock inside the old one

    def _enter(self, inquiry: 'Inquiry[object]', blockers: Iterable[Blocker]) -> None:
        """Queue an inquiry under all its blockers, instead of where it was queued before."""
        if inquiry.places:
            self._leave(inquiry)
        inquiry.places = tuple(set(blockers))
        inquiry.number = next(self._numbers)
        for child, stamp in inquiry.places:
            insort(self._lines.setdefault(child, []), (stamp, inquiry.number, inquiry))
        self._count += 1
        self._somebody.set()

    def _leave(self, inquiry: 'Inquiry[object]') -> None:
        """Remove an inquiry from all queues."""
        if not inquiry.places:
            return
        for child, stamp in inquiry.places:
            line = self._lines[child]
            del line[bisect_left(line, (stamp, inquiry.number))]
            if not line:
                del self._lines[child]
        inquiry.places = ()
        self._count -= 1
        if not self._count:
            self._somebody.clear()

    def _pop(self, entries: Iterable[_Entry]) -> 'list[Inquiry[object]]':
        popped = list({number: inquiry for _, number, inquiry in entries}.values())
        for inquiry in popped:
            self._leave(inquiry)
        return popped

    def _pop_all(self) -> 'list[Inquiry[object]]':
        """Remove and return all: the structure changed, or their waits must fail."""
        return self._pop([entry for line in self._lines.values() for entry in line])

    def _pop_ready(self, tree: Tree, children: Iterable[str],
                   version: int) -> 'list[Inquiry[object]]':
        if tree.version != version:
            return self._pop_all()
        ready: list[Inquiry[object]] = []
        for child in children:
            line, history = self._lines.get(child), tree.histories.get(child)
            if line and history is not None and history.latest_stamp is not None:
                # Those about stamps that the edge has now reached.
                ready += self._pop(line[:bisect_left(line, (history.latest_stamp + 1,))])
        return ready

    # --- for threads that wait

    def wait_for(self, query: Callable[[], Answer],
                 begin: Callable[[TransformException], Deadline | None]) -> Answer:
        """
        Block the thread until a query has an answer; see ``PlainBuffer.wait_for``.

        :param begin: called with the lock, if the query fails and waiting may help: returns how
            long to wait; None: not at all.
        """
        inquiry: Inquiry[Answer] | None = None
        deadline: Deadline | None = None
        try:
            with self.lock:
                try:
                    return query()
                except TransformException as error:
                    deadline = begin(error) if error.blocked_on is not None else None
                    if error.blocked_on is None or deadline is None:
                        raise
                    event = threading.Event()
                    inquiry = Inquiry(self, query, event.set)
                    self._enter(inquiry, error.blocked_on)
            while True:
                over = not deadline.wait(event)
                event.clear()
                answered = inquiry.ask(once_more=not over)
                if answered is not None:
                    return answered.value
        except TransformException as error:
            if deadline is not None:
                error.waited_s = deadline.elapsed_s()
            raise
        finally:
            if inquiry is not None:
                inquiry.end()

    # --- for code that changes the tree

    def change(self, tree: Tree, children: Callable[[], Iterable[str]],
               insert: Callable[..., Answer], *arguments: object) -> Answer:
        """
        Insert under the lock, then wake those whose answer may have changed.

        They are woken even if the insertion raises, since part of it may have been inserted.

        :param children: returns the child frames of the inserted edges; called only if somebody
            waits.
        """
        ready: list[Inquiry[object]] = []
        try:
            with self.lock:
                version = tree.version
                try:
                    return insert(*arguments)
                finally:
                    if self._count:
                        ready = self._pop_ready(tree, children(), version)
        finally:
            if ready:
                wake_all(ready)

    def ask_again(self) -> None:
        """Run the queries of all again, whatever blocks them."""
        with self.lock:
            inquiries = self._pop_all()
        wake_all(inquiries)

    def fail(self, failure: TransformException) -> None:
        """Make all give up with an error."""
        with self.lock:
            self.failure = copy(failure)
            inquiries = self._pop_all()
        wake_all(inquiries)

    # --- for threads that receive messages

    def sleep_until_somebody(self, timeout_s: float) -> bool:
        """
        Block until somebody waits: for threads that gather messages before they insert them.

        :return: whether somebody waits, or ``end_sleep`` was called.
        """
        woken = self._somebody.wait(timeout_s)
        if woken and not self._count:
            with self.lock:
                if not self._count:
                    self._somebody.clear()
        return woken

    def end_sleep(self) -> None:
        """Let ``sleep_until_somebody`` return; takes no lock."""
        self._somebody.set()


def wake_all(inquiries: 'Iterable[Inquiry[object]]') -> None:
    """
    Wake inquiries; the caller must not hold the buffer's lock.

    :raises BaseException: the first exception that one of them raised, after all were woken.
    """
    call_all(inquiry.wake for inquiry in inquiries)


# --- one that waits

class Answered(Generic[Answer]):
    """The answer of a query, which may be anything, even None."""

    __slots__ = ('value',)

    def __init__(self, value: Answer) -> None:
        self.value = value


class Inquiry(Generic[Answer]):
    """
    A query that runs until it has an answer or can no longer have one.

    :ivar wake: called, without the lock, when the query should run again.
    :ivar number: of its last entry into the queues; orders those that need the same stamp.
    :ivar places: the queues in which it stands now; none if what blocks it has changed.
    :ivar over: whether it has ended.
    """

    __slots__ = ('wake', 'number', 'places', 'over', '_waiting', '_query', '_failure_before')

    def __init__(self, waiting: Waiting, query: Callable[[], Answer],
                 wake: Callable[[], None]) -> None:
        """
        Make an inquiry that does not wait yet; a failure of all waits from now on ends it.

        :param query: raises a ``TransformException`` as long as it has no answer.
        """
        self.wake = wake
        self.places: tuple[Blocker, ...] = ()
        self.number, self.over = 0, False
        self._waiting, self._query = waiting, query
        self._failure_before = waiting.failure

    def ask(self, *, once_more: bool = True,
            before_waiting: Callable[[], None] | None = None) -> Answered[Answer] | None:
        """
        Return the answer; None if it waits or has ended.

        :param once_more: whether it waits for what is missing, if that may still arrive.
        :param before_waiting: called with the lock, just before it begins to wait.
        :raises TransformException: there is no answer and it does not wait for one, or all
            have been made to give up since it began.
        """
        waiting = self._waiting
        with waiting.lock:
            if self.over:
                return None
            failure = waiting.failure
            if failure is not None and failure is not self._failure_before:
                # A copy, for the same one may be raised in several threads.
                raise copy(failure)
            try:
                return Answered(self._query())
            except TransformException as error:
                if error.blocked_on is None or not once_more:
                    raise
                if before_waiting is not None:
                    before_waiting()
                waiting._enter(self, error.blocked_on)
                return None

    def wake_by(self, wake: Callable[[], None]) -> bool:
        """Replace what wakes it; return False if it is over."""
        with self._waiting.lock:
            if not self.over:
                self.wake = wake
            return not self.over

    def end(self) -> None:
        """Leave the queues; later calls of ``ask`` return None."""
        with self._waiting.lock:
            self.over = True
            self._waiting._leave(self)
            self.wake = _nothing


def _nothing() -> None:
    """Replace what woke an inquiry that is over."""
