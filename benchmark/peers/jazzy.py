# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Jazzy's own tf2: the C++ buffer with its binding, and the Python code that calls it."""

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.time import Time
import tf2_py
import tf2_ros

from .cpp import CppBuffer
from .messages import transform_stamped
from .. import motion
from ..motion import Robot


class JazzyBuffer(CppBuffer):
    """``tf2_py.BufferCore`` of ROS 2."""

    def __init__(self) -> None:
        super().__init__(tf2_py)

    def duration(self, seconds: float) -> Duration:
        """Return a duration of rclpy."""
        return Duration(seconds=seconds)

    def message(self, edge: motion.Edge, stamp: int, pose: motion.Pose) -> TransformStamped:
        """Return a transform as a message."""
        return transform_stamped(edge, stamp, pose)

    def time(self, stamp: int) -> Time:
        """Return a time of rclpy."""
        return Time(nanoseconds=stamp)


class Tf2RosBuffer(JazzyBuffer):
    """``tf2_ros.Buffer``, as a Python node calls it; also calls ``can_transform``."""

    def reset(self, robot: Robot, history_s: float) -> None:
        """Start again with an empty buffer."""
        super().reset(robot, history_s)
        self.buffer = tf2_ros.Buffer(self.duration(history_s))
        self.lookup = self.buffer.lookup_transform
