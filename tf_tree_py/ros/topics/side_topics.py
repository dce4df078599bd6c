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

"""Topics beside /tf that tell a buffer more, read in a thread of our own."""

from collections.abc import Callable
from typing import Any
import weakref

from rclpy.node import Node
from rclpy.qos import QoSProfile

from ..threads.companion import companion
from ..threads.receiver import Receiver


class SideTopics:
    """
    Reads topics in one daemon thread, on a small node beside the user's.

    It lives as long as its owner, or until ``close()``. The user's node need not be spun.
    """

    def __init__(self, owner: object, node: Node, name: str) -> None:
        """
        Begin without topics.

        :param owner: when it is gone, the thread ends; no callback may keep it alive.
        :param node: whose names and remappings to use.
        """
        self._node = node
        self._home = companion(node, name, with_clock=False)
        self._receiver = Receiver(self._home, lambda: None)
        self._subscriptions: list[Any] = []
        weakref.finalize(owner, self._receiver.stop)

    def subscribe(self, msg_type: Any, topic: str, callback: Callable[[Any], None],
                  qos: QoSProfile | int) -> str:
        """Call back with every message of a topic; return the topic's whole name."""
        name = self._node.resolve_topic_name(topic)
        self._subscriptions.append(self._home.create_subscription(msg_type, name, callback, qos))
        self._receiver.wake()
        return name

    def close(self) -> None:
        """Stop reading."""
        self._receiver.close()
