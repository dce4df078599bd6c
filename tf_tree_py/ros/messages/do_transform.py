# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The functions that transform messages, tf2's ``do_transform_*``, and messages as arrays.

Each is a pure function of a message and a ``TransformStamped``. The result is in the transform's
``header.frame_id`` and has its stamp. It shares nothing with the message or the transform, and
neither is changed. The functions for the parts of messages are in ``geometry`` and
``point_cloud``. Users register their own types in ``registry``, which also has the pairs of a
stamped type and its content.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from geometry_msgs.msg import (
    Accel,
    AccelStamped,
    AccelWithCovariance,
    AccelWithCovarianceStamped,
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonInstance,
    PolygonInstanceStamped,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    Transform,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
    VelocityStamped,
    Wrench,
    WrenchStamped,
)
from nav_msgs.msg import Odometry, Path
import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.scans import points_of
from tf_tree_py.core import Pose as PlainPose
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

from . import geometry, point_cloud
from .fast_messages import copy_of, maker
from .geometry import points_array, pose_values, rotate_covariance, transform_values
from .point_cloud import do_transform_cloud, points_of_scan

# Transforms an object to the target frame of a transform.
Transformer = Callable[[Any, TransformStamped], Any]

_point_stamped, _vector3_stamped = maker(PointStamped), maker(Vector3Stamped)
_quaternion_stamped, _transform_stamped = maker(QuaternionStamped), maker(TransformStamped)
_pose_stamped, _pose_array = maker(PoseStamped), maker(PoseArray)
_pose_with_covariance_stamped = maker(PoseWithCovarianceStamped)
_polygon_stamped, _polygon_instance_stamped = maker(PolygonStamped), maker(PolygonInstanceStamped)
_wrench_stamped, _velocity_stamped = maker(WrenchStamped), maker(VelocityStamped)
_twist_stamped, _accel_stamped = maker(TwistStamped), maker(AccelStamped)
_twist_with_covariance_stamped = maker(TwistWithCovarianceStamped)
_accel_with_covariance_stamped = maker(AccelWithCovarianceStamped)
_path, _odometry = maker(Path), maker(Odometry)


def do_transform(message: object, transform: TransformStamped) -> Any:
    """
    Return a message of any type in the table, in the transform's target frame.

    :raises KeyError: the table does not have its type; ``registry`` explains more.
    """
    return TRANSFORMERS[type(message)](message, transform)


# --- points, directions, poses


def do_transform_point(point: PointStamped, transform: TransformStamped) -> PointStamped:
    """Return a point: rotated and translated."""
    return _point_stamped(_header(transform), geometry.point(point.point, _pose(transform)))


def do_transform_vector3(vector3: Vector3Stamped, transform: TransformStamped) -> Vector3Stamped:
    """Return a free vector: rotated, not translated."""
    return _vector3_stamped(_header(transform), geometry.vector3(vector3.vector, _pose(transform)))


def do_transform_quaternion(quaternion: QuaternionStamped,
                            transform: TransformStamped) -> QuaternionStamped:
    """Return an orientation in the target frame."""
    return _quaternion_stamped(
        _header(transform), geometry.quaternion(quaternion.quaternion, _pose(transform)))


def do_transform_pose(pose: Pose, transform: TransformStamped) -> Pose:
    """
    Return a pose without a header, as tf2's function of this name.

    :raises TypeError: a pose with a header.
    """
    if isinstance(pose, PoseStamped | PoseWithCovarianceStamped):
        name = 'stamped' if isinstance(pose, PoseStamped) else 'with_covariance_stamped'
        raise TypeError(f'do_transform_pose takes a Pose without a header, as in tf2, and this is '
                        f'a {type(pose).__name__}: call do_transform_pose_{name}, or '
                        "buffer.transform(pose, 'map')")
    return geometry.pose(pose, _pose(transform))


def do_transform_pose_stamped(pose: PoseStamped, transform: TransformStamped) -> PoseStamped:
    """Return a pose with the transform's header."""
    return _pose_stamped(_header(transform), geometry.pose(pose.pose, _pose(transform)))


def do_transform_pose_with_covariance_stamped(
        pose: PoseWithCovarianceStamped,
        transform: TransformStamped) -> PoseWithCovarianceStamped:
    """Return a pose and its covariance, rotated into the target's axes."""
    return _pose_with_covariance_stamped(
        _header(transform), geometry.pose_with_covariance(pose.pose, _pose(transform)))


def transform_covariance(cov_in: npt.ArrayLike, transform: TransformStamped) -> Array:
    """Return a covariance (36,), row-major, in the target's axes: each block R C R^T."""
    return rotate_covariance(cov_in, _pose(transform)[3:])


