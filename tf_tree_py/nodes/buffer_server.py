"""tf2's program that looks up transforms for other processes."""

from collections.abc import Sequence
import sys
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.ros.buffer import Buffer
from tf_tree_py.ros.buffer_server import BufferServer
from tf_tree_py.ros.listener import TransformListener
from tf_tree_py.ros.lookup_goal import ACTION_NAME

from .parameters import declare, describe, Setting
from .running import Parser, run, spin

NAME = 'buffer_server'
NODE_NAME = 'tf_buffer'

SETTINGS = (
    Setting('buffer_size', 120.0, 'how much history is kept, s', (0.0, 1e9)),
)

_DESCRIPTION = f"""\
Hears /tf and /tf_static, and answers the lookups of BufferClients, tf2's and ours, by the
action {ACTION_NAME} (tf2_msgs/action/LookupTransform)."""


class BufferServerNode(Node):
    """Listens, and serves what it heard."""

    def __init__(self, **node_options: Any) -> None:
        """
        Begin to listen and to serve.

        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter has a wrong type or is out of its range.
        """
        super().__init__(NODE_NAME, **node_options)
        size_s = declare(self, SETTINGS)['buffer_size']
        self.buffer = Buffer(Duration(seconds=size_s), self)
        self._listener = TransformListener(self.buffer, self)
        self._server = BufferServer(self.buffer, self)

    def destroy_node(self) -> None:
        """Stop serving and listening, and destroy the node."""
        self._server.close()
        self._listener.close()
        super().destroy_node()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: spin(BufferServerNode(), ended))


if __name__ == '__main__':
    sys.exit(main())
