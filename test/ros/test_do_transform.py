# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every type of message that can be transformed, compared with matrices and its own inverse."""

from copy import deepcopy
import itertools

from effort import examples
from geometry_msgs.msg import (
    Accel,
    AccelStamped,
    AccelWithCovarianceStamped,
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
    VelocityStamped,
    Wrench,
    WrenchStamped,
)
from hypothesis import given
from inputs import for_each
from message_tools import (
    filled,
    inverse_of,
    leaves,
    mutable_parts,
    numbers,
    poses,
    seeds,
    spoil,
    stamped_transform,
    transforms,
)
from nav_msgs.msg import Odometry, Path
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.screws import carry
from tf_tree_py.ros.messages import do_transform as functions, geometry
from tf_tree_py.ros.messages.do_transform import do_transform, TRANSFORMERS
from tf_tree_py.ros.messages.registry import STAMPED_FORMS

GEOMETRY = [kind for kind in TRANSFORMERS if kind not in (LaserScan, PointCloud2)]
WITH_HEADER = [kind for kind in GEOMETRY if hasattr(kind, 'header')]

POSE = (1.0, -2.0, 3.0, 0.5, -0.5, 0.5, -0.5)

# Half a turn about x, and a translation of 10, 20, 30: easy to check by hand.
BY_HAND = stamped_transform((10.0, 20.0, 30.0, 1.0, 0.0, 0.0, 0.0))


def xyz(message):
    return np.array([message.x, message.y, message.z])


def quaternion(message):
    return (message.x, message.y, message.z, message.w)


def matrix_of(pose_message):
    return se3.as_matrix(geometry.pose_values(pose_message))


def unit_quaternions(message):
    """Normalise the quaternions in a message to rotations, as in real messages."""
    for part in mutable_parts(message):
        if isinstance(part, Quaternion):
            part.x, part.y, part.z, part.w = so3.normalize(quaternion(part))
    return message


def assert_same(a, b, tolerance=1e-9):
    """Assert that two messages are equal except for rounding and the signs of quaternions."""
    assert type(a) is type(b)
    for one, other in zip(mutable_parts(a), mutable_parts(b), strict=True):
        if isinstance(one, Quaternion) and np.dot(quaternion(one), quaternion(other)) < 0.0:
            one.x, one.y, one.z, one.w = (-value for value in quaternion(one))
    for (path, one), (_, other) in zip(leaves(a), leaves(b), strict=True):
        if isinstance(one, float):
            assert one == pytest.approx(other, abs=tolerance), path
        elif '.header.' not in path:
            assert one == other, path


# --- properties of every type


@for_each(kind=GEOMETRY)
def test_result_is_of_the_same_kind_in_the_target_frame(kind):
    transform = stamped_transform(POSE)
    result = do_transform(filled(kind, np.random.default_rng(1)), transform)
    assert type(result) is kind
    if kind in WITH_HEADER:
        assert result.header == transform.header


@for_each(kind=GEOMETRY)
def test_result_shares_nothing_and_changes_nothing(kind):
    message, transform = filled(kind, np.random.default_rng(2)), stamped_transform(POSE)
    message_before, transform_before = deepcopy(message), deepcopy(transform)
    result = do_transform(message, transform)
    result_before = deepcopy(result)
    assert (message, transform) == (message_before, transform_before)

    mine = {id(part) for part in mutable_parts(result)}
    assert not mine & {id(part) for part in (*mutable_parts(message), *mutable_parts(transform))}
    spoil(result)
    assert (message, transform) == (message_before, transform_before)
    result = do_transform(message, transform)
    spoil(message)
    spoil(transform)
    assert result == result_before


@for_each(kind=STAMPED_FORMS)
def test_messages_with_and_without_header_are_moved_alike(kind):
    message = filled(kind, np.random.default_rng(9))
    form, field = STAMPED_FORMS[kind]
    moved = do_transform(form(**{field: message}), stamped_transform(POSE))
    assert getattr(moved, field) == do_transform(message, stamped_transform(POSE))