def do_transform_transform(transform_in: TransformStamped,
                           transform: TransformStamped) -> TransformStamped:
    """Return the transform from the child to the target: the ``child_frame_id`` stays."""
    return _transform_stamped(
        _header(transform), transform_in.child_frame_id,
        geometry.transform(transform_in.transform, _pose(transform)))


# --- many points, many poses


def do_transform_polygon_stamped(polygon: PolygonStamped,
                                 transform: TransformStamped) -> PolygonStamped:
    """Return a polygon, each of its points rotated and translated."""
    return _polygon_stamped(
        _header(transform), geometry.polygon(polygon.polygon, _pose(transform)))


def do_transform_polygon_instance_stamped(
        polygon: PolygonInstanceStamped,
        transform: TransformStamped) -> PolygonInstanceStamped:
    """Return a polygon with its id."""
    return _polygon_instance_stamped(
        _header(transform), geometry.polygon_instance(polygon.polygon, _pose(transform)))


def do_transform_pose_array(poses: PoseArray, transform: TransformStamped) -> PoseArray:
    """Return many poses."""
    return _pose_array(_header(transform), geometry.poses(poses.poses, _pose(transform)))


def do_transform_path(path: Path, transform: TransformStamped) -> Path:
    """
    Return a path; each of its poses keeps its own stamp, the planned time of arrival.

    :raises InvalidArgumentException: a pose names another frame than the path does.
    """
    source, target = path.header.frame_id, transform.header.frame_id
    headers = []
    for number, pose in enumerate(path.poses):
        if pose.header.frame_id not in (source, ''):
            raise InvalidArgumentException(
                f'poses[{number}] of the path is in {pose.header.frame_id!r}, the path in '
                f'{source!r}: transform each pose separately')
        headers.append(copy_of(pose.header, target))
    poses = geometry.poses([pose.pose for pose in path.poses], _pose(transform))
    return _path(_header(transform), list(map(_pose_stamped, headers, poses)))


def do_transform_laser_scan(scan: LaserScan, transform: TransformStamped) -> PointCloud2:
    """Return the valid points of a scan as a cloud; see ``point_cloud.as_cloud``."""
    return do_transform_cloud(point_cloud.as_cloud(scan), transform)


# --- motion and force


def do_transform_wrench(wrench: WrenchStamped, transform: TransformStamped,
                        lever_arm: bool = True) -> WrenchStamped:
    """Return the same wrench about the target's origin; see ``geometry.wrench``."""
    return _wrench_stamped(
        _header(transform), geometry.wrench(wrench.wrench, _pose(transform), lever_arm))


def do_transform_twist(twist: TwistStamped, transform: TransformStamped,
                       lever_arm: bool = False) -> TwistStamped:
    """Return a twist in the target's axes, of the same point; see ``geometry.twist``."""
    return _twist_stamped(
        _header(transform), geometry.twist(twist.twist, _pose(transform), lever_arm))


def do_transform_twist_with_covariance(
        twist: TwistWithCovarianceStamped, transform: TransformStamped,
        lever_arm: bool = False) -> TwistWithCovarianceStamped:
    """Return a twist and its covariance in the target's axes; see ``geometry.twist``."""
    return _twist_with_covariance_stamped(
        _header(transform),
        geometry.twist_with_covariance(twist.twist, _pose(transform), lever_arm))


def do_transform_velocity(velocity: VelocityStamped,
                          transform: TransformStamped) -> VelocityStamped:
    """
    Return a velocity in the target's axes; the body and the reference frame stay.

    tf2's C++ also adds the velocity in the old axes, and the sum has no meaning.
    """
    return _velocity_stamped(
        _header(transform), velocity.body_frame_id, velocity.reference_frame_id,
        geometry.twist(velocity.velocity, _pose(transform)))


def do_transform_accel(accel: AccelStamped, transform: TransformStamped) -> AccelStamped:
    """Return an acceleration in the target's axes, of the same point; see ``geometry.accel``."""
    return _accel_stamped(_header(transform), geometry.accel(accel.accel, _pose(transform)))


def do_transform_accel_with_covariance(
        accel: AccelWithCovarianceStamped,
        transform: TransformStamped) -> AccelWithCovarianceStamped:
    """Return an acceleration and its covariance in the target's axes."""
    return _accel_with_covariance_stamped(
        _header(transform), geometry.accel_with_covariance(accel.accel, _pose(transform)))


def do_transform_odometry(odometry: Odometry, transform: TransformStamped) -> Odometry:
    """Return an odometry: its pose in the target frame; its twist, in the child's frame, stays."""
    return _odometry(
        _header(transform), odometry.child_frame_id,
        geometry.pose_with_covariance(odometry.pose, _pose(transform)),
        geometry.same_twist(odometry.twist))


