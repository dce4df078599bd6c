# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A node that closes its resources when it is destroyed."""

from contextlib import ExitStack
from typing import Any

from rclpy.node import Node


class _DestroyedOnError(type):
    """Destroys an object whose constructor raises; else its publishers would stay in the graph."""

    def __call__(cls, *arguments: Any, **options: Any) -> Any:
        node: Any = cls.__new__(cls)  # type: ignore[call-overload]
        try:
            node.__init__(*arguments, **options)
        except BaseException:
            node.destroy_node()
            raise
        return node


class ClosingNode(Node, metaclass=_DestroyedOnError):
    """
    A node that closes its resources before it is destroyed, the newest first.

    It is also destroyed if its constructor raises. It may be destroyed more than once, because
    rclpy does so, too, from Kilted on.
    """

    _is_complete = False

    def __init__(self, name: str, **node_options: Any) -> None:
        """
        Create a node without resources.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        """
        self._closing = ExitStack()
        super().__init__(name, **node_options)
        self._is_complete = True

    def destroy_node(self) -> None:
        """Close the resources, and destroy the node."""
        self._closing.close()
        # rclpy cannot destroy a node that it has refused, such as one with a wrong name.
        if self._is_complete:
            super().destroy_node()