@for_each(kind=GEOMETRY)
@given(poses, seeds)
def test_there_and_back_again(kind, pose, seed):
    message = unit_quaternions(filled(kind, np.random.default_rng(seed)))
    transform = stamped_transform(pose)
    there = do_transform(message, transform)
    back = do_transform(there, inverse_of(transform, se3.inverse(pose)))
    assert_same(back, message, 1e-9)


@for_each(kind=GEOMETRY)
@examples(0.5)
@given(poses, poses, seeds)
def test_one_after_the_other_is_the_product(kind, a_T_b, b_T_c, seed):
    message = unit_quaternions(filled(kind, np.random.default_rng(seed)))
    steps = do_transform(do_transform(message, stamped_transform(b_T_c, 'base', 'c')),
                         stamped_transform(a_T_b))
    assert_same(steps, do_transform(message, stamped_transform(se3.compose(a_T_b, b_T_c))), 1e-8)


@for_each(kind=GEOMETRY, number=[
    lambda rng: int(rng.integers(-5, 5)), lambda rng: np.float64(rng.normal()),
    lambda rng: np.float32(rng.normal()), lambda rng: np.int64(rng.integers(1, 5)),
    lambda rng: bool(rng.integers(0, 2)),
])
def test_other_numbers_become_floats(kind, number):
    message = filled(kind, np.random.default_rng(3), number)
    transform = stamped_transform((1, 2, 3, 0, 0, 0, 1))
    transform.transform.translation.x = 1
    transform.transform.rotation.w = 1
    result = do_transform(message, transform)
    wanted = [path for path, value in leaves(filled(kind, np.random.default_rng(0)))
              if isinstance(value, float)]
    types = {path: type(value) for path, value in leaves(result)}
    assert {types[path] for path in wanted if 'covariance' not in path} <= {float}
    as_floats = filled(kind, np.random.default_rng(3), lambda rng: float(number(rng)))
    assert numbers(result) == pytest.approx(numbers(do_transform(as_floats, transform)), abs=1e-6)
    # A message accepts an int for a float field, and then serializes garbage.
    arrived = deserialize_message(serialize_message(result), kind)
    assert numbers(arrived) == pytest.approx(numbers(result), rel=1e-6)


@for_each(kind=GEOMETRY)
def test_nan_stays_and_raises_nothing(kind):
    message = filled(kind, np.random.default_rng(4), lambda rng: float('nan'))
    assert np.isnan(numbers(do_transform(message, stamped_transform(POSE)))).any()


# --- points and directions


@given(transforms, seeds)
def test_points_and_vectors_go_by_the_matrix(transform, seed):
    rng = np.random.default_rng(seed)
    matrix = se3.as_matrix(geometry.transform_values(transform.transform))
    point, vector = filled(PointStamped, rng), filled(Vector3Stamped, rng)
    assert xyz(functions.do_transform_point(point, transform).point) == pytest.approx(
        (matrix @ [*xyz(point.point), 1.0])[:3], abs=1e-11)
    assert xyz(functions.do_transform_vector3(vector, transform).vector) == pytest.approx(
        matrix[:3, :3] @ xyz(vector.vector), abs=1e-12)
    for kind in (Point, Point32):
        point = filled(kind, rng)
        assert xyz(do_transform(point, transform)) == pytest.approx(
            (matrix @ [*xyz(point), 1.0])[:3], abs=1e-11)
    vector = filled(Vector3, rng)
    assert xyz(do_transform(vector, transform)) == pytest.approx(
        matrix[:3, :3] @ xyz(vector), abs=1e-12)


def test_points_and_vectors_by_hand():
    point = PointStamped(point=Point(x=1.0, y=2.0, z=3.0))
    assert xyz(functions.do_transform_point(point, BY_HAND).point).tolist() == [11.0, 18.0, 27.0]
    vector = Vector3Stamped(vector=Vector3(x=1.0, y=2.0, z=3.0))
    moved = functions.do_transform_vector3(vector, BY_HAND).vector
    assert xyz(moved).tolist() == [1.0, -2.0, -3.0]


