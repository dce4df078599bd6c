# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The poses of many joints at many positions at once: forward kinematics of edges, in numpy."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array, Vector3

from .joints import FLOATING, Joint, PLANAR, PRISMATIC, TURNING

Indices = npt.NDArray[np.intp]


class _Slides(NamedTuple):
    """Joints that slide: their rows, their columns, and directions (K, 3) in the parent."""

    rows: Indices
    columns: Indices
    directions: Array


class Motion:
    """
    The edges of some joints as functions of their variables.

    All joints of one type are computed at once. If p is the rotation of a joint's origin and n
    its axis, then its rotation by an angle a is p (n sin(a/2), cos(a/2)), a quaternion product.
    p (n, 0) and p (0, 1) do not depend on a. Each joint therefore costs a sine, a cosine and two
    multiplications of a quaternion by a number.

    :ivar variables: the names of all joints' variables: the columns of the argument of
        ``poses``.
    """

    def __init__(self, joints: Sequence[Joint]) -> None:
        """
        Compute the constant parts.

        :param joints: the rows of the result of ``poses``.
        """
        self.variables = tuple(name for joint in joints for name in joint.variables)
        self._columns = {name: column for column, name in enumerate(self.variables)}
        self._origins = np.array([joint.origin for joint in joints], float).reshape(-1, 7)
        # A planar joint slides twice, and numpy's += adds to each indexed row only once.
        self._slides = [slides for slides in (
            self._sliding(joints, PRISMATIC, PLANAR, part=0), self._sliding(joints, PLANAR, part=1)
        ) if len(slides.rows)]
        self._turning, self._angles = self._places(joints, *TURNING, PLANAR, part=-1)
        axes = np.array([(*joints[row].axis, 0.0) for row in self._turning]).reshape(-1, 4)
        self._cosine_parts = self._origins[self._turning, 3:]
        self._sine_parts = so3.multiply_many(self._cosine_parts, axes)
        self._floating, first = self._places(joints, FLOATING, part=0)
        self._floats = first[:, None] + np.arange(7)

    def _places(self, joints: Sequence[Joint], *joint_types: str,
                part: int) -> tuple[Indices, Indices]:
        """Return the rows of the joints of some types, and the columns of one variable of each."""
        places = [(row, self._columns[joint.variables[part]])
                  for row, joint in enumerate(joints) if joint.joint_type in joint_types]
        rows, columns = np.array(places, np.intp).reshape(-1, 2).T
        return rows, columns

    def _sliding(self, joints: Sequence[Joint], *joint_types: str, part: int) -> _Slides:
        rows, columns = self._places(joints, *joint_types, part=part)
        directions = np.array([_direction(joints[row], part) for row in rows]).reshape(-1, 3)
        return _Slides(rows, columns, so3.rotate_many(self._origins[rows, 3:], directions))

    def has_turns(self, values: Array) -> bool:
        """Return whether no floating joint has a zero quaternion; values as in ``poses``."""
        return not len(self._floats) or bool(
            values[..., self._floats[:, 3:]].any(axis=-1).all())

    def poses(self, values: Array) -> Array:
        """
        Return ``parent_T_child`` of each joint.

        :param values: (..., variables) metres and radians.
        :return: (..., joints, 7).
        """
        poses = np.empty((*values.shape[:-1], *self._origins.shape))
        poses[...] = self._origins
        for rows, columns, directions in self._slides:
            poses[..., rows, :3] += values[..., columns, None] * directions
        if len(self._turning):
            half = 0.5 * values[..., self._angles, None]
            poses[..., self._turning, 3:] = (
                np.sin(half) * self._sine_parts + np.cos(half) * self._cosine_parts)
        if len(self._floating):
            free = values[..., self._floats]
            free[..., 3:] /= np.linalg.norm(free[..., 3:], axis=-1, keepdims=True)
            poses[..., self._floating, :] = se3.compose_many(self._origins[self._floating], free)
        return poses


def _direction(joint: Joint, part: int) -> Vector3:
    """
    Return the direction in which a joint slides, in the child's frame.

    A planar joint slides along x and y after the shortest rotation that takes z to its normal,
    and along x and y themselves if the normal is z.
    """
    if joint.joint_type == PRISMATIC:
        return joint.axis
    x, y, z = joint.axis
    # That rotation is (z cross normal, 1 + z . normal), normalised. If the normal is -z, take
    # half a turn about x.
    turn = so3.normalize((-y, x, 0.0, 1.0 + z)) if z > -1.0 else (1.0, 0.0, 0.0, 0.0)
    return so3.rotate(turn, (1.0, 0.0, 0.0) if part == 0 else (0.0, 1.0, 0.0))
