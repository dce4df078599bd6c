# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waiting for the data of another process.

What waits stands in the queues of ``core.buffer.waiting``, as for a buffer. While something does,
a thread sleeps until there is a new state, and wakes those whose answer may have changed.
"""

from collections.abc import Callable, Iterable
import threading
import weakref

from tf_tree_py.core.buffer.waiting import Inquiry, Waiting
from tf_tree_py.core.errors import Blocker, ClockJumpException
from tf_tree_py.core.tree.tree import Tree

from .errors import LapsedException, SharedTreeException
from .futex import Futex
from .layout import STATE
from .mirror import Mirror

# How often to look whether the writer is alive.
_LOOK_S = 0.1


class SharedWaiting(Waiting):
    """
    The inquiries that wait for the data of another process; ``follow`` is called first.

    :cvar stay_s: how long the thread stays when nothing waits, seconds.
    """

    stay_s = 1.0

    def follow(self, mirror: Mirror, tree: Tree,
               on_thread: Callable[[threading.Thread], object]) -> None:
        """
        Wake inquiries when the state of a tree has changed; the lock is held.

        :param on_thread: called with each thread that will wake them.
        """
        self._thread: threading.Thread | None = None
        self._mirror, self._tree, self._on_thread = mirror, tree, on_thread
        self._failures = mirror.directory.failures.number
        # The version at which inquiries were last woken, and the failures that they know.
        self._words = weakref.ref(mirror.words)  # it must not keep the file
        self._over: SharedTreeException | None = None
        # The child frames of the edges whose newest samples are shown.
        self._looked_at: list[str] = []
        # Those that wait already have asked another tree.
        self._version = -1 if len(self) else tree.version
        if len(self):
            self._start()

    def repair_in_child(self) -> None:
        """Forget the threads of the parent process, which do not exist here."""
        super().repair_in_child()
        self._thread = None

    def _enter(self, inquiry: Inquiry[object], blockers: Iterable[Blocker]) -> None:
        is_new = not inquiry.number
        super()._enter(inquiry, blockers)
        if len(self) == 1:  # all that is known now was known to the query
            self._version = self._tree.version
        self._note_failure()
        if is_new:
            inquiry._failure_before = self.failure
        elif inquiry._failure_before is not self.failure:
            self._version = -1  # it waits already, so it must fail
        if self._thread is None:
            try:
                self._start()
            except RuntimeError:  # there are too many threads
                self._leave(inquiry)
                raise

    def _start(self) -> None:
        thread = threading.Thread(target=self._follow, name='tf_tree_py waits', daemon=True)
        self._on_thread(thread)
        thread.start()
        self._thread = thread

    def _follow(self) -> None:
        while self._is_needed():
            words = self._mirror.words
            state = words[STATE]
            try:
                self._wake()
            except BaseException as error:  # noqa: B902 - of a callback; the others were woken
                threading.excepthook(threading.ExceptHookArgs(
                    (type(error), error, error.__traceback__, self._thread)))
            Futex(words, STATE).wait(state, _LOOK_S)

    def _is_needed(self) -> bool:
        """Sleep until something waits; return False if nothing did for a while."""
        if self.sleep_until_somebody(self.stay_s):
            return True
        with self.lock:
            if len(self):
                return True
            self._thread = None
            return False

    def _wake(self) -> None:
        """Show the newest state, and wake those whose answer may have changed."""
        self._over, self._looked_at = None, []
        self.change(self._tree, lambda: self._looked_at, self._refresh)
        if self._over is not None:
            self.fail(self._over)

    def _note_failure(self) -> None:
        """Let those that wait fail, if those in the other process have; the lock is held."""
        failures, words = self._mirror.directory.failures, self._mirror.words
        if failures.number != self._failures and words is self._words():
            self.failure = ClockJumpException(failures.last)
            self._version = -1  # so that all ask again
        self._failures, self._words = failures.number, weakref.ref(words)

    def _refresh(self) -> None:
        try:
            with self._mirror:
                awaited = [child for child in self._lines if child is not None]
                for child in awaited:
                    self._tree.histories.get(child)  # which brings it up to date
        except LapsedException:
            return  # there is another state already
        except SharedTreeException as error:
            self._over = error
        else:
            self._looked_at = awaited
        self._note_failure()
        # Another thread, which looked something up, may have shown a new structure first.
        if self._tree.version != self._version:
            self._tree.version += 1
            self._version = self._tree.version
