# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The conversion of a LaserScan to a point cloud."""

from copy import deepcopy
import math

import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointField
from std_msgs.msg import Header
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.messages.do_transform import do_transform_laser_scan
from tf_tree_py.ros.messages.laser_scan import as_cloud, points_of_scan
from tf_tree_py.ros.messages.point_cloud import field_column, points_of

INF, NAN = math.inf, math.nan


def scan_of(ranges, **fields):
    return LaserScan(**{
        'header': Header(frame_id='laser'), 'angle_min': -math.pi / 2,
        'angle_increment': math.pi / 4, 'range_min': 0.5, 'range_max': 10.0,
        'ranges': ranges, **fields})


def names(cloud):
    return [field.name for field in cloud.fields]


def values(cloud, name):
    return field_column(cloud, name).reshape(-1).tolist()


def test_rays_point_where_their_angles_say():
    cloud = as_cloud(scan_of([1.0, 2.0, 3.0, 4.0, 5.0]))
    root = 2 ** -0.5
    expected = [[0, -1, 0], [2 * root, -2 * root, 0], [3, 0, 0], [4 * root, 4 * root, 0],
                [0, 5, 0]]
    assert points_of(cloud) == pytest.approx(np.array(expected), abs=1e-6)
    assert cloud.header.frame_id == 'laser'
    assert names(cloud) == ['x', 'y', 'z']
    assert {field.datatype for field in cloud.fields} == {PointField.FLOAT32}
    assert cloud.is_dense


@pytest.mark.filterwarnings('error')
def test_only_rays_that_hit_something_are_points():
    scan = scan_of([INF, -INF, NAN, 0.0, 0.49, 0.5, 10.0, 10.01, -1.0])
    ranges = np.linalg.norm(points_of(as_cloud(scan)), axis=1)
    assert ranges == pytest.approx([0.5, 10.0], rel=1e-6)
    assert np.linalg.norm(points_of_scan(scan), axis=1) == pytest.approx([0.5, 10.0], rel=1e-6)


@pytest.mark.filterwarnings('error')
def test_a_range_that_is_infinite_hits_nothing_even_without_a_limit():
    assert len(points_of_scan(scan_of([1.0, INF], range_max=INF))) == 1


def test_limits_are_compared_as_the_ranges_are_stored():
    # 0.1 and 3.3 have no exact float32: the stored values are slightly greater or smaller.
    scan = scan_of([0.1, 3.3], range_min=0.1, range_max=3.3)
    assert len(points_of(as_cloud(scan))) == 2


@pytest.mark.filterwarnings('error')
def test_invalid_rays_are_kept_as_nan_when_asked():
    cloud = as_cloud(scan_of([1.0, INF, 2.0, NAN], intensities=[1.0, 2.0, 3.0, 4.0]), True)
    assert np.isnan(points_of(cloud)).all(axis=1).tolist() == [False, True, False, True]
    assert values(cloud, 'intensity') == [1.0, 2.0, 3.0, 4.0]
    assert not cloud.is_dense
    assert as_cloud(scan_of([1.0, 2.0]), True).is_dense


def test_intensities_stay_with_their_rays():
    cloud = as_cloud(scan_of([1.0, INF, 2.0], intensities=[7.0, 8.0, 9.0]))
    assert values(cloud, 'intensity') == [7.0, 9.0]
    assert 'intensity' not in names(as_cloud(scan_of([1.0, 2.0], intensities=[7.0])))


def test_rays_know_when_they_were_taken():
    cloud = as_cloud(scan_of([1.0, INF, 2.0], time_increment=0.25))
    assert values(cloud, 'time') == [0.0, 0.5]
    assert 'time' not in names(as_cloud(scan_of([1.0])))


@pytest.mark.parametrize('ranges', [[], [INF, NAN]])
def test_a_scan_of_nothing_gives_an_empty_cloud(ranges):
    cloud = as_cloud(scan_of(ranges))
    assert (cloud.height, cloud.width, len(cloud.data)) == (1, 0, 0)
    assert points_of(cloud).shape == (0, 3)


def test_scan_is_moved_and_not_changed():
    scan = scan_of([1.0, INF, 2.0], intensities=[1.0, 2.0, 3.0])
    before = deepcopy(scan)
    transform = transform_stamped(
        'map', 'laser', 5, (1.0, 2.0, 3.0, 0.0, 0.0, 2 ** -0.5, 2 ** -0.5))
    cloud = do_transform_laser_scan(scan, transform)
    assert points_of(cloud) == pytest.approx(np.array([[2.0, 2.0, 3.0], [1.0, 4.0, 3.0]]))
    assert cloud.header == transform.header
    assert values(cloud, 'intensity') == [1.0, 3.0]
    assert scan == before
    cloud.header.frame_id = 'other'
    assert (scan, transform.header.frame_id) == (before, 'map')


@pytest.mark.parametrize('fields', [{'range_max': 20, 'angle_increment': 1},
                                    {'time_increment': 1, 'range_min': 0}])
def test_ints_are_numbers_too(fields):
    assert points_of(as_cloud(scan_of([1, 2], **fields))).shape == (2, 3)
