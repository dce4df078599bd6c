# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The effect of a rigid transform on each message that has no header.

Every function here takes a message in b and the pose ``a_T_b``, and returns a new message in a
that shares nothing with the first. The fields of the given message may hold ints or numpy's
numbers; those of the returned one hold floats. A quaternion of a pose need not have unit length. A
quaternion of zeros counts as no rotation, as in tf2: the message was not filled in. Headers are in
``do_transform``.

A covariance of six numbers, as pose, twist and accel messages have it, is row-major (36,): three
numbers along the axes x, y, z, then three about them.
"""

from collections.abc import Sequence
import math

from geometry_msgs.msg import (
    Accel,
    AccelWithCovariance,
    Point,
    Point32,
    Polygon,
    PolygonInstance,
    Pose as PoseMessage,
    PoseWithCovariance,
    Quaternion,
    Transform,
    Twist,
    TwistWithCovariance,
    Vector3,
    Wrench,
)
import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.poses import is_sound, judged
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.screws import adjoint, carry, Screw

from .fast_messages import maker, many_maker, reader


def rotate_covariance(covariance: npt.ArrayLike, a_q_b: so3.Quaternion) -> Array:
    """Return a covariance (36,) in the axes of a: each 3 x 3 block is R C R^T."""
    return _congruent(covariance, _diagonal(a_q_b))


def _carry_covariance(covariance: npt.ArrayLike, a_T_b: PoseTuple) -> Array:
    """Return the covariance (36,) of a twist that the adjoint transforms from b to a."""
    return _congruent(covariance, adjoint(a_T_b))


def _diagonal(a_q_b: so3.Quaternion) -> Array:
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = so3.as_matrix(a_q_b)
    return matrix


def _congruent(covariance: npt.ArrayLike, matrix: Array) -> Array:
    """Return M C M^T of a covariance (36,)."""
    square = np.asarray(covariance, dtype=float).reshape(6, 6)
    return np.asarray(matrix @ square @ matrix.T).reshape(36)


# --- parts of messages

_accel, _accel_with_covariance = maker(Accel), maker(AccelWithCovariance)
_point, _point32, _vector3, _quaternion = map(maker, (Point, Point32, Vector3, Quaternion))
_polygon, _polygon_instance = maker(Polygon), maker(PolygonInstance)
_pose, _pose_with_covariance = maker(PoseMessage), maker(PoseWithCovariance)
_transform, _wrench = maker(Transform), maker(Wrench)
_twist, _twist_with_covariance = maker(Twist), maker(TwistWithCovariance)

_points, _quaternions, _poses = map(many_maker, (Point, Quaternion, PoseMessage))
_points32 = many_maker(Point32)
_read_points, _read_quaternions, _read_poses = map(reader, (Point, Quaternion, PoseMessage))


# --- points and directions


def point(message: Point, a_T_b: PoseTuple) -> Point:
    """Return a point: rotated and translated."""
    return _point(*se3.apply(a_T_b, _xyz(message)))


def point32(message: Point32, a_T_b: PoseTuple) -> Point32:
    """Return a point of single precision: rotated and translated."""
    return _point32(*se3.apply(a_T_b, _xyz(message)))


def vector3(message: Vector3, a_T_b: PoseTuple) -> Vector3:
    """Return a free vector, a direction with a length: rotated, not translated."""
    return _vector3(*so3.rotate(a_T_b[3:], _xyz(message)))


def quaternion(message: Quaternion, a_T_b: PoseTuple) -> Quaternion:
    """Return an orientation in a: the product, with its sign and length unchanged."""
    q = (float(message.x), float(message.y), float(message.z), float(message.w))
    return _quaternion(*so3.multiply(a_T_b[3:], q))


def polygon(message: Polygon, a_T_b: PoseTuple) -> Polygon:
    """Return a polygon, each of its points rotated and translated."""
    x, y, z, *q = a_T_b
    a_R_b = np.array(so3.as_matrix((q[0], q[1], q[2], q[3])))
    moved = a_R_b @ np.array(_read_points(message.points), dtype=float)
    moved += ((x,), (y,), (z,))
    return _polygon(_points32(*moved.tolist()))


def polygon_instance(message: PolygonInstance, a_T_b: PoseTuple) -> PolygonInstance:
    """Return a polygon with its id."""
    return _polygon_instance(polygon(message.polygon, a_T_b), message.id)


# --- poses


def pose(message: PoseMessage, a_T_b: PoseTuple) -> PoseMessage:
    """Return a pose: the product, with w >= 0 as in tf2's Python."""
    return pose_message(se3.compose(a_T_b, pose_values(message)))


def poses(messages: Sequence[PoseMessage], a_T_b: PoseTuple) -> list[PoseMessage]:
    """Return many poses; see ``pose``."""
    a_T_each = se3.compose_many(np.array(a_T_b), _poses_array(messages))
    a_T_each[a_T_each[:, 6] < 0.0, 3:] *= -1.0
    columns = a_T_each.T.tolist()
    messages_in_a: list[PoseMessage] = _poses(_points(*columns[:3]), _quaternions(*columns[3:]))
    return messages_in_a


def pose_with_covariance(message: PoseWithCovariance, a_T_b: PoseTuple) -> PoseWithCovariance:
    """
    Return a pose with its covariance, as tf2 does.

    It is the covariance of the position and of a rotation about fixed axes (REP 103), and is only
    rotated. The displacement that a rotation about a's origin would cause is not included.
    """
    return _pose_with_covariance(
        pose(message.pose, a_T_b), rotate_covariance(message.covariance, a_T_b[3:]))


def transform(message: Transform, a_T_b: PoseTuple) -> Transform:
    """Return a transform to b as a transform to a: the product, with the sign of tf2's C++."""
    x, y, z, *q = se3.compose(a_T_b, transform_values(message))
    return _transform(_vector3(x, y, z), _quaternion(*so3.with_tf2_sign((q[0], q[1], q[2], q[3]))))


# --- screws


def wrench(message: Wrench, a_T_b: PoseTuple, lever_arm: bool = True) -> Wrench:
    """
    Return the same wrench about a's origin: what a sensor there would measure.

    The force is rotated, and so is the torque. Moving the force from b's origin to a's adds the
    torque t x F, as in tf2's C++ (ROS 1's Python omits it).

    :param lever_arm: False omits that part: the torque stays about b's origin.
    """
    tx, ty, tz, fx, fy, fz = _carried((*_xyz(message.torque), *_xyz(message.force)),
                                      a_T_b, lever_arm)
    return _wrench(_vector3(fx, fy, fz), _vector3(tx, ty, tz))


def twist(message: Twist, a_T_b: PoseTuple, lever_arm: bool = False) -> Twist:
    """
    Return a twist in a's axes.

    By default both are free vectors, which are only rotated into a's axes: the velocity of the
    point at b's origin, and the angular velocity of its body. This is what a controller needs that
    uses base_link's velocity in map.

    :param lever_arm: True for the velocity of the point of the same rigid body that is at
        a's origin, v + t x w. Use it between frames of one body, such as for the velocity
        of base_link from an odometer that is mounted elsewhere.
    """
    vx, vy, vz, wx, wy, wz = _carried((*_xyz(message.linear), *_xyz(message.angular)),
                                      a_T_b, lever_arm)
    return _twist(_vector3(vx, vy, vz), _vector3(wx, wy, wz))


def twist_values(given: Twist | Sequence[float]) -> Sequence[float]:
    """Return a twist as six numbers; what is no message is returned as it is."""
    if not isinstance(given, Twist):
        return given
    return *_xyz(given.linear), *_xyz(given.angular)


