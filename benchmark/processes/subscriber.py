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
Somebody who listens to /tf: ``python -m benchmark.processes.subscriber WAY``.

WAY is one of ``WAYS``. The main thread waits for commands, and costs nothing; the
listening is done by another thread.
"""

import resource
import sys
from typing import Any

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
import tf_tree_py
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .spinning import spin_beside
from ..rows import DOCTOR, OURS, PLAIN, TF2_ROS
from ..worker import serve


class OurEar:
    """``TransformListener``."""

    def __init__(self, node: Node) -> None:
        self._buffer = tf_tree_py.Buffer()
        self._listener = tf_tree_py.TransformListener(self._buffer, node)

    def received(self, transforms: int) -> float:
        """Return how many messages of so many transforms the buffer took."""
        return self._buffer.statistics().accepted / transforms


class DoctorsEar(OurEar):
    """The same, watched by a doctor."""

    def __init__(self, node: Node) -> None:
        super().__init__(node)
        self._buffer.observers.add(Doctor())


class PlainEar:
    """A subscription whose callback counts, and is otherwise empty."""

    def __init__(self, node: Node) -> None:
        self._count = 0
        self._subscription = node.create_subscription(
            TFMessage, TF_TOPIC, self._receive, dynamic_qos())
        spin_beside(node)

    def _receive(self, _: TFMessage) -> None:
        self._count += 1

    def received(self, transforms: int) -> float:
        """Return how many messages arrived."""
        return self._count


class Tf2Ear:
    """tf2's own listener, where it is installed; it does not count what its buffer takes."""

    def __init__(self, node: Node) -> None:
        import tf2_ros
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node, spin_thread=True)

    def received(self, transforms: int) -> None:
        """Return nothing."""


WAYS = {OURS: OurEar, DOCTOR: DoctorsEar, PLAIN: PlainEar, TF2_ROS: Tf2Ear}


def usage(ear: Any, transforms: int) -> dict[str, float | None]:
    """Return the seconds of CPU this process has had, and what has arrived."""
    spent = resource.getrusage(resource.RUSAGE_SELF)
    return {'cpu_s': spent.ru_utime + spent.ru_stime, 'received': ear.received(transforms)}


def main() -> None:
    rclpy.init()
    node = Node('benchmark_subscriber')
    ear = WAYS[sys.argv[1]](node)
    serve({'usage': lambda transforms: usage(ear, transforms),
           'publishers': lambda: node.count_publishers(TF_TOPIC)})
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
