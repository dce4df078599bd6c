"""Makes ``rclpy.spin_once`` return when a transform came, though the node received nothing."""

from contextlib import suppress
from typing import Any
import weakref

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


class Waker:
    """
    Gives a node's executor something to do.

    A task of the executor's, and not a guard condition of the node's: the
    ``EventsExecutor`` refuses nodes that have one.
    """

    def __init__(self, node: Node) -> None:
        self._node = weakref.ref(node)
        # The executor that has not run its task yet.
        self._busy: Any = None

    def wake(self) -> None:
        """Make ``spin_once`` return; what comes while nobody spins makes it return once."""
        node = self._node()
        executor = None if node is None else node.executor or _executor_of_spin_once(node)
        if executor is None or executor is self._busy:
            return
        self._busy = executor
        # It may be shut down just now.
        with suppress(AttributeError, InvalidHandle):
            executor.create_task(self._done)

    def _done(self) -> None:
        self._busy = None


def _executor_of_spin_once(node: Node) -> Any:
    """Return the executor that ``rclpy.spin_once`` will take, if it is that of the node."""
    if node.context is rclpy.get_default_context() and node.context.ok():
        return rclpy.get_global_executor()
    return None
