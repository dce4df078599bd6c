# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope's topic, which supplies the rotation of an edge between its poses."""

import math

from rclpy.duration import Duration
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

# A second of a fast gyroscope: on a busy machine the thread may be delayed that long.
_DEPTH = 1000
# How often a message that cannot be used is logged.
_PERIOD_S = 10.0


class GyroListener:
    """
    A listener that aids an edge with the angular velocities of an ``Imu`` topic.

    See ``BufferCore.aid``. It reads in its own thread, on a small node in addition to the user's.
    The buffer needs the pose of the sensor in the child frame. It lives until it is garbage
    collected or until ``close()``; it is a context manager.
    """

    def __init__(self, buffer: Buffer, node: Node, child: str, topic: str = 'imu', *,
                 qos: QoSProfile | int | None = None, max_gap: Duration | None = None,
                 saturation: float = math.inf) -> None:
        """
        Begin to listen.

        :param buffer: the buffer to fill.
        :param node: supplies the names and remappings.
        :param child: the child frame of the edge, such as ``base_link`` of odom -> base_link. It
            carries the sensor, and its parent must not rotate.
        :param topic: of type ``sensor_msgs/Imu``.
        :param qos: best effort unless given, which matches every publisher.
        :param max_gap: a longer time between two messages is a gap, in which poses are
            interpolated as without a gyroscope; None: five of its usual periods.
        :param saturation: the largest rate about one of the sensor's axes that it can measure,
            radians a second; a sample that reaches it is a gap, too.
        :raises TypeError: a buffer of another library, such as tf2's.
        :raises ValueError: limits that are not positive.
        """
        check_is_ours(buffer, Buffer, 'GyroListener')
        check_places('GyroListener(buffer, node, child)', node=node)
        gap = None if max_gap is None else as_nanoseconds(max_gap)
        if gap is not None and gap <= 0 or not saturation > 0.0:
            raise ValueError(
                f'max_gap={max_gap} and saturation={saturation!r} have to be positive')
        self._topics = SideTopics(self, node, 'gyro_listener_impl')
        aid = _Aid(buffer, node, child.removeprefix('/'), gap, saturation)
        self._topics.subscribe(Imu, topic, aid.take, qos or sensor_qos(_DEPTH))

    def close(self) -> None:
        """Stop listening; the contents of the buffer stay."""
        self._topics.close()

    def __enter__(self) -> 'GyroListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Aid:
    """Rotates angular velocities into the axes of an edge's child."""

    def __init__(self, buffer: Buffer, node: Node, child: str, max_gap: int | None,
                 saturation: float) -> None:
        self._buffer = buffer
        self._max_gap, self._saturation = max_gap, saturation
        self._logger = node.get_logger()
        self._child = child

    def take(self, message: Imu) -> None:
        """Store a message of the topic."""
        rate = message.angular_velocity
        try:
            if message.angular_velocity_covariance[0] == -1.0:
                return  # -1 marks an Imu message without an angular velocity
            mounted = self._buffer.lookup(
                self._child, message.header.frame_id.removeprefix('/'))
            turned = so3.rotate(mounted.rotation, (rate.x, rate.y, rate.z))
            # The sensor's axes saturate, and the child's may be rotated relative to them.
            reached = max(abs(rate.x), abs(rate.y), abs(rate.z)) >= self._saturation
            self._buffer.aid(
                self._child, [as_nanoseconds(message.header.stamp)], [turned],
                max_gap=self._max_gap,
                saturation=max(map(abs, turned)) if reached else math.inf)
        except TransformException as error:
            self._logger.warning(f'A message of the gyroscope cannot be used: {error}',
                                 throttle_duration_sec=_PERIOD_S)
