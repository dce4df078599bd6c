# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The arm's node: sends joint states, images and clock over DDS, and grasps to the arm."""

from array import array
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Header
from tf_tree_py import as_nanoseconds, as_pose, time_message

from .wire import Grasp, Hello, Picture, State


class ArmNode(Node):
    """
    Publishes the messages from the pipe, and writes grasps to it.

    All stamps are times of the simulation.
    """

    def __init__(self, hello: Hello, pipe: Connection) -> None:
        super().__init__('arm')
        self._pipe = pipe
        self._intrinsics = hello.intrinsics
        self._clock_topic = self.create_publisher(Clock, 'clock', 10)
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._color = self.create_publisher(Image, 'camera/color', 10)
        self._depth = self.create_publisher(Image, 'camera/depth', 10)
        self._info = self.create_publisher(CameraInfo, 'camera/info', 10)
        self.create_subscription(TransformStamped, 'grasp', self._grasp, 10)

    def everybody_is_there(self) -> bool:
        """Return whether the broadcaster and perception are connected."""
        return bool(self._joints.get_subscription_count()
                    and all(topic.get_subscription_count()
                            for topic in (self._color, self._depth, self._info))
                    and self.count_publishers('grasp') and self.count_publishers('tf'))

    def publish(self, message: State | Picture) -> None:
        """Publish a message from the arm."""
        stamp = time_message(message.stamp)
        if isinstance(message, State):
            self._clock_topic.publish(Clock(clock=stamp))
            self._joints.publish(JointState(
                header=Header(stamp=stamp), name=list(message.positions),
                position=array('d', message.positions.values())))
            return
        header = Header(stamp=stamp, frame_id='camera')
        self._color.publish(self._image(header, 'rgb8', message.color))
        self._depth.publish(self._image(header, '32FC1', message.depth))
        focal, (cx, cy) = self._intrinsics.focal, self._intrinsics.center
        self._info.publish(CameraInfo(
            header=header, width=self._intrinsics.width, height=self._intrinsics.height,
            k=[focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0]))

    def _image(self, header: Header, encoding: str, data: bytes) -> Any:
        return Image(header=header, encoding=encoding, width=self._intrinsics.width,
                     height=self._intrinsics.height, step=len(data) // self._intrinsics.height,
                     data=array('B', data))

    def _grasp(self, message: TransformStamped) -> None:
        with suppress(OSError):  # the arm may have ended
            self._pipe.send(Grasp(as_nanoseconds(message.header.stamp), as_pose(message)))
