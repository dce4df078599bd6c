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

"""tf2's program that looks up transforms for other processes."""

from collections.abc import Sequence
import sys
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.remote.buffer_server import BufferServer
from tf_tree_py.ros.remote.lookup_goal import ACTION_NAME
from tf_tree_py.ros.topics.listener import TransformListener

from .bad_input import BadInput
from .parameters import declare, describe, Setting
from .running import Parser, run, spin

NAME = 'buffer_server'
NODE_NAME = 'tf_buffer'

SETTINGS = (
    Setting('buffer_size', 120.0, 'how much history is kept, s', (0.0, 1e9)),
    Setting('max_future', 0.0, 'refuse stamps further ahead of the clock, s; 0 takes them',
            (0.0, 1e9)),
    Setting('clear_on_jump_back', 0.0,
            'forget what moves when stamps jump back further, s; 0 never does', (0.0, 1e9)),
    Setting('diagnostics', False, 'publish on /diagnostics how every edge is, once a second'),
)

_DESCRIPTION = f"""\
Hears /tf and /tf_static, and answers the lookups of BufferClients, tf2's and ours, by the
action {ACTION_NAME} (tf2_msgs/action/LookupTransform)."""


class BufferServerNode(Node):
    """Listens to transforms, and answers lookups of them."""

    def __init__(self, **node_options: Any) -> None:
        """
        Begin to listen and to serve.

        :param node_options: as rclpy's ``Node`` takes them.
        :raises BadInput: a parameter has a wrong type or is out of its range.
        """
        super().__init__(NODE_NAME, **node_options)
        given = declare(self, SETTINGS)
        self.buffer = Buffer(
            Duration(seconds=given['buffer_size']), self,
            max_future=_unless_zero(given['max_future']),
            clear_on_jump_back=_unless_zero(given['clear_on_jump_back']))
        self._open: list[Any] = [
            TransformListener(self.buffer, self), BufferServer(self.buffer, self)]
        if given['diagnostics']:
            self._open.append(self._diagnostics())

    def _diagnostics(self) -> Any:
        # Imported here, because diagnostic_msgs is needed by those only who want diagnostics.
        try:
            from tf_tree_py.ros.diagnostics import TransformDiagnostics
        except ModuleNotFoundError as error:
            raise BadInput(f'parameter diagnostics: {error.name} is not installed') from error
        return TransformDiagnostics(self.buffer, self)

    def destroy_node(self) -> None:
        """Stop serving and listening, and destroy the node."""
        while self._open:
            self._open.pop().close()
        super().destroy_node()


def _unless_zero(seconds: float) -> Duration | None:
    return Duration(seconds=seconds) if seconds else None


def main(argv: Sequence[str] | None = None) -> int:
    """Run the executable; return its exit status."""
    parser = Parser(NAME, _DESCRIPTION, describe(SETTINGS))
    parser.parse_args(parser.own_arguments(argv))
    return run(NAME, argv, lambda ended: spin(BufferServerNode(), ended))


if __name__ == '__main__':
    sys.exit(main())
