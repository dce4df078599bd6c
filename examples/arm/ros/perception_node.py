# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Perception as a node: detects the block in the camera's frame, and sends its pose in the world.

An image waits in a ``MessageFilter`` until the tree reaches its stamp. The callback receives
both, and its result is correct at any delay.
"""

import sys
from typing import Any

from geometry_msgs.msg import TransformStamped
import numpy as np
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image as ImageMessage
from tf_tree_py import (
    as_nanoseconds,
    as_pose,
    Buffer,
    MessageFilter,
    transform_stamped,
    TransformListener,
)
from tf_tree_py.nodes.running import run, spin

from ..image import Image, Intrinsics
from ..perception import find_block

_KEPT = 10


class PerceptionNode(Node):
    """Publishes the pose of the block in the world for each image that shows the block."""

    def __init__(self) -> None:
        super().__init__('perception', parameter_overrides=[Parameter('use_sim_time', value=True)])
        self.buffer = Buffer(node=self)
        self.listener = TransformListener(self.buffer, self)
        self.filter = MessageFilter(self.buffer, self, 'world', self.seen,
                                    header_of=lambda shot: shot['color'].header)
        self.grasps = self.create_publisher(TransformStamped, 'grasp', 10)
        self._shots: dict[int, dict[str, Any]] = {}
        for part, msg_type in (('color', ImageMessage), ('depth', ImageMessage),
                               ('info', CameraInfo)):
            self.create_subscription(
                msg_type, f'camera/{part}',
                lambda message, part=part: self.collect(part, message), 10)

    def collect(self, part: str, message: Any) -> None:
        """Collect the messages of one shot by their stamp."""
        stamp = as_nanoseconds(message.header.stamp)
        shot = self._shots.setdefault(stamp, {})
        shot[part] = message
        if len(shot) == 3:
            self.filter.add(self._shots.pop(stamp))
        while len(self._shots) > _KEPT:
            del self._shots[min(self._shots)]

    def seen(self, shot: dict[str, Any], transform: TransformStamped) -> None:
        """Detect the block in an image; publish its pose, with the camera's pose at that stamp."""
        camera_T_block = find_block(image_of(shot))
        if camera_T_block is None:
            return
        world_T_camera = as_pose(transform)
        self.grasps.publish(transform_stamped(
            'world', 'block', as_nanoseconds(transform.header.stamp),
            world_T_camera @ camera_T_block))


def image_of(shot: dict[str, Any]) -> Image:
    """Return the messages of one shot as an image."""
    color, depth, info = shot['color'], shot['depth'], shot['info']
    shape = info.height, info.width
    return Image(
        as_nanoseconds(color.header.stamp),
        np.frombuffer(color.data, dtype=np.uint8).reshape(*shape, 3),
        np.frombuffer(depth.data, dtype=np.float32).reshape(shape).astype(float),
        Intrinsics(info.width, info.height, info.k[0], (info.k[2], info.k[5])))


if __name__ == '__main__':
    sys.exit(run('perception', None, lambda ended: spin(PerceptionNode(), ended)))
