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

"""Makes ``rclpy.spin_once`` return when a transform came, though the node received nothing."""

from contextlib import suppress
from typing import Any
import weakref

import rclpy
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


class Waker:
    """
    Gives a node's executor a task, so that it wakes up.

    A guard condition on the node would do too, but the ``EventsExecutor`` refuses nodes
    that have one.
    """

    def __init__(self, node: Node) -> None:
        self._node = weakref.ref(node)
        # The executor that has not yet run the task it was given.
        self._busy: Any = None

    def wake(self) -> None:
        """Make ``spin_once`` return; several calls while nobody spins make it return once."""
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
