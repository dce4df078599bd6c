# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Two terminals: ros2 run tf_tree_py five_frame_publisher;
# python3 examples/points_with_transforms.py;
# and something that publishes geometry_msgs/msg/PointStamped on detection, with its stamp.
"""Receives points together with their transforms, or logs why a transform is missing."""
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
            self.buffer, self, 'world', self.receive, timeout=Duration(seconds=1.0),
            on_drop=lambda point, drop, why: self.get_logger().warning(f'{drop.name}: {why}'))
        self.filter.subscribe(PointStamped, 'detection')

    def receive(self, message, world_T_sensor):
        p = message.point
        x, y, z = as_pose(world_T_sensor) @ (p.x, p.y, p.z)
        self.get_logger().info(f'Point at ({x:.3f}, {y:.3f}, {z:.3f}) in the world')


with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    rclpy.init()
    rclpy.spin(PointsWithTransforms())