@pytest.mark.parametrize('count', [0, 1, 2, 100])
def test_polygon_is_its_points(count):
    transform, rng = stamped_transform(POSE), np.random.default_rng(5)
    polygon = PolygonStamped(polygon=Polygon(points=[filled(Point32, rng) for _ in range(count)]))
    moved = functions.do_transform_polygon_stamped(polygon, transform).polygon.points
    assert [type(point) for point in moved] == [Point32] * count
    for point, before in zip(moved, polygon.polygon.points, strict=True):
        assert xyz(point) == pytest.approx(xyz(do_transform(before, transform)), abs=1e-12)


# --- poses


@given(transforms, poses)
def test_poses_go_by_the_product_of_matrices(transform, pose):
    message = geometry.pose_message(pose)
    moved = functions.do_transform_pose(message, transform)
    assert type(moved) is Pose
    expected = se3.as_matrix(geometry.transform_values(transform.transform)) @ se3.as_matrix(pose)
    assert matrix_of(moved) == pytest.approx(expected, abs=1e-10)
    assert moved.orientation.w >= 0.0
    same = functions.do_transform_pose_stamped(PoseStamped(pose=message), transform)
    assert (same.pose, same.header) == (moved, transform.header)


@given(transforms, transforms)
def test_transform_has_the_sign_of_tf2(a_T_b, b_T_c):
    moved = functions.do_transform_transform(b_T_c, a_T_b).transform.rotation
    assert so3.has_tf2_sign(*quaternion(moved))


def test_pose_by_hand():
    pose = Pose(position=Point(x=1.0, y=2.0, z=3.0), orientation=Quaternion(w=1.0))
    moved = functions.do_transform_pose(pose, BY_HAND)
    assert xyz(moved.position).tolist() == [11.0, 18.0, 27.0]
    assert quaternion(moved.orientation) == (1.0, 0.0, 0.0, 0.0)


@given(transforms, poses)
def test_quaternion_is_the_product_as_it_comes(transform, pose):
    x, y, z, w = pose[3:]
    message = QuaternionStamped(quaternion=Quaternion(x=x, y=y, z=z, w=w))
    moved = functions.do_transform_quaternion(message, transform).quaternion
    turn = quaternion(transform.transform.rotation)
    assert quaternion(moved) == pytest.approx(so3.multiply(turn, pose[3:]), abs=1e-12)


@pytest.mark.parametrize('scale', [1.001, 1e-9, 1e9, -3.0])
def test_quaternions_need_not_be_of_unit_length(scale):
    transform = stamped_transform((*POSE[:3], *(scale * value for value in POSE[3:])))
    exact = stamped_transform(POSE)
    pose = geometry.pose_message((1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8))
    longer = deepcopy(pose)
    longer.orientation = Quaternion(y=0.6 * scale, w=0.8 * scale)
    assert_same(functions.do_transform_pose(longer, transform),
                functions.do_transform_pose(pose, exact))
    assert_same(do_transform(Point(x=1.0), transform), do_transform(Point(x=1.0), exact))
    array = functions.do_transform_pose_array(PoseArray(poses=[pose, longer]), transform)
    assert_same(array.poses[1], array.poses[0])


def test_a_quaternion_of_zeros_is_no_rotation():
    nobody_filled = Pose(orientation=Quaternion(w=0.0), position=Point(x=1.0))
    moved = functions.do_transform_pose(nobody_filled, BY_HAND)
    assert quaternion(moved.orientation) == (1.0, 0.0, 0.0, 0.0)
    assert xyz(moved.position).tolist() == [11.0, 20.0, 30.0]
    array = functions.do_transform_pose_array(PoseArray(poses=[nobody_filled]), BY_HAND)
    assert array.poses == [moved]


def test_transform_keeps_its_child():
    message = stamped_transform((0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), 'base', 'camera')
    moved = do_transform(message, BY_HAND)
    assert type(moved) is TransformStamped
    assert (moved.header.frame_id, moved.child_frame_id) == ('map', 'camera')
    assert xyz(moved.transform.translation).tolist() == [10.0, 20.0, 29.0]


