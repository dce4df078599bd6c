# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Covariances of edges, from the topics that contain them: odometries and localisations."""

from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf_tree_py.beyond.uncertainty.insertion import (
    Covariances,
    Edge,
    EdgeEstimate,
    not_moved,
    STATIC_COVARIANCE_TOPIC,
    take_estimate,
)
from tf_tree_py.core.messages.incidents import Incident

from .qos import sensor_qos, static_listener_qos
from .side_topics import SideTopics
from ..buffer.buffer import Buffer
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..messages.convert import as_nanoseconds, as_pose, time_message

_TYPE_NAMES = {Odometry: 'nav_msgs/msg/Odometry',
               PoseWithCovarianceStamped: 'geometry_msgs/msg/PoseWithCovarianceStamped'}
# How long the transform from the pose's frame to the edge's child may be missing.
_PATIENCE = Duration(seconds=5.0)


class CovarianceListener:
    """
    A listener that fills a buffer with the covariances of edges whose poses come from ``/tf``.

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
        check_is_ours(buffer, Buffer, 'CovarianceListener')
        check_places('CovarianceListener(buffer, node)', node=node)
        self._buffer = buffer
        self._topics = SideTopics(self, node, 'covariance_listener_impl')
        self.subscribe(Odometry, static_topic, qos=static_listener_qos())

    def subscribe(self, msg_type: type, topic: str, *, child: str | None = None,
                  edge: Edge | None = None, with_poses: bool = False, planar: bool = False,
                  qos: QoSProfile | int | None = None) -> None:
        """
        Read the covariances of a topic for an edge.

        :param msg_type: ``Odometry`` or ``PoseWithCovarianceStamped``.
        :param child: the frame of the pose; for it, ``edge``, ``with_poses`` and ``planar`` see
            ``Covariances``.
        :param qos: best effort unless given, which matches every publisher.
        :raises ValueError: arguments that contradict each other.
        """
        rules = Covariances(child, edge, with_poses, planar)
        rules.check_type(_TYPE_NAMES.get(msg_type, repr(msg_type)))
        source = _Source(self._buffer, topic, rules)
        source.authority = self._topics.subscribe(
            msg_type, topic, source.take, qos or sensor_qos())

    def close(self) -> None:
        """Stop listening; the contents of the buffer stay."""
        self._topics.close()

    def __enter__(self) -> 'CovarianceListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Source:
    """One topic and the edge of its covariances."""

    def __init__(self, buffer: Buffer, topic: str, rules: Covariances) -> None:
        self.authority = topic
        self._buffer = buffer
        self._rules = rules

    def take(self, message: Any) -> None:
        """Store a message of the topic."""
        estimate = self._rules.judged(_as_estimate(message), self.authority)
        if isinstance(estimate, Incident):
            self._buffer.feeds.refuse(estimate)
            return
        carrier = self._rules.carrier(estimate)
        if carrier is None:
            self._store(estimate)
        else:
            self._store_moved(estimate, carrier)

    def _store(self, estimate: EdgeEstimate) -> None:
        self._buffer.feeds.note(take_estimate(
            self._buffer.intake, estimate, self._rules.with_poses, self.authority))

    def _store_moved(self, estimate: EdgeEstimate, carrier: str) -> None:
        """Store an estimate for an edge above its frame, once the transform to it is available."""
        def store(future: Any) -> None:
            if future.cancelled() or future.exception() is not None:
                self._buffer.feeds.refuse(
                    not_moved(estimate, carrier, future.exception(), self.authority))
            else:
                self._store(estimate.of(carrier, as_pose(future.result())))

        self._buffer.wait_for_transform_async(
            estimate.child, carrier, time_message(estimate.stamp),
            _PATIENCE).add_done_callback(store)


def _as_estimate(message: Any) -> EdgeEstimate:
    """Return the estimate in an Odometry or a PoseWithCovarianceStamped."""
    t, q = message.pose.pose.position, message.pose.pose.orientation
    return EdgeEstimate(message.header.frame_id, getattr(message, 'child_frame_id', ''),
                        as_nanoseconds(message.header.stamp), (t.x, t.y, t.z, q.x, q.y, q.z, q.w),
                        message.pose.covariance)
