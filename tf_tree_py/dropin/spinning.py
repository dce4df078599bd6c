# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2's ``spin_thread=True``: spins a node that its program does not spin.

tf2's thread begins at once, so callbacks run before the node is complete. This one first waits for
a second, because most programs soon spin their node themselves.
"""

import atexit
from contextlib import suppress
import threading
import weakref

from rclpy.action.server import RCLError
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from tf_tree_py.ros.threads.internal_node import is_running

_UNTIL_SPUN_S = 1.0
_TO_END_S = 1.0


def spin_if_nobody_does(node: Node) -> threading.Timer:
    """
    Spin a node in a thread, unless the program begins to spin it within a second.

    If the program later adds the node to an executor, that takes it over, by rclpy's rule.
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
                "Nothing else spins this node, so its TransformListener's thread does, as "
                'spin_thread=True requests')
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
    except RCLError:
        # ROS was shut down between the executor's check and its wait.
        if is_running(executor.context):
            raise
    finally:
        atexit.unregister(end)
        executor.shutdown()
