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

# Two terminals: ros2 run tf_tree_py five_frame_publisher;
# python3 examples/points_with_transforms.py;
# and something that publishes geometry_msgs/msg/PointStamped on detection, with its stamp.
"""Calls back with a point and the transform that was found for it, or tells why there is none."""
from contextlib import suppress

from geometry_msgs.msg import PointStamped
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py import as_pose, Buffer, MessageFilter, TransformListener


class PointsWithTransforms(Node):

    def __init__(self):
        super().__init__('points_with_transforms')
        self.buffer = Buffer(node=self)
        self.listener = TransformListener(self.buffer, self)
        self.filter = MessageFilter(
            self.buffer, self, 'world', self.take, timeout=Duration(seconds=1.0),
            on_drop=lambda point, drop, why: self.get_logger().warning(f'{drop.name}: {why}'))
        self.filter.subscribe(PointStamped, 'detection')

    def take(self, message, world_T_sensor):
        p = message.point
        x, y, z = as_pose(world_T_sensor) @ (p.x, p.y, p.z)
        self.get_logger().info(f'Point at ({x:.3f}, {y:.3f}, {z:.3f}) in the world')


with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    rclpy.init()
    rclpy.spin(PointsWithTransforms())
