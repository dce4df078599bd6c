# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
From a pose in space to a planar one (x, y, yaw) and back: metres, radians, yaw about z.

``project`` also returns the residual that a planar pose omits: the error of a planar tree.
"""

import math
from typing import NamedTuple

from tf_tree_py.core.geometry.se3 import PoseTuple

PlanarTuple = tuple[float, float, float]


class Residual(NamedTuple):
    """
    The part of a pose in space that a planar pose omits.

    A point at height h above the origin is misplaced on the floor by h sin(tilt): 2.6 cm for
    h = 0.3 m at 5 degrees.
    """

    z: float
    """Height of the origin above the plane, metres."""
    tilt: float
    """Angle between the two z axes, radians, 0 to pi."""


def lift(planar: PlanarTuple) -> PoseTuple:
    """Return the pose in space of a planar pose, at height 0."""
    x, y, yaw = planar
    return (x, y, 0.0, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def project(pose: PoseTuple) -> tuple[PlanarTuple, Residual]:
    """
    Return the planar part of a pose in space, and what is lost; the yaw lies in (-pi, pi].

    The rotation is split into tilt * yaw about z (swing and twist). This yaw is the nearest to
    the full rotation. If the tilt is pi, no yaw is defined, and 0 is returned.
    """
    x, y, z, qx, qy, qz, qw = pose
    yaw = 2.0 * math.atan2(qz, qw) if qz or qw else 0.0
    tilt = 2.0 * math.atan2(math.hypot(qx, qy), math.hypot(qz, qw))
    return (x, y, _wrap(yaw)), Residual(z, tilt)


def _wrap(angle: float) -> float:
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped
