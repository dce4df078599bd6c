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
Waiting for a buffer's answers: ask, stand in line, be woken, or give up.

Written once for all who wait: a thread that sleeps, a future, a message in a filter. What
they wait for is in ``waiters``. How long they wait is up to them.
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
    """What an inquiry returns that has no answer yet."""

    PENDING = 'pending'


PENDING = Pending.PENDING


class Waiting:
    """
    All who wait at one buffer; its length is how many.

    Its methods may be called from any thread. Waiters are woken without the lock.

    :ivar lock: the buffer's.
    """

    def __init__(self, lock: Any) -> None:
        """
        Begin with nobody.

        :param lock: the buffer's, re-entrant.
        """
        self.lock = lock
        self._waiters = Waiters()
        # The last failure sent to all waiters; each compares it with the one at its start.
        self._failure: TransformException | None = None

    def __len__(self) -> int:
        return len(self._waiters)

    # --- for those who wait

    def wait_for(self, query: Callable[[], Answer], deadline: Deadline) -> Answer:
        """Sleep until a query has an answer; see ``BufferCore.wait_for``."""
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

    # --- for those who change what is waited for

    def change(self, tree: Tree, children: Callable[[], Iterable[str]],
               insert: Callable[..., Answer], *arguments: Any) -> Answer:
        """
        Insert under the lock, then wake those whose answer may have changed.

        They are woken even if the insertion raises: part of it may have been inserted.

        :param children: returns those of the edges that are inserted; called only if
            somebody waits.
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
        """Let everybody ask again, whatever blocks them."""
        with self.lock:
            waiters = self._waiters.take_all()
        wake_all(waiters)

    def fail(self, failure: TransformException) -> None:
        """Make everybody who waits give up with an error."""
        with self.lock:
            self._failure = copy(failure)
            waiters = self._waiters.take_all()
        wake_all(waiters)

    # --- for those who deliver it

    def sleep_until_somebody(self, timeout_s: float) -> bool:
        """
        Sleep until somebody waits: for threads that collect messages before they deliver.

        :return: whether somebody waits.
        """
        return self._waiters.somebody.wait(timeout_s)


class Inquiry(Generic[Answer]):
    """
    A query that is asked until it has an answer, or cannot have one any more.

    Between two questions it stands in the line of those who wait.
    """

    __slots__ = ('_waiting', '_query', '_waiter', '_begun', '_failure_before', '_over')

    def __init__(self, waiting: Waiting, query: Callable[[], Answer],
                 wake: Callable[[], None]) -> None:
        """
        Take a query; the wait begins when it is asked for the first time.

        :param query: raises a ``TransformException`` as long as it has no answer.
        :param wake: called, without the lock, when it is time to ask again.
        """
        self._waiting = waiting
        self._query = query
        self._waiter = Waiter(wake)
        self._begun = self._over = False
        self._failure_before: TransformException | None = None

    @property
    def waits(self) -> bool:
        """Return whether it stands in line: nothing that blocks it has changed."""
        return self._waiter.waits

    @property
    def over(self) -> bool:
        """Return whether it has ended."""
        return self._over

    def ask(self, *, once_more: bool = True,
            may_wait: Callable[[], bool] | None = None) -> Answer | Pending:
        """
        Return the answer, or ``PENDING``: it stands in line, or has ended.

        :param once_more: stand in line for what is missing, if it may still come.
        :param may_wait: called with the lock just before it stands in line; False forbids that.
        :raises TransformException: there is no answer, and it does not wait for one; or since
            its beginning everybody was made to give up.
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
                if may_wait is not None and not may_wait():
                    raise
                waiting._waiters.add(self._waiter, error.blocked_on)
                return PENDING

    def wake_by(self, wake: Callable[[], None]) -> bool:
        """Be woken by something else from now on; return False if it is over."""
        with self._waiting.lock:
            if not self._over:
                self._waiter.wake = wake
            return not self._over

    def end(self) -> bool:
        """Leave the line for good; return whether nobody else did so before."""
        with self._waiting.lock:
            first, self._over = not self._over, True
            self._waiting._waiters.discard(self._waiter)
            self._waiter.wake = _nothing
        return first


def _nothing() -> None:
    """Wake nobody."""
