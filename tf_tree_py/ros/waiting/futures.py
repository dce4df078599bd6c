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

"""Waiting without a thread of one's own: what ``Buffer``'s ``..._async`` methods return."""

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.task import Future
from tf_tree_py.core.arrivals.observers import Asked
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple

from .awaitable import AwaitableFuture
from .timeouts import Timeouts, Wait
from ..messages.convert import as_nanoseconds, transform_stamped


class TransformFuture(AwaitableFuture):
    """
    A future whose result is a ``TransformStamped``: the one that was found at first.

    It fails as a lookup does, when the timeout is over, when the time has become older
    than the buffer keeps, when the clock jumps back, and when the last listener closes.
    """

    def __init__(self, timeouts: Timeouts, frames: tuple[str, str], lookups: Sequence[Asked],
                 query: Callable[[], tuple[int, PoseTuple]], timeout: Any) -> None:
        """
        Ask for the first time.

        :param timeouts: those of the buffer that is asked.
        :param frames: target and source.
        :param lookups: what observers are told that it asks.
        :param query: returns a stamp and ``target_T_source``.
        """
        super().__init__()
        self._frames = frames
        self._wait = Wait(
            timeouts, self, query, None if timeout is None else as_nanoseconds(timeout))
        timeouts.forget_orphans()
        self._tell_end = timeouts.observers.begin(*lookups)
        self._wait.ask()

    def answered(self, answer: tuple[int, PoseTuple]) -> None:
        """End with what was found."""
        try:
            transform = transform_stamped(*self._frames, *answer)
        except TransformException as error:  # no message can hold its stamp
            self.failed(error)
        else:
            self.set_result(transform)
            self._tell_end(None)

    def failed(self, error: TransformException) -> None:
        """End with the reason why nothing will be found."""
        self.set_exception(error)
        self._tell_end(error)
        if self._wait.released:
            # Marks the exception as read: its reader has ended too, and rclpy would complain.
            self.exception()

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Call back when it ends; until then it lives, whether or not you keep it."""
        self._wait.keep_alive()
        super().add_done_callback(callback)

    def _end(self) -> bool:
        """Stop waiting; return whether nobody had ended it before."""
        first = super()._end()
        if first:
            self._wait.end()
        return first


async def outcome(future: AwaitableFuture) -> Any:
    """Return a future's result as soon as it is there; whoever is cancelled cancels it."""
    try:
        return await future
    finally:
        future.cancel()
