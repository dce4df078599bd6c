# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Who runs the callbacks of a listener on a user's node: a thread, or nothing at all."""

from contextlib import suppress
import threading
import time

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.timer import Timer

from ..buffer.buffer import Buffer
from ..threads.executors import takes_calls

# A period of 0 would be due at once as well, but rcl computes with it.
_AT_ONCE_S = 1e-6
# After so many seconds in which the timer is due a node is not spun; the second one if it is in an
# executor, whose thread may be late on a busy machine.
_NOT_SPUN_S, _NOT_RUN_S = 0.1, 1.0


class Spinner:
    """
    A record of the thread that runs a node's single-threaded executor and delivers transforms.

    A program may spin its node first in one thread and then in another; the first then no longer
    delivers.

    It also finds out whether the node is spun at all while lookups wait: it makes a timer on the
    node due, which any executor would serve first.
    """

    def __init__(self, buffer: Buffer, node: Node) -> None:
        self._buffer = buffer
        self._node = node
        # Later the node may have been destroyed.
        self._name = node.get_fully_qualified_name()
        self._thread: threading.Thread | None = None
        self._timer: Timer | None = None
        self._due_since: float | None = None

    def note(self) -> None:
        """Record that the current thread delivers transforms."""
        self._due_since = None
        alone = isinstance(self._node.executor, SingleThreadedExecutor)
        thread = threading.current_thread() if alone else None
        if thread is not self._thread:
            self.forget()
            self._thread = thread
        if thread is not None:
            self._buffer.feeds.add_thread(thread)

    def forget(self) -> None:
        """Allow the recorded thread to wait for transforms again."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._buffer.feeds.remove_thread(thread)

    def check_from_now_on(self) -> 'Spinner':
        """Add the timer to the node, for ``check``; return this object."""
        self._timer = self._node.create_timer(
            _AT_ONCE_S, self._serve, MutuallyExclusiveCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME), autostart=False)
        return self

    def end(self) -> None:
        """Forget the thread, and remove the timer."""
        self.forget()
        timer, self._timer = self._timer, None
        if timer is not None:
            self._node.destroy_timer(timer)

    def check(self) -> None:
        """Make the timer due, unless it already is."""
        timer, executor = self._timer, self._node.executor
        if timer is None or self._due_since is not None or not (
                executor is None or takes_calls(executor)):
            return
        self._due_since = time.monotonic()
        # The node may be destroyed, or its executor shut down, at any moment.
        with suppress(AttributeError, InvalidHandle):
            timer.reset()
            if isinstance(executor, Executor):
                executor.wake()

    def why_nothing_arrives(self) -> str:
        """Return that nothing runs the node's callbacks, if that is certain, or ''."""
        since = self._due_since
        if since is None:
            return ''
        passed_s = time.monotonic() - since
        if self._node.executor is None and passed_s >= _NOT_SPUN_S:
            return (f'The node {self._name} is not being spun, so its TransformListener receives '
                    'nothing: spin the node in another thread, or leave out spin_thread=False')
        if passed_s < _NOT_RUN_S:
            return ''
        return (f'The executor of the node {self._name} has run none of its callbacks for '
                f'{passed_s:.1f} s, so its TransformListener receives nothing: the executor is '
                'not spun, or all its threads are in other callbacks. Leave out '
                'spin_thread=False, or use more threads')

    def _serve(self) -> None:
        timer = self._timer
        if timer is not None:
            timer.cancel()
        self._due_since = None
