# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Topics in addition to /tf whose messages go to a buffer, read in a separate thread.

Odometries and localisations contain covariances of edges; a gyroscope's topic supplies the
rotation of an edge between its poses.
"""

from collections.abc import Callable
import math
from typing import Any
import weakref

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.task import Future
from sensor_msgs.msg import Imu
from tf_tree_py.beyond.uncertainty.insertion import (
    Covariances,
    Edge,
    EdgeEstimate,
    estimate_in,
    insert_estimate,
    not_moved,
    STATIC_COVARIANCE_TOPIC,
)
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.limited_log import LimitedLog

from .qos import mismatches, sensor_qos, static_listener_qos
from ..buffer.buffer import Buffer
from ..buffer.interface import check_is_ours, check_places
from ..messages.convert import as_nanoseconds, as_pose, time_message
from ..threads.internal_node import internal_node
from ..threads.receiver import Receiver


class SideTopics:
    """
    Reads topics in one daemon thread, on a small node in addition to the user's.

    It lives as long as its owner, or until ``close()``. The user's node need not be spun.

    :ivar log: of what is wrong with what arrives.
    """

    def __init__(self, owner: object, node: Node, name: str, log: LimitedLog | None = None,
                 on_end: Callable[[], object] = lambda: None) -> None:
        """
        Begin without topics.

        :param owner: when it is garbage collected, the thread ends; no callback may keep it alive.
        :param node: supplies the names and remappings.
        :param log: see above; None: the node's.
        :param on_end: the thread calls it last.
        """
        self._node = node
        self._home = internal_node(node, name, with_clock=False)
        self.log = log or LimitedLog(node.get_logger().warning)
        self._receiver = Receiver(self._home, on_end, write_counts=self.log.write_counts)
        self._subscriptions: list[Subscription] = []
        weakref.finalize(owner, self._receiver.stop)

    def subscribe(self, msg_type: type, topic: str, callback: Callable[[Any], None],
                  qos: QoSProfile | int) -> str:
        """Call back with every message of a topic; return the topic's full name."""
        name = self._node.resolve_topic_name(topic)
        self._subscriptions.append(self._home.create_subscription(
            msg_type, name, callback, qos, event_callbacks=mismatches(name, self.log)))
        self._receiver.wake()
        return name

    def close(self) -> None:
        """Stop reading."""
        self._receiver.close()


class _Listener(Closable):
    """A listener that fills a buffer from side topics; a context manager, which closes it."""

    def __init__(self, buffer: Buffer, node: Node, usage: str, name: str,
                 log: LimitedLog | None = None) -> None:
        """
        Begin without topics.

        :param usage: how it is made, for errors, such as ``GyroListener(buffer, node, child)``.
        :param name: of its small node.
        :param log: as for ``SideTopics``.
        :raises TypeError: a buffer of another library, such as tf2's.
        :raises SharedTreeException: the buffer shows the tree of another process.
        """
        check_is_ours(buffer, Buffer, type(self).__name__)
        check_places(usage, node=node)
        buffer.check_receives(usage)
        self._topics = SideTopics(self, node, name, log, buffer.feeds.end_side_listener)
        buffer.feeds.begin_side_listener()

    def close(self) -> None:
        """Stop listening; the contents of the buffer stay."""
        self._topics.close()


# --- covariances

_TYPE_NAMES = {Odometry: 'nav_msgs/msg/Odometry',
               PoseWithCovarianceStamped: 'geometry_msgs/msg/PoseWithCovarianceStamped'}
# How long the transform from the pose's frame to the edge's child may be missing.
_PATIENCE = Duration(seconds=5.0)


class CovarianceListener(_Listener):
    """
    A listener that fills a buffer with the covariances of edges.

    The poses of these edges come from ``/tf``, or from the same messages, by
    ``TransformListener.subscribe``.

    It reads in its own thread, on a small node in addition to the user's. It always subscribes to
    the covariances of static edges that ``static_transform_publisher`` publishes; ``subscribe``
    adds topics. It lives until it is garbage collected or until ``close()``; it is a context
    manager.
    """

    def __init__(self, buffer: Buffer, node: Node, *,
                 static_topic: str = STATIC_COVARIANCE_TOPIC) -> None:
        """
        Subscribe to the covariances of static edges.

        :param buffer: the buffer to fill.
        :param node: supplies the names and remappings.
        :param static_topic: the topic of these, as Odometry for their two frames.
        :raises TypeError: a buffer of another library, such as tf2's.
        """
        super().__init__(buffer, node, 'CovarianceListener(buffer, node)',
                         'covariance_listener_impl', buffer.feeds.log)
        self._buffer = buffer
        self.subscribe(Odometry, static_topic, qos=static_listener_qos())

    def subscribe(self, msg_type: type, topic: str, *, child: str | None = None,
                  edge: Edge | None = None, planar: bool = False,
                  qos: QoSProfile | int | None = None) -> None:
        """
        Read the covariances of a topic for an edge.

        :param msg_type: ``Odometry`` or ``PoseWithCovarianceStamped``.
        :param child: the frame of the pose; for it, ``edge`` and ``planar`` see ``Covariances``.
        :param qos: best effort unless given, which matches every publisher.
        :raises ValueError: arguments that contradict each other.
        """
        rules = Covariances(child, edge, planar=planar)
        rules.check_type(_TYPE_NAMES.get(msg_type, repr(msg_type)))
        covariances = _CovarianceTopic(self._buffer, topic, rules)
        covariances.authority = self._topics.subscribe(
            msg_type, topic, covariances.receive, qos or sensor_qos())


