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
Twists and wrenches, six numbers each, taken from one frame to another.

Both are screws: three numbers that depend on the origin, and three that do not. Of
a twist these are the linear velocity of the body's point at the origin, and the
angular velocity; of a wrench the torque about the origin, and the force. The form
whose name ends in ``_many`` takes arrays, as in ``se3``.
"""

import numpy as np

from .se3 import PoseTuple
from .so3 import Array
from ..geometry import so3

Screw = tuple[float, float, float, float, float, float]


def carry(a_T_b: PoseTuple, screw: Screw) -> Screw:
    """
    Take a screw from b's axes and origin to a's axes and origin.

    The adjoint, (R v + t x R w, R w): Murray, Li, Sastry, "A Mathematical
    Introduction to Robotic Manipulation", section 2.4.

    :param screw: (vx, vy, vz, wx, wy, wz); see the top of this file for what they are.
    """
    tx, ty, tz, *rest = a_T_b
    q = (rest[0], rest[1], rest[2], rest[3])
    vx, vy, vz = so3.rotate(q, screw[:3])
    wx, wy, wz = so3.rotate(q, screw[3:])
    return (vx + ty * wz - tz * wy, vy + tz * wx - tx * wz, vz + tx * wy - ty * wx, wx, wy, wz)


def carry_many(a_T_b: Array, screws: Array) -> Array:
    """Take screws (..., 6) from b to a by poses (..., 7), elementwise; see ``carry``."""
    v = so3.rotate_many(a_T_b[..., 3:], screws[..., :3])
    w = so3.rotate_many(a_T_b[..., 3:], screws[..., 3:])
    return np.concatenate([v + np.cross(a_T_b[..., :3], w), w], axis=-1)


def adjoint(a_T_b: PoseTuple) -> Array:
    """Return the matrix (6, 6) that takes a screw from b to a: ``carry`` of each unit screw."""
    return carry_many(np.array(a_T_b), np.eye(6)).T
