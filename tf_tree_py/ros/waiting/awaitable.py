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
rclpy's future, fit for results that come from a thread which is not the executor's.

Which executor runs the coroutine that awaits, rclpy does not tell; only this file
looks for it, on the stack. Where it cannot be found, the coroutine goes on when its
executor next has something to do, as with rclpy's own futures.
"""

from collections.abc import Callable, Generator
from concurrent.futures import CancelledError
from contextlib import suppress
from copy import copy
import sys
import threading
from types import FrameType
from typing import Any
import weakref

from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.task import Future, Task
from tf_tree_py.core.errors import TransformException

_STEP_OF_TASK = Task.__call__.__code__
# An executor that looked away looks back at once: it never takes more than a few.
_MAX_NUDGES = 100


class AwaitableFuture(Future):
    """
    A future that ends once, from any thread, and wakes whoever awaits it.

    It can be awaited in every rclpy executor and in asyncio, and spun for. Callbacks
    of ``add_done_callback`` run in the thread that ends it. What ``result`` raises is
    a copy, so that threads do not share a traceback.
    """

    def __init__(self) -> None:
        super().__init__()
        self._ending = threading.Lock()
        self._raised: list[BaseException] = []

    def _end(self) -> bool:
        """Return whether nobody has ended it before."""
        return self._ending.acquire(blocking=False)

    def set_result(self, result: Any) -> None:
        """End with a result, unless it has ended."""
        if self._end():
            super().set_result(result)
            self._raise()

    def set_exception(self, exception: BaseException) -> None:
        """End with an exception, unless it has ended."""
        if self._end():
            super().set_exception(exception)
            self._raise()

    def cancel(self) -> None:
        """End without a result, unless it has ended."""
        if self._end():
            super().cancel()
            self._raise()

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Call back when it ends, or now if it has."""
        super().add_done_callback(_DoneCallback(callback, self._raised))
        self._raise()

    def _raise(self) -> None:
        """Raise what a callback raised, now that all were called."""
        if self._raised:
            raise self._raised.pop(0)

    def result(self) -> Any:
        """
        Return the result; None while there is none.

        :raises CancelledError: it was cancelled; that of ``concurrent.futures``.
        """
        if self.cancelled():
            raise CancelledError
        error = self.exception()
        if isinstance(error, TransformException):
            raise copy(error)
        return super().result()

    def __await__(self) -> Generator[Any, Any, Any]:
        if not self.done() and not self.cancelled():
            awaiting = _who_awaits()
            if isinstance(awaiting, Task):
                return (yield from self._await_in_executor(awaiting))
            if awaiting is not None:
                return (yield from self._await_in_loop(awaiting))
        return (yield from super().__await__())

    def _await_in_executor(self, task: Task) -> Generator[Any, Any, Any]:
        awaiter = _Awaiter(task)
        # Not by a method of our own, which may keep the future alive for its callbacks:
        # the coroutine keeps this one, and when it is dropped so are we.
        super().add_done_callback(awaiter)
        try:
            return (yield from super().__await__())
        finally:
            awaiter.resumed = True
            self.remove_done_callback(awaiter)

    def _await_in_loop(self, loop: Any) -> Generator[Any, Any, Any]:
        ended = loop.create_future()

        def tell() -> None:
            if not ended.done():
                ended.set_result(None)

        def tell_loop(_: Future) -> None:
            with suppress(RuntimeError):  # the loop was closed meanwhile
                loop.call_soon_threadsafe(tell)

        self.add_done_callback(tell_loop)
        try:
            yield from ended
        finally:
            # As in asyncio: who is cancelled cancels what it awaits.
            self.cancel()
        return self.result()


class _DoneCallback:
    """
    A callback that cannot keep those behind it from being called.

    rclpy warns of an ``Exception`` and goes on, but ``sys.exit()`` goes past it.
    """

    def __init__(self, callback: Callable[[Future], Any], raised: list[BaseException]) -> None:
        self._callback = callback
        self._raised = raised

    def __call__(self, future: Future) -> None:
        try:
            self._callback(future)
        except Exception:
            raise
        except BaseException as error:  # noqa: B902 - the future raises it later
            self._raised.append(error)

    def __eq__(self, other: object) -> bool:
        # By its own callback, for that is what remove_done_callback is given.
        return self is other or self._callback == other

    __hash__ = None  # type: ignore[assignment]


class _Awaiter:
    """
    Makes an executor go on with a task, once what the task awaits has ended.

    A ``MultiThreadedExecutor`` that is woken passes over a task whose last step has not
    quite returned, and sleeps again: then it is nudged until the task was resumed.
    """

    def __init__(self, task: Task) -> None:
        self._task = weakref.ref(task)
        self._executor: Any = getattr(task, '_executor', lambda: None)
        self._nudges = _MAX_NUDGES
        self.resumed = False

    def __call__(self, _: Future) -> None:
        executor, task = self._executor(), self._task()
        if executor is None or task is None:
            return
        if not isinstance(executor, Executor):
            # An EventsExecutor, which does not look at its tasks when it is woken.
            executor.create_task(task)
            return
        # It may be shut down just now, and then has nothing left to wake.
        with suppress(AttributeError, InvalidHandle):
            executor.wake()
            if task.executing():
                executor.create_task(self._nudge)

    def _nudge(self) -> None:
        executor = self._executor()
        self._nudges -= 1
        if self._nudges and not self.resumed and executor is not None:
            executor.create_task(self._nudge)


def _who_awaits() -> Any:
    """Return the rclpy task or the asyncio loop in which a coroutine runs; None: neither."""
    asyncio = sys.modules.get('asyncio')
    step_of_loop = None if asyncio is None else asyncio.Handle._run.__code__
    frame: FrameType | None = sys._getframe(2)
    # Either may run inside the other: the inner one counts.
    while frame is not None and frame.f_code is not step_of_loop:
        if frame.f_code is _STEP_OF_TASK:
            return frame.f_locals['self']
        frame = frame.f_back
    return None if asyncio is None else asyncio._get_running_loop()
