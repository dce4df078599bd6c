# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The futures that the ``..._async`` methods of ``Buffer`` return."""

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.task import Future
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.messages.observers import Asked

from .awaitable import AwaitableFuture
from .timeouts import Timeouts, Wait
from ..messages.convert import as_nanoseconds, transform_stamped


class TransformFuture(AwaitableFuture):
    """
    A future whose result is the first ``TransformStamped`` that the lookup finds.

    It fails with the errors of a lookup: when the timeout is over, when its time has become
    older than the buffer keeps, when the clock jumps back, and when the last listener closes.
    """

    def __init__(self, timeouts: Timeouts, frames: tuple[str, str], lookups: Sequence[Asked],
                 query: Callable[[], tuple[int, PoseTuple]], timeout: Any) -> None:
        """
        Run the query for the first time.

        :param timeouts: those of the buffer.
        :param frames: target and source.
        :param lookups: the lookups that observers are notified of.
        :param query: returns a stamp and ``target_T_source``.
        """
        super().__init__()
        self._frames = frames
        self._wait = Wait(
            timeouts, self, query, None if timeout is None else as_nanoseconds(timeout))
        timeouts.forget_orphans()
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
        self.set_exception(error)
        self._notify_end(error)
        if self._wait.released:
            # Marks the exception as read: its reader has ended, too, and rclpy would warn.
            self.exception()

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Call back when it ends; until then the buffer keeps the future alive."""
        self._wait.keep_alive()
        super().add_done_callback(callback)

    def _end(self) -> bool:
        """Stop waiting; return False if it had ended already."""
        first = super()._end()
        if first:
            self._wait.end()
        return first


async def outcome(future: AwaitableFuture) -> Any:
    """Return a future's result once it has one; cancelling this cancels the future."""
    try:
        return await future
    finally:
        future.cancel()
