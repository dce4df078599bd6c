# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The futures that the ``..._async`` methods of ``Buffer`` return.

The result of such a future of rclpy may come from a thread outside the executor. rclpy does not
reveal which executor runs the coroutine that awaits a future. Only this file searches for it on
the stack. If it finds none, the coroutine continues at the next activity of its executor, as with
rclpy's own futures.

The rules:

- Arrival, timeout and cancelling race: whoever raises the flag ``_ending`` ends the future.
  rclpy's own would end again.
- A future is ended without a lock of the package held, because callbacks run at once, and may do
  anything.
- ``drop`` takes no lock: a garbage collection calls it, in the middle of any thread.
"""

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from copy import copy
import sys
import threading
from types import FrameType
from typing import Any, TYPE_CHECKING
import weakref

from geometry_msgs.msg import TransformStamped
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.task import Future, Task
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.observers import Asked

from .timeouts import Timeouts, Wait
from ..messages.convert import as_nanoseconds, DurationLike, transform_stamped
from ..threads.executors import takes_calls

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop

Callback = Callable[[Future], object]

STEP_OF_TASK = Task.__call__.__code__
# A limit that is never reached: the executor checks the task again after a few.
_MAX_NUDGES = 100


class AwaitableFuture(Future):
    """
    A future that ends once, from any thread, and wakes the coroutine that awaits it.

    It can be awaited in every rclpy executor and in asyncio, and used with
    ``spin_until_future_complete``. Callbacks of ``add_done_callback`` run in the thread that
    ends it. ``result`` raises a copy of the error, so that threads do not share a traceback.

    :ivar released: whether it ended because there will be no more data.
    """

    released = False

    def __init__(self) -> None:
        super().__init__()
        self._ending = threading.Lock()
        self._raised: list[BaseException] = []

    def _end(self) -> bool:
        """End it; return False if it had ended already."""
        return self._ending.acquire(blocking=False)

    def set_result(self, result: object) -> None:
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

    def drop(self) -> None:
        """
        Let go of it, because the coroutine that awaited it is dropped; takes no lock.

        A garbage collection drops coroutines, in the middle of a thread that may hold any lock.
        """
        raise NotImplementedError

    def add_done_callback(self, callback: Callback) -> None:
        """Call back when it ends, or now if it has."""
        self._add(callback, self._call_back)

    def _add(self, callback: Callback, call: Callable[[Callback], None]) -> None:
        super().add_done_callback(_DoneCallback(callback, call, self._raised))
        self._raise()

    def _call_back(self, callback: Callback) -> None:
        """Call a callback of ``add_done_callback``, in the thread that is right for it."""
        self._call_here(callback)

    def _call_here(self, callback: Callback) -> None:
        callback(self)

    def _raise(self) -> None:
        """Raise the error of a callback, after all callbacks were called."""
        if self._raised:
            raise self._raised.pop(0)

    def result(self) -> Any:
        """
        Return the result; None while there is none.

        :raises CancelledError: it was cancelled; the class of ``concurrent.futures``.
        """
        if self.cancelled():
            raise CancelledError
        error = self.exception()
        if isinstance(error, TransformException):
            raise copy(error)
        return super().result()

    def __await__(self) -> Generator[object, None, TransformStamped]:
        if not self.done() and not self.cancelled():
            awaiting = _who_awaits()
            if isinstance(awaiting, Task):
                return (yield from self._await_in_executor(awaiting))
            if awaiting is not None:
                return (yield from self._await_in_loop(awaiting))
        return (yield from super().__await__())

    def _await_in_executor(self, task: Task) -> Generator[object, None, TransformStamped]:
        awaiter = _Awaiter(task)
        # Not by this class's own method, which may keep the future alive for its callbacks. Here
        # the coroutine keeps the future: when the coroutine is dropped, the future has to end,
        # too.
        super().add_done_callback(awaiter)
        try:
            return (yield from super().__await__())
        finally:
            awaiter.resumed = True
            self.remove_done_callback(awaiter)

    def _await_in_loop(
            self, loop: 'AbstractEventLoop') -> Generator[object, None, TransformStamped]:
        ended = loop.create_future()

        def end() -> None:
            if not ended.done():
                ended.set_result(None)

        def wake_loop(_: Future) -> None:
            with suppress(RuntimeError):  # the loop was closed in the meantime
                loop.call_soon_threadsafe(end)

        self._add(wake_loop, self._call_here)
        try:
            yield from ended
        finally:
            # As in asyncio: a task that is cancelled cancels the future that it awaits.
            self.cancel()
        return self.result()


class _DoneCallback:
    """
    A callback that cannot prevent the calls of later ones.

    rclpy logs an ``Exception`` and continues, but it does not catch ``SystemExit``.
    """

    def __init__(self, callback: Callback, call: Callable[[Callback], None],
                 raised: list[BaseException]) -> None:
        self._callback = callback
        self._call = call
        self._raised = raised

    def __call__(self, future: AwaitableFuture) -> None:
        try:
            self._call(self._callback)
        except TransformException:
            # Most callbacks read the result, so after the end of ROS all of them raise its error.
            if not future.released:
                raise
        except Exception:
            raise
        except BaseException as error:  # noqa: B902 - the future raises it later
            self._raised.append(error)

    def __eq__(self, other: object) -> bool:
        # Equal to the callback, because remove_done_callback receives that.
        return self is other or self._callback == other

    __hash__ = None  # type: ignore[assignment]


class _Awaiter:
    """
    Makes an executor resume a task after the future that it awaits has ended.

    A ``MultiThreadedExecutor`` that wakes up skips a task whose last step has not quite
    returned, and sleeps again. In this case it is woken until it has resumed the task.
    """

    def __init__(self, task: Task) -> None:
        self._task = weakref.ref(task)
        self._executor: Callable[[], Executor | None] = getattr(task, '_executor', lambda: None)
        self._nudges = _MAX_NUDGES
        self.resumed = False

    def __call__(self, _: Future) -> None:
        executor, task = self._executor(), self._task()
        if executor is None or task is None or not takes_calls(executor):
            return
        if not isinstance(executor, Executor):
            # An EventsExecutor, which does not check its tasks when it wakes up.
            executor.create_task(task)
        else:
            self._wake(executor, task)

    def _wake(self, executor: Executor, task: Task) -> None:
        # If it is being shut down, there is nothing left to wake.
        with suppress(AttributeError, InvalidHandle):
            executor.wake()
            if task.executing():
                executor.create_task(self._nudge)

    def _nudge(self) -> None:
        executor = self._executor()
        self._nudges -= 1
        if self._nudges and not self.resumed and executor is not None:
            executor.create_task(self._nudge)


def _who_awaits() -> 'Task | AbstractEventLoop | None':
    """Return the rclpy task or the asyncio loop in which a coroutine runs; None: neither."""
    asyncio = sys.modules.get('asyncio')
    step_of_loop = None if asyncio is None else asyncio.Handle._run.__code__
    frame: FrameType | None = sys._getframe(2)
    # Either may run inside the other; the inner one is the right one.
    while frame is not None and frame.f_code is not step_of_loop:
        if frame.f_code is STEP_OF_TASK:
            return frame.f_locals['self']
        frame = frame.f_back
    return None if asyncio is None else asyncio._get_running_loop()


# --- the futures of lookups

class TransformFuture(AwaitableFuture):
    """
    A future whose result is the first ``TransformStamped`` that the lookup finds.

    It fails with the errors of a lookup: when the timeout is over, when its time has become
    older than the buffer keeps, when the clock jumps back, and when the last listener closes.
    """

    def __init__(self, timeouts: Timeouts, frames: tuple[str, str], lookups: Sequence[Asked],
                 query: Callable[[], tuple[int, PoseTuple]], timeout: DurationLike | None) -> None:
        """
        Run the query for the first time.

        :param timeouts: those of the buffer.
        :param frames: target and source.
        :param lookups: the lookups that observers are notified of.
        :param query: returns a stamp and ``target_T_source``.
        """
        super().__init__()
        self._timeouts = timeouts
        self._frames = frames
        self._wait = Wait(
            timeouts, self, query, None if timeout is None else as_nanoseconds(timeout))
        timeouts.forget_orphans()
        # Before the query, which may end this future at once.
        self._notify_end = timeouts.observers.begin(*lookups)
        self._wait.ask()

    def answered(self, answer: tuple[int, PoseTuple]) -> None:
        """End with the transform."""
        try:
            transform = transform_stamped(*self._frames, *answer)
        except TransformException as error:  # no message can hold its stamp
            self.failed(error)
        else:
            self.set_result(transform)
            self._notify_end(None)

    def failed(self, error: TransformException) -> None:
        """End with the reason why there will be no transform."""
        self.released = self._wait.released
        self.set_exception(error)
        self._notify_end(error)
        if self.released:
            # Marks the exception as read: its reader has ended, too, and rclpy would warn.
            self.exception()

    def drop(self) -> None:
        """Do nothing: without a reference to it, the buffer forgets its wait."""

    def _add(self, callback: Callback, call: Callable[[Callback], None]) -> None:
        # Until it ends, the buffer keeps it alive, as its callbacks wait for it.
        self._wait.keep_alive()
        super()._add(callback, call)

    def _call_back(self, callback: Callback) -> None:
        self._timeouts.call_back(self, callback)

    def _end(self) -> bool:
        """Stop waiting; return False if it had ended already."""
        first = super()._end()
        if first:
            self._wait.end()
        return first


async def outcome(future: AwaitableFuture) -> TransformStamped:
    """Return a future's result once it has one; cancelling this cancels the future."""
    let_go = future.cancel
    try:
        return await future
    except GeneratorExit:
        let_go = future.drop
        raise
    finally:
        let_go()
