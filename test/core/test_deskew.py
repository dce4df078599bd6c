# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A spinning lidar on a robot that drives and rotates scans a flat wall."""

import math

import numpy as np
import pytest
from tf_tree_py import BufferCore, deskew, InvalidArgumentException, Pose

SECOND = 1_000_000_000
SCAN_START, SCAN_TIME = 10 * SECOND, SECOND // 10
SPEED, TURN_RATE = 1.0, 1.0
WALL_X = 5.0
base_T_lidar = Pose.from_xyz_rpy(x=0.2, z=0.8, yaw=0.3)


def odom_T_base(stamp):
    """Return the pose of a circle: metres a second ahead, radians a second to the left."""
    yaw = TURN_RATE * (stamp - SCAN_START) / SECOND
    radius = SPEED / TURN_RATE
    return Pose.from_xyz_rpy(
        x=radius * math.sin(yaw), y=radius * (1.0 - math.cos(yaw)), yaw=yaw)


@pytest.fixture
def driving():
    buffer = BufferCore()
    buffer.insert('base_link', 'lidar', 0, base_T_lidar, static=True)
    # From before the scan until after it, at 200 Hz.
    for stamp in range(SCAN_START - SCAN_TIME, SCAN_START + 2 * SCAN_TIME, SECOND // 200):
        buffer.insert('odom', 'base_link', stamp, odom_T_base(stamp))
    return buffer


@pytest.fixture
def scan():
    """Return (points, stamps) of two turns of the lidar, each sweeping the wall in a quarter."""
    sweep = np.arange(1000) * (SCAN_TIME // 4000)
    stamps = SCAN_START + np.concatenate([sweep, SCAN_TIME + sweep])
    wall = np.stack([np.full(1000, WALL_X), np.linspace(-2.0, 2.0, 1000),
                     np.linspace(0.2, 1.5, 1000)], axis=1)
    points = [(odom_T_base(stamp) @ base_T_lidar).inverse() @ point
              for stamp, point in zip(stamps.tolist(), [*wall, *wall], strict=True)]
    return np.array(points), stamps


def thickness(points):
    """Return the distance of points from their best plane, metres."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][-1]
    distances = centred @ normal
    return distances.max() - distances.min()


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
