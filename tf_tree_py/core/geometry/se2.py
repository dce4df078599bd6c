# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Planar poses (x, y, yaw): metres and radians, yaw about z, anticlockwise.

For a robot on flat ground. ``project`` returns what a planar pose cannot hold as
well, because a planar tree goes wrong by just that.
"""

import math
from typing import NamedTuple

from .se3 import PoseTuple

PlanarTuple = tuple[float, float, float]

IDENTITY: PlanarTuple = (0.0, 0.0, 0.0)


class Residual(NamedTuple):
    """
    What a planar pose cannot hold of a spatial one.

    A point h above the origin is misplaced on the floor by h sin(tilt): 2.6 cm for
    h = 0.3 m at 5 degrees.
    """

    z: float
    """Height of the origin above the plane, metres."""
    tilt: float
    """Angle between the two z axes, radians, 0 to pi."""


def compose(a_T_b: PlanarTuple, b_T_c: PlanarTuple) -> PlanarTuple:
    """Return a_T_c, with the yaw wrapped to (-pi, pi]."""
    x, y = apply(a_T_b, b_T_c[:2])
    return (x, y, wrap(a_T_b[2] + b_T_c[2]))


def inverse(a_T_b: PlanarTuple) -> PlanarTuple:
    """Return b_T_a."""
    x, y, yaw = a_T_b
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return (-cosine * x - sine * y, sine * x - cosine * y, wrap(-yaw))


def apply(a_T_b: PlanarTuple, point: tuple[float, float]) -> tuple[float, float]:
    """Take a point in the plane from coordinates in b to coordinates in a."""
    x, y, yaw = a_T_b
    px, py = point
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return (x + cosine * px - sine * py, y + sine * px + cosine * py)


def lift(planar: PlanarTuple, z: float = 0.0) -> PoseTuple:
    """Return the spatial pose of a planar one, at a height z in metres."""
    x, y, yaw = planar
    return (x, y, z, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def project(pose: PoseTuple) -> tuple[PlanarTuple, Residual]:
    """
    Return the planar part of a spatial pose, and what was lost.

    The rotation is split into tilt * yaw about z (swing and twist); this yaw is the
    one nearest to the full rotation. A tilt of pi has none, and gives 0.
    """
    x, y, z, qx, qy, qz, qw = pose
    yaw = 2.0 * math.atan2(qz, qw) if qz or qw else 0.0
    tilt = 2.0 * math.atan2(math.hypot(qx, qy), math.hypot(qz, qw))
    return (x, y, wrap(yaw)), Residual(z, tilt)


def wrap(angle: float) -> float:
    """Return the same angle in (-pi, pi]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped
