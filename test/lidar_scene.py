# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A spinning lidar on a robot that drives and rotates scans a flat wall."""

from functools import cache
import math

import numpy as np
from tf_tree_py import BufferCore, Pose

SECOND = 1_000_000_000
SCAN_TIME = SECOND // 10
SPEED, TURN_RATE = 1.0, 1.0
WALL_X = 5.0
base_T_lidar = Pose.from_xyz_rpy(x=0.2, z=0.8, yaw=0.3)


def odom_T_base(time_s):
    """Return the pose of a circle: metres a second ahead, radians a second to the left."""
    yaw = TURN_RATE * time_s
    radius = SPEED / TURN_RATE
    return Pose.from_xyz_rpy(
        x=radius * math.sin(yaw), y=radius * (1.0 - math.cos(yaw)), yaw=yaw)


def driving(start):
    """Return a buffer with the robot's drive, from before the scan until after it, at 200 Hz."""
    buffer = BufferCore()
    buffer.insert('base_link', 'lidar', 0, base_T_lidar, static=True)
    for stamp in range(start - 2 * SCAN_TIME, start + 3 * SCAN_TIME, SECOND // 200):
        buffer.insert('odom', 'base_link', stamp, odom_T_base((stamp - start) / SECOND))
    return buffer


def scan(start):
    """Return (points, stamps) of two turns of the lidar, each sweeping the wall in a quarter."""
    points, offsets = _two_turns()
    return points.copy(), start + offsets


@cache
def _two_turns():
    sweep = np.arange(1000) * (SCAN_TIME // 4000)
    offsets = np.concatenate([sweep, SCAN_TIME + sweep])
    wall = np.stack([np.full(1000, WALL_X), np.linspace(-2.0, 2.0, 1000),
                     np.linspace(0.2, 1.5, 1000)], axis=1)
    points = [(odom_T_base(offset / SECOND) @ base_T_lidar).inverse() @ point
              for offset, point in zip(offsets.tolist(), [*wall, *wall], strict=True)]
    return np.array(points), offsets


def thickness(points):
    """Return the distance of points from their best plane, metres."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][-1]
    distances = centred @ normal
    return distances.max() - distances.min()
