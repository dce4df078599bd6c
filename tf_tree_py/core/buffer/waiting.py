# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for a buffer's answers: run a query, wait for what blocks it, run it again, or give up.

Blocked threads, futures and messages in a filter all wait through this module. ``waiters``
records which edges each waiter needs. Timeouts are elsewhere: each waiter has its own.
"""

from collections.abc import Callable, Iterable
from copy import copy
from enum import Enum
import threading
from typing import Any, Generic, TypeVar

from .deadline import Deadline
from .waiters import Waiter, Waiters, wake_all
from ..errors import TransformException
from ..tree.tree import Tree

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

        :return: whether there is a waiter.
        """
        return self._waiters.somebody.wait(timeout_s)


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
