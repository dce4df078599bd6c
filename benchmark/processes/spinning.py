"""Spinning a node beside a main thread that waits for commands."""

from contextlib import suppress
import threading

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


def spin_beside(node: Node) -> None:
    """Spin a node, as ``rclpy.spin`` does, in a thread that ends when ROS is shut down."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    threading.Thread(target=spin).start()
