# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Makes ``rclpy.spin_once`` return when a transform arrives on another node."""

from contextlib import suppress
from typing import Any
import weakref

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


class Waker:
    """
    Gives a node's executor a task, so that it wakes up.

    A guard condition on the node would work, too, but the ``EventsExecutor`` refuses nodes that
    have one.
    """

    def __init__(self, node: Node) -> None:
        self._node = weakref.ref(node)
        # The executor that has not yet run its task.
        self._busy: Any = None

    def wake(self) -> None:
        """Make ``spin_once`` return; several calls before the next spin make it return once."""
        node = self._node()
        executor = None if node is None else node.executor or _executor_of_spin_once(node)
        if executor is None or executor is self._busy:
            return
        self._busy = executor
        # The executor may be shut down at this moment.
        with suppress(AttributeError, InvalidHandle):
            executor.create_task(self._done)

    def _done(self) -> None:
        self._busy = None


def _executor_of_spin_once(node: Node) -> Any:
    """Return the executor that ``rclpy.spin_once`` uses, if the node has its context."""
    if node.context is rclpy.get_default_context() and node.context.ok():
        return rclpy.get_global_executor()
    return None
