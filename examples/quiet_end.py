# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A node that ends quietly at Ctrl-C and SIGTERM (docs/ending.md)."""

import signal

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from tf_tree_py import Buffer, TransformListener


def main() -> None:
    """Spin a node until a signal arrives, and destroy everything in order."""
    arrived: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: arrived.append(number))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # rclpy handles no signal
    node = rclpy.create_node('quiet_end')
    buffer = Buffer(node=node)
    listener = TransformListener(buffer, node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print('spinning', flush=True)
    while not arrived:
        executor.spin_once(timeout_sec=0.1)  # returns, so that Python can call the handler

    listener.close()
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(uninstall_handlers=False)  # there are none; removing them resets those above


if __name__ == '__main__':
    main()
