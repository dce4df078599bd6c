# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The rarer 4x4 matrices of ``tf_transformations``, and its virtual trackball.

They are shears, projections, crystals and point sets. With the trackball (Shoemake 1992) a mouse
turns an object.
"""

from collections.abc import Iterable
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from .transformations import (
    about,
    affine,
    Array,
    eigenvector,
    EPSILON,
    fixed_point,
    nearest_quaternion,
    quaternion_from_matrix,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    unit_vector,
    Vector,
    vector_norm,
)


def shear_matrix(angle: float, direction: npt.ArrayLike, point: npt.ArrayLike,
                 normal: npt.ArrayLike) -> Array:
    """Return the matrix that shears by an angle, along a direction within the plane."""
    sheared = math.tan(angle) * np.outer(unit_vector(direction), unit_vector(normal))
    return about(np.identity(3) + sheared, point)


def shear_from_matrix(matrix: npt.ArrayLike) -> tuple[float, Array, Array, Array]:
    """Return the angle, the direction, and a point and the normal of the plane."""
    matrix = np.asarray(matrix, dtype=float)
    directions, tangents, normals = np.linalg.svd(matrix[:3, :3] - np.identity(3))
    direction, tangent, normal = directions[:, 0], tangents[0], normals[0]
    height = -(direction @ matrix[:3, 3]) / tangent if tangent else 0.0
    return math.atan(tangent), direction, height * normal, normal


def projection_matrix(point: npt.ArrayLike, normal: Any, direction: npt.ArrayLike | None = None,
                      perspective: npt.ArrayLike | None = None, pseudo: bool = False) -> Array:
    """
    Return the matrix that projects onto the plane through a point.

    :param direction: projects along it, and otherwise along the normal.
    :param perspective: projects towards this point instead.
    :param pseudo: keep the relative depth: it is the orthogonal projection that is left to do.
    """
    point, normal = np.asarray(point, dtype=float)[:3], unit_vector(normal[:3])
    if perspective is None:
        along = np.asarray(normal if direction is None else direction, dtype=float)[:3]
        return about(np.identity(3) - np.outer(along, normal) / (along @ normal), point)
    eye = np.asarray(perspective, dtype=float)[:3]
    linear = (eye - point) @ normal * np.identity(3) - np.outer(eye, normal)
    matrix = affine(linear, point @ normal * eye)
    if pseudo:
        matrix[:3, :3] -= np.outer(normal, normal)
        matrix[:3, 3] += point @ normal * normal
    matrix[3] = *-normal, eye @ normal
    return matrix


def projection_from_matrix(matrix: npt.ArrayLike, pseudo: bool = False) -> tuple[
        Array, Array, Array | None, Array | None, bool]:
    """
    Return what ``projection_matrix`` takes; the point is homogeneous.

    :raises ValueError: it is not a projection.
    """
    matrix = np.asarray(matrix, dtype=float)
    values, vectors = np.linalg.eig(matrix)
    if not pseudo and np.any(abs(values - 1.0) < 1e-8):
        return (fixed_point(matrix), eigenvector(matrix[:3, :3].T, 0.0, 0),
                eigenvector(matrix[:3, :3], 0.0, 0), None, False)
    others = np.flatnonzero(abs(values) > 1e-8)
    if not others.size:
        raise ValueError('no eigenvector not corresponding to eigenvalue 0: it is no projection')
    point = vectors[:, others[-1]].real / vectors[3, others[-1]].real
    normal = -matrix[3, :3]
    perspective = matrix[:3, 3] / (point[:3] @ normal)
    return point, normal, None, perspective - normal if pseudo else perspective, pseudo


def clip_matrix(left: float, right: float, bottom: float, top: float, near: float, far: float,
                perspective: bool = False) -> Array:
    """
    Return the matrix from a view to coordinates from -1 to 1.

    The view is a box, or with ``perspective`` a frustum that is seen from the origin along z;
    then divide by the fourth coordinate.

    :raises ValueError: a bound is not below its opposite, or the frustum has ``near <= 0``.
    """
    low, high = np.array([left, bottom, near]), np.array([right, top, far])
    if np.any(low >= high):
        raise ValueError(f'invalid frustum: left, bottom, near = {low.tolist()} have to be below '
                         f'right, top, far = {high.tolist()}')
    centre, half = (high + low) / 2.0, (high - low) / 2.0
    if not perspective:
        return affine(np.diag(1.0 / half), -centre / half)
    if near <= EPSILON:
        raise ValueError(f'invalid frustum: near <= 0: it is {near}')
    x, y, z = centre / half
    return np.array([[-near / half[0], 0.0, x, 0.0],
                     [0.0, -near / half[1], y, 0.0],
                     [0.0, 0.0, -z, near * far / half[2]],
                     [0.0, 0.0, -1.0, 0.0]])


def orthogonalization_matrix(lengths: Iterable[float], angles: npt.ArrayLike) -> Array:
    """Return the matrix of a crystal's cell, by its three lengths, and angles in degrees."""
    a, b, c = lengths
    (sin_a, sin_b, _), (cos_a, cos_b, cos_g) = (wave(np.radians(angles)) for wave in (
        np.sin, np.cos))
    cosine = (cos_a * cos_b - cos_g) / (sin_a * sin_b)
    return affine([[a * sin_b * math.sqrt(1.0 - cosine**2), 0.0, 0.0],
                   [-a * sin_b * cosine, b * sin_a, 0.0],
                   [a * cos_b, b * cos_a, c]])


def superimposition_matrix(v0: npt.ArrayLike, v1: npt.ArrayLike, scaling: bool = False,
                           usesvd: bool = True) -> Array:
    """
    Return the matrix that moves points, (3, N) or (4, N), closest to others (least squares).

    :param scaling: also scale them.
    :param usesvd: use Kabsch's method, and otherwise Horn's, which has the same answer.
    :raises ValueError: the shapes differ, or there are fewer than three points.
    """
    v0, v1 = (np.asarray(points, dtype=float)[:3] for points in (v0, v1))
    if v0.shape != v1.shape or v0.shape[1] < 3:
        raise ValueError('v0 and v1 have to be of the same shape, (3, N) or (4, N), with at least '
                         f'3 points: they are of {v0.shape} and {v1.shape}')
    centre0, centre1 = v0.mean(axis=1), v1.mean(axis=1)
    v0, v1 = v0 - centre0[:, np.newaxis], v1 - centre1[:, np.newaxis]
    if usesvd:
        left, _, right = np.linalg.svd(v1 @ v0.T)
        left[:, 2] *= np.sign(np.linalg.det(left @ right))  # else it would mirror
        linear = left @ right
    else:
        linear = quaternion_matrix(nearest_quaternion(v1 @ v0.T))[:3, :3]
    if scaling:
        linear = linear * math.sqrt(np.sum(v1**2) / np.sum(v0**2))
    return affine(linear, centre1 - linear @ centre0)


# --- the trackball

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
