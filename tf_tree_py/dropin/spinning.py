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

"""
tf2's ``spin_thread=True``: spins a node that its program does not spin.

tf2's begins at once, so callbacks run while the node is still being made. This one waits
for a second first, because most programs soon spin their node themselves.
"""

import atexit
from contextlib import suppress
import threading
import weakref

from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

_UNTIL_SPUN_S = 1.0
_TO_END_S = 1.0


def spin_if_nobody_does(node: Node) -> threading.Timer:
    """
    Spin a node in a thread, unless the program begins to spin it within a second.

    An executor that the program adds it to later takes it over, as is rclpy's rule.
    """
    timer = threading.Timer(_UNTIL_SPUN_S, _spin, [weakref.ref(node)])
    timer.daemon = True
    timer.start()
    return timer


def _spin(reference: weakref.ref[Node]) -> None:
    node = reference()
    if node is None or node.executor is not None or not node.context.ok():
        return
    executor = SingleThreadedExecutor(context=node.context)
    # The node may be destroyed, or ROS shut down, at any moment.
    with suppress(InvalidHandle, ExternalShutdownException):
        with node.handle:
            executor.add_node(node)
            node.get_logger().info(
                "Nobody spins this node, so its TransformListener's thread does, as "
                'spin_thread=True asks for')
        del node
        _spin_until_exit(executor)


def _spin_until_exit(executor: SingleThreadedExecutor) -> None:
    stop = Future()
    thread = threading.current_thread()

    def end() -> None:
        stop.set_result(None)
        executor.wake()
        thread.join(_TO_END_S)

    # If the thread were still inside rclpy when Python ends, the process would abort.
    atexit.register(end)
    try:
        executor.spin_until_future_complete(stop)
    finally:
        atexit.unregister(end)
        executor.shutdown()
