"""
Waiting without a thread of one's own: what ``Buffer``'s ``..._async`` methods return.

A ``Wait`` stands in the buffer's one list of waiters, under what blocks it, just as a
sleeping thread does; whoever changes that asks again on its behalf. Nothing polls.
"""

from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Generic, TypeVar
import weakref

from geometry_msgs.msg import TransformStamped
from rclpy.task import Future
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.buffer.waiters import Waiter, wake_all
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple

from .alarm_clock import Alarms, Deadline
from .awaitable import AwaitableFuture
from .clock import ClockWatch
from ..messages.convert import as_nanoseconds, transform_stamped

Answer = TypeVar('Answer')

# Nanoseconds, 146 years.
_FOREVER = 2**62


class Wait(Generic[Answer]):
    """
    A query that is asked until it has an answer, or cannot have one any more.

    The first time it is asked by ``ask``; then by whoever inserts what blocked it, in
    their thread, without the buffer's lock. It is over once ``_end`` was called.

    The buffer does not keep it alive. One that nobody refers to is forgotten, at the
    latest when the next one is made; unless ``_keep_alive`` was called.
    """

    _over = True

    def __init__(self, buffer: 'AsyncLookups', query: Callable[[], Answer],
                 timeout: int | None) -> None:
        """
        Take a query.

        :param query: raises a ``TransformException`` as long as it has no answer.
        :param timeout: nanoseconds of the buffer's clock; None: as long as it takes.
        """
        self._buffer = buffer
        self._query = query
        self._timeout = timeout
        self._deadline: Deadline | None = None
        self._alarm: int | None = None
        self._waiter = Waiter(_ask_if_alive(self))
        self._failure_before = buffer._failure
        self._over = False

    @abstractmethod
    def _answered(self, answer: Answer) -> None:
        """Take the answer, and ``_end``; in the thread that asked."""

    @abstractmethod
    def _failed(self, error: TransformException) -> None:
        """Take the reason why there will be no answer, and ``_end``; likewise."""

    def ask(self, *, once_more: bool = True) -> None:
        """
        Answer the query, or stand under what blocks it.

        :param once_more: stand; otherwise what blocks it is the reason to fail.
        """
        deadline = self._deadline
        if deadline is not None and deadline.is_over():
            once_more = False
        try:
            answer = self._ask(once_more)
        except TransformException as error:
            if deadline is not None:
                error.waited_s = deadline.elapsed_s()
                error.hint = deadline.why_early or error.hint
            # The traceback leads back here: a cycle, which only a collection would find.
            self._failed(error.with_traceback(None))
        else:
            if answer is not None:
                self._answered(answer)

    def expire(self) -> None:
        """Ask for the last time."""
        self.ask(once_more=False)

    def _ask(self, once_more: bool) -> Answer | None:
        """Return the answer; None when there is none yet, or no need for one any more."""
        with self._buffer._lock:
            if self._over:
                return None
            self._buffer._raise_failure_since(self._failure_before)
            try:
                return self._query()
            except TransformException as error:
                if error.blocked_on is None or not once_more:
                    raise
                if self._deadline is None and not self._may_wait():
                    raise
                self._buffer._waiters.add(self._waiter, error.blocked_on)
                return None

    def _may_wait(self) -> bool:
        """Set the deadline; return whether there is one worth to wait for."""
        buffer, timeout = self._buffer, self._timeout
        if timeout is None:
            self._deadline = Deadline(buffer._watch, _FOREVER, None)
        elif timeout > 0:
            self._deadline = Deadline(buffer._watch, timeout, buffer._wall_guard_s)
            self._alarm = buffer._alarm_clock().add(self, self._deadline)
        return self._deadline is not None

    def _end(self) -> bool:
        """Stop waiting; return whether nobody else did so before."""
        with self._buffer._lock:
            first, self._over = not self._over, True
            self._buffer._waiters.discard(self._waiter)
            self._waiter.wake = _nothing
        if first and self._alarm is not None:
            self._buffer._alarm_clock().forget(self._alarm)
        return first

    def _keep_alive(self) -> None:
        """Let the buffer keep it alive until it is over."""
        with self._buffer._lock:
            if not self._over:
                self._waiter.wake = self.ask

    def __del__(self) -> None:
        if not self._over:
            self._buffer._leave_orphan(self._waiter, self._alarm)


def _ask_if_alive(wait: Wait[Any]) -> Callable[[], None]:
    reference = weakref.ref(wait)

    def ask() -> None:
        alive = reference()
        if alive is not None:
            alive.ask()

    return ask


