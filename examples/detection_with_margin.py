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

# Terminals: ros2 run tf_tree_py five_frame_publisher; python3 examples/detection_with_margin.py;
# Odometry with covariances on odometry, and a camera's PoseWithCovarianceStamped on detection.
"""Takes uncertain detections to the world, with what the way there may be off, for a planner."""
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
        margin = 3.0 * np.sqrt(np.linalg.eigvalsh(floor)[-1])  # three sigma, the worst way
        self.get_logger().info(f'Keep {margin:.3f} m more away from it')


with suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    rclpy.init()
    rclpy.spin(DetectionWithMargin())
