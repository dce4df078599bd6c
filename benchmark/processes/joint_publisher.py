# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A publisher of joint states: ``python -m benchmark.processes.joint_publisher``.

It sends bytes that were serialized beforehand, so that it keeps its rate.
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
        Send messages at a rate, as precisely as the machine permits.

        :param first: number of the first message.
        :param transforms: number of joints per message.
        :return: the number of messages that were late by more than a period.
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
