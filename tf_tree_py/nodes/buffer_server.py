# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The counterpart of tf2's buffer_server, which looks up transforms for other processes."""

from collections.abc import Callable
import sys
from typing import Any

from rclpy.duration import Duration
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.remote.buffer_server import BufferServer
from tf_tree_py.ros.remote.lookup_goal import ACTION_NAME
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.waiting.clock import JUMP_BACK

from .bad_input import BadInput
from .parameters import declare, Setting
from .running import ClosingNode, main_of

NAME = 'buffer_server'
_NODE_NAME = 'tf_buffer'

SETTINGS = (
    Setting('buffer_size', 120.0, 'how much history is kept, s', (0.0, 1e9)),
    Setting('max_future', 0.0, 'refuse stamps further ahead of the clock, s; 0: accept them',
            (0.0, 1e9)),
    Setting('clear_on_jump_back', 0.0,
            'clear moving transforms when stamps jump back by more, s; 0: never', (0.0, 1e9)),
    Setting('clear_on_clock_jump_back', as_seconds(JUMP_BACK),
            'clear them when simulated time goes back by this, s; 0: at any step', (0.0, 1e9)),
    Setting('diagnostics', False, 'publish the state of each edge on /diagnostics, once a second'),
)

_DESCRIPTION = f"""\
Subscribes to /tf and /tf_static, and serves the lookups of BufferClients (of tf2 or of this
package) as the action {ACTION_NAME} (tf2_msgs/action/LookupTransform)."""


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
            max_future=_unless_zero(given['max_future']),
            clear_on_jump_back=_unless_zero(given['clear_on_jump_back']),
            clear_on_clock_jump_back=Duration(seconds=given['clear_on_clock_jump_back']))
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


def _unless_zero(seconds: float) -> Duration | None:
    return Duration(seconds=seconds) if seconds else None


main = main_of(NAME, _DESCRIPTION, SETTINGS, BufferServerNode)


if __name__ == '__main__':
    sys.exit(main())