# --- the table


def _header(transform: TransformStamped) -> Header:
    return copy_of(transform.header)


def _pose(transform: TransformStamped) -> PoseTuple:
    return geometry.transform_values(transform.transform)


def _bare(part: Callable[[Any, PoseTuple], object]) -> Transformer:
    """Return the transformer of a message without header."""
    return lambda message, transform: part(message, _pose(transform))


TRANSFORMERS: Mapping[type, Transformer] = {
    PointStamped: do_transform_point,
    Vector3Stamped: do_transform_vector3,
    QuaternionStamped: do_transform_quaternion,
    PoseStamped: do_transform_pose_stamped,
    PoseWithCovarianceStamped: do_transform_pose_with_covariance_stamped,
    TransformStamped: do_transform_transform,
    PolygonStamped: do_transform_polygon_stamped,
    PolygonInstanceStamped: do_transform_polygon_instance_stamped,
    PoseArray: do_transform_pose_array,
    Path: do_transform_path,
    Odometry: do_transform_odometry,
    WrenchStamped: do_transform_wrench,
    TwistStamped: do_transform_twist,
    TwistWithCovarianceStamped: do_transform_twist_with_covariance,
    VelocityStamped: do_transform_velocity,
    AccelStamped: do_transform_accel,
    AccelWithCovarianceStamped: do_transform_accel_with_covariance,
    LaserScan: do_transform_laser_scan,
    PointCloud2: do_transform_cloud,
    Point: _bare(geometry.point),
    Point32: _bare(geometry.point32),
    Vector3: _bare(geometry.vector3),
    Quaternion: _bare(geometry.quaternion),
    Pose: _bare(geometry.pose),
    PoseWithCovariance: _bare(geometry.pose_with_covariance),
    Transform: _bare(geometry.transform),
    Polygon: _bare(geometry.polygon),
    PolygonInstance: _bare(geometry.polygon_instance),
    Wrench: _bare(geometry.wrench),
    Twist: _bare(geometry.twist),
    TwistWithCovariance: _bare(geometry.twist_with_covariance),
    Accel: _bare(geometry.accel),
    AccelWithCovariance: _bare(geometry.accel_with_covariance),
}
"""The transformers of the types that need no registration; they add no header to a message."""


# --- messages as arrays

Values = TypeVar('Values')

_POSES: Mapping[type, Callable[[Any], PoseTuple]] = {
    Transform: transform_values,
    TransformStamped: lambda message: transform_values(message.transform),
    Pose: pose_values,
    PoseStamped: lambda message: pose_values(message.pose),
    PoseWithCovariance: lambda message: pose_values(message.pose),
    PoseWithCovarianceStamped: lambda message: pose_values(message.pose.pose),
    Odometry: lambda message: pose_values(message.pose.pose),
    PlainPose: lambda pose: pose,
}

_POINTS: Mapping[type, Callable[[Any], npt.NDArray[np.floating]]] = {
    Polygon: lambda message: points_array(message.points),
    PolygonStamped: lambda message: points_array(message.polygon.points),
    PolygonInstance: lambda message: points_array(message.polygon.points),
    PolygonInstanceStamped: lambda message: points_array(message.polygon.polygon.points),
    PoseArray: lambda message: points_array([pose.position for pose in message.poses]),
    Path: lambda message: points_array([pose.pose.position for pose in message.poses]),
    LaserScan: points_of_scan,
    PointCloud2: points_of,
}


def as_matrix(transform: object) -> Array:
    """
    Return a transform or a pose as a homogeneous matrix.

    :param transform: a ``Transform``, a ``Pose`` (the message, or this package's), or a
        message that holds one of them.
    :return: (4, 4)
    :raises TypeError: something else.
    """
    return se3.as_matrix(_read(_POSES, transform))


def as_points(message: object) -> npt.NDArray[Any]:
    """
    Return the points of a message as a new array.

    These are the positions of a ``Path`` or ``PoseArray``, the corners of a ``Polygon``, all
    points of a ``PointCloud2``, row by row, and the valid points of a ``LaserScan``.

    :return: (N, 3) metres; float64, or float32 for a cloud with such fields.
    :raises TypeError: something else.
    """
    return _read(_POINTS, message)


def _read(table: Mapping[type, Callable[[Any], Values]], message: object) -> Values:
    if type(message) not in table:
        names = ', '.join(cls.__name__ for cls in table)
        raise TypeError(f'{type(message).__name__} is none of {names}')
    return table[type(message)](message)