@pytest.mark.parametrize('count', [0, 1, 50])
def test_pose_array_and_path_are_their_poses(count):
    transform, rng = stamped_transform(POSE), np.random.default_rng(6)
    some = [unit_quaternions(filled(Pose, rng)) for _ in range(count)]
    expected = [functions.do_transform_pose(pose, transform) for pose in some]
    array = functions.do_transform_pose_array(PoseArray(poses=some), transform)
    assert len(array.poses) == count
    assert all(pose.orientation.w >= 0.0 for pose in array.poses)
    for pose, wanted in zip(array.poses, expected, strict=True):
        assert_same(pose, wanted, 1e-12)
    path = Path(header=Header(frame_id='base'), poses=[PoseStamped(pose=pose) for pose in some])
    for pose, wanted in zip(functions.do_transform_path(path, transform).poses, expected,
                            strict=True):
        assert_same(pose.pose, wanted, 1e-12)


def test_path_keeps_the_time_of_each_pose():
    path = Path(header=Header(frame_id='base'), poses=[PoseStamped(), PoseStamped()])
    path.poses[0].header.stamp.sec = 3
    path.poses[1].header.frame_id = 'base'
    moved = functions.do_transform_path(path, stamped_transform(POSE))
    assert [pose.header.frame_id for pose in moved.poses] == ['map', 'map']
    assert [pose.header.stamp.sec for pose in moved.poses] == [3, 0]


def test_path_that_is_in_two_frames_is_refused():
    path = Path(header=Header(frame_id='base'), poses=[PoseStamped(), PoseStamped()])
    path.poses[1].header.frame_id = 'odom'
    with pytest.raises(InvalidArgumentException,
                       match=r"poses\[1\] of the path is in 'odom', the path in 'base'"):
        functions.do_transform_path(path, stamped_transform(POSE))


# --- covariances


def correlated(rng):
    factor = rng.normal(size=(6, 6))
    return factor @ factor.T


@given(transforms, seeds)
def test_covariance_is_turned_block_by_block(transform, seed):
    covariance = correlated(np.random.default_rng(seed))
    rotation = np.array(so3.as_matrix(geometry.transform_values(transform.transform)[3:]))
    moved = functions.transform_covariance(covariance.reshape(36), transform)
    assert moved.shape == (36,)
    square = moved.reshape(6, 6)
    for row, column in itertools.product((0, 3), (0, 3)):
        block = covariance[row:row + 3, column:column + 3]
        assert square[row:row + 3, column:column + 3] == pytest.approx(
            rotation @ block @ rotation.T, abs=1e-12)
    assert np.linalg.eigvalsh(square) == pytest.approx(np.linalg.eigvalsh(covariance), abs=1e-10)


def test_covariance_by_hand():
    transform = stamped_transform((1.0, 2.0, 3.0, 0.0, 0.0, 2 ** -0.5, 2 ** -0.5))
    covariance = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    covariance[0, 4] = covariance[4, 0] = 0.5
    moved = functions.transform_covariance(covariance.reshape(36).tolist(), transform)
    expected = np.diag([2.0, 1.0, 3.0, 5.0, 4.0, 6.0])
    expected[1, 3] = expected[3, 1] = -0.5
    assert moved.reshape(6, 6) == pytest.approx(expected, abs=1e-12)


def test_messages_with_covariance_use_it():
    transform, rng = stamped_transform(POSE), np.random.default_rng(7)
    for kind, part in ((PoseWithCovarianceStamped, 'pose'), (TwistWithCovarianceStamped, 'twist'),
                       (AccelWithCovarianceStamped, 'accel'), (Odometry, 'pose')):
        message = filled(kind, rng)
        covariance = getattr(message, part).covariance
        moved = getattr(do_transform(message, transform), part).covariance
        assert moved == pytest.approx(functions.transform_covariance(covariance, transform))
    message = filled(PoseWithCovariance, rng)
    assert do_transform(message, transform).pose == do_transform(message.pose, transform)


