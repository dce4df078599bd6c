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

"""A gyroscope's topic, which tells the rotation of an edge between its poses."""

from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import so3

from .qos import sensor_qos
from .side_topics import SideTopics
from ..buffer.buffer import Buffer
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..messages.convert import as_nanoseconds

# A second of a fast gyroscope: on a busy machine the thread may have to wait that long.
_DEPTH = 1000
# How often a message that cannot be used is logged.
_PERIOD_S = 10.0


class GyroListener:
    """
    Aids an edge with the angular velocities of an ``Imu`` topic; see ``BufferCore.aid``.

    It reads in a thread of its own, on a small node beside yours. The buffer has to
    know where the sensor is mounted in the child frame. It lives until it is let go or
    ``close()``; it is a context manager.
    """

    def __init__(self, buffer: Buffer, node: Node, child: str, topic: str = 'imu', *,
                 qos: QoSProfile | int | None = None) -> None:
        """
        Begin to listen.

        :param buffer: what to fill.
        :param node: whose names and remappings to use.
        :param child: the child frame of the edge, such as ``base_link`` of odom ->
            base_link, which carries the sensor and whose parent does not turn.
        :param topic: of type ``sensor_msgs/Imu``.
        :param qos: best effort unless given, which matches every publisher.
        :raises TypeError: another buffer than ours, such as tf2's.
        """
        check_is_ours(buffer, Buffer, 'GyroListener')
        check_places('GyroListener(buffer, node, child)', node=node)
        self._topics = SideTopics(self, node, 'gyro_listener_impl')
        aid = _Aid(buffer, node, child.removeprefix('/'))
        self._topics.subscribe(Imu, topic, aid.take, qos or sensor_qos(_DEPTH))

    def close(self) -> None:
        """Stop listening; what is in the buffer stays there."""
        self._topics.close()

    def __enter__(self) -> 'GyroListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Aid:
    """Turns angular velocities into the axes of an edge's child."""

    def __init__(self, buffer: Buffer, node: Node, child: str) -> None:
        self._buffer = buffer
        self._logger = node.get_logger()
        self._child = child

    def take(self, message: Imu) -> None:
        """Take a message of the topic."""
        rate = message.angular_velocity
        try:
            if message.angular_velocity_covariance[0] == -1.0:
                return  # that is how an Imu message says that it has no angular velocity
            mounted = self._buffer.lookup(
                self._child, message.header.frame_id.removeprefix('/'))
            turned = so3.rotate(mounted.rotation, (rate.x, rate.y, rate.z))
            self._buffer.aid(self._child, [as_nanoseconds(message.header.stamp)], [turned])
        except TransformException as error:
            self._logger.warning(f'A message of the gyroscope is lost: {error}',
                                 throttle_duration_sec=_PERIOD_S)
