# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Spin a node in a thread while the main thread waits for commands."""

from contextlib import suppress
import threading

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


def spin_beside(node: Node) -> None:
    """Spin a node like ``rclpy.spin``, in a thread that ends when ROS is shut down."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    threading.Thread(target=spin).start()
