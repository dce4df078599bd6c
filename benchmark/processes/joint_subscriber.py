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
Who hears joint states: ``python -m benchmark.processes.joint_subscriber WAY FREQUENCY``.

WAY is ours, urdf_broadcaster on a chain of joints that sends no more often than FREQUENCY;
or a subscription with an empty callback. Both count what they hear.
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


class OurEar(UrdfBroadcaster):
    """The node, with a count."""

    def __init__(self, frequency: float) -> None:
        self.count = 0
        super().__init__(parameter_overrides=[
            Parameter('robot_description', value=_chain()),
            Parameter('publish_frequency', value=frequency)])

    def _hear(self, message: JointState) -> None:
        super()._hear(message)
        self.count += 1


class PlainEar(Node):
    """A subscription whose callback counts, and is otherwise empty."""

    def __init__(self) -> None:
        super().__init__('benchmark_plain')
        self.count = 0
        self.create_subscription(JointState, 'joint_states', self._hear, sensor_qos())

    def _hear(self, _: JointState) -> None:
        self.count += 1


class Count:
    """What ``usage`` asks for."""

    def __init__(self, ear: Any) -> None:
        self._ear = ear

    def received(self, _: int) -> int:
        """Return how many messages arrived."""
        return self._ear.count  # type: ignore[no-any-return]


def _chain() -> str:
    """Return a robot with its joints one on the other."""
    return '\n'.join([
        '<robot name="chain">', *(f'<link name="link_{number}"/>' for number in range(JOINTS + 1)),
        *(f'<joint name="joint_{number}" type="revolute"><parent link="link_{number}"/>'
          f'<child link="link_{number + 1}"/><origin xyz="0.1 0 0" rpy="0.1 0.2 0.3"/>'
          '<axis xyz="0 0 1"/></joint>' for number in range(JOINTS)), '</robot>'])


def main() -> None:
    rclpy.init()
    way, frequency = sys.argv[1:]
    ear = OurEar(float(frequency)) if way == OURS else PlainEar()
    spin_beside(ear)
    count = Count(ear)
    serve({'usage': lambda transforms: usage(count, transforms)})
    ear.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
