# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Wait for transforms on /tf: ``python -m benchmark.processes.waiter WAY``.

The x of each transform is the time at which it was sent. The results are the delays until the
user's code continued.
"""

from collections.abc import Callable
import queue
import sys
import time
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
import tf_tree_py
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .spinning import spin_beside
from .. import motion
from ..rows import OURS, PLAIN, TF2_ROS
from ..worker import serve

_TIMEOUT = Duration(seconds=20.0)


class _Lookups:
    """Lookups that block until their transform arrives."""

    def __init__(self, buffer: Any, listener: object) -> None:
        self._buffer = buffer
        self._listener = listener

    def wait(self, sample: int) -> float:
        """Return the seconds from sending until a blocked lookup returned."""
        stamp = Time(nanoseconds=motion.chain(1).edges[0].stamp_of(sample))
        found = self._buffer.lookup_transform('frame_0', 'frame_1', stamp, _TIMEOUT)
        return time.monotonic() - found.transform.translation.x


class _Callback:
    """A plain subscription: the shortest delay that rclpy's executor permits."""

    def __init__(self, node: Node) -> None:
        self._delays: queue.SimpleQueue[float] = queue.SimpleQueue()
        self._subscription = node.create_subscription(
            TFMessage, TF_TOPIC, self._receive, dynamic_qos())
        spin_beside(node)

    def _receive(self, message: TFMessage) -> None:
        self._delays.put(time.monotonic() - message.transforms[0].transform.translation.x)

    def wait(self, _: int) -> float:
        """Return the seconds from sending until the callback was called."""
        return self._delays.get(timeout=20.0)


def _ours(node: Node) -> _Lookups:
    buffer = tf_tree_py.Buffer()
    return _Lookups(buffer, tf_tree_py.TransformListener(buffer, node))


def _tf2_ros(node: Node) -> _Lookups:
    import tf2_ros
    buffer = tf2_ros.Buffer()
    return _Lookups(buffer, tf2_ros.TransformListener(buffer, node, spin_thread=True))


WAYS: dict[str, Callable[[Node], Any]] = {OURS: _ours, PLAIN: _Callback, TF2_ROS: _tf2_ros}


def main() -> None:
    rclpy.init()
    node = Node('benchmark_waiter')
    waiting = WAYS[sys.argv[1]](node)
    serve({'wait_often': lambda count: [waiting.wait(sample) for sample in range(count)],
           'publishers': lambda: node.count_publishers(TF_TOPIC)})
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
