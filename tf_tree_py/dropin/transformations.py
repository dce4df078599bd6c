# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``tf_transformations``: 4x4 matrices, quaternions (x, y, z, w) and Euler angles in radians.

Many programs import it together with tf2_ros. Axis sequences are those of Gohlke's
transformations.py: ``s`` for fixed axes or ``r`` for rotating axes, and the three axes in the
order of the angles, such as ``sxyz``. Where several answers are right, such as a quaternion and
its negative, an axis and its opposite, or the angles in gimbal lock, the answer is that of the
original package. The rarer matrices and the Arcball are in
``rarer_matrices``.
"""

from collections.abc import Sequence
from itertools import product
import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from tf_tree_py.core.geometry import so3

Array = npt.NDArray[np.float64]
Vector = Sequence[float] | Array
Axes = str | tuple[int, int, int, int]
EPSILON = 4 * float(np.finfo(float).eps)

TRANSLATION_IDENTITY = [0.0, 0.0, 0.0]
ROTATION_IDENTITY = np.identity(3)
ZOOM_IDENTITY = [1.0, 1.0, 1.0]
SHEAR_IDENTITY = TRANSLATION_IDENTITY


# --- matrices

def identity_matrix() -> Array:
    """Return the 4x4 identity matrix."""
    return np.identity(4)


def translation_matrix(direction: npt.ArrayLike) -> Array:
    """Return the matrix that translates by a vector."""
    return affine(np.identity(3), direction)


def translation_from_matrix(matrix: npt.ArrayLike) -> Array:
    """Return the translation of a matrix."""
    return np.array(matrix, dtype=float)[:3, 3]


def rotation_matrix(angle: float, direction: Vector, point: npt.ArrayLike | None = None) -> Array:
    """Return the matrix that rotates about an axis, through a point or the origin."""
    return about(Rotation.from_rotvec(angle * unit_vector(direction[:3])).as_matrix(), point)


def rotation_from_matrix(matrix: npt.ArrayLike) -> tuple[float, Array, Array]:
    """
    Return the angle, the axis, and a homogeneous point on the axis.

    :raises ValueError: it is not a rotation.
    """
    matrix = np.asarray(matrix, dtype=float)
    linear = matrix[:3, :3]
    # Also for matrices of 32-bit numbers.
    axis = eigenvector(linear.T, 1.0, -1, tolerance=1e-5)
    angle = math.atan2(axis @ _doubled_axis(linear), np.trace(linear) - 1.0)
    return angle, axis, fixed_point(matrix)


def scale_matrix(factor: float, origin: npt.ArrayLike | None = None,
                 direction: Vector | None = None) -> Array:
    """Return the matrix that scales about an origin, along a direction or along all."""
    if direction is None:
        return about(factor * np.identity(3), origin)
    axis = unit_vector(direction[:3])
    return about(np.identity(3) - (1.0 - factor) * np.outer(axis, axis), origin)


def scale_from_matrix(matrix: npt.ArrayLike) -> tuple[float, Array, Array | None]:
    """
    Return the factor, the origin, and the direction, or None if it scales along all.

    :raises ValueError: no point stays in its place.
    """
    matrix = np.asarray(matrix, dtype=float)
    factor, direction = np.trace(matrix[:3, :3]) - 2.0, None
    try:
        direction = unit_vector(eigenvector(matrix[:3, :3], factor, 0))
    except ValueError:
        factor = (factor + 2.0) / 3.0
    return factor, fixed_point(matrix)[:3], direction


def reflection_matrix(point: npt.ArrayLike, normal: Vector) -> Array:
    """Return the matrix that reflects at the plane through a point."""
    return scale_matrix(-1.0, point, normal)


def reflection_from_matrix(matrix: npt.ArrayLike) -> tuple[Array, Array]:
    """
    Return a point of the plane, and its unit normal.

    :raises ValueError: it is not a reflection.
    """
    matrix = np.asarray(matrix, dtype=float)
    normal = eigenvector(matrix[:3, :3], -1.0, 0)
    determinant = np.linalg.det(matrix[:3, :3])
    if abs(determinant + 1.0) >= 1e-8:
        raise ValueError(f'the determinant of a reflection is -1, not {determinant:.9g}')
    return fixed_point(matrix)[:3], normal


def compose_matrix(scale: npt.ArrayLike | None = None, shear: npt.ArrayLike | None = None,
                   angles: tuple[float, float, float] | None = None,
                   translate: npt.ArrayLike | None = None, perspective: object = None) -> Array:
    """
    Return the matrix that shears, then scales, rotates and translates.

    :param scale: the factors along x, y, z.
    :param shear: the factors x-y, x-z, y-z.
    :param angles: Euler angles ``sxyz``.
    :param perspective: ignored, as in the original package.
    """
    sheared = np.identity(3)
    sheared[np.triu_indices(3, 1)] = SHEAR_IDENTITY if shear is None else shear
    scaled = np.diag(ZOOM_IDENTITY if scale is None else scale) @ sheared
    turned = ROTATION_IDENTITY if angles is None else euler_matrix(*angles)[:3, :3]
    return affine(turned @ scaled, TRANSLATION_IDENTITY if translate is None else translate)


def decompose_matrix(matrix: npt.ArrayLike) -> tuple[Array, Array, tuple[float, ...], Array, None]:
    """
    Return what ``compose_matrix`` takes: scale, shear, angles, translation, and None.

    :raises numpy.linalg.LinAlgError: the matrix is singular.
    """
    turned, scale, shear = _decomposed(matrix)
    return scale, shear, euler_from_matrix(turned), translation_from_matrix(matrix), None


def inverse_matrix(matrix: Any) -> Array:
    """Return the inverse of a matrix."""
    return np.linalg.inv(matrix)


def concatenate_matrices(*matrices: npt.ArrayLike) -> Array:
    """Return the product of matrices, the first one leftmost."""
    product = np.identity(4)
    for matrix in matrices:
        product = product @ np.asarray(matrix, dtype=float)
    return product


def is_same_transform(matrix0: npt.ArrayLike, matrix1: npt.ArrayLike) -> bool:
    """Return whether two matrices are equal, up to their homogeneous scale."""
    first, second = (np.asarray(matrix, dtype=float) for matrix in (matrix0, matrix1))
    return bool(np.allclose(first / first[3, 3], second / second[3, 3]))


# --- Euler angles

def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = 'sxyz') -> Array:
    """Return the matrix of three Euler angles."""
    return affine(_from_euler(ai, aj, ak, axes).as_matrix())


def quaternion_from_euler(ai: float, aj: float, ak: float,
                          axes: Axes = 'sxyz') -> tuple[float, ...]:
    """Return the quaternion of three Euler angles: roll, pitch and yaw unless axes differ."""
    return tuple(_from_euler(ai, aj, ak, axes).as_quat())


def euler_from_matrix(matrix: npt.ArrayLike, axes: Axes = 'sxyz') -> tuple[float, ...]:
    """
    Return the Euler angles of a matrix, 3x3 or 4x4.

    If only the sum or difference of two angles is determined, the angle about the fixed third axis
    is 0.
    """
    first, odd, repeats, turns = _code(axes)
    order = _axes(first, odd)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.asarray(
        matrix, dtype=float)[np.ix_(order, order)].tolist()
    if repeats:
        free = math.sqrt(xy**2 + xz**2)
        middle, outer = math.atan2(free, xx), (math.atan2(xy, xz), math.atan2(yx, -zx))
    else:
        free = math.sqrt(xx**2 + yx**2)
        middle, outer = math.atan2(-zx, free), (math.atan2(zy, zz), math.atan2(yx, xx))
    if free <= EPSILON:
        outer = (math.atan2(-yz, yy), 0.0)
    angles = (outer[0], middle, outer[1])
    if odd:
        angles = (-angles[0], -angles[1], -angles[2])
    return angles[::-1] if turns else angles


def euler_from_quaternion(quaternion: npt.ArrayLike, axes: Axes = 'sxyz') -> tuple[float, ...]:
    """Return the Euler angles of a quaternion: roll, pitch and yaw unless axes differ."""
    return euler_from_matrix(quaternion_matrix(quaternion), axes)


# --- quaternions

def quaternion_about_axis(angle: float, axis: npt.ArrayLike) -> tuple[float, ...]:
    """Return the quaternion of a rotation about an axis."""
    half = angle / 2
    return tuple(np.append(math.sin(half) * unit_vector(axis), math.cos(half)))


def quaternion_matrix(quaternion: npt.ArrayLike) -> Array:
    """Return the matrix of a quaternion, which need not be of length one."""
    quaternion = np.asarray(quaternion, dtype=float)
    if quaternion @ quaternion < np.finfo(float).eps:
        return np.identity(4)
    return affine(Rotation.from_quat(quaternion).as_matrix())


def quaternion_from_matrix(matrix: npt.ArrayLike) -> tuple[float, ...]:
    """
    Return the quaternion of a matrix, 3x3 or 4x4, without its scale and shear; w is not negative.

    :raises numpy.linalg.LinAlgError: the matrix is singular.
    """
    return tuple(nearest_quaternion(_decomposed(matrix)[0]))


def quaternion_multiply(quaternion1: Any, quaternion0: Any) -> tuple[float, ...]:
    """Return the product of two quaternions, of any length: 0 rotates first, then 1."""
    return so3.multiply(quaternion1, quaternion0)


def quaternion_conjugate(quaternion: npt.ArrayLike) -> Array:
    """Return the conjugate of a quaternion."""
    return np.asarray(quaternion, dtype=float) * (-1.0, -1.0, -1.0, 1.0)


def quaternion_inverse(quaternion: npt.ArrayLike) -> Array:
    """Return the inverse of a quaternion."""
    quaternion = np.asarray(quaternion, dtype=float)
    return quaternion_conjugate(quaternion) / (quaternion @ quaternion)


def quaternion_slerp(quat0: Vector, quat1: Vector, fraction: float, spin: int = 0,
                     shortestpath: bool = True) -> Array:
    """
    Return the quaternion at a fraction of the rotation from one to another.

    :param spin: how many half turns to add; the quaternion is of length one for even ones only.
    """
    first, last = unit_vector(quat0[:4]), unit_vector(quat1[:4])
    if fraction == 1.0:
        return last
    cosine = float(first @ last)
    if fraction == 0.0 or abs(abs(cosine) - 1.0) < EPSILON:
        return first
    if shortestpath and cosine < 0.0:
        cosine, last = -cosine, -last
    angle = math.acos(cosine) + spin * math.pi
    mixed = math.sin((1.0 - fraction) * angle) * first + math.sin(fraction * angle) * last
    return np.asarray(mixed / math.sin(angle))


def random_quaternion(rand: Vector | None = None) -> Array:
    """Return a random rotation; the same one for the same three numbers from 0 to 1 (Shoemake)."""
    # numpy's global generator: programs call numpy.random.seed.
    first, second, third = np.random.random(3) if rand is None else rand  # noqa: NPY002
    angles = 2 * math.pi * np.array([second, second, third, third])
    waves = np.sin(angles + np.array([0.0, math.pi / 2, 0.0, math.pi / 2]))
    return waves * np.sqrt([1.0 - first, 1.0 - first, first, first])


def random_rotation_matrix(rand: Vector | None = None) -> Array:
    """Return the matrix of a random rotation, likewise."""
    return quaternion_matrix(random_quaternion(rand))


# --- vectors

def vector_norm(data: npt.ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """Return the length of a vector, or of the vectors along an axis; None if ``out`` takes it."""
    data = np.asarray(data, dtype=float)
    if out is not None:
        np.sqrt(np.sum(data**2, axis=axis), out=out)
        return None
    if data.ndim == 1:
        return math.sqrt(data @ data)
    return np.atleast_1d(np.sqrt(np.sum(data**2, axis=axis)))


def unit_vector(data: npt.ArrayLike, axis: int | None = None, out: Array | None = None) -> Any:
    """Return a vector of length one, or those along an axis; None if ``out`` takes them."""
    data = np.asarray(data, dtype=float)
    length = vector_norm(data, axis)
    unit = data / (length if axis is None or data.ndim == 1 else np.expand_dims(length, axis))
    if out is None:
        return unit
    out[:] = unit
    return None


def random_vector(size: int | tuple[int, ...]) -> Array:
    """Return random numbers from 0 to 1."""
    return np.asarray(np.random.random(size))  # noqa: NPY002 - likewise


# --- parts

def affine(linear: npt.ArrayLike, translation: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Return the 4x4 matrix of a linear map and a translation."""
    matrix = np.identity(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = translation
    return matrix


def about(linear: Array, point: npt.ArrayLike | None) -> Array:
    """Return the 4x4 matrix of a linear map that keeps a point, or the origin, in its place."""
    point = np.zeros(3) if point is None else np.asarray(point, dtype=float)[:3]
    return affine(linear, point - linear @ point)


def eigenvector(matrix: Array, value: float, place: int, tolerance: float = 1e-8) -> Array:
    """
    Return the real part of one of the unit eigenvectors of an eigenvalue.

    :param place: which one: 0 is the first, -1 the last.
    :raises ValueError: it is no eigenvalue.
    """
    values, vectors = np.linalg.eig(matrix)
    found = np.flatnonzero(abs(values - value) < tolerance)
    if not found.size:
        raise ValueError(f'no eigenvector corresponding to eigenvalue {value:.9g}: it is no '
                         f'matrix of this kind; its eigenvalues are {values}')
    return np.asarray(vectors[:, found[place]].real)


def fixed_point(matrix: Array) -> Array:
    """Return a homogeneous point that a matrix keeps in its place."""
    point = eigenvector(matrix, 1.0, -1)
    return point / point[3]


def _doubled_axis(linear: Array) -> Array:
    """Return the axis of a rotation, of twice the sine of its angle in length."""
    turned = linear - linear.T
    return np.array([turned[2, 1], turned[0, 2], turned[1, 0]])


def _decomposed(matrix: npt.ArrayLike) -> tuple[Array, Array, Array]:
    """
    Return rotation, scales and shears: the linear part is rotation @ diag(scales) @ triangle.

    The shears are above the diagonal of the triangle, which has ones on it and zeros below. A
    mirroring is in the first scale.
    """
    linear = np.asarray(matrix, dtype=float)[:3, :3]
    try:
        scaled = np.linalg.cholesky(linear.T @ linear).T
    except np.linalg.LinAlgError:
        raise np.linalg.LinAlgError(
            f'the matrix is singular, so it contains no rotation: {linear.tolist()}') from None
    if np.linalg.det(linear) < 0.0:
        scaled[0] *= -1.0
    scales = np.diag(scaled).copy()
    shears = (scaled / scales[:, np.newaxis])[np.triu_indices(3, 1)]
    return linear @ np.linalg.inv(scaled), scales, shears


def nearest_quaternion(linear: Array) -> Array:
    """Return the quaternion of the rotation closest to a matrix (Bar-Itzhack 2000, Horn 1987)."""
    form = np.zeros((4, 4))
    form[:3, :3] = linear + linear.T - np.trace(linear) * np.identity(3)
    form[3] = *_doubled_axis(linear), np.trace(linear)  # eigh reads the lower triangle
    quaternion = np.linalg.eigh(form / 3.0)[1][:, -1]
    return -quaternion if quaternion[3] < 0.0 else quaternion


def _from_euler(ai: float, aj: float, ak: float, axes: Axes) -> Rotation:
    name = _TUPLE2AXES[_code(axes)]
    # In scipy, capital letters are rotating axes.
    return Rotation.from_euler(name[1:] if name[0] == 's' else name[1:].upper(), (ai, aj, ak))


# --- sequences of axes

def _axes(first: int, odd: int) -> list[int]:
    step = -1 if odd else 1
    return [first, (first + step) % 3, (first - step) % 3]


def _named(first: int, odd: int, repeats: int, turns: int) -> str:
    """Return the name of a sequence in Gohlke's encoding: first axis, parity, ..."""
    one, two, three = ('xyz'[axis] for axis in _axes(first, odd))
    letters = one + two + (one if repeats else three)
    return f'r{letters[::-1]}' if turns else f's{letters}'


# The names of the original package; programs import them.
_AXES2TUPLE = {_named(*code): code for code in product((0, 1, 2), (0, 1), (0, 1), (0, 1))}
_TUPLE2AXES = {code: name for name, code in _AXES2TUPLE.items()}


def _code(axes: Axes) -> tuple[int, int, int, int]:
    code = _AXES2TUPLE.get(axes.lower()) if isinstance(axes, str) else axes
    if code not in _TUPLE2AXES:
        raise KeyError(f'axes={axes!r} is not a sequence such as sxyz or rzyx')
    return code
