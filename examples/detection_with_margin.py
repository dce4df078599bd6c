# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

# Terminals: ros2 run tf_tree_py five_frame_publisher; python3 examples/detection_with_margin.py;
# Odometry with covariances on odometry, and a camera's PoseWithCovarianceStamped on detection.
"""Transforms uncertain detections to the world, including the uncertainty of the transform."""
from contextlib import suppress

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from tf_tree_py import Buffer, CovarianceListener, TransformException, TransformListener


class DetectionWithMargin(Node):

    def __init__(self):
        super().__init__('detection_with_margin')
        self.buffer = Buffer(node=self)
        self.listener = TransformListener(self.buffer, self)
        self.covariances = CovarianceListener(self.buffer, self)
        self.covariances.subscribe(Odometry, 'odometry', planar=True)
        self.publisher = self.create_publisher(PoseWithCovarianceStamped, 'detection_found', 10)
        self.create_subscription(PoseWithCovarianceStamped, 'detection', self.detected, 10)

    def detected(self, detection):
        try:
            found = self.buffer.transform(
                detection, 'world', timeout=Duration(seconds=0.5), uncertain=True)
        except TransformException as error:
            return self.get_logger().warning(f'Detection lost: {error}')
        self.publisher.publish(found)
        floor = np.reshape(found.pose.covariance, (6, 6))[:2, :2]
        margin = 3.0 * np.sqrt(np.linalg.eigvalsh(floor)[-1])  # three sigma, worst direction
        self.get_logger().info(f'Keep {margin:.3f} m more away from it')


with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    rclpy.init()
    rclpy.spin(DetectionWithMargin())
