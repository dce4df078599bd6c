# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every type of message that can be transformed, by hand, and there and back again."""

from copy import deepcopy
import math

from geometry_msgs import msg
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Twist, Vector3, Wrench
from hypothesis import given
from inputs import for_each
import message_tools as tools
from message_tools import filled, numbers, poses, seeds, stamped_transform, transforms
from nav_msgs.msg import Odometry, Path
import numpy as np
import pytest
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message
from ros_helpers import at
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
import tf_tree_py
from tf_tree_py import Buffer, InvalidArgumentException, Pose as PlainPose
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.ros.messages import do_transform as functions, geometry
from tf_tree_py.ros.messages.do_transform import do_transform, TRANSFORMERS
from tf_tree_py.ros.messages.registry import STAMPED_FORMS
from tf_tree_py.screws import carry

GEOMETRY = [cls for cls in TRANSFORMERS if cls not in (LaserScan, PointCloud2)]

SECOND = 10**9
POSE = (1.0, -2.0, 3.0, 0.5, -0.5, 0.5, -0.5)

# Half a turn about x, and a translation of 10, 20, 30: easy to check by hand.
BY_HAND = stamped_transform((10.0, 20.0, 30.0, 1.0, 0.0, 0.0, 0.0))


def quaternion(message):
    return (message.x, message.y, message.z, message.w)


def vector(x, y, z):
    return Vector3(x=float(x), y=float(y), z=float(z))


def quaternions_in(message):
    return [part for part in tools.mutable_parts(message) if isinstance(part, Quaternion)]


def unit_quaternions(message):
    """Normalise the quaternions in a message to rotations, as in real messages."""
    for part in quaternions_in(message):
        part.x, part.y, part.z, part.w = so3.normalize(quaternion(part))
    return message


def assert_same(a, b, tolerance=1e-9):
    """Assert that two messages are equal except for rounding and the signs of quaternions."""
    assert type(a) is type(b)
    for one, other in zip(quaternions_in(a), quaternions_in(b), strict=True):
        if np.dot(quaternion(one), quaternion(other)) < 0.0:
            one.x, one.y, one.z, one.w = (-value for value in quaternion(one))
    for (path, one), (_, other) in zip(tools.leaves(a), tools.leaves(b), strict=True):
        if isinstance(one, float):
            assert one == pytest.approx(other, rel=1e-12, abs=tolerance), path
        elif '.header.' not in path:
            assert one == other, path


# --- properties of every type


@for_each(cls=GEOMETRY)
def test_result_shares_nothing_and_changes_nothing(cls):
    message, transform = filled(cls, np.random.default_rng(2)), stamped_transform(POSE)
    result = do_transform(message, transform)
    assert type(result) is cls
    assert not hasattr(cls, 'header') or result.header == transform.header
    tools.assert_shares_nothing(do_transform, message, transform)


@for_each(cls=STAMPED_FORMS)
def test_messages_with_and_without_header_are_moved_alike(cls):
    message = filled(cls, np.random.default_rng(9))
    form, field = STAMPED_FORMS[cls]
    moved = do_transform(form(**{field: message}), stamped_transform(POSE))
    assert getattr(moved, field) == do_transform(message, stamped_transform(POSE))


@for_each(cls=GEOMETRY)
@given(poses, poses, seeds)
def test_transforms_in_series_are_their_product_and_can_be_undone(cls, a_T_b, b_T_c, seed):
    message = unit_quaternions(filled(cls, np.random.default_rng(seed)))
    first, second = stamped_transform(b_T_c, 'base', 'c'), stamped_transform(a_T_b)
    there = do_transform(message, first)
    product = stamped_transform(se3.compose(a_T_b, b_T_c))
    assert_same(do_transform(there, second), do_transform(message, product), 1e-8)
    assert_same(do_transform(there, stamped_transform(se3.inverse(b_T_c), 'c', 'base')), message)


