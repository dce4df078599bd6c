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
A publisher of joint states: ``python -m benchmark.processes.joint_publisher``.

It sends bytes that were made beforehand, so that it keeps its pace.
"""

import math

import rclpy
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.ros.messages.convert import time_message

from .publisher import keep_pace
from ..motion import START
from ..worker import serve


class JointPublisher:
    """Streams of joint states."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(JointState, 'joint_states', 10)

    def send(self, first: int, count: int, transforms: int, rate_hz: float) -> int:
        """
        Send messages at a rate, as nearly as the machine lets it.

        :param first: number of the first.
        :param transforms: how many joints are in each.
        :return: how many messages were late by more than a period.
        """
        message = JointState(name=[f'joint_{number}' for number in range(transforms)])
        messages = []
        for number in range(first, first + count):
            message.header.stamp = time_message(
                START + round(number * NANOSECONDS_PER_SECOND / rate_hz))
            message.position = [math.sin(0.01 * number + joint) for joint in range(transforms)]
            messages.append(serialize_message(message))
        return keep_pace(self._publisher.publish, messages, rate_hz)


if __name__ == '__main__':
    rclpy.init()
    serve({'send': JointPublisher(Node('benchmark_joints')).send})
    rclpy.try_shutdown()
