# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Topics in addition to /tf whose messages go to a buffer, read in a separate thread."""

from collections.abc import Callable
from typing import Any
import weakref

from rclpy.node import Node
from rclpy.qos import QoSProfile

from ..threads.internal_node import internal_node
from ..threads.receiver import Receiver


class SideTopics:
    """
    Reads topics in one daemon thread, on a small node in addition to the user's.

    It lives as long as its owner, or until ``close()``. The user's node need not be spun.
    """

    def __init__(self, owner: object, node: Node, name: str) -> None:
        """
        Begin without topics.

        :param owner: when it is garbage collected, the thread ends; no callback may keep it alive.
        :param node: supplies the names and remappings.
        """
        self._node = node
        self._home = internal_node(node, name, with_clock=False)
        self._receiver = Receiver(self._home, lambda: None)
        self._subscriptions: list[Any] = []
        weakref.finalize(owner, self._receiver.stop)

    def subscribe(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                  qos: QoSProfile | int) -> str:
        """Call back with every message of a topic; return the topic's full name."""
        name = self._node.resolve_topic_name(topic)
        self._subscriptions.append(self._home.create_subscription(msg_type, name, callback, qos))
        self._receiver.wake()
        return name

    def close(self) -> None:
        """Stop reading."""
        self._receiver.close()
