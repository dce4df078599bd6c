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

"""Which nodes publish on a topic, according to the ROS graph."""

from contextlib import suppress
from dataclasses import replace
import math
import time
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from tf_tree_py.core.arrivals.incidents import Incident, one_of

_REFRESH_S = 1.0
_RETRY_S = 0.05
# What the graph says of an endpoint before its node has announced itself.
_UNNAMED = '_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_'


class Authority:
    """
    The name of the node that publishes on a topic, or of those that do.

    A message does not say who sent it; the graph says who publishes on its topic. So with
    several publishers the answer is ``one of a, b``. The graph is asked at most once a
    second. It is asked more often while a name is missing, because the first message may
    arrive before the publisher's name, and before an incident is reported.

    :ivar placeholder: stands for the name while it is missing.
    :ivar endpoints: the publishers' ids in the middleware.
    :ivar names: the publishers' node names, one for each; empty while one is missing.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._topic = topic
        self._ask_at = -math.inf
        self._corrected_at = -math.inf
        self.placeholder = self._name = f'unknown publisher of {topic}'
        self.endpoints: frozenset[bytes] = frozenset()
        self.names: list[str] = []

    def name(self) -> str:
        """Return the publisher's full node name, or all candidates."""
        now = time.monotonic()
        if now >= self._ask_at:
            self.ask()
            self._ask_at = now + (_RETRY_S if self._name == self.placeholder else _REFRESH_S)
        return self._name

    def ask(self) -> None:
        """Ask the graph now."""
        # The last answer stays once the listener is closed or ROS has shut down.
        if self._node.context.ok():
            with suppress(InvalidHandle):
                self._name = self._ask()

    def correct(self, incidents: list[Incident]) -> list[Incident]:
        """
        Return incidents with the current name: a second publisher may just have appeared.

        :param incidents: of messages of this topic that have just arrived.
        """
        if not incidents:
            return incidents
        now = time.monotonic()
        if now >= self._corrected_at + _RETRY_S:
            self._corrected_at = now
            self._ask_at = now
        name = self.name()
        return [replace(incident, authority=name) for incident in incidents]

    def _ask(self) -> str:
        infos = self._node.get_publishers_info_by_topic(self._topic)
        endpoints = frozenset(bytes(info.endpoint_gid) for info in infos)
        if endpoints != self.endpoints:
            self.endpoints = endpoints
        names = [node_name(info) for info in infos]
        self.names = [] if _UNNAMED in names else sorted(names)
        return one_of(set(names)) if self.names else self.placeholder


def node_name(info: Any) -> str:
    """Return the full name of an endpoint's node, as the graph tells it."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
