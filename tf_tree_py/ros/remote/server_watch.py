# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Discovery of the action's servers, and of new ones among them."""

from contextlib import suppress
import math
import time

from rclpy.action.server import RCLError
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

# The errors of rclpy when a node has been destroyed, or its context has ended.
GONE = InvalidHandle, RCLError

# DDS discovers a server part by part: at first requests or responses may be lost.
_DISCOVERY_S = 10.0
# A request to a server that replaces another is sent again after this time without a response.
_AGAIN_S = 0.5
# A request to the first server, in parts of the time in which the server has to accept it. That
# server was completely discovered by the client, so it is more likely slow than deaf: a hundred
# clients that repeat their requests soon would make it slower still.
_AGAIN_AT_FIRST = 0.5


class ServerWatch:
    """
    A comparison of the present servers with the earlier ones.

    A server that was killed seems to be present until its DDS lease ends, after about 20 s. The
    server that was started in its place shows up sooner.
    """

    def __init__(self, node: Node, name: str) -> None:
        """
        Begin without a server.

        :param node: reads the graph.
        :param name: the action's name, absolute.
        """
        self._node = node
        self._status_topic = f'{name}/_action/status'
        self._known: frozenset[bytes] = frozenset()
        self._discovered_at = -math.inf
        self._is_first = True

    def is_there(self) -> bool:
        """Return whether there is a server, though it may not receive requests yet."""
        return bool(self._find())

    def note_first(self) -> None:
        """Treat the present servers as known, if none is known yet."""
        if not self._known:
            self._known = self._find()
            self._discovered_at = time.monotonic()

    def has_new(self) -> bool:
        """Return whether there is a server that was absent at the last call."""
        servers = self._find()
        is_new = bool(self._known and servers - self._known)
        if is_new:
            self._discovered_at = time.monotonic()
            self._is_first = False
        if servers:
            self._known = servers
        return is_new

    def may_have_lost(self, silent_s: float, acceptance_s: float) -> bool:
        """
        Return whether the newest server is so new that a request to it may be lost.

        A server that replaces another is granted twice as much time for each repetition.

        :param silent_s: the seconds since the request, without a response.
        :param acceptance_s: the seconds in which a server has to accept a request.
        """
        age_s = time.monotonic() - self._discovered_at
        again_s = (_AGAIN_AT_FIRST * acceptance_s if self._is_first
                   else _AGAIN_S + age_s - silent_s)
        return age_s < _DISCOVERY_S and silent_s >= again_s

    def _find(self) -> frozenset[bytes]:
        """Return an identity of each server: that of its publisher of the goals' states."""
        with suppress(*GONE):
            return frozenset(bytes(publisher.endpoint_gid) for publisher
                             in self._node.get_publishers_info_by_topic(self._status_topic))
        return frozenset()
