# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A publisher on /tf: ``python -m benchmark.processes.publisher``.

It sends bytes that were serialized beforehand, so that it keeps its rate.
"""

from collections.abc import Callable, Iterable
from itertools import cycle, islice
import random
import time
from typing import TypeVar

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from tf_tree_py.core import Sample
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import WireWriter, write
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    static_broadcaster_qos,
    TF_STATIC_TOPIC,
    TF_TOPIC,
)

from .. import motion, wire
from ..worker import serve

_Message = TypeVar('_Message')

# Messages that are prepared, and transforms in one of a crowd.
_PREPARED, _CROWD = 5000, 500


class Publisher:
    """Streams of transforms."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())
        self._sent_hz = 0.0

    def sent_hz(self) -> float:
        """Return the messages a second of the last ``send``, which a busy machine slows down."""
        return self._sent_hz

    def send(self, first: int, count: int, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, as precisely as the machine permits.

        :param first: number of the first sample.
        :param transforms: number per message.
        :return: the number of messages that were late by more than a period.
        """
        edges = motion.chain(transforms).edges
        messages = [wire.message_at(edges, first + number) for number in range(count)]
        begin = time.monotonic()
        late = keep_pace(self._publisher.publish, messages, rate_hz)
        self._sent_hz = (count - 1) / (time.monotonic() - begin)
        return late

    def send_now(self, seconds: float, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, stamped with the time at which they are sent.

        :return: the number that were late by more than a period.
        """
        edges = motion.chain(transforms).edges
        names = [(edge.parent, edge.child) for edge in edges]
        count = round(seconds * rate_hz)
        # Poses are prepared, so that the rate is kept; after a while they repeat.
        rows = [[pack_pose(*motion.pose_at(edge, edge.stamp_of(number))) for edge in edges]
                for number in range(min(count, _PREPARED))]
        writer = WireWriter()

        def publish(poses: list[bytes]) -> None:
            stamps = [time.time_ns()] * len(poses)
            self._publisher.publish(writer.write(Batch(names, stamps, poses)))

        return keep_pace(publish, islice(cycle(rows), count), rate_hz)

    def send_true(self, seconds: float, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, in which each edge of a chain has ``motion.steady_pose``.

        :return: the number that were late by more than a period.
        """
        edges = motion.chain(transforms).edges

        def publish(_: int) -> None:
            stamp = time.time_ns()
            self._publisher.publish(wire.message(
                edges, [stamp] * len(edges), [motion.steady_pose(stamp)] * len(edges)))

        return keep_pace(publish, range(round(seconds * rate_hz)), rate_hz)

    def send_crowd(self, seconds: float, frames: int, rate_hz: float) -> None:
        """Send many frames at a rate, half of them static, in messages of 500."""
        half, writer = frames // 2, WireWriter()
        static = self._node.create_publisher(TFMessage, TF_STATIC_TOPIC, static_broadcaster_qos())
        static.publish(write([Sample('map', f'static_{number}', 0, IDENTITY)
                              for number in range(half)]))
        names = [('map', f'moving_{number}') for number in range(half)]
        parts = [names[first:first + _CROWD] for first in range(0, half, _CROWD)]

        def publish(part: list[tuple[str, str]]) -> None:
            self._publisher.publish(writer.write(Batch(
                part, [time.time_ns()] * len(part), [pack_pose(*IDENTITY)] * len(part))))

        keep_pace(publish, islice(cycle(parts), round(seconds * rate_hz * len(parts))),
                  rate_hz * len(parts))

    def send_timed(self, count: int) -> None:
        """Send single transforms at intervals; their x is the time of sending."""
        edge = motion.chain(1).edges[0]
        for sample in range(count):
            time.sleep(random.uniform(0.005, 0.015))
            # The clock is the same for all processes of the machine.
            pose = (time.monotonic(), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            self._publisher.publish(wire.message([edge], [edge.stamp_of(sample)], [pose]))


def keep_pace(publish: Callable[[_Message], None], messages: Iterable[_Message],
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
    serve({verb: getattr(publisher, verb) for verb in (
        'send', 'sent_hz', 'send_crowd', 'send_now', 'send_true', 'send_timed')})
    rclpy.try_shutdown()
