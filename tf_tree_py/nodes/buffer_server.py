# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The counterpart of tf2's buffer_server, which looks up transforms for other processes."""

from collections.abc import Callable
import sys
from typing import Any

from rclpy.duration import Duration
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.remote.buffer_server import BufferServer
from tf_tree_py.ros.remote.lookup_goal import ACTION_NAME
from tf_tree_py.ros.topics.listener import TransformListener

from .bad_input import BadInput
from .parameters import declare, Setting
from .running import ClosingNode, main_of
from .time_limits import MAX_AGE, TIME_LIMITS, time_limits

NAME = 'buffer_server'
_NODE_NAME = 'tf_buffer'

SETTINGS = (
    Setting('buffer_size', 120.0, 'how much history is kept, s', (0.0, 1e9)),
    *TIME_LIMITS,
    MAX_AGE,
    Setting('diagnostics', False, 'publish the state of each edge on /diagnostics, once a second'),
)

_DESCRIPTION = f"""\
Subscribes to /tf and /tf_static, and serves the lookups of BufferClients (of tf2 or of this
package) as the action {ACTION_NAME} (tf2_msgs/action/LookupTransform)."""
_EXAMPLES = (
    ('buffer_server', 'two minutes of history'),
    ('buffer_server --ros-args -p buffer_size:=30 -p max_age:=0.5',
     '30 s, and no latest older than 0.5 s'),
)


class BufferServerNode(ClosingNode):
    """Receives transforms, and serves lookups of them."""

    def __init__(self, **node_options: Any) -> None:
        """
        Start to receive and to serve.

        :param node_options: the keyword arguments of rclpy's ``Node``.
        :raises BadInput: a parameter has a wrong type or is out of its range.
        """
        super().__init__(_NODE_NAME, **node_options)
        given = declare(self, SETTINGS)
        self.buffer = Buffer(
            Duration(seconds=given['buffer_size']), self,
            **time_limits(given))
        self._closing.callback(TransformListener(self.buffer, self).close)
        self._closing.callback(BufferServer(self.buffer, self).close)
        if given['diagnostics']:
            self._closing.callback(self._diagnostics())

    def _diagnostics(self) -> Callable[[], None]:
        # Imported here, because only diagnostics require diagnostic_msgs.
        try:
            from tf_tree_py.ros.diagnostics import TransformDiagnostics
        except ModuleNotFoundError as error:
            raise BadInput(f'parameter diagnostics: {error.name} is not installed') from error
        return TransformDiagnostics(self.buffer, self).close


main = main_of(NAME, _DESCRIPTION, _EXAMPLES, SETTINGS, BufferServerNode)


if __name__ == '__main__':
    sys.exit(main())
