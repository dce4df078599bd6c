# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Checks for wrong arguments in the place of a buffer or a node.

They are refused at once with a clear error; otherwise an AttributeError would follow later.
"""

from typing import Any

from rclpy.node import Node


def check_is_ours(buffer: Any, ours: type, user: str) -> None:
    """
    Refuse a buffer of another library: tf2's has the same name and other methods.

    :param ours: the class ``Buffer`` of this package.
    :param user: the name of the class that takes it.
    :raises TypeError: another class, such as ``tf2_ros.Buffer``, or a node in its place.
    """
    if isinstance(buffer, ours):
        return
    kind = type(buffer)
    what_to_do = ('the buffer comes first, and then the node' if isinstance(buffer, Node)
                  else 'create it with `from tf_tree_py import Buffer`')
    raise TypeError(f'{user} takes a Buffer of tf_tree_py, and this is a '
                    f'{kind.__module__}.{kind.__qualname__}: {what_to_do}')


def check_places(call: str, *, buffer: Any = None, node: Any = None) -> None:
    """
    Refuse a node in the place of a buffer, and a buffer in the place of a node.

    :param call: the right call, for the error.
    :param buffer: the argument in the place of a buffer.
    :param node: the argument in the place of a node.
    :raises TypeError: they are swapped.
    """
    if isinstance(buffer, Node):
        raise TypeError(f'{call}: the buffer comes first, and here it is a '
                        f'{type(buffer).__name__}')
    if hasattr(node, 'lookup_transform') and not isinstance(node, Node):
        raise TypeError(f'{call}: the node is a {type(node).__name__}')
