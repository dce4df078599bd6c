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
A publisher on /tf: ``python -m benchmark.processes.publisher``.

It sends bytes that were made beforehand, so that it keeps its pace.
"""

from collections.abc import Callable, Sequence
import random
import time

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .. import motion, wire
from ..worker import serve


class Publisher:
    """Streams of transforms."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())

    def send(self, first: int, count: int, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, as nearly as the machine lets it.

        :param first: number of the first sample.
        :param transforms: in each message.
        :return: how many messages were late by more than a period.
        """
        edges = motion.chain(transforms).edges
        messages = [wire.message_at(edges, first + number) for number in range(count)]
        return keep_pace(self._publisher.publish, messages, rate_hz)

    def send_timed(self, count: int) -> None:
        """Send single transforms whose x is the time of sending, now and then."""
        edge = motion.chain(1).edges[0]
        for sample in range(count):
            time.sleep(random.uniform(0.005, 0.015))
            # The clock is the whole machine's.
            pose = (time.monotonic(), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
            self._publisher.publish(wire.message([edge], [edge.stamp_of(sample)], [pose]))


def keep_pace(publish: Callable[[bytes], None], messages: Sequence[bytes], rate_hz: float) -> int:
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
    serve({'send': publisher.send, 'send_timed': publisher.send_timed})
    rclpy.try_shutdown()
