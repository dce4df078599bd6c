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

"""
Wrong arguments where a buffer or a node belongs.

They are refused at once with a sentence; otherwise an AttributeError would follow later.
"""

from typing import Any

from rclpy.node import Node


def check_is_ours(buffer: Any, ours: type, user: str) -> None:
    """
    Refuse a buffer that is not this package's: tf2's has the same name and other methods.

    :param ours: the class ``Buffer`` of this package.
    :param user: the name of the class that takes it.
    :raises TypeError: another one, such as ``tf2_ros.Buffer``, or a node in its place.
    """
    if isinstance(buffer, ours):
        return
    kind = type(buffer)
    what_to_do = ('the buffer comes first, and then the node' if isinstance(buffer, Node)
                  else 'make it of `from tf_tree_py import Buffer`')
    raise TypeError(f'{user} takes a Buffer of tf_tree_py, and this is a '
                    f'{kind.__module__}.{kind.__qualname__}: {what_to_do}')


def check_places(call: str, *, buffer: Any = None, node: Any = None) -> None:
    """
    Refuse a node in the place of a buffer, and a buffer in the place of a node.

    :param call: the right call, for the error.
    :param buffer: what was given as a buffer.
    :param node: what was given as a node.
    :raises TypeError: they changed places.
    """
    if isinstance(buffer, Node):
        raise TypeError(f'{call}: the buffer comes first, and here it is a '
                        f'{type(buffer).__name__}')
    if hasattr(node, 'lookup_transform') and not isinstance(node, Node):
        raise TypeError(f'{call}: the node is a {type(node).__name__}')
