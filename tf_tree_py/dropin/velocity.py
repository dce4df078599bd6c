# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Velocities as tf2's ``lookupVelocity`` computes them, its errors included.

For code that was tuned to them; ``tf_tree_py.lookup_twist`` returns the correct ones.
"""

import math

import numpy as np
from tf_tree_py.beyond.motion.twist import ORIGIN, Velocity
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import carry
from tf_tree_py.core.geometry.so3 import Quaternion, Vector3
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.tree.queries import Queries


def lookup_velocity(tree: Queries, tracking_frame: str, observation_frame: str, stamp: int,
                    averaging_interval: int, *, reference_frame: str | None = None,
                    reference_point: Vector3 = ORIGIN,
                    reference_point_frame: str | None = None) -> Velocity:
    """
    Return the result of tf2's ``lookupVelocity``; the parameters are those of ``lookup_twist``.

    It is wrong where frames rotate: the displacement, which is already in the observation frame's
    axes, is rotated by reference_R_tracking once more; the velocity is that of the body's point at
    the reference frame's origin, so that a frame that spins in place three metres away has one;
    and the lever to the reference point is multiplied element by element, instead of by a cross
    product. Times are converted to float seconds, rounded as in Jazzy, which may put the newest
    stamp of today's clocks some 100 ns beyond the data. ``LATEST`` gives the velocity at the time
    0.

    It equals Jazzy's to 1e-9 if a frame rotates by more than 1e-6 rad in the interval. For smaller
    rotations the arc cosine returns rounding errors in both, which differ.

    :param stamp: nanoseconds, the middle of the interval unless the data ends before.
    :param averaging_interval: nanoseconds.
    :raises TransformException: as ``lookup`` does.
    """
    reference_frame = reference_frame or observation_frame
    reference_point_frame = reference_point_frame or tracking_frame
    try:
        latest_s = _as_float_seconds(tree.latest_common_time(observation_frame, tracking_frame))
    except TransformException:
        latest_s = 0.0  # the lookups raise the reason
    stamp_s, interval_s = _as_float_seconds(stamp), averaging_interval / 1e9
    end_s = min(stamp_s + interval_s * 0.5, latest_s)
    start_s = max(0.00001 + interval_s, end_s) - interval_s
    start = tree.lookup(observation_frame, tracking_frame, _from_float_seconds(start_s))
    end = tree.lookup(observation_frame, tracking_frame, _from_float_seconds(end_s))
    rate = 1.0 / (end_s - start_s) if end_s != start_s else math.nan
    turn = _tf2_rotation_vector(so3.multiply(so3.conjugate(start.rotation), end.rotation))
    wx, wy, wz = so3.rotate(start.rotation, turn)
    twist = ((end.x - start.x) * rate, (end.y - start.y) * rate, (end.z - start.z) * rate,
             wx * rate, wy * rate, wz * rate)

    time = _from_float_seconds(stamp_s)
    pose = tree.lookup(reference_frame, tracking_frame, time)
    vx, vy, vz, wx, wy, wz = carry(pose, twist)
    px, py, pz = se3.apply(
        tree.lookup(reference_frame, reference_point_frame, time), reference_point)
    linear = (vx + wx * (px - pose.x), vy + wy * (py - pose.y), vz + wz * (pz - pose.z))
    return Velocity(_from_float_seconds(start_s + interval_s * 0.5), linear, (wx, wy, wz))


def _as_float_seconds(stamp: int) -> float:
    """Return seconds, rounded as in tf2's ``timeToSec``: the two parts separately."""
    whole, rest = divmod(stamp, NANOSECONDS_PER_SECOND)
    return whole + 1e-9 * rest


def _from_float_seconds(seconds: float) -> int:
    """Return nanoseconds, rounded as in tf2's ``timeFromSec``."""
    whole = math.floor(seconds)
    return whole * NANOSECONDS_PER_SECOND + math.floor((seconds - whole) * 1e9 + 0.5)


def _tf2_rotation_vector(q: Quaternion) -> Vector3:
    """
    Return tf2's axis times tf2's angle, of the quaternion that tf2 makes from the matrix.

    Beyond 120 degrees w may be negative there; the angle is then more than half a turn.
    """
    x, y, z, w = so3.with_tf2_sign(q)
    square = 1.0 - w * w
    if square < 10.0 * np.finfo(float).eps:
        return (2.0 * math.acos(min(w, 1.0)), 0.0, 0.0)
    scale = 2.0 * math.acos(w) / math.sqrt(square)
    return (scale * x, scale * y, scale * z)