def twist_with_covariance(message: TwistWithCovariance, a_T_b: PoseTuple,
                          lever_arm: bool = False) -> TwistWithCovariance:
    """Return a twist and its covariance in a's axes; see ``twist``."""
    covariance = (_carry_covariance(message.covariance, a_T_b) if lever_arm
                  else rotate_covariance(message.covariance, a_T_b[3:]))
    return _twist_with_covariance(twist(message.twist, a_T_b, lever_arm), covariance)


def same_twist(message: TwistWithCovariance) -> TwistWithCovariance:
    """Return a copy."""
    linear, angular = message.twist.linear, message.twist.angular
    return _twist_with_covariance(_twist(_vector3(*_xyz(linear)), _vector3(*_xyz(angular))),
                                  np.array(message.covariance, dtype=float))


def accel(message: Accel, a_T_b: PoseTuple) -> Accel:
    """
    Return an acceleration in a's axes: free vectors, only rotated.

    It stays the acceleration of the point at b's origin. Another point of the body would need the
    angular velocity, too (w x (w x r)), which the message does not have.
    """
    return _accel(vector3(message.linear, a_T_b), vector3(message.angular, a_T_b))


def accel_with_covariance(message: AccelWithCovariance, a_T_b: PoseTuple) -> AccelWithCovariance:
    """Return an acceleration and its covariance in a's axes; see ``accel``."""
    return _accel_with_covariance(
        accel(message.accel, a_T_b), rotate_covariance(message.covariance, a_T_b[3:]))


def _carried(screw: Screw, a_T_b: PoseTuple, lever_arm: bool) -> Screw:
    return carry(a_T_b if lever_arm else (0.0, 0.0, 0.0, *a_T_b[3:]), screw)


# --- values of messages


def pose_values(message: PoseMessage) -> PoseTuple:
    """Return the seven numbers of a pose message, the quaternion of unit length."""
    return _unit(message.position, message.orientation)


def transform_values(message: Transform) -> PoseTuple:
    """Return the seven numbers of a transform message, the quaternion of unit length."""
    return _unit(message.translation, message.rotation)


def _unit(t: Point | Vector3, q: Quaternion) -> PoseTuple:
    values = (float(t.x), float(t.y), float(t.z),
              float(q.x), float(q.y), float(q.z), float(q.w))
    return values if is_sound(values) else unit(values)


def unit(values: PoseTuple) -> PoseTuple:
    """Return a pose with a unit quaternion: no rotation for zeros; not finite ones stay."""
    x, y, z, qx, qy, qz, qw = values
    size = math.hypot(qx, qy, qz, qw)
    if size == 0.0:
        return (x, y, z, *so3.IDENTITY)
    if not math.isfinite(size):
        return values
    return (x, y, z, *so3.normalize((qx, qy, qz, qw)))


def _poses_array(messages: Sequence[PoseMessage]) -> Array:
    """Return the numbers (N, 7) of pose messages, the quaternions of unit length."""
    positions, orientations = _read_poses(messages)
    columns = [*_read_points(positions), *_read_quaternions(orientations)]
    array = np.array(columns, dtype=float).T
    poses, good = judged(array)
    return poses if good.all() else np.array([unit(row) for row in array.tolist()])


def points_array(messages: Sequence[Point | Point32 | Vector3]) -> Array:
    """Return the coordinates (N, 3) of messages with x, y and z."""
    return np.array(_read_points(messages), dtype=float).T


def pose_message(values: PoseTuple) -> PoseMessage:
    """Return a pose message of seven floats, with w >= 0."""
    x, y, z, qx, qy, qz, qw = values
    q = (qx, qy, qz, qw) if qw >= 0.0 else (-qx, -qy, -qz, -qw)
    return _pose(_point(x, y, z), _quaternion(*q))


def _xyz(message: Point | Point32 | Vector3) -> so3.Vector3:
    return (float(message.x), float(message.y), float(message.z))
