# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The nodes that publish on a topic, from the ROS graph."""

from contextlib import suppress
from dataclasses import replace
import math
import time
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from tf_tree_py.core.messages.incidents import Incident, one_of

from ..threads.context_state import is_running

_REFRESH_S = 1.0
_RETRY_S = 0.05
# The graph's name of an endpoint before its node has announced itself.
_UNNAMED = '_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_'


class PublisherNames:
    """
    The name of the node that publishes on a topic, or of several nodes.

    A message does not name its sender; the graph lists the publishers of its topic. With several
    publishers the name is therefore ``one of a, b``. The graph is read at most once a second. It
    is read more often while a name is missing, because the first message may arrive before the
    publisher's name, and before an incident is reported.

    :ivar placeholder: replaces the name while it is missing.
    :ivar endpoints: the publishers' ids in the middleware.
    :ivar names: the publishers' node names, one for each; empty while one is missing.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._topic = topic
        self._ask_at = -math.inf
        self._corrected_at = self._presented_at = -math.inf
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
        """Read the graph now."""
        # The last result stays once the listener is closed or ROS has shut down.
        if is_running(self._node.context):
            with suppress(InvalidHandle):
                self._name = self._ask()

    def correct(self, incidents: list[Incident]) -> list[Incident]:
        """
        Return incidents with the current name: a second publisher may have just appeared.

        :param incidents: of messages of this topic that have just arrived.
        """
        if not incidents:
            return incidents
        self._corrected_at = self._asked_again(self._corrected_at)
        name = self.name()
        return [replace(incident, authority=name) for incident in incidents]

    def present_name(self) -> str:
        """Return the current name from the graph, which is read at most twenty times a second."""
        self._presented_at = self._asked_again(self._presented_at)
        return self.name()

    def _asked_again(self, last: float) -> float:
        """Let the graph be read, unless it just was; return the time."""
        now = time.monotonic()
        if now < last + _RETRY_S:
            return last
        self._ask_at = now
        return now

    def _ask(self) -> str:
        infos = self._node.get_publishers_info_by_topic(self._topic)
        endpoints = frozenset(bytes(info.endpoint_gid) for info in infos)
        if endpoints != self.endpoints:
            self.endpoints = endpoints
        names = [node_name(info) for info in infos]
        self.names = [] if _UNNAMED in names else sorted(names)
        return one_of(set(names)) if self.names else self.placeholder


def node_name(info: Any) -> str:
    """Return the full name of an endpoint's node, from the graph."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
