# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A subscriber of /tf: ``python -m benchmark.processes.subscriber WAY``.

WAY is one of ``WAYS``. The main thread only waits for commands; another thread receives the
messages.
"""

import resource
import sys
from typing import Any

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
import tf_tree_py
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .spinning import spin_beside
from ..rows import DOCTOR, OURS, PLAIN, TF2_ROS
from ..worker import serve


class OurSubscriber:
    """``TransformListener``."""

    def __init__(self, node: Node) -> None:
        self._buffer = tf_tree_py.Buffer()
        self._listener = tf_tree_py.TransformListener(self._buffer, node)

    def received(self, transforms: int) -> float:
        """Return the number of inserted messages, each with this number of transforms."""
        return self._buffer.statistics().accepted / transforms


class DoctorsSubscriber(OurSubscriber):
    """The same, observed by a doctor."""

    def __init__(self, node: Node) -> None:
        super().__init__(node)
        self._buffer.observers.add(Doctor())


class PlainSubscriber:
    """A subscription whose callback only counts."""

    def __init__(self, node: Node) -> None:
        self._count = 0
        self._subscription = node.create_subscription(
            TFMessage, TF_TOPIC, self._receive, dynamic_qos())
        spin_beside(node)

    def _receive(self, _: TFMessage) -> None:
        self._count += 1

    def received(self, transforms: int) -> float:
        """Return the number of messages that arrived."""
        return self._count


class Tf2Subscriber:
    """tf2's own listener, if it is installed; its buffer does not count insertions."""

    def __init__(self, node: Node) -> None:
        import tf2_ros
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node, spin_thread=True)

    def received(self, transforms: int) -> None:
        """Return None."""


WAYS = {OURS: OurSubscriber, DOCTOR: DoctorsSubscriber, PLAIN: PlainSubscriber,
        TF2_ROS: Tf2Subscriber}


def usage(subscriber: Any, transforms: int) -> dict[str, float | None]:
    """Return the CPU time of this process, seconds, and the number of messages that arrived."""
    spent = resource.getrusage(resource.RUSAGE_SELF)
    return {'cpu_s': spent.ru_utime + spent.ru_stime, 'received': subscriber.received(transforms)}


def main() -> None:
    rclpy.init()
    node = Node('benchmark_subscriber')
    subscriber = WAYS[sys.argv[1]](node)
    serve({'usage': lambda transforms: usage(subscriber, transforms),
           'publishers': lambda: node.count_publishers(TF_TOPIC)})
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
