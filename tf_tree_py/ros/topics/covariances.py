"""Covariances of edges, from the topics that have them: odometries and localisations."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf_tree_py.core.arrivals.incidents import Incident, Kind
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.covariances import carried
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

from .qos import sensor_qos, STATIC_COVARIANCE_TOPIC, static_listener_qos
from .side_topics import SideTopics
from ..buffer.buffer import Buffer
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..messages.convert import as_nanoseconds, as_pose, time_message
from ..messages.uncertain import uncertain_values

Edge = tuple[str, str]

# How long the way from the pose's frame to the edge's child may take to be known.
_PATIENCE = Duration(seconds=5.0)
# A rotation that is less known than this is not known at all.
_UNKNOWN = np.pi ** 2
_OFF_THE_FLOOR = [2, 3, 4]


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
        :param child: the frame whose pose it is; an odometry names it itself.
        :param edge: (parent, child) of the edge that the uncertainty belongs to, unless it
            is the one between the message's two frames. amcl_pose has the robot's pose in
            map, but what it is unsure of is ('map', 'odom'): the covariance is then moved to
            where odom's origin is at that time. The parent is the message's frame.
        :param with_poses: take the pose too, for an edge that is not on ``/tf``.
        :param planar: take x, y and the rotation about z only. Drivers of robots on a floor
            say 1e6 of the others, which are not unknown but fixed.
        :param qos: best effort unless given, which matches every publisher.
        :raises ValueError: arguments that do not fit together.
        """
        if msg_type not in (Odometry, PoseWithCovarianceStamped):
            raise ValueError(f'{msg_type!r} is neither Odometry nor PoseWithCovarianceStamped')
        if msg_type is PoseWithCovarianceStamped and not child:
            raise ValueError('a PoseWithCovarianceStamped does not say of which frame it is: '
                             "pass child=..., 'base_link' of amcl_pose for instance")
        if with_poses and edge is not None:
            raise ValueError('with_poses is for an edge between the two frames of the message, '
                             f'and {edge} is another')
        source = _Source(self._buffer, topic, child, edge, with_poses, planar)
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

    def __init__(self, buffer: Buffer, topic: str, child: str | None, edge: Edge | None,
                 with_poses: bool, planar: bool) -> None:
        self.authority = topic
        self._buffer = buffer
        self._child = child
        self._edge = edge
        self._with_poses = with_poses
        self._planar = planar

    def take(self, message: Any) -> None:
        """Take a message of the topic."""
        parent = message.header.frame_id.removeprefix('/')
        child = (self._child or message.child_frame_id).removeprefix('/')
        stamp = as_nanoseconds(message.header.stamp)
        refuse = self._refusing(parent, child, stamp)
        try:
            pose, covariance = uncertain_values(message.pose)
        except InvalidArgumentException as error:
            refuse(str(error))
            return
        if self._planar:
            covariance[_OFF_THE_FLOOR] = covariance[:, _OFF_THE_FLOOR] = 0.0
        fault = _fault_of(covariance)
        if fault:
            refuse(fault)
        elif self._with_poses:
            self._buffer.feeds.note(self._buffer.intake.take_uncertain(
                Sample(parent, child, stamp, pose), covariance, self.authority, False))
        elif self._edge is None or self._edge == (parent, child):
            self._store((parent, child), stamp, covariance)
        elif self._edge[0] != parent:
            refuse(f'it is a pose in {parent!r}, and the edge {self._edge} begins elsewhere')
        else:
            self._take_moved(child, stamp, pose, covariance, refuse)

    def _store(self, edge: Edge, stamp: int, covariance: Array) -> None:
        self._buffer.feeds.note(self._buffer.intake.take_covariance(
            *edge, stamp, covariance, self.authority))

    def _refusing(self, parent: str, child: str, stamp: int) -> Callable[[str], None]:
        def refuse(why: str) -> None:
            self._buffer.feeds.refuse(Incident(
                Kind.BAD_COVARIANCE, parent, child, stamp, self.authority, why))

        return refuse

    def _take_moved(self, child: str, stamp: int, pose: PoseTuple, covariance: Array,
                    refuse: Callable[[str], None]) -> None:
        """Take the covariance of a pose for an edge above it, once the way there is known."""
        assert self._edge is not None
        edge = self._edge

        def take(future: Any) -> None:
            if future.cancelled() or future.exception() is not None:
                refuse(f'where {edge[1]!r} was then is not known: {future.exception()}')
                return
            there = se3.compose(pose, as_pose(future.result()))
            lever = np.subtract(there[:3], pose[:3])
            self._store(edge, stamp, carried(np.eye(3), lever, covariance))

        self._buffer.wait_for_transform_async(
            child, edge[1], time_message(stamp), _PATIENCE).add_done_callback(take)


def _fault_of(covariance: Array) -> str:
    """Return why a covariance says nothing, or ''."""
    if not covariance.any():
        return 'it is all zero: nobody filled it, and the edge stays as sure as it was'
    widest = float(covariance.diagonal()[3:].max())
    if widest > _UNKNOWN:
        return (f'the variance of a rotation is {widest:g} rad^2, more than any angle: so it is '
                'not known at all. Of a robot on a floor take the rest: '
                'subscribe(..., planar=True)')
    return ''
