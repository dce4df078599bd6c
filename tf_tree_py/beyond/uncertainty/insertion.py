# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Insertion of covariances into a buffer, also of poses with covariances from other topics.

Which edges such a pose belongs to is decided here, by the same rules for live and for recorded
topics.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY, PlainBuffer
from tf_tree_py.core.errors import InvalidArgumentException, TransformException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import (
    admitted,
    checked,
    impossible_stamp,
    ImpossibleStamp,
    message_stamp,
    Sample,
)
from tf_tree_py.core.times import Stamp

from .covariance_history import set_covariance
from .covariances import carried, checked_covariance

STATIC_COVARIANCE_TOPIC = '/tf_static_covariance'
"""Where ``static_transform_publisher`` sends static edges' covariances, as Odometry."""

Edge = tuple[str, str]

# Whether the messages of a type name the frame whose pose they contain.
_NAMES_ITS_CHILD = {'nav_msgs/Odometry': True, 'geometry_msgs/PoseWithCovarianceStamped': False}

# A rotation with a larger variance than this, radians^2, is completely unknown.
_UNKNOWN = np.pi ** 2
_OFF_THE_FLOOR = [2, 3, 4]


class EdgeEstimate(NamedTuple):
    """
    The pose of a frame in another at a stamp, with its covariance.

    :ivar child: '' if the message does not name it.
    :ivar pose: ``parent_T_child``.
    :ivar covariance: (6, 6), see ``covariances``; (36,) as in the message before it
        has been checked; None: unknown, so the edge keeps its previous one.
    :ivar fault: why the covariance of the message is not used.
    """

    parent: str
    child: str
    stamp: int
    pose: PoseTuple
    covariance: Array | None
    fault: Incident | None = None

    def of(self, other: str, child_T_other: PoseTuple) -> 'EdgeEstimate':
        """Return the estimate of another frame that is rigidly attached to the child."""
        assert self.covariance is not None
        pose = se3.compose(self.pose, child_T_other)
        lever = np.subtract(pose[:3], self.pose[:3])
        return EdgeEstimate(self.parent, other, self.stamp, pose,
                            carried(np.eye(3), lever, self.covariance))


def estimate_in(message: Any) -> EdgeEstimate | ImpossibleStamp:
    """Return the estimate in an Odometry or a PoseWithCovarianceStamped, of rclpy or rosbags."""
    t, q = message.pose.pose.position, message.pose.pose.orientation
    return impossible_stamp(message) or EdgeEstimate(
        message.header.frame_id, getattr(message, 'child_frame_id', ''),
        message_stamp(message), (t.x, t.y, t.z, q.x, q.y, q.z, q.w),
        message.pose.covariance)


