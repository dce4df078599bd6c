# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A subscriber of joint states: ``python -m benchmark.processes.joint_subscriber WAY FREQUENCY``.

WAY is ours (urdf_broadcaster on a chain of joints, sending at most at FREQUENCY) or a
subscription with an empty callback. Both count the messages.
"""

import sys
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from tf_tree_py.nodes.urdf_broadcaster import UrdfBroadcaster
from tf_tree_py.ros.topics.qos import sensor_qos

from .spinning import spin_beside
from .subscriber import usage
from ..groups.joints import JOINTS
from ..rows import OURS
from ..worker import serve


class OurSubscriber(UrdfBroadcaster):
    """The node, with a message counter."""

    def __init__(self, frequency: float) -> None:
        self.count = 0
        super().__init__(parameter_overrides=[
            Parameter('robot_description', value=_chain()),
            Parameter('publish_frequency', value=frequency)])

    def _hear(self, message: JointState) -> None:
        super()._hear(message)
        self.count += 1


class PlainSubscriber(Node):
    """A subscription whose callback only counts."""

    def __init__(self) -> None:
        super().__init__('benchmark_plain')
        self.count = 0
        self.create_subscription(JointState, 'joint_states', self._hear, sensor_qos())

    def _hear(self, _: JointState) -> None:
        self.count += 1


class Count:
    """The count in the form that ``usage`` requires."""

    def __init__(self, subscriber: Any) -> None:
        self._subscriber = subscriber

    def received(self, _: int) -> int:
        """Return the number of messages that arrived."""
        return self._subscriber.count  # type: ignore[no-any-return]


def _chain() -> str:
    """Return the URDF of a serial chain of joints."""
    return '\n'.join([
        '<robot name="chain">', *(f'<link name="link_{number}"/>' for number in range(JOINTS + 1)),
        *(f'<joint name="joint_{number}" type="revolute"><parent link="link_{number}"/>'
          f'<child link="link_{number + 1}"/><origin xyz="0.1 0 0" rpy="0.1 0.2 0.3"/>'
          '<axis xyz="0 0 1"/></joint>' for number in range(JOINTS)), '</robot>'])


def main() -> None:
    rclpy.init()
    way, frequency = sys.argv[1:]
    subscriber = OurSubscriber(float(frequency)) if way == OURS else PlainSubscriber()
    spin_beside(subscriber)
    count = Count(subscriber)
    serve({'usage': lambda transforms: usage(count, transforms)})
    subscriber.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
