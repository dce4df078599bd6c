"""Arguments that changed places: told at once, not by an AttributeError later."""

from typing import Any

from rclpy.node import Node


def check_places(call: str, *, buffer: Any = None, node: Any = None) -> None:
    """
    See that a buffer is no node, and a node no buffer.

    :param call: how to call what was called.
    :param buffer: what was given as a buffer.
    :param node: what was given as a node.
    :raises TypeError: they changed places.
    """
    if isinstance(buffer, Node):
        raise TypeError(f'{call}: the buffer comes first, and here it is a '
                        f'{type(buffer).__name__}')
    if hasattr(node, 'lookup_transform') and not isinstance(node, Node):
        raise TypeError(f'{call}: the node is a {type(node).__name__}')