@dataclass(frozen=True)
class Covariances:
    """
    The edge that the covariances of a topic belong to.

    The messages are Odometry or PoseWithCovarianceStamped. By default, the edge is the one
    between the message's two frames.

    :ivar child: the frame whose pose the messages contain; Odometry names it.
    :ivar edge: (parent, child) of another edge that the covariances belong to. For example,
        amcl_pose contains the robot's pose in map, but the uncertain edge is
        ('map', 'odom'). The covariance is then moved to the origin of odom at that time.
        The parent is the message's frame.
    :ivar with_poses: insert the pose too, for an edge that is not on ``/tf``; also if the
        covariance cannot be used.
    :ivar planar: use only x, y and the rotation about z. Drivers of robots on a floor give
        the other components a variance of 1e6, although these are fixed, not unknown.
    :raises ValueError: arguments that contradict each other.
    """

    child: str | None = None
    edge: Edge | None = None
    with_poses: bool = False
    planar: bool = False

    def __post_init__(self) -> None:
        child, edge = self.child, self.edge
        if not isinstance(child, str | None):
            raise ValueError(f'child is the name of a frame, not {child!r}')
        if edge is None:
            return
        if not isinstance(edge, tuple | list) or len(edge) != 2 or not all(
                isinstance(frame, str) for frame in edge):
            raise ValueError(f"edge is (parent, child), such as ('map', 'odom'), not {edge!r}")
        if self.with_poses:
            raise ValueError('with_poses applies to the edge between the two frames of the '
                             f'message; {edge} is another edge')

    def check_type(self, type_name: str) -> bool:
        """
        Return whether messages of a type contain the name of their child frame.

        :param type_name: in the form of ROS 2 or ROS 1, such as ``nav_msgs/msg/Odometry``.
        :raises ValueError: another type, or neither the messages nor ``child`` name the frame.
        """
        names_its_child = _NAMES_ITS_CHILD.get(type_name.replace('/msg/', '/'))
        if names_its_child is None:
            raise ValueError(f'{type_name} is neither Odometry nor PoseWithCovarianceStamped')
        if not (names_its_child or self.child):
            raise ValueError('a PoseWithCovarianceStamped does not name the frame whose pose it '
                             "contains: pass child=..., such as 'base_link' for amcl_pose")
        return names_its_child

    def judged(self, received: EdgeEstimate | ImpossibleStamp,
               authority: str) -> EdgeEstimate | Incident:
        """
        Return the checked estimate of a message, or an incident if it cannot be used.

        :param received: the estimate as the message contains it, or its impossible stamp.
        :param authority: the sender.
        """
        if isinstance(received, ImpossibleStamp):
            return received._replace(child=self.child or received.child).incident(authority)
        sample = checked(Sample(
            received.parent.removeprefix('/'),
            (self.child or received.child).removeprefix('/'),
            received.stamp, received.pose), authority)
        if isinstance(sample, Incident):
            return sample
        if received.covariance is None:
            return EdgeEstimate(*sample, None)
        try:
            covariance = self._checked(received.covariance)
        except (InvalidArgumentException, TypeError, ValueError) as error:
            fault = str(error)
        else:
            fault = _fault_of(covariance) or self._fault_of_edge(sample.parent)
        if not fault:
            return EdgeEstimate(*sample, covariance)
        if self.with_poses:
            return EdgeEstimate(*sample, None, _incident(
                Kind.POSE_ALONE, sample, authority, fault))
        return _incident(Kind.BAD_COVARIANCE, sample, authority, fault)

    def _checked(self, given: npt.ArrayLike) -> Array:
        if not self.planar:
            return checked_covariance(given)
        flat = np.array(given, dtype=float).reshape(6, 6)
        flat[_OFF_THE_FLOOR] = flat[:, _OFF_THE_FLOOR] = 0.0
        return checked_covariance(flat)

    def _fault_of_edge(self, parent: str) -> str:
        if self.edge is None or self.edge[0] == parent:
            return ''
        return f'it is a pose in {parent!r}, which is not the parent of the edge {self.edge}'

    def carrier(self, estimate: EdgeEstimate) -> str | None:
        """Return the frame to whose origin to move an estimate; None if it is there already."""
        if self.edge is None or self.edge[1] == estimate.child:
            return None
        return self.edge[1]


def not_moved(estimate: EdgeEstimate, frame: str, error: TransformException | None,
              authority: str) -> Incident:
    """Return an incident: the pose of the frame to move an estimate to is not available."""
    return _incident(Kind.BAD_COVARIANCE, estimate, authority,
                     f'the pose of {frame!r} at that time is not available: {error}')


def _incident(kind: Kind, about: Sample | EdgeEstimate, authority: str, why: str) -> Incident:
    return Incident(kind, about.parent, about.child, about.stamp, authority, why)


def _fault_of(covariance: Array) -> str:
    """Return why a covariance contains no information, or ''."""
    if not covariance.any():
        return 'it is all zero: the sender did not set it, and the edge keeps its covariance'
    widest = float(covariance.diagonal()[3:].max())
    if widest > _UNKNOWN:
        return (f'the variance of a rotation is {widest:g} rad^2, wider than a full turn: the '
                'rotation is unknown. For a robot on a floor, planar=True uses only x, y and yaw')
    return ''


