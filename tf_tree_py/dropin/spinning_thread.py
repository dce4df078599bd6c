# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Calls from the listener's thread into the thread that spins a program's node.

In tf2 the listener's callback runs in that thread. Programs rely on two consequences:
``rclpy.spin_once`` returns when a transform has arrived, and the callbacks of futures never run
beside the node's other callbacks.
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any
import weakref

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor
from rclpy.node import Node
from tf_tree_py.core.errors import warn
from tf_tree_py.ros.threads.executors import takes_calls

# A period of 0 would be due at once as well, but rcl computes with it.
_AT_ONCE_S = 1e-6
# How long ``rclpy.spin_once`` waits at most where another process receives the messages.
_BEAT_S = 0.1


class SpinningThread:
    """
    Calls functions in whichever thread spins a node, as soon as one does.

    A timer on the node makes the calls, because every executor serves timers, and a timer that
    is due waits until the node is spun. A task of the executor would not: between two calls of
    ``rclpy.spin_once`` the node is in none, and the global executor must not be created in this
    thread, because rclpy's list of guard conditions allows only one thread (docs/ending.md). An
    ``EventsExecutor`` refuses nodes with a guard condition.

    A task takes less time than a timer, and messages are many. So a task wakes the executor that
    the node is in. An executor that no other thread may call is not woken, and calls are made in
    the listener's thread instead.
    """

    def __init__(self, node: Node, *, wake_always: bool, is_notified: bool = True) -> None:
        """
        Add a timer to the node.

        :param wake_always: whether the node's executor is woken by every message, not only for
            calls. If not, there are no calls while the node is in no executor.
        :param is_notified: whether ``message_arrived`` will be called. If not, the executor is
            woken every 0.1 s instead.
        """
        self._node = weakref.ref(node)
        self._wake_always = wake_always
        self._due: deque[Callable[[], object]] = deque()
        # The executor that has not yet run its task.
        self._woken: Executor | None = None
        self._timer = node.create_timer(
            _AT_ONCE_S, self._call_due, MutuallyExclusiveCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME), autostart=False)
        self._beat = None if is_notified or not wake_always else node.create_timer(
            _BEAT_S, _nothing, MutuallyExclusiveCallbackGroup(),
            Clock(clock_type=ClockType.STEADY_TIME))

    def end(self) -> None:
        """Remove the timer; calls that are due are not made."""
        node = self._node()
        if node is not None:
            node.destroy_timer(self._timer)
            if self._beat is not None:
                node.destroy_timer(self._beat)

    def message_arrived(self) -> None:
        """Make ``spin_once`` return; several messages before the next spin make it return once."""
        node = self._node()
        if node is None or not self._wake_always:
            return
        executor: Any = node.executor
        if executor is None:
            self._make_due()
        elif executor is not self._woken and takes_calls(executor):
            self._woken = executor
            # The executor may be shut down at this moment.
            with suppress(AttributeError, InvalidHandle):
                executor.create_task(self._has_run)

    def call(self, function: Callable[[], object]) -> bool:
        """
        Call a function in the thread that spins the node.

        Its exceptions are shown as rclpy shows those of callbacks of futures.

        :return: False if there will be no call.
        """
        node = self._node()
        if node is None or (node.executor is None and not self._wake_always):
            return False
        if not takes_calls(node.executor):
            return False
        self._due.append(function)
        if not self._make_due():
            return False
        executor: Any = node.executor
        # rclpy does not promise that the reset of a timer wakes its wait; so far it does. The
        # executor may be shut down at this moment.
        with suppress(AttributeError, InvalidHandle):
            executor.wake()
        return True

    def _make_due(self) -> bool:
        """Let the timer fire as soon as the node is spun; return False if it was destroyed."""
        try:
            self._timer.reset()
        except InvalidHandle:
            return False
        return True

    def _has_run(self) -> None:
        self._woken = None

    def _call_due(self) -> None:
        # First: a reset from now on is for the next call.
        self._timer.cancel()
        while self._due:
            function = self._due.popleft()
            try:
                function()
            except Exception as error:
                warn(f'Unhandled exception in done callback: {error}')


def _nothing() -> None:
    """Do nothing: the thread has been woken."""
