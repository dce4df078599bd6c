# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``tf_transformations``: 4x4 matrices, quaternions (x, y, z, w) and Euler angles in radians.

Many programs import it together with tf2_ros. Rotations are scipy's. Axis sequences are those of
Gohlke's transformations.py: ``s`` for fixed axes or ``r`` for rotating axes, and the three axes in
the order of the angles, such as ``sxyz``.
"""

import math
from typing import Any
import warnings

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
Axes = str | tuple[int, int, int, int]
_EPSILON = 4 * float(np.finfo(float).eps)


# --- matrices

def identity_matrix() -> Array:
    """Return the 4x4 identity matrix."""
    return np.identity(4)


def translation_matrix(direction: Any) -> Array:
    """Return the matrix that translates by a vector."""
    return _matrix(np.identity(3), direction)


def translation_from_matrix(matrix: Any) -> Array:
    """Return the translation of a matrix."""
    return np.array(matrix, dtype=float)[:3, 3]


def rotation_matrix(angle: float, direction: Any, point: Any = None) -> Array:
    """Return the matrix that rotates about an axis, through a point or the origin."""
    return _about(_about_axis(angle, direction).as_matrix(), point)


def rotation_from_matrix(matrix: Any) -> tuple[float, Array, Array]:
    """Return the angle, the axis, and a homogeneous point on the axis."""
    matrix = np.asarray(matrix, dtype=float)
    vector = _rotation(matrix).as_rotvec()
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > _EPSILON else np.array([1.0, 0.0, 0.0])
    # Points on the axis do not move: (I - R) point = translation.
    point = np.linalg.lstsq(np.identity(3) - matrix[:3, :3], matrix[:3, 3], rcond=1e-9)[0]
    return angle, axis, np.append(point, 1.0)


def scale_matrix(factor: float, origin: Any = None, direction: Any = None) -> Array:
    """Return the matrix that scales about an origin, along a direction or along all."""
    if direction is None:
        return _about(factor * np.identity(3), origin)
    axis = unit_vector(direction[:3])
    return _about(np.identity(3) - (1.0 - factor) * np.outer(axis, axis), origin)


def reflection_matrix(point: Any, normal: Any) -> Array:
    """Return the matrix that reflects at the plane through a point."""
    return scale_matrix(-1.0, point, normal)


def inverse_matrix(matrix: Any) -> Array:
    """Return the inverse of a matrix."""
    return np.linalg.inv(np.asarray(matrix, dtype=float))


def concatenate_matrices(*matrices: Any) -> Array:
    """Return the product of matrices, the first one leftmost."""
    product = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, dtype=float)
    return product


def is_same_transform(matrix0: Any, matrix1: Any) -> bool:
    """Return whether two matrices are equal, up to their homogeneous scale."""
    first, second = (np.asarray(matrix, dtype=float) for matrix in (matrix0, matrix1))
    return bool(np.allclose(first / first[3, 3], second / second[3, 3]))


# --- Euler angles

def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = 'sxyz') -> Array:
    """Return the matrix of three Euler angles."""
    return _matrix(_from_euler(ai, aj, ak, axes).as_matrix())


def quaternion_from_euler(ai: float, aj: float, ak: float,
                          axes: Axes = 'sxyz') -> tuple[float, ...]:
    """Return the quaternion of three Euler angles: roll, pitch and yaw unless axes differ."""
    return tuple(_from_euler(ai, aj, ak, axes).as_quat().tolist())


def euler_from_matrix(matrix: Any, axes: Axes = 'sxyz') -> tuple[float, ...]:
    """
    Return the Euler angles of a matrix, 3x3 or 4x4.

    If only the sum or difference of two angles is determined, the angle about the fixed third axis
    is 0.
    """
    letters, step = _fixed_axes(axes)
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'Gimbal lock', UserWarning)
        angles = _rotation(matrix).as_euler(letters)
    if letters[0] == letters[2] and letters[:2] not in 'xyzx':
        angles = _with_a_negative_middle(angles)
    return tuple(angles[::step].tolist())


def euler_from_quaternion(quaternion: Any, axes: Axes = 'sxyz') -> tuple[float, ...]:
    """Return the Euler angles of a quaternion: roll, pitch and yaw unless axes differ."""
    return euler_from_matrix(quaternion_matrix(quaternion), axes)


# --- quaternions

def quaternion_about_axis(angle: float, axis: Any) -> tuple[float, ...]:
    """Return the quaternion of a rotation about an axis."""
    half = angle / 2
    return (*(math.sin(half) * unit_vector(axis)).tolist(), math.cos(half))


def quaternion_matrix(quaternion: Any) -> Array:
    """Return the matrix of a quaternion, which need not be of length one."""
    quaternion = np.asarray(quaternion, dtype=float)
    if quaternion @ quaternion < _EPSILON:
        return np.identity(4)
    return _matrix(Rotation.from_quat(quaternion).as_matrix())


def quaternion_from_matrix(matrix: Any) -> tuple[float, ...]:
    """Return the quaternion of a matrix, 3x3 or 4x4; w is not negative."""
    quaternion = _rotation(matrix).as_quat()
    return tuple((math.copysign(1.0, quaternion[3]) * quaternion).tolist())


def quaternion_multiply(quaternion1: Any, quaternion0: Any) -> tuple[float, ...]:
    """Return the product of two quaternions, of any length: 0 rotates first, then 1."""
    x1, y1, z1, w1 = quaternion1
    x0, y0, z0, w0 = quaternion0
    return (w1 * x0 + x1 * w0 + y1 * z0 - z1 * y0,
            w1 * y0 - x1 * z0 + y1 * w0 + z1 * x0,
            w1 * z0 + x1 * y0 - y1 * x0 + z1 * w0,
            w1 * w0 - x1 * x0 - y1 * y0 - z1 * z0)


def quaternion_conjugate(quaternion: Any) -> Array:
    """Return the conjugate of a quaternion."""
    return np.asarray(quaternion, dtype=float) * (-1.0, -1.0, -1.0, 1.0)


def quaternion_inverse(quaternion: Any) -> Array:
    """Return the inverse of a quaternion."""
    quaternion = np.asarray(quaternion, dtype=float)
    return quaternion_conjugate(quaternion) / (quaternion @ quaternion)


def quaternion_slerp(quat0: Any, quat1: Any, fraction: float, spin: int = 0,
                     shortestpath: bool = True) -> Array:
    """
    Return the quaternion at a fraction of the rotation from one to another.

    :raises ValueError: ``spin`` is given: Gohlke's formula then returns quaternions of another
        length.
    """
    if spin:
        raise ValueError('quaternion_slerp does not support spin here: the program itself has to '
                         'add further turns of quat1 about the axis')
    first, last = unit_vector(quat0[:4]), unit_vector(quat1[:4])
    if fraction == 1.0:
        return last
    if shortestpath and first @ last < 0.0:
        last = -last
    across = last - (first @ last) * first
    sine = float(np.linalg.norm(across))
    if sine < _EPSILON:
        return first
    angle = fraction * math.atan2(sine, first @ last)
    return unit_vector(math.cos(angle) * first + math.sin(angle) / sine * across)


def random_quaternion(rand: Any = None) -> Array:
    """Return a random rotation; the same one for the same three numbers from 0 to 1 (Shoemake)."""
    # numpy's global generator: programs call numpy.random.seed.
    first, second, third = np.random.random(3) if rand is None else rand  # noqa: NPY002
    angles = 2 * math.pi * np.array([second, second, third, third])
    waves = np.sin(angles + np.array([0.0, math.pi / 2, 0.0, math.pi / 2]))
    return waves * np.sqrt([1.0 - first, 1.0 - first, first, first])


def random_rotation_matrix(rand: Any = None) -> Array:
    """Return the matrix of a random rotation, likewise."""
    return quaternion_matrix(random_quaternion(rand))


# --- vectors

def vector_norm(data: Any, axis: int | None = None) -> Any:
    """Return the length of a vector, or of the vectors along an axis."""
    return np.sqrt(np.sum(np.square(np.asarray(data, dtype=float)), axis=axis))


def unit_vector(data: Any, axis: int | None = None) -> Array:
    """Return a vector of length one, or the vectors along an axis."""
    data = np.asarray(data, dtype=float)
    length = vector_norm(data, axis)
    return np.asarray(data / (length if axis is None else np.expand_dims(length, axis)))


def random_vector(size: Any) -> Array:
    """Return random numbers from 0 to 1."""
    return np.asarray(np.random.random(size))  # noqa: NPY002 - likewise


# --- parts

def _matrix(linear: Any, translation: Any = (0.0, 0.0, 0.0)) -> Array:
    matrix = np.identity(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = translation
    return matrix


def _about(linear: Any, point: Any) -> Array:
    """Return the 4x4 matrix of a linear map that keeps a point, or the origin, in its place."""
    point = np.zeros(3) if point is None else np.asarray(point, dtype=float)[:3]
    return _matrix(linear, point - linear @ point)


def _about_axis(angle: float, axis: Any) -> Rotation:
    return Rotation.from_rotvec(angle * unit_vector(axis[:3]))


def _rotation(matrix: Any) -> Rotation:
    return Rotation.from_matrix(np.asarray(matrix, dtype=float)[:3, :3])


def _from_euler(ai: float, aj: float, ak: float, axes: Axes) -> Rotation:
    letters, step = _fixed_axes(axes)
    return Rotation.from_euler(letters, (ai, aj, ak)[::step])


def _fixed_axes(axes: Axes) -> tuple[str, int]:
    """
    Return a sequence as one of fixed axes, and the step through the angles.

    A rotation about rotating axes is one about fixed axes in the reverse order.
    """
    name = axes if isinstance(axes, str) else _named(*axes)
    if len(name) != 4 or name[0] not in 'sr':
        raise ValueError(f'axes={axes!r} is not a sequence such as sxyz or rzyx')
    return (name[1:], 1) if name[0] == 's' else (name[:0:-1], -1)


def _named(first: int, odd: int, repeats: int, turns: int) -> str:
    """Return the name of a sequence in Gohlke's encoding: first axis, parity, ..."""
    step = -1 if odd else 1
    letters = ''.join('xyz'[axis % 3] for axis in (
        first, first + step, first if repeats else first - step))
    return f'r{letters[::-1]}' if turns else f's{letters}'


def _with_a_negative_middle(angles: Array) -> Array:
    """Return the same rotation in Gohlke's range for odd sequences such as szyz."""
    first, middle, last = angles
    if abs(math.sin(middle)) < 1e-7:  # only two angles matter
        return np.array([first, -middle, last])
    turned = (math.remainder(angle + math.pi, 2 * math.pi) for angle in (first, last))
    return np.array([next(turned), -middle, next(turned)])