# --- insertion into a buffer

class UncertainBuffer(PlainBuffer):
    """A buffer that takes covariances with transforms."""

    def insert(self, parent: str, child: str, stamp: Stamp, pose: PoseLike, *,
               authority: str = DEFAULT_AUTHORITY, static: bool = False,
               strict: bool | None = None,
               covariance: npt.ArrayLike | None = None) -> list[Incident]:
        """
        Insert one transform, and its covariance.

        :param pose: ``parent_T_child``: a ``Pose``; seven floats, metres, quaternion x y z w;
            a (4, 4) matrix; or a ``Rotation`` or ``RigidTransform`` of scipy.
        :param stamp: nanoseconds; ignored for static transforms.
        :param static: whether the transform is valid at all times.
        :param strict: True raises an exception if a transform is refused; None issues a Python
            warning, once for each kind; False does neither, for callers that check the returned
            incidents.
        :param covariance: (6, 6) of x, y, z and rotation about x, y, z, metres^2 and
            radians^2, as in ``PoseWithCovariance``: t' = t + dt in the parent's axes,
            R' = Exp(dr) R about the parent's fixed axes through the child's origin. None:
            unknown; the edge keeps its previous covariance.
        :return: the incidents: empty if the transform was inserted without a remark.
        :raises InvalidArgumentException: an invalid stamp, pose or covariance, or a name that
            is not a string.
        :raises RefusedException: with ``strict``, after all valid transforms were inserted.
        """
        sample = admitted(Sample(parent, child, self._stamp_of(stamp), checked_pose(pose)))
        if covariance is None:
            return self._refusals.report(self.intake.insert([sample], authority, static), strict)
        return self._refusals.report(_insert_uncertain(
            self.intake, sample, checked_covariance(covariance), authority, static), strict)


def _insert_uncertain(intake: Intake, sample: Sample, covariance: Array, authority: str,
                      static: bool, announced: bool = False) -> list[Incident]:
    """Insert a sample and its covariance (6, 6), or neither if one of them is refused."""
    def insert(samples: list[Sample], authority: str, static: bool) -> list[Incident]:
        incidents = intake.insert_each(samples, authority, static)
        if samples and not any(incident.refused for incident in incidents):
            refused = set_covariance(intake.tree, *sample[:3], covariance, authority)
            intake.count(0, refused)
            incidents += refused
        return incidents

    return intake.insert([sample], authority, static, insert, announced=announced)


def insert_covariance(intake: Intake, parent: str, child: str, stamp: int, covariance: Array,
                      authority: str) -> list[Incident]:
    """Insert the covariance (6, 6) of an edge whose poses are inserted separately."""
    with intake.lock:
        refused = set_covariance(intake.tree, parent, child, stamp, covariance, authority)
        intake.count(0, refused)
    return refused


def insert_estimate(intake: Intake, estimate: EdgeEstimate, authority: str) -> list[Incident]:
    """Insert an edge's covariance from a topic; its poses are inserted separately."""
    parent, child, stamp, _, covariance, _ = estimate
    assert covariance is not None
    return insert_covariance(intake, parent, child, stamp, covariance, authority)


def insert_estimated_pose(intake: Intake, estimate: EdgeEstimate, authority: str, *,
                          static: bool = False, announced: bool = False) -> list[Incident]:
    """
    Insert the pose of an edge from a topic, and its covariance if it is known.

    :param announced: whether observers know of the pose.
    """
    parent, child, stamp, pose_tuple, covariance, fault = estimate
    pose = Sample(parent, child, stamp, pose_tuple)
    if covariance is not None:
        return _insert_uncertain(intake, pose, covariance, authority, static, announced)
    incidents = [] if fault is None else [fault]
    intake.refuse(*incidents)
    return incidents + intake.insert([pose], authority, static, announced=announced)
