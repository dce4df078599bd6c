# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot that turns at changing rates, with and without a gyroscope."""

import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose

SECOND = 1_000_000_000
MS = 1_000_000


def turning(seconds):
    """Return the pose of a robot that goes on the spot from side to side."""
    return Pose.from_xyz_rpy(yaw=0.5 * np.sin(2.0 * seconds))


def aided(gyro_until, poses_until=6 * SECOND):
    """Return a robot that drives along x and turns at changing rates, at 20 Hz."""
    buffer = BufferCore()
    for stamp in range(0, poses_until + 1, 50 * MS):
        buffer.insert('odom', 'base', stamp, turning(stamp / SECOND))
    stamps = np.arange(0, gyro_until + 1, 5 * MS)
    rates = np.zeros((len(stamps), 3))
    rates[:, 2] = np.cos(2e-9 * stamps)
    buffer.aid('base', stamps, rates)
    return buffer
