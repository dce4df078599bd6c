# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A publisher on /tf: ``python -m benchmark.processes.publisher``.

It sends bytes that were serialized beforehand, so that it keeps its rate.
"""

from collections.abc import Callable, Sequence
import random
import time
from typing import TypeVar

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import WireWriter
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .. import motion, wire
from ..worker import serve

_Message = TypeVar('_Message')


class Publisher:
    """Streams of transforms."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())

    def send(self, first: int, count: int, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, as precisely as the machine permits.

        :param first: number of the first sample.
        :param transforms: number per message.
        :return: the number of messages that were late by more than a period.
        """
        edges = motion.chain(transforms).edges
        messages = [wire.message_at(edges, first + number) for number in range(count)]
        return keep_pace(self._publisher.publish, messages, rate_hz)

    def send_now(self, seconds: float, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, stamped with the time at which they are sent.

        :return: the number that were late by more than a period.
        """
        edges = motion.chain(transforms).edges
        names = [(edge.parent, edge.child) for edge in edges]
        rows = [[pack_pose(*motion.pose_at(edge, edge.stamp_of(number))) for edge in edges]
                for number in range(round(seconds * rate_hz))]
        writer = WireWriter()

        def publish(poses: list[bytes]) -> None:
            stamps = [time.time_ns()] * len(poses)
            self._publisher.publish(writer.write(Batch(names, stamps, poses)))

        return keep_pace(publish, rows, rate_hz)

    def send_timed(self, count: int) -> None:
        """Send single transforms at intervals; their x is the time of sending."""
        edge = motion.chain(1).edges[0]
        for sample in range(count):
            time.sleep(random.uniform(0.005, 0.015))
            # The clock is the same for all processes of the machine.
            pose = (time.monotonic(), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            self._publisher.publish(wire.message([edge], [edge.stamp_of(sample)], [pose]))


def keep_pace(publish: Callable[[_Message], None], messages: Sequence[_Message],
              rate_hz: float) -> int:
    """Publish at a rate; return how many were late by more than a period."""
    begin, late = time.monotonic(), 0
    for number, message in enumerate(messages):
        ahead = begin + number / rate_hz - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        late += ahead < -1.0 / rate_hz
        publish(message)
    return late


if __name__ == '__main__':
    rclpy.init()
    publisher = Publisher(Node('benchmark_publisher'))
    serve({'send': publisher.send, 'send_now': publisher.send_now,
           'send_timed': publisher.send_timed})
    rclpy.try_shutdown()
