"""Who publishes on a topic, as far as the graph tells."""

import time

from rclpy.node import Node

_REFRESH_S = 1.0
_UNKNOWN = 'unknown_publisher'


class Authority:
    """
    The name of the node that publishes on a topic, or of those that do.

    A received message does not say who sent it; the graph says who might have. So
    with several publishers the honest answer is ``one of a, b``. Asked anew at
    most once a second.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._topic = topic
        self._asked = -_REFRESH_S
        self._name = _UNKNOWN

    def name(self) -> str:
        """Return the publisher's full node name, or all candidates."""
        now = time.monotonic()
        if now - self._asked >= _REFRESH_S:
            self._asked = now
            self._name = self._ask()
        return self._name

    def _ask(self) -> str:
        names = sorted({
            f'{info.node_namespace.rstrip("/")}/{info.node_name}'
            for info in self._node.get_publishers_info_by_topic(self._topic)
        })
        if len(names) > 1:
            return 'one of ' + ', '.join(names)
        return names[0] if names else _UNKNOWN