@for_each(cls=GEOMETRY, number=[
    lambda rng: int(rng.integers(-5, 5)), lambda rng: np.float64(rng.normal()),
    lambda rng: np.float32(rng.normal()), lambda rng: np.int64(rng.integers(1, 5)),
    lambda rng: bool(rng.integers(0, 2)),
])
def test_other_numbers_become_floats(cls, number):
    message = filled(cls, np.random.default_rng(3), number)
    transform = stamped_transform((1, 2, 3, 0, 0, 0, 1))
    transform.transform.translation.x = transform.transform.rotation.w = 1
    result = do_transform(message, transform)
    assert {type(value) for path, value in tools.leaves(result)
            if isinstance(value, float) and 'covariance' not in path} == {float}
    # A message accepts an int for a float field, and then serializes garbage.
    arrived = deserialize_message(serialize_message(result), cls)
    as_floats = filled(cls, np.random.default_rng(3), lambda rng: float(number(rng)))
    assert numbers(arrived) == pytest.approx(numbers(do_transform(as_floats, transform)), rel=1e-6)


@for_each(cls=GEOMETRY)
def test_nan_stays_and_raises_nothing(cls):
    message = filled(cls, np.random.default_rng(4), lambda rng: float('nan'))
    assert np.isnan(numbers(do_transform(message, stamped_transform(POSE)))).any()


# --- by hand


BODY = {'body_frame_id': 'base', 'reference_frame_id': 'odom'}
MOTION = {'linear': vector(1, 2, 3), 'angular': vector(4, 5, 6)}
TURNED = {'linear': vector(1, -2, -3), 'angular': vector(4, -5, -6)}
COVERED = msg.TwistWithCovariance(twist=Twist(**MOTION), covariance=np.arange(36.0))
# A field that was not set may be a quaternion of zeros, which stands for no rotation.
UNSET = Pose(position=Point(x=1.0), orientation=Quaternion(w=0.0))


def moved_to(x, y, z):
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=1.0, w=0.0))


@for_each(example=[
    (Point(x=1.0, y=2.0, z=3.0), Point(x=11.0, y=18.0, z=27.0)),
    (msg.Point32(x=1.0, y=2.0, z=3.0), msg.Point32(x=11.0, y=18.0, z=27.0)),
    (vector(1, 2, 3), vector(1, -2, -3)),
    (Pose(position=Point(x=1.0, y=2.0, z=3.0)), moved_to(11.0, 18.0, 27.0)),
    (UNSET, moved_to(11.0, 20.0, 30.0)),
    (msg.PoseArray(poses=[UNSET]),
     msg.PoseArray(header=BY_HAND.header, poses=[moved_to(11.0, 20.0, 30.0)])),
    (stamped_transform((0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), 'base', 'camera'),
     stamped_transform((10.0, 20.0, 29.0, 1.0, 0.0, 0.0, 0.0), 'map', 'camera')),
    (Twist(**MOTION), Twist(**TURNED)),
    (msg.Accel(**MOTION), msg.Accel(**TURNED)),
    (msg.VelocityStamped(velocity=Twist(**MOTION), **BODY),
     msg.VelocityStamped(header=BY_HAND.header, velocity=Twist(**TURNED), **BODY)),
    (Odometry(child_frame_id='base', twist=COVERED),
     Odometry(header=BY_HAND.header, child_frame_id='base', twist=COVERED,
              pose=msg.PoseWithCovariance(pose=moved_to(10.0, 20.0, 30.0)))),
    # f = (1 -2 -3), turned torque (1 -2 -3), t x f = (0 60 -40).
    (Wrench(force=vector(1, 2, 3), torque=vector(1, 2, 3)),
     Wrench(force=vector(1, -2, -3), torque=vector(1, 58, -43))),
])
def test_message_is_moved_as_computed_by_hand(example):
    message, expected = example
    assert do_transform(message, BY_HAND) == expected


