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

"""Covariances of edges, from the topics that have them: odometries and localisations."""

from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf_tree_py.core.arrivals.estimate import (
    Covariances,
    Edge,
    Estimate,
    not_moved,
    STATIC_COVARIANCE_TOPIC,
)
from tf_tree_py.core.arrivals.incidents import Incident

from .qos import sensor_qos, static_listener_qos
from .side_topics import SideTopics
from ..buffer.buffer import Buffer
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..messages.convert import as_nanoseconds, as_pose, time_message

_TYPE_NAMES = {Odometry: 'nav_msgs/msg/Odometry',
               PoseWithCovarianceStamped: 'geometry_msgs/msg/PoseWithCovarianceStamped'}
# How long the way from the pose's frame to the edge's child may take to be known.
_PATIENCE = Duration(seconds=5.0)


class CovarianceListener:
    """
    Fills a buffer with the covariances of edges whose poses it has from ``/tf``.

    It reads in a thread of its own, on a small node beside yours. From the start it hears
    what ``static_transform_publisher`` tells of static edges; ``subscribe`` adds topics.
    It lives until it is let go or ``close()``; it is a context manager.
    """

    def __init__(self, buffer: Buffer, node: Node, *,
                 static_topic: str = STATIC_COVARIANCE_TOPIC) -> None:
        """
        Begin to listen to covariances of static edges.

        :param buffer: what to fill.
        :param node: whose names and remappings to use.
        :param static_topic: where these are published, as Odometry for their two frames.
        :raises TypeError: another buffer than ours, such as tf2's.
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
        Take the covariances of a topic for an edge.

        :param msg_type: ``Odometry`` or ``PoseWithCovarianceStamped``.
        :param child: the frame whose pose it is; with ``edge``, ``with_poses`` and ``planar``
            see ``Covariances``.
        :param qos: best effort unless given, which matches every publisher.
        :raises ValueError: arguments that do not fit together.
        """
        rules = Covariances(child, edge, with_poses, planar)
        rules.check_type(_TYPE_NAMES.get(msg_type, repr(msg_type)))
        source = _Source(self._buffer, topic, rules)
        source.authority = self._topics.subscribe(
            msg_type, topic, source.take, qos or sensor_qos())

    def close(self) -> None:
        """Stop listening; what is in the buffer stays there."""
        self._topics.close()

    def __enter__(self) -> 'CovarianceListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Source:
    """One topic and the edge that it tells of."""

    def __init__(self, buffer: Buffer, topic: str, rules: Covariances) -> None:
        self.authority = topic
        self._buffer = buffer
        self._rules = rules

    def take(self, message: Any) -> None:
        """Take a message of the topic."""
        estimate = self._rules.judged(_as_estimate(message), self.authority)
        if isinstance(estimate, Incident):
            self._buffer.feeds.refuse(estimate)
            return
        carrier = self._rules.carrier(estimate)
        if carrier is None:
            self._store(estimate)
        else:
            self._store_moved(estimate, carrier)

    def _store(self, estimate: Estimate) -> None:
        self._buffer.feeds.note(self._buffer.intake.take_estimate(
            estimate, self._rules.with_poses, self.authority))

    def _store_moved(self, estimate: Estimate, carrier: str) -> None:
        """Take an estimate for an edge above its frame, once the way there is known."""
        def store(future: Any) -> None:
            if future.cancelled() or future.exception() is not None:
                self._buffer.feeds.refuse(
                    not_moved(estimate, carrier, future.exception(), self.authority))
            else:
                self._store(estimate.of(carrier, as_pose(future.result())))

        self._buffer.wait_for_transform_async(
            estimate.child, carrier, time_message(estimate.stamp),
            _PATIENCE).add_done_callback(store)


def _as_estimate(message: Any) -> Estimate:
    """Return what an Odometry or a PoseWithCovarianceStamped says."""
    t, q = message.pose.pose.position, message.pose.pose.orientation
    return Estimate(message.header.frame_id, getattr(message, 'child_frame_id', ''),
                    as_nanoseconds(message.header.stamp), (t.x, t.y, t.z, q.x, q.y, q.z, q.w),
                    message.pose.covariance)