def _nothing() -> None:
    """Wake nobody."""


class TransformFuture(Wait[tuple[int, PoseTuple]], AwaitableFuture):
    """
    A future whose result is a ``TransformStamped``: the one that was found at first.

    It fails as a lookup does, when the timeout is over, when the time has become older
    than the buffer keeps, when the clock jumps back, and when the last listener closes.
    """

    def __init__(self, buffer: 'AsyncLookups', frames: tuple[str, str],
                 query: Callable[[], tuple[int, PoseTuple]], timeout: Any) -> None:
        """
        Ask for the first time.

        :param frames: target and source.
        :param query: returns a stamp and ``target_T_source``.
        """
        AwaitableFuture.__init__(self)
        Wait.__init__(self, buffer, query, None if timeout is None else as_nanoseconds(timeout))
        self._frames = frames
        buffer._forget_orphans()
        self.ask()

    def _answered(self, answer: tuple[int, PoseTuple]) -> None:
        try:
            transform = transform_stamped(*self._frames, *answer)
        except TransformException as error:  # no message can hold its stamp
            self._failed(error)
        else:
            self.set_result(transform)

    def _failed(self, error: TransformException) -> None:
        self.set_exception(error)
        if self._deadline is not None and self._deadline.released:
            # Who would have asked has ended too, of which rclpy would complain.
            self.exception()

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Call back when it ends; until then it lives, whether or not you keep it."""
        self._keep_alive()
        super().add_done_callback(callback)

    def __del__(self) -> None:
        Wait.__del__(self)
        AwaitableFuture.__del__(self)


class LookupCoroutines:
    """Lookups that can be awaited, in rclpy's executors and in asyncio."""

    wait_for_transform_async: Callable[..., AwaitableFuture]
    wait_for_transform_full_async: Callable[..., AwaitableFuture]

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: Any,
                                     timeout: Any = None) -> TransformStamped:
        """Return the transform as soon as it is there."""
        future = self.wait_for_transform_async(target_frame, source_frame, time, timeout)
        try:
            return await future
        finally:
            future.cancel()

    async def lookup_transform_full_async(
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = None) -> TransformStamped:
        """Return the transform between two times as soon as it is there."""
        future = self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout)
        try:
            return await future
        finally:
            future.cancel()


class AsyncLookups(LookupCoroutines, BufferCore):
    """
    The part of ``Buffer`` that answers later.

    Times, frames and errors are those of ``lookup_transform``; a timeout of None waits
    as long as there is hope. All may be called from any thread, also from the one that
    delivers the transforms.
    """

    _watch: ClockWatch
    _wall_guard_s: float | None
    _as_stamp: Callable[[Any], int]

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._alarms: Alarms | None = None
        self._orphans: deque[tuple[Waiter, int | None]] = deque()

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any,
                                 timeout: Any = None) -> TransformFuture:
        """Return a future of the transform."""
        stamp = self._as_stamp(time)
        return TransformFuture(
            self, (target_frame, source_frame),
            lambda: self.lookup_stamped(target_frame, source_frame, stamp), timeout)

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = None) -> TransformFuture:
        """Return a future of the transform between two times."""
        stamps = self._as_stamp(target_time), self._as_stamp(source_time)
        return TransformFuture(
            self, (target_frame, source_frame),
            lambda: self.lookup_full_stamped(
                target_frame, stamps[0], source_frame, stamps[1], fixed_frame), timeout)

    # --- for those who wait, not for users

    def _alarm_clock(self) -> Alarms:
        """Return what watches the deadlines of all who wait without a thread."""
        with self._lock:
            if self._alarms is None:
                self._alarms = Alarms(self._watch, self._forget_orphans)
            return self._alarms

    def _leave_orphan(self, waiter: Waiter, alarm: int | None) -> None:
        """Note a waiter whom nobody needs any more; takes no lock, for finalizers call it."""
        self._orphans.append((waiter, alarm))
        if alarm is not None and self._alarms is not None:
            self._alarms.ring()

    def _forget_orphans(self) -> None:
        """Take waiters out whom nobody needs any more."""
        with suppress(IndexError):
            while True:
                waiter, alarm = self._orphans.popleft()
                with self._lock:
                    self._waiters.discard(waiter)
                if alarm is not None:
                    self._alarm_clock().forget(alarm)

    def _wake_everybody(self) -> None:
        """Let all who wait ask again: some give up when nobody delivers any more."""
        with self._lock:
            waiters = self._waiters.take_all()
        wake_all(waiters)
