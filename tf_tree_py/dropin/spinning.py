"""
tf2's ``spin_thread=True``, for programs that leave the spinning of their node to it.

tf2's begins at once, so that callbacks run while the node is still being made. Most
programs spin their node themselves soon after, and for them there is nothing to do.
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
    Spin a node in a thread, unless somebody begins to within a second.

    Whoever spins it later takes it over, as rclpy's executors do.
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

    # A thread that is still inside rclpy when Python ends would abort the process.
    atexit.register(end)
    try:
        executor.spin_until_future_complete(stop)
    finally:
        atexit.unregister(end)
        executor.shutdown()