def test_lever_arm_of_wrenches_and_twists_can_be_chosen():
    wrench = msg.WrenchStamped(wrench=Wrench(force=vector(1, 2, 3), torque=vector(1, 2, 3)))
    assert functions.do_transform_wrench(wrench, BY_HAND, lever_arm=False).wrench == Wrench(
        force=vector(1, -2, -3), torque=vector(1, -2, -3))
    # A wheel rotates at 2 rad/s about z, seen from a frame one metre behind it on the same body.
    wheel = msg.TwistStamped(twist=Twist(angular=vector(0, 0, 2)))
    behind = stamped_transform((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    assert functions.do_transform_twist(wheel, behind, lever_arm=True).twist == Twist(
        linear=vector(0, -2, 0), angular=vector(0, 0, 2))


# --- points, directions, poses


@given(transforms, poses)
def test_sign_of_a_rotation_is_that_of_tf2(transform, pose):
    """A quaternion alone is the product as it comes."""
    x, y, z, w = pose[3:]
    moved = quaternion(do_transform(Quaternion(x=x, y=y, z=z, w=w), transform))
    turn = quaternion(transform.transform.rotation)
    assert moved == pytest.approx(so3.multiply(turn, pose[3:]), abs=1e-12)
    moved = do_transform(stamped_transform(pose, 'base', 'arm'), transform).transform.rotation
    assert so3.has_tf2_sign(*quaternion(moved))
    moved = functions.do_transform_pose(geometry.pose_message(pose), transform)
    assert moved.orientation.w >= 0.0


@pytest.mark.parametrize('scale', [1.001, 1e-9, 1e9, -3.0])
def test_quaternions_need_not_be_of_unit_length(scale):
    transform = stamped_transform((*POSE[:3], *(scale * value for value in POSE[3:])))
    exact = stamped_transform(POSE)
    pose = geometry.pose_message((1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8))
    longer = deepcopy(pose)
    longer.orientation = Quaternion(y=0.6 * scale, w=0.8 * scale)
    assert_same(do_transform(longer, transform), do_transform(pose, exact))
    assert_same(do_transform(Point(x=1.0), transform), do_transform(Point(x=1.0), exact))
    array = functions.do_transform_pose_array(msg.PoseArray(poses=[pose, longer]), transform)
    assert_same(array.poses[1], array.poses[0])


@pytest.mark.parametrize('count', [0, 1, 2, 100])
def test_lists_of_points_and_poses_are_moved_one_by_one(count):
    transform, rng = stamped_transform(POSE), np.random.default_rng(5)
    points = [filled(msg.Point32, rng) for _ in range(count)]
    some = [unit_quaternions(filled(Pose, rng)) for _ in range(count)]
    polygon = msg.PolygonStamped(polygon=msg.Polygon(points=points))
    path = Path(header=Header(frame_id='base'), poses=[PoseStamped(pose=pose) for pose in some])
    array = functions.do_transform_pose_array(msg.PoseArray(poses=some), transform).poses
    assert all(pose.orientation.w >= 0.0 for pose in array)
    for moved, before in (
            (functions.do_transform_polygon_stamped(polygon, transform).polygon.points, points),
            (array, some),
            ([each.pose for each in functions.do_transform_path(path, transform).poses], some)):
        for one, alone in zip(moved, before, strict=True):
            assert_same(one, do_transform(alone, transform), 1e-12)


def test_path_keeps_the_stamps_and_refuses_a_second_frame():
    path = Path(header=Header(frame_id='base'), poses=[PoseStamped(), PoseStamped()])
    path.poses[0].header.stamp.sec = 3
    path.poses[1].header.frame_id = 'base'
    moved = functions.do_transform_path(path, stamped_transform(POSE))
    assert [(pose.header.frame_id, pose.header.stamp.sec) for pose in moved.poses] == [
        ('map', 3), ('map', 0)]
    path.poses[1].header.frame_id = 'odom'
    with pytest.raises(InvalidArgumentException,
                       match=r"poses\[1\] of the path is in 'odom', the path in 'base'"):
        functions.do_transform_path(path, stamped_transform(POSE))


# --- covariances


@for_each(class_and_part=[(msg.PoseWithCovarianceStamped, 'pose'), (Odometry, 'pose'),
                          (msg.TwistWithCovarianceStamped, 'twist'),
                          (msg.AccelWithCovarianceStamped, 'accel')])
def test_covariance_in_a_message_is_turned_beside_its_mean(class_and_part):
    (cls, part), transform = class_and_part, stamped_transform(POSE)
    message = filled(cls, np.random.default_rng(7))
    covered, moved = getattr(message, part), getattr(do_transform(message, transform), part)
    assert moved.covariance == pytest.approx(
        functions.transform_covariance(covered.covariance, transform))
    assert getattr(moved, part) == do_transform(getattr(covered, part), transform)


@given(transforms, seeds)
def test_covariance_goes_by_the_adjoint_of_a_twist(transform, seed):
    """That is the rotation of each block, unless the twist is carried along the lever arm."""
    rng = np.random.default_rng(seed)
    message, factor = filled(msg.TwistWithCovarianceStamped, rng), rng.normal(size=(6, 6))
    message.twist.covariance = (factor @ factor.T).reshape(36)
    turned = functions.transform_covariance(message.twist.covariance.tolist(), transform)
    pose = geometry.transform_values(transform.transform)
    for lever_arm, a_T_b in ((False, (0.0, 0.0, 0.0, *pose[3:])), (True, pose)):
        moved = functions.do_transform_twist_with_covariance(message, transform, lever_arm).twist
        assert lever_arm or np.array_equal(moved.covariance, turned)
        adjoint = np.array([carry(a_T_b, tuple(unit)) for unit in np.eye(6).tolist()]).T
        assert moved.covariance.reshape(6, 6) == pytest.approx(
            adjoint @ factor @ factor.T @ adjoint.T, rel=1e-9, abs=1e-9)
        assert numbers(moved.twist) == pytest.approx(
            adjoint @ numbers(message.twist.twist), rel=1e-12, abs=1e-9)


# --- the velocities of a buffer


@for_each(frame_and_linear=[(None, [2.0, 0.0, 0.0]), ('base', [0.0, -2.0, 0.0])])
def test_velocity_says_what_moves_and_in_whose_axes(frame_and_linear):
    frame, linear = frame_and_linear
    buffer, axes, interval = Buffer(), frame or 'odom', Duration(seconds=0.2)
    for step in range(21):
        buffer.insert('odom', 'base', SECOND + step * SECOND // 10,
                      PlainPose.from_xyz_rpy(x=0.2 * step, yaw=math.pi / 2))
    message = buffer.lookup_twist('base', 'odom', at(2).to_msg(), interval, reference_frame=frame)
    assert (message.header.frame_id, message.header.stamp) == (axes, at(2).to_msg())
    assert (message.body_frame_id, message.reference_frame_id) == ('base', 'odom')
    expected = pytest.approx([*linear, 0.0, 0.0, 0.0], rel=1e-12, abs=1e-9)
    assert numbers(message.velocity) == expected
    assert deserialize_message(serialize_message(message), type(message)) == message

    moved = do_transform(buffer.lookup_twist('base', 'odom', at(2), interval),
                         buffer.lookup_transform(axes, 'odom', at(2)))
    assert numbers(moved.velocity) == expected
    moved.velocity = message.velocity
    assert moved == message
    twists = buffer.lookup_twist_many('base', 'odom', [at(2)], interval, reference_frame=frame)
    assert twists[0] == expected


def test_velocity_with_covariance_is_the_message_of_ros():
    rng, buffer, interval = np.random.default_rng(1), Buffer(), Duration(seconds=0.2)
    for step in range(100):
        buffer.insert('odom', 'base', SECOND + step * SECOND // 10,
                      PlainPose(x=0.2 * step + rng.normal(scale=0.01)))
    message = buffer.lookup_twist_uncertain(
        'base', 'odom', at(2), interval, reference_frame='base')
    velocity, covariance = tf_tree_py.lookup_twist_uncertain(
        buffer, 'base', 'odom', 2 * SECOND, SECOND // 5, reference_frame='base')
    assert (message.header.frame_id, message.header.stamp) == ('base', at(2).to_msg())
    assert numbers(message.twist.twist).tolist() == [*velocity.linear, *velocity.angular]
    assert message.twist.covariance.tolist() == covariance.ravel().tolist()
    assert covariance[0, 0] == pytest.approx(2.0 * (0.01 / 0.2)**2, rel=0.5)
    assert deserialize_message(serialize_message(message), type(message)) == message


@pytest.mark.parametrize(('cls', 'other'), [
    (PoseStamped, 'do_transform_pose_stamped'),
    (msg.PoseWithCovarianceStamped, 'do_transform_pose_with_covariance_stamped')])
def test_a_pose_with_a_header_is_refused_with_what_to_call(cls, other):
    with pytest.raises(TypeError, match=f'this is a {cls.__name__}: call {other}, or'):
        functions.do_transform_pose(cls(), BY_HAND)
    assert getattr(functions, other)(cls(), BY_HAND).header == BY_HAND.header
