# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Transforming twists and wrenches, six numbers each, from one frame to another.

Both are screws: three numbers that depend on the origin, and three that do not. For a twist
these are the linear velocity of the body's point at the origin, and the angular velocity; for
a wrench the torque about the origin, and the force. The form whose name ends in ``_many``
accepts arrays, as in ``se3``.
"""

import numpy as np

from . import so3
from .se3 import PoseTuple
from .so3 import Array

Screw = tuple[float, float, float, float, float, float]


def carry(a_T_b: PoseTuple, screw: Screw) -> Screw:
    """
    Transform a screw from b's axes and origin to a's axes and origin.

    This is the adjoint, (R v + t x R w, R w): Murray, Li, Sastry, "A Mathematical
    Introduction to Robotic Manipulation", section 2.4.

    :param screw: (vx, vy, vz, wx, wy, wz); see the module docstring.
    """
    tx, ty, tz, *rest = a_T_b
    q = (rest[0], rest[1], rest[2], rest[3])
    vx, vy, vz = so3.rotate(q, screw[:3])
    wx, wy, wz = so3.rotate(q, screw[3:])
    return (vx + ty * wz - tz * wy, vy + tz * wx - tx * wz, vz + tx * wy - ty * wx, wx, wy, wz)


def carry_many(a_T_b: Array, screws: Array) -> Array:
    """Transform screws (..., 6) from b to a by poses (..., 7), elementwise; see ``carry``."""
    v = so3.rotate_many(a_T_b[..., 3:], screws[..., :3])
    w = so3.rotate_many(a_T_b[..., 3:], screws[..., 3:])
    return np.concatenate([v + np.cross(a_T_b[..., :3], w), w], axis=-1)


def adjoint(a_T_b: PoseTuple) -> Array:
    """Return the matrix (6, 6) that transforms a screw from b to a, as ``carry`` does."""
    return carry_many(np.array(a_T_b), np.eye(6)).T
