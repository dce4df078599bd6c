# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The conversion of messages to arrays."""

from geometry_msgs.msg import (
    Point,
    Point32,
    Polygon,
    PolygonInstance,
    PolygonInstanceStamped,
    PolygonStamped,
    Pose as PoseMessage,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3Stamped,
)
from hypothesis import given
from message_tools import poses, stamped_transform
from nav_msgs.msg import Odometry, Path
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.ros.messages.arrays import as_matrix, as_points
from tf_tree_py.ros.messages.geometry import pose_message
from tf_tree_py.ros.messages.point_cloud import packed_cloud

CORNERS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@given(poses)
def test_everything_with_a_pose_becomes_its_matrix(values):
    message = pose_message(values)
    covered = PoseWithCovariance(pose=message)
    expected = se3.as_matrix(values)
    for thing in (stamped_transform(values), stamped_transform(values).transform, message,
                  PoseStamped(pose=message), covered, PoseWithCovarianceStamped(pose=covered),
                  Odometry(pose=covered), Pose(*values)):
        matrix = as_matrix(thing)
        assert matrix.shape == (4, 4)
        assert matrix == pytest.approx(expected, abs=1e-12)


def test_matrix_is_a_rotation_whatever_the_quaternion_is():
    assert as_matrix(PoseMessage(orientation=Quaternion(w=5.0))) == pytest.approx(np.eye(4))
    assert as_matrix(PoseMessage(orientation=Quaternion(w=0.0))) == pytest.approx(np.eye(4))
    assert as_matrix(TransformStamped()) == pytest.approx(np.eye(4))


def test_points_of_polygons():
    corners = [Point32(x=x, y=y, z=z) for x, y, z in CORNERS.tolist()]
    polygon = Polygon(points=corners)
    instance = PolygonInstance(polygon=polygon)
    for message in (polygon, PolygonStamped(polygon=polygon), instance,
                    PolygonInstanceStamped(polygon=instance)):
        assert as_points(message).tolist() == CORNERS.tolist()


def test_points_of_poses():
    several = [PoseMessage(position=Point(x=x, y=y, z=z)) for x, y, z in CORNERS.tolist()]
    assert as_points(PoseArray(poses=several)).tolist() == CORNERS.tolist()
    path = Path(poses=[PoseStamped(pose=pose) for pose in several])
    assert as_points(path).tolist() == CORNERS.tolist()


def test_points_of_a_cloud_and_of_a_scan():
    columns = dict(zip('xyz', CORNERS.T.astype(np.float32), strict=True))
    cloud = packed_cloud(Header(), columns, True)
    points = as_points(cloud)
    assert (points.tolist(), points.dtype) == (CORNERS.tolist(), np.float32)
    points[:] = 0.0
    assert as_points(cloud).tolist() == CORNERS.tolist()
    scan = LaserScan(range_max=10.0, angle_increment=np.pi / 2, ranges=[1.0, float('inf'), 2.0])
    assert as_points(scan) == pytest.approx(np.array([[1.0, 0, 0], [-2.0, 0, 0]]), abs=1e-6)


@pytest.mark.parametrize('empty', [Polygon(), PoseArray(), Path(), PointCloud2(), LaserScan()])
def test_nothing_gives_no_points(empty):
    assert as_points(empty).shape == (0, 3)


def test_other_things_are_refused_by_name():
    with pytest.raises(TypeError, match='Vector3Stamped is none of Transform, '):
        as_matrix(Vector3Stamped())
    with pytest.raises(TypeError, match='PoseStamped is none of Polygon, '):
        as_points(PoseStamped())


def test_ints_become_floats():
    points = as_points(Polygon(points=[Point32(x=1, y=2, z=3)]))
    assert points.dtype == float
    assert as_matrix(PoseMessage(position=Point(x=1), orientation=Quaternion(w=1))).dtype == float
