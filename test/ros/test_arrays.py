# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The conversion of messages to arrays."""

from geometry_msgs import msg
from hypothesis import given
from inputs import for_each
from message_tools import poses, stamped_transform
from nav_msgs.msg import Odometry, Path
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.ros.messages.do_transform import as_matrix, as_points
from tf_tree_py.ros.messages.geometry import pose_message
from tf_tree_py.ros.messages.point_cloud import packed_cloud

CORNERS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@given(poses)
def test_everything_with_a_pose_becomes_its_matrix(values):
    message = pose_message(values)
    covered = msg.PoseWithCovariance(pose=message)
    for thing in (stamped_transform(values), stamped_transform(values).transform, message,
                  msg.PoseStamped(pose=message), covered, Odometry(pose=covered),
                  msg.PoseWithCovarianceStamped(pose=covered), Pose(*values)):
        matrix = as_matrix(thing)
        assert matrix.shape == (4, 4)
        assert matrix == pytest.approx(se3.as_matrix(values), rel=1e-12)


@for_each(message=[msg.Pose(orientation=msg.Quaternion(w=5.0)), msg.TransformStamped(),
                   msg.Pose(orientation=msg.Quaternion(w=0.0)),
                   msg.Pose(position=msg.Point(x=0), orientation=msg.Quaternion(w=1))])
def test_matrix_is_of_floats_and_rotates_whatever_the_quaternion_is(message):
    assert as_matrix(message) == pytest.approx(np.eye(4))
    assert as_matrix(message).dtype == float


POLYGON = msg.Polygon(points=[msg.Point32(x=x, y=y, z=z) for x, y, z in CORNERS.tolist()])
# A message accepts ints, too.
INTS = msg.Polygon(points=[msg.Point32(x=1, y=2, z=3), msg.Point32(x=4, y=5, z=6)])
SEVERAL = [msg.Pose(position=msg.Point(x=x, y=y, z=z)) for x, y, z in CORNERS.tolist()]


@for_each(message=[
    POLYGON, INTS, msg.PolygonStamped(polygon=POLYGON), msg.PolygonInstance(polygon=POLYGON),
    msg.PolygonInstanceStamped(polygon=msg.PolygonInstance(polygon=POLYGON)),
    msg.PoseArray(poses=SEVERAL), Path(poses=[msg.PoseStamped(pose=pose) for pose in SEVERAL])])
def test_polygons_and_poses_become_points(message):
    points = as_points(message)
    assert (points.tolist(), points.dtype) == (CORNERS.tolist(), float)


def test_clouds_and_scans_become_points():
    columns = dict(zip('xyz', CORNERS.T.astype(np.float32), strict=True))
    cloud = packed_cloud(Header(), columns, True)
    points = as_points(cloud)
    assert (points.tolist(), points.dtype) == (CORNERS.tolist(), np.float32)
    points[:] = 0.0
    assert as_points(cloud).tolist() == CORNERS.tolist()
    scan = LaserScan(range_max=10.0, ranges=[1.0, float('inf'), 2.0])
    assert as_points(scan).tolist() == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]


@for_each(empty=[msg.Polygon(), msg.PoseArray(), Path(), PointCloud2(), LaserScan()])
def test_nothing_gives_no_points(empty):
    assert as_points(empty).shape == (0, 3)


def test_other_things_are_refused_by_name():
    with pytest.raises(TypeError, match='Vector3Stamped is none of Transform, '):
        as_matrix(msg.Vector3Stamped())
    with pytest.raises(TypeError, match='PoseStamped is none of Polygon, '):
        as_points(msg.PoseStamped())