class _CovarianceTopic:
    """One topic and the edge of its covariances."""

    def __init__(self, buffer: Buffer, topic: str, rules: Covariances) -> None:
        self.authority = topic
        self._buffer = buffer
        self._rules = rules

    def receive(self, message: Odometry | PoseWithCovarianceStamped) -> None:
        """Store a message of the topic."""
        estimate = self._rules.judged(estimate_in(message), self.authority)
        if isinstance(estimate, Incident):
            self._buffer.feeds.refuse(estimate)
            return
        carrier = self._rules.carrier(estimate)
        if carrier is None:
            self._store(estimate)
        else:
            self._store_moved(estimate, carrier)

    def _store(self, estimate: EdgeEstimate) -> None:
        self._buffer.feeds.note(insert_estimate(
            self._buffer.intake, estimate, self.authority))

    def _store_moved(self, estimate: EdgeEstimate, carrier: str) -> None:
        """Store an estimate for an edge above its frame, once the transform to it is available."""
        def store(future: Future) -> None:
            if future.cancelled() or future.exception() is not None:
                self._buffer.feeds.refuse(
                    not_moved(estimate, carrier, future.exception(), self.authority))
            else:
                self._store(estimate.of(carrier, as_pose(future.result())))

        self._buffer.wait_for_transform_async(
            estimate.child, carrier, time_message(estimate.stamp),
            _PATIENCE).add_done_callback(store)


# --- gyroscopes

# A second of a fast gyroscope: on a busy machine the thread may be delayed that long.
_DEPTH = 1000


class GyroListener(_Listener):
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
        :param max_gap: a longer time between two messages is a gap, see ``Buffer.aid``; None:
            five of its usual periods.
        :param saturation: the largest rate about one of the sensor's axes that it can measure,
            radians a second; a sample that reaches it is a gap, too.
        :raises TypeError: a buffer of another library, such as tf2's.
        :raises ValueError: limits that are not positive.
        """
        gap = None if max_gap is None else as_nanoseconds(max_gap)
        if gap is not None and gap <= 0 or not saturation > 0.0:
            raise ValueError(
                f'max_gap={max_gap} and saturation={saturation!r} have to be positive')
        super().__init__(buffer, node, 'GyroListener(buffer, node, child)', 'gyro_listener_impl')
        aid = _Aid(buffer, child.removeprefix('/'), gap, saturation, self._topics.log)
        aid.topic = self._topics.subscribe(Imu, topic, aid.receive, qos or sensor_qos(_DEPTH))


class _Aid:
    """Rotates angular velocities into the axes of an edge's child."""

    def __init__(self, buffer: Buffer, child: str, max_gap: int | None,
                 saturation: float, log: LimitedLog) -> None:
        self.topic = ''
        self._log = log
        self._buffer = buffer
        self._max_gap, self._saturation = max_gap, saturation
        self._child = child

    def receive(self, message: Imu) -> None:
        """Store a message of the topic."""
        rate = message.angular_velocity
        try:
            if message.angular_velocity_covariance[0] == -1.0:
                return  # -1 marks an Imu message without an angular velocity
            mounted = self._buffer.lookup(self._child, message.header.frame_id.removeprefix('/'))
            turned = so3.rotate(mounted.rotation, (rate.x, rate.y, rate.z))
            # The sensor's axes saturate, and the child's may be rotated relative to them.
            reached = max(abs(rate.x), abs(rate.y), abs(rate.z)) >= self._saturation
            self._buffer.aid(
                self._child, [as_nanoseconds(message.header.stamp)], [turned],
                max_gap=self._max_gap,
                saturation=max(map(abs, turned)) if reached else math.inf)
        except TransformException as error:
            self._log.write(
                f'unusable angular velocity, {type(error).__name__}', self.topic,
                f'A message of the gyroscope cannot be used: {error}', str(error))
