# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rotations as unit quaternions (x, y, z, w), with each formula in two forms.

The scalar form accepts and returns tuples of plain floats, because one numpy operation on one
quaternion costs more than all of its arithmetic. The form whose name ends in ``_many`` accepts
arrays (..., 4) and broadcasts. A test checks that both are equal. q and -q are the same
rotation. A function here may return either, unless its docstring specifies the sign;
``with_tf2_sign`` returns the one used in messages. Poses are in ``se3``.

Pure functions: no state, any thread. A result may be the argument itself, so neither is changed.
"""

from collections.abc import Sequence
import math
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .chain import (
    HALF_TURN,
    Quaternion as Quaternion,
    slerp_weights as slerp_weights,
    through_tf2_matrix as through_tf2_matrix,
)
from ..times import Mask

Array = npt.NDArray[np.float64]  # of the shape that the docstring names
# A float, or an array (...), in a formula that is valid for both.
Number = TypeVar('Number', float, Array)
Three = tuple[Number, Number, Number]
Four = tuple[Number, Number, Number, Number]
Six = tuple[Number, Number, Number, Number, Number, Number]
Seven = tuple[Number, Number, Number, Number, Number, Number, Number]

Vector3 = Three[float]

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)

# A matrix whose R^T R differs from I by more than this is not a rotation.
_ORTHONORMAL_TOLERANCE = 1e-6

# Closer to gimbal lock than this many radians, roll is set to zero.
_GIMBAL_LOCK = 1e-12


def multiply(a: Four[Number], b: Four[Number]) -> Four[Number]:
    """Return the Hamilton product a b, which rotates by b first, then by a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def multiply_many(a: Array, b: Array) -> Array:
    """Return the Hamilton products of (..., 4) and (..., 4)."""
    return joined(multiply(columns(a), columns(b)))


def conjugate(q: Four[Number]) -> Four[Number]:
    """Return the inverse rotation of a unit quaternion."""
    x, y, z, w = q
    return (-x, -y, -z, w)


def conjugate_many(q: Array) -> Array:
    """Return the inverse rotations of unit quaternions (..., 4)."""
    return np.concatenate([-q[..., :3], q[..., 3:]], axis=-1)


def rotate(q: Four[Number], v: Three[Number]) -> Three[Number]:
    """Return q v q*: v + 2 w (u x v) + 2 u x (u x v), with u the vector part of q."""
    x, y, z, w = q
    vx, vy, vz = v
    cx = 2.0 * (y * vz - z * vy)
    cy = 2.0 * (z * vx - x * vz)
    cz = 2.0 * (x * vy - y * vx)
    return (
        vx + w * cx + y * cz - z * cy,
        vy + w * cy + z * cx - x * cz,
        vz + w * cz + x * cy - y * cx,
    )


def rotate_many(q: Array, v: Array) -> Array:
    """Rotate vectors (..., 3) by unit quaternions (..., 4)."""
    return joined(rotate(columns(q), columns(v)))


def normalize(q: Quaternion) -> Quaternion:
    """
    Return q scaled to length one.

    :raises ValueError: the quaternion is zero or not finite.
    """
    size = math.hypot(*q)
    if not 0.0 < size < math.inf:
        raise ValueError(f'not a rotation: the quaternion {tuple(q)} (x y z w) has length {size}')
    x, y, z, w = q
    return (x / size, y / size, z / size, w / size)


def has_tf2_sign(x: float, y: float, z: float, w: float) -> bool:
    """
    Return whether tf2 converts the matrix of the rotation to q, and not to -q.

    w is positive if the trace of the matrix is; otherwise the largest of the other components
    is positive, as in ``getRotation`` of tf2's ``Matrix3x3``. The trace of a unit quaternion's
    matrix is 4 w^2 - 1, and the order of its diagonal is that of x^2, y^2 and z^2. Every result
    of tf2's buffer is converted from such a matrix.
    """
    if w > 0.5:
        return True
    if w < -0.5:
        return False
    if x * x < y * y:
        x = y
    return (z if x * x < z * z else x) > 0.0


def with_tf2_sign(q: Quaternion) -> Quaternion:
    """Return that one of q and -q for which ``has_tf2_sign`` is true."""
    x, y, z, w = q
    return q if has_tf2_sign(x, y, z, w) else (-x, -y, -z, -w)


def with_tf2_sign_many(q: Array) -> Array:
    """Return unit quaternions (..., 4) with the sign of ``with_tf2_sign``."""
    if (q[..., 3] > 0.5).all():
        return q
    largest = np.argmax(np.abs(q[..., :3]), axis=-1)[..., None]
    decisive = np.where(np.abs(q[..., 3]) > 0.5, q[..., 3],
                        np.take_along_axis(q, largest, axis=-1)[..., 0])
    return np.asarray(np.where(decisive[..., None] >= 0.0, q, -q))


