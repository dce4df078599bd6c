# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Three terminals: ros2 run tf_tree_py five_frame_publisher; python3 examples/detection_in_map.py;
#   ros2 topic pub /detection geometry_msgs/msg/PointStamped \
#     "{header: {stamp: now, frame_id: camera}, point: {x: 1.0}}"
"""Transforms points that a camera detected to the map, at the stamp of the image."""
from contextlib import suppress

from geometry_msgs.msg import PointStamped
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py import as_pose, Buffer, TransformException, TransformListener


class DetectionInMap(Node):

    def __init__(self):
        super().__init__('detection_in_map')
        self.buffer = Buffer(node=self)
        self.listener = TransformListener(self.buffer, self)
        self.publisher = self.create_publisher(PointStamped, 'detection_in_map', 10)
        self.create_subscription(PointStamped, 'detection', self.detected, 10)

    def detected(self, detection):
        header, p = detection.header, detection.point
        try:  # Wait: the transforms of this stamp may arrive later than the detection.
            map_T_camera = as_pose(self.buffer.lookup_transform(
                'world', header.frame_id, header.stamp, timeout=Duration(seconds=0.5)))
        except TransformException as error:
            return self.get_logger().warning(f'Detection lost: {error}')
        header.frame_id = 'world'
        p.x, p.y, p.z = map_T_camera @ (p.x, p.y, p.z)
        self.publisher.publish(detection)
        self.get_logger().info(f'Detection at ({p.x:.3f}, {p.y:.3f}, {p.z:.3f}) in the world')


with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    rclpy.init()
    rclpy.spin(DetectionInMap())
