# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The core's deskewing, of the points of a scan and of what is no scan."""

import lidar_scene
from lidar_scene import SECOND, thickness, WALL_X
import numpy as np
import pytest
from tf_tree_py import deskew, InvalidArgumentException

SCAN_START = 10 * SECOND


@pytest.fixture
def driving():
    return lidar_scene.driving(SCAN_START)


@pytest.fixture
def scan():
    return lidar_scene.scan(SCAN_START)


def test_wall_is_flat_only_after_deskewing(driving, scan):
    points, stamps = scan
    assert thickness(points) > 0.02
    moved = deskew(driving, points, stamps, 'lidar', 'lidar', SCAN_START)
    assert thickness(moved) < 0.001


def test_wall_stands_where_it_is(driving, scan):
    points, stamps = scan
    in_odom = deskew(driving, points, stamps, 'odom', 'lidar', SCAN_START)
    assert in_odom[:, 0] == pytest.approx(WALL_X, abs=0.001)


def test_points_keep_their_floating_type_and_their_holes(driving, scan):
    points, stamps = scan
    holed = points.astype(np.float32)
    holed[7] = np.nan
    moved = deskew(driving, holed, stamps, 'base_link', 'lidar', SCAN_START)
    assert moved.dtype == np.float32
    assert np.isnan(moved[7]).all()
    assert not np.isnan(np.delete(moved, 7, axis=0)).any()


@pytest.mark.parametrize(('points_shape', 'stamps_shape'), [
    ((4, 2), (4,)), ((4, 3), (3,)), ((3,), (3,)), ((4, 3), (4, 1)),
])
def test_shapes_that_do_not_fit_are_named(driving, points_shape, stamps_shape):
    with pytest.raises(
            InvalidArgumentException, match=r'points must be \(N, 3\) with stamps \(N,\)'):
        deskew(driving, np.zeros(points_shape), np.zeros(stamps_shape, dtype=int),
               'lidar', 'lidar', SCAN_START)


def test_an_empty_scan_stays_empty(driving):
    moved = deskew(driving, np.zeros((0, 3)), np.zeros(0, dtype=int), 'lidar', 'lidar',
                   SCAN_START)
    assert moved.shape == (0, 3)