# --- motion and force


def test_wrench_has_the_lever_arm_of_its_new_point():
    # By hand: f = (1 -2 -3), turned torque (1 -2 -3), t x f = (0 60 -40).
    wrench = WrenchStamped(wrench=Wrench(force=Vector3(x=1.0, y=2.0, z=3.0),
                                         torque=Vector3(x=1.0, y=2.0, z=3.0)))
    moved = functions.do_transform_wrench(wrench, BY_HAND).wrench
    assert xyz(moved.force).tolist() == [1.0, -2.0, -3.0]
    assert xyz(moved.torque).tolist() == [1.0, 58.0, -43.0]
    free = functions.do_transform_wrench(wrench, BY_HAND, lever_arm=False).wrench
    assert xyz(free.force).tolist() == [1.0, -2.0, -3.0]
    assert xyz(free.torque).tolist() == [1.0, -2.0, -3.0]


def test_a_force_off_the_axis_makes_a_torque():
    one_metre_ahead = stamped_transform((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    moved = do_transform(Wrench(force=Vector3(y=5.0)), one_metre_ahead)
    assert xyz(moved.torque).tolist() == [0.0, 0.0, 5.0]


def test_twist_and_accel_are_only_turned():
    vectors = {'linear': Vector3(x=1.0, y=2.0, z=3.0), 'angular': Vector3(x=4.0, y=5.0, z=6.0)}
    for kind, part, inner in ((TwistStamped, 'twist', Twist), (AccelStamped, 'accel', Accel),
                              (VelocityStamped, 'velocity', Twist)):
        moved = getattr(do_transform(kind(**{part: inner(**vectors)}), BY_HAND), part)
        assert xyz(moved.linear).tolist() == [1.0, -2.0, -3.0]
        assert xyz(moved.angular).tolist() == [4.0, -5.0, -6.0]


def test_twist_with_lever_arm_is_that_of_the_point_at_the_target():
    # A wheel rotates at 2 rad/s about z, seen from a frame one metre behind it on the same body.
    twist = TwistStamped(twist=Twist(angular=Vector3(z=2.0)))
    behind = stamped_transform((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    moved = functions.do_transform_twist(twist, behind, lever_arm=True).twist
    assert xyz(moved.linear).tolist() == [0.0, -2.0, 0.0]
    assert xyz(moved.angular).tolist() == [0.0, 0.0, 2.0]


@given(transforms, seeds)
def test_covariance_of_a_carried_twist_goes_by_the_adjoint(transform, seed):
    message = filled(TwistWithCovarianceStamped, np.random.default_rng(seed))
    covariance = correlated(np.random.default_rng(seed))
    message.twist.covariance = covariance.reshape(36)
    moved = functions.do_transform_twist_with_covariance(message, transform, lever_arm=True).twist
    pose = geometry.transform_values(transform.transform)
    adjoint = np.array([carry(pose, tuple(unit)) for unit in np.eye(6).tolist()]).T
    assert moved.covariance.reshape(6, 6) == pytest.approx(
        adjoint @ covariance @ adjoint.T, rel=1e-9, abs=1e-9)
    values = [*xyz(message.twist.twist.linear), *xyz(message.twist.twist.angular)]
    assert [*xyz(moved.twist.linear), *xyz(moved.twist.angular)] == pytest.approx(
        adjoint @ values, abs=1e-9)


def test_velocity_keeps_its_frames():
    message = VelocityStamped(body_frame_id='base', reference_frame_id='odom')
    moved = do_transform(message, BY_HAND)
    assert (moved.body_frame_id, moved.reference_frame_id) == ('base', 'odom')


def test_odometry_keeps_the_twist_of_its_child():
    message = unit_quaternions(filled(Odometry, np.random.default_rng(8)))
    message.child_frame_id = 'base_link'
    moved = do_transform(message, BY_HAND)
    assert moved.child_frame_id == 'base_link'
    assert moved.twist == message.twist
    assert moved.pose == do_transform(message.pose, BY_HAND)