def is_half_turn(cosine: Array) -> Mask:
    """Return whether two unit quaternions with this dot product are half a turn apart."""
    return (cosine < HALF_TURN) & (cosine > -HALF_TURN)


def slerp_weights_many(cosine: Array, ratio: Array,
                       as_tf2: bool = False) -> tuple[Array, Array]:
    """Return ``slerp_weights`` for arrays that broadcast against each other."""
    near = np.abs(cosine)
    apart = near < 1.0
    if apart.all():
        angle = np.arccos(near)
        turned = ratio * angle
        second = np.sin(turned) / np.sin(angle)
        first = np.cos(turned) - near * second
    else:
        angle = np.arccos(np.where(apart, near, 0.0))
        second = np.where(apart, np.sin(ratio * angle) / np.sin(angle), 0.0 if as_tf2 else ratio)
        first = np.where(apart, np.cos(ratio * angle) - near * second, 1.0 - second)
    return first, np.where(cosine >= 0.0, second, -second)


def slerp(a: Quaternion, b: Quaternion, ratio: float) -> Quaternion:
    """Interpolate on the sphere, the short way round, at constant angular speed."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    first, second = slerp_weights(ax * bx + ay * by + az * bz + aw * bw, ratio)
    return (
        first * ax + second * bx,
        first * ay + second * by,
        first * az + second * bz,
        first * aw + second * bw,
    )


def slerp_many(a: Array, b: Array, ratio: Array, as_tf2: bool = False) -> Array:
    """Interpolate (..., 4) with (..., 4) at ratios (...); ``as_tf2`` as in ``slerp_weights``."""
    cosine = _dot_many(a, b)
    if as_tf2 and (chosen := is_half_turn(cosine)).any():
        a, b = (_through_tf2_matrices(each, chosen) for each in (a, b))
        cosine = _dot_many(a, b)
    first, second = slerp_weights_many(cosine, ratio, as_tf2)
    return np.asarray(first[..., None] * a + second[..., None] * b)


def _dot_many(a: Array, b: Array) -> Array:
    # The order of the sum is that of the scalar form: the last bit decides whether it is one.
    x, y, z, w = columns(a * b)
    return np.asarray(x + y + z + w)


def _through_tf2_matrices(q: Array, chosen: Mask) -> Array:
    q = np.array(np.broadcast_to(q, (*chosen.shape, 4)))
    q[chosen] = [through_tf2_matrix((x, y, z, w)) for x, y, z, w in q[chosen].tolist()]
    return q


def exp(rotation_vector: Vector3) -> Quaternion:
    """Return the rotation about a vector by its length in radians."""
    x, y, z = rotation_vector
    angle = math.hypot(x, y, z)
    scale = math.sin(0.5 * angle) / angle if angle else 0.5
    return (scale * x, scale * y, scale * z, math.cos(0.5 * angle))


def exp_many(rotation_vectors: Array) -> Array:
    """Return the quaternions (..., 4) of rotation vectors (..., 3) in radians."""
    return joined(exp_columns(*columns(rotation_vectors)))


def exp_columns(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array, Array]:
    """Return the same as ``exp_many``, with a separate array (...) for each coordinate."""
    angle = np.sqrt(x * x + y * y + z * z)
    scale = np.divide(np.sin(0.5 * angle), angle, out=np.full_like(angle, 0.5), where=angle > 0.0)
    return scale * x, scale * y, scale * z, np.cos(0.5 * angle)


def log(q: Quaternion) -> Vector3:
    """Return the rotation vector, radians, of length 0 to pi."""
    x, y, z, w = q
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = math.hypot(x, y, z)
    # angle/sin(angle/2); atan2 has full precision at both ends.
    scale = 2.0 * math.atan2(sine, w) / sine if sine else 2.0
    return (scale * x, scale * y, scale * z)


def log_many(q: Array) -> Array:
    """Return the rotation vectors (..., 3) of unit quaternions (..., 4)."""
    return joined(log_columns(*columns(q)))


def log_columns(x: Array, y: Array, z: Array, w: Array) -> tuple[Array, Array, Array]:
    """Return the same as ``log_many``, with a separate array (...) for each coordinate."""
    sine = np.sqrt(x * x + y * y + z * z)
    scale = np.divide(2.0 * np.arctan2(sine, np.abs(w)), sine, out=np.full_like(sine, 2.0),
                      where=sine > 0.0)
    # Use -q if w is negative.
    scale = np.where(w < 0.0, -scale, scale)
    return scale * x, scale * y, scale * z


def as_matrix(q: Four[Number]) -> tuple[Three[Number], Three[Number], Three[Number]]:
    """Return the rotation matrix, row by row; its columns are the rotated axes."""
    x, y, z, w = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def as_matrix_many(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    rows = [joined(row) for row in as_matrix(columns(q))]
    return np.stack(rows, axis=-2)


def from_matrix(matrix: npt.ArrayLike) -> Quaternion:
    """
    Return the unit quaternion, w >= 0, of a (3, 3) rotation matrix.

    :raises ValueError: not (3, 3), not orthonormal within 1e-6, or a reflection.
    """
    array = np.asarray(matrix, dtype=float)
    if array.shape != (3, 3):
        raise ValueError(f'a rotation matrix must have the shape (3, 3), not {array.shape}')
    x, y, z, w = from_matrix_many(array).tolist()
    return (x, y, z, w)


def from_matrix_many(matrices: Array) -> Array:
    """
    Return the unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3).

    This is Shepperd's method ("Quaternion from Rotation Matrix", 1978): divide by the largest
    of the four components, which keeps full precision near pi.

    :raises ValueError: not orthonormal within 1e-6, or a reflection.
    """
    m = matrices
    gram = np.swapaxes(m, -1, -2) @ m
    if not np.all(np.abs(gram - np.eye(3)) < _ORTHONORMAL_TOLERANCE):
        raise ValueError('not a rotation: R^T R differs from I by more than 1e-6')
    if not np.all(np.linalg.det(m) > 0.0):
        raise ValueError('not a rotation: det R = -1, a reflection')
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    both, odd = m + np.swapaxes(m, -1, -2), m - np.swapaxes(m, -1, -2)
    xy, yz, zx = both[..., 0, 1], both[..., 1, 2], both[..., 2, 0]
    wx, wy, wz = odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]
    # Row k is the quaternion times four times its own k-th component.
    products = np.stack(
        [
            np.stack([1.0 + xx - yy - zz, xy, zx, wx], axis=-1),
            np.stack([xy, 1.0 - xx + yy - zz, yz, wy], axis=-1),
            np.stack([zx, yz, 1.0 - xx - yy + zz, wz], axis=-1),
            np.stack([wx, wy, wz, 1.0 + xx + yy + zz], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.einsum('...ii->...i', products), axis=-1)[..., None, None]
    q = np.squeeze(np.take_along_axis(products, largest, axis=-2), axis=-2)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., 3:] < 0.0, -q, q))


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """
    Return the rotation of roll, pitch and yaw, radians.

    The rotations are about the fixed axes x, y, z in this order: R = Rz(yaw) Ry(pitch) Rx(roll),
    as in URDF and tf2.
    """
    about_x = (math.sin(0.5 * roll), 0.0, 0.0, math.cos(0.5 * roll))
    about_y = (0.0, math.sin(0.5 * pitch), 0.0, math.cos(0.5 * pitch))
    about_z = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    return multiply(about_z, multiply(about_y, about_x))


def as_rpy(q: Quaternion) -> Vector3:
    """
    Return (roll, pitch, yaw), radians, with pitch in [-pi/2, pi/2].

    They are computed from half the sum and half the difference of yaw and roll, as in Bernardes,
    Viollet, "Quaternion to Euler angles conversion" (2022): near gimbal lock the three angles
    together keep full precision, unlike those from elements of the matrix. In gimbal lock
    (pitch = +-pi/2) only the sum or the difference is defined: roll is 0.
    """
    x, y, z, w = q
    above, below = math.hypot(w + y, z - x), math.hypot(w - y, z + x)
    pitch = math.atan2(2.0 * (w * y - x * z), above * below)
    half_sum, half_difference = math.atan2(z + x, w - y), math.atan2(z - x, w + y)
    if below < _GIMBAL_LOCK:
        half_sum = half_difference
    elif above < _GIMBAL_LOCK:
        half_difference = half_sum
    roll, yaw = half_sum - half_difference, half_sum + half_difference
    return (math.remainder(roll, math.tau), pitch, math.remainder(yaw, math.tau))


def columns(array: Array) -> Any:
    """Split (..., n) into n arrays (...), for a formula written for plain floats."""
    # For short arrays, np.moveaxis takes three times as long, and so does np.stack below.
    numbers = np.asarray(array, dtype=float)
    return tuple(numbers[..., column] for column in range(numbers.shape[-1]))


def joined(parts: Sequence[Array]) -> Array:
    """Join n arrays (...) to one (..., n): the inverse of ``columns``."""
    made = np.empty((*np.broadcast(*parts).shape, len(parts)))
    for column, part in enumerate(parts):
        made[..., column] = part
    return made
