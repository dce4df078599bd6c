"""Whether a buffer is one of ours: that of tf2 has the same name and other methods."""

from typing import Any

from rclpy.node import Node

from .buffer import Buffer


def check_is_ours(buffer: Any, user: str) -> None:
    """
    Refuse what is no ``Buffer`` of this package.

    :param user: the name of the class that takes it.
    :raises TypeError: another one, such as ``tf2_ros.Buffer``, or a node in its place.
    """
    if isinstance(buffer, Buffer):
        return
    kind = type(buffer)
    what_to_do = ('the buffer comes first, and then the node' if isinstance(buffer, Node)
                  else 'make it of `from tf_tree_py import Buffer`')
    raise TypeError(f'{user} takes a Buffer of tf_tree_py, and this is a '
                    f'{kind.__module__}.{kind.__qualname__}: {what_to_do}')
