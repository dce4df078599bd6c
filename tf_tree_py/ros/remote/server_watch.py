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

"""Which servers of the action are there, and whether another one has come."""

from contextlib import suppress
import time

from rclpy.action.server import RCLError
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

# What rclpy raises when a node has been destroyed, or its context has ended.
GONE = InvalidHandle, RCLError

# DDS discovers a server part by part: at first it may not hear requests, or not be heard.
_DISCOVERY_S = 10.0


class ServerWatch:
    """
    Compares the servers that are there with those that were there before.

    A server that was killed seems to be there until its lease with DDS ends, after 20 s or so.
    The one that was started in its place shows up sooner.
    """

    def __init__(self, node: Node, name: str) -> None:
        """
        Begin without a server.

        :param node: who looks at the graph.
        :param name: the action's, absolute.
        """
        self._node = node
        self._status_topic = f'{name}/_action/status'
        self._known: frozenset[bytes] = frozenset()
        self._discovered_at = 0.0

    def is_there(self) -> bool:
        """Return whether there is a server, though it may not hear requests yet."""
        return bool(self._find())

    def note_first(self) -> None:
        """Treat the servers that are there as known, if none is known yet."""
        if not self._known:
            self._known = self._find()

    def has_new(self) -> bool:
        """Return whether a server is there that was not there at the last call."""
        servers = self._find()
        is_new = bool(self._known and servers - self._known)
        if is_new:
            self._discovered_at = time.monotonic() + _DISCOVERY_S
        if servers:
            self._known = servers
        return is_new

    def may_be_deaf(self) -> bool:
        """Return whether a server is so new that it may not hear requests yet."""
        return time.monotonic() < self._discovered_at

    def _find(self) -> frozenset[bytes]:
        """Return an identity of each server: that of its publisher of the goals' states."""
        with suppress(*GONE):
            return frozenset(bytes(publisher.endpoint_gid) for publisher
                             in self._node.get_publishers_info_by_topic(self._status_topic))
        return frozenset()
