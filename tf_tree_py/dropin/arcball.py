# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The virtual trackball of ``tf_transformations`` (Shoemake 1992): a mouse turns an object."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from .transformations import (
    Array,
    EPSILON,
    quaternion_from_matrix,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    unit_vector,
    Vector,
    vector_norm,
)


class Arcball:
    """A sphere in a window; a drag of the cursor turns it."""

    def __init__(self, initial: npt.ArrayLike | None = None) -> None:
        """
        Start from a quaternion or a 4x4 matrix, or without rotation.

        :raises ValueError: ``initial`` is neither.
        """
        initial = np.asarray((0.0, 0.0, 0.0, 1.0) if initial is None else initial, dtype=float)
        if initial.shape not in ((4,), (4, 4)):
            raise ValueError('initial is a quaternion (4,) or a matrix (4, 4), not of shape '
                             f'{initial.shape}')
        matrix = initial.shape == (4, 4)
        start = quaternion_from_matrix(initial) if matrix else unit_vector(initial)
        self._at_press = self._before = self._now = start
        self._pressed = np.array([0.0, 0.0, 1.0])
        self._centre, self._radius = (0.0, 0.0), 1.0
        self._constrained = False
        self._axes: list[Array] = []
        self._axis: Array | None = None

    def place(self, center: Vector, radius: float) -> None:
        """Set the centre and the radius in the window's coordinates."""
        self._centre, self._radius = (center[0], center[1]), float(radius)

    def setaxes(self, *axes: npt.ArrayLike) -> None:
        """Set the axes to which ``setconstrain`` constrains rotations."""
        self._axes = [unit_vector(axis) for axis in axes]

    def setconstrain(self, constrain: bool) -> None:
        """Constrain rotations to the axes, or do not."""
        self._constrained = constrain is True

    def getconstrain(self) -> bool:
        """Return whether rotations are constrained."""
        return self._constrained

    def down(self, point: Vector) -> None:
        """Begin a drag at a point of the window; the nearest axis will constrain it."""
        self._pressed = arcball_map_to_sphere(point, self._centre, self._radius)
        self._at_press = self._before = self._now
        self._axis = arcball_nearest_axis(self._pressed, self._axes) if self._constrained else None
        self._pressed = self._on_circle(self._pressed)

    def drag(self, point: Vector) -> None:
        """Turn to where the cursor is now."""
        now = self._on_circle(arcball_map_to_sphere(point, self._centre, self._radius))
        self._before = self._now
        axis = np.cross(self._pressed, now)
        self._now = self._at_press
        if axis @ axis >= EPSILON:
            self._now = quaternion_multiply((*axis, self._pressed @ now), self._at_press)

    def next(self, acceleration: float = 0.0) -> None:  # noqa: A003, RUF100 - ament's rule
        """Continue the last drag by as much again."""
        following = quaternion_slerp(self._before, self._now, 2.0 + acceleration)
        self._before, self._now = self._now, following

    def matrix(self) -> Array:
        """Return the rotation as a 4x4 matrix."""
        return quaternion_matrix(self._now)

    def _on_circle(self, point: Array) -> Array:
        return point if self._axis is None else arcball_constrain_to_axis(point, self._axis)


def arcball_map_to_sphere(point: Vector, center: Vector, radius: float) -> Array:
    """Return the point of the unit sphere under a point of the window, whose y points down."""
    x, y = (point[0] - center[0]) / radius, (center[1] - point[1]) / radius
    depth = max(0.0, 1.0 - x**2 - y**2)
    return np.asarray(unit_vector([x, y, depth**0.5]))


def arcball_constrain_to_axis(point: npt.ArrayLike, axis: npt.ArrayLike) -> Array:
    """Return the nearest point of the sphere's circle about an axis, on the visible side."""
    point, axis = np.asarray(point, dtype=float), np.asarray(axis, dtype=float)
    across = point - axis * (axis @ point)
    length = vector_norm(across)
    if length > EPSILON:
        return np.asarray(across / (-length if across[2] < 0.0 else length))
    # Every point of the circle is as near.
    if axis[2] == 1.0:
        return np.array([1.0, 0.0, 0.0])
    return np.asarray(unit_vector([-axis[1], axis[0], 0.0]))


def arcball_nearest_axis(point: npt.ArrayLike, axes: Iterable[Array]) -> Array | None:
    """Return the axis whose circle is nearest to a point of the sphere, or None without axes."""
    return max(axes, key=lambda axis: arcball_constrain_to_axis(point, axis) @ np.asarray(point),
               default=None)
