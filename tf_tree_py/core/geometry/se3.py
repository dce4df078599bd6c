# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rigid transforms as seven floats: x, y, z, qx, qy, qz, qw; metres, unit quaternion.

The scalar form works on tuples of plain floats, the form whose name ends in ``_many`` on arrays
(..., 7). Each formula is written once per form, next to each other, and a test checks that they
are equal. ``pose`` wraps the scalar form in a class with ``@``; rotations are in ``so3``. The
formulas of a lookup are in ``chain``, because they can be compiled.

A pose named ``a_T_b`` transforms coordinates in b to coordinates in a, so inner names cancel:
``a_T_c = compose(a_T_b, b_T_c)`` and ``a_p = apply(a_T_b, b_p)``.

Twists and wrenches are screws, six numbers each: three that depend on the origin, and three
that do not. For a twist these are the linear velocity of the body's point at the origin, and
the angular velocity; for a wrench the torque about the origin, and the force.

Pure functions: no state, any thread.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from . import chain, so3
from .so3 import Array, Vector3

PoseTuple = chain.PoseTuple
Twist = tuple[float, float, float, float, float, float]

IDENTITY = chain.IDENTITY
compose, compose_chain, inverse = chain.compose, chain.compose_chain, chain.inverse


def compose_many(a_T_b: Array, b_T_c: Array) -> Array:
    """Return a_T_c, elementwise, of arrays (..., 7) that broadcast."""
    translation = a_T_b[..., :3] + so3.rotate_many(a_T_b[..., 3:], b_T_c[..., :3])
    return np.concatenate(
        [translation, so3.multiply_many(a_T_b[..., 3:], b_T_c[..., 3:])], axis=-1)


def inverse_many(a_T_b: Array) -> Array:
    """Return b_T_a, elementwise, of (..., 7)."""
    q = so3.conjugate_many(a_T_b[..., 3:])
    return np.concatenate([so3.rotate_many(q, -a_T_b[..., :3]), q], axis=-1)


def inverse_columns(a_T_b: Any) -> tuple[Any, ...]:
    """Return b_T_a of seven numbers, or of an array (...) for each coordinate."""
    x, y, z, *q = a_T_b
    b_q_a: Any = so3.conjugate((q[0], q[1], q[2], q[3]))
    return (*so3.rotate(b_q_a, (-x, -y, -z)), *b_q_a)


def apply(a_T_b: PoseTuple, point: Vector3) -> Vector3:
    """Transform one point from coordinates in b to coordinates in a."""
    x, y, z, qx, qy, qz, qw = a_T_b
    px, py, pz = so3.rotate((qx, qy, qz, qw), point)
    return (x + px, y + py, z + pz)


def apply_many(a_T_b: npt.ArrayLike, points: npt.ArrayLike) -> Array:
    """
    Transform points from coordinates in b to coordinates in a.

    :param a_T_b: (7,) one pose for all points, or (..., 7) one for each.
    :param points: (..., 3), metres.
    :return: (..., 3), metres.
    """
    poses = np.asarray(a_T_b, dtype=float)
    array = np.asarray(points, dtype=float)
    if array.shape[-1:] != (3,) or poses.shape[-1:] != (7,):
        raise ValueError(
            f'poses are (..., 7) and points (..., 3), not {poses.shape} and {array.shape}')
    if poses.ndim == 1:
        return np.asarray(array @ so3.as_matrix_many(poses[3:]).T + poses[:3])
    return np.asarray(so3.rotate_many(poses[..., 3:], array) + poses[..., :3])


def distance(a: PoseTuple, b: PoseTuple) -> tuple[float, float]:
    """Return the distance of two poses: metres, and radians up to pi."""
    x, y, z, qx, qy, qz, qw = a
    *turn, w = so3.multiply((-qx, -qy, -qz, qw), b[3:])
    return math.dist((x, y, z), b[:3]), 2.0 * math.atan2(math.hypot(*turn), abs(w))


def distance_many(a: Array, b: Array) -> tuple[Array, Array]:
    """
    Return the distances of poses (..., 7): metres (...), and radians (...) up to pi.

    The formula for the angle is Kahan's, from the difference and the sum of two unit vectors. It
    is as accurate as that of the product, which takes four times as many numpy operations.
    """
    gone, less, more = b[..., :3] - a[..., :3], b[..., 3:] - a[..., 3:], b[..., 3:] + a[..., 3:]
    # einsum does not warn about numbers that are not finite.
    gone, less, more = (np.einsum('...i,...i->...', each, each) for each in (gone, less, more))
    # q and -q are the same rotation.
    return np.sqrt(gone), 4.0 * np.arctan2(
        np.sqrt(np.minimum(less, more)), np.sqrt(np.maximum(less, more)))


def interpolate(a: PoseTuple, b: PoseTuple, ratio: float) -> PoseTuple:
    """
    Return the pose between two: the translation on a line, the rotation by slerp.

    This is not the screw motion between the two: the origin of the frame moves on a straight
    line.

    :param ratio: 0 for a, 1 for b.
    """
    (ax, ay, az, *_), (bx, by, bz, *_) = a, b
    left = 1.0 - ratio
    return (left * ax + ratio * bx, left * ay + ratio * by, left * az + ratio * bz,
            *so3.slerp(a[3:], b[3:], ratio))


def interpolate_many(a: Array, b: Array, ratio: Array, as_tf2: bool = False) -> Array:
    """Interpolate (..., 7) with (..., 7) at ratios (...); ``as_tf2`` as in ``slerp_weights``."""
    u = ratio[..., None]
    rotation = so3.slerp_many(a[..., 3:], b[..., 3:], ratio, as_tf2)
    return np.concatenate([(1.0 - u) * a[..., :3] + u * b[..., :3], rotation], axis=-1)


def exp(twist: Twist) -> PoseTuple:
    """
    Return the pose reached by a constant twist in unit time.

    It is (V v, exp w) with V = I + (1 - cos t)/t^2 [w] + (t - sin t)/t^3 [w]^2 and
    t = |w|: Murray, Li, Sastry, "A Mathematical Introduction to Robotic
    Manipulation", equation 2.36.

    :param twist: (vx, vy, vz, wx, wy, wz): metres, radians.
    """
    vx, vy, vz, wx, wy, wz = twist
    square = wx * wx + wy * wy + wz * wz
    first, second = _left_jacobian(square)
    return (*_jacobian_product((vx, vy, vz), (wx, wy, wz), first, second),
            *so3.exp((wx, wy, wz)))


def exp_many(twists: Array) -> Array:
    """Return the poses (..., 7) of twists (..., 6)."""
    v, w = twists[..., :3], twists[..., 3:]
    first, second = _left_jacobian_many(np.einsum('...i,...i->...', w, w))
    return np.concatenate([_jacobian_product_many(v, w, first, second), so3.exp_many(w)], axis=-1)


def log(pose: PoseTuple) -> Twist:
    """
    Return the constant twist that reaches the pose in unit time.

    This is the inverse of ``exp``, with a rotation of at most pi: v = V^-1 p with the
    translation p, and V^-1 = I - [w]/2 + (1/t^2 - cot(t/2)/(2t)) [w]^2.

    :return: (vx, vy, vz, wx, wy, wz): metres, radians.
    """
    x, y, z, *q = pose
    wx, wy, wz = so3.log((q[0], q[1], q[2], q[3]))
    third = _inverse_left_jacobian(wx * wx + wy * wy + wz * wz)
    return (*_jacobian_product((x, y, z), (wx, wy, wz), -0.5, third), wx, wy, wz)


def log_many(poses: Array) -> Array:
    """Return the twists (..., 6) of poses (..., 7)."""
    w = so3.log_many(poses[..., 3:])
    third = _inverse_left_jacobian_many(np.einsum('...i,...i->...', w, w))
    half = np.full_like(third, -0.5)
    return np.concatenate([_jacobian_product_many(poses[..., :3], w, half, third), w], axis=-1)


def left_jacobian_many(rotation_vectors: Array) -> Array:
    """
    Return the left Jacobians (..., 3, 3) of SO(3) at rotation vectors (..., 3).

    It is V of ``exp``: Exp(w + d) = Exp(V d) Exp(w) to first order. The right Jacobian is V of
    -w.
    """
    w = rotation_vectors[..., None, :]
    first, second = _left_jacobian_many(np.einsum('...i,...i->...', w, w))
    columns = _jacobian_product_many(np.eye(3), w, first, second)
    return np.swapaxes(columns, -1, -2)


def left_jacobian_product(rotation_vector: Vector3, rate: Vector3) -> Vector3:
    """Return the angular velocity of Exp(w) for a rate of w: V of ``exp`` times the rate."""
    x, y, z = rotation_vector
    first, second = _left_jacobian(x * x + y * y + z * z)
    vx, vy, vz = _jacobian_product(rate, rotation_vector, first, second)
    return (vx, vy, vz)


def as_matrix(pose: PoseTuple) -> Array:
    """Return the (4, 4) homogeneous matrix."""
    return as_matrix_many(np.array(pose))


def as_matrix_many(poses: Array) -> Array:
    """Return the homogeneous matrices (..., 4, 4) of poses (..., 7)."""
    matrices = np.zeros((*poses.shape[:-1], 4, 4))
    matrices[..., :3, :3] = so3.as_matrix_many(poses[..., 3:])
    matrices[..., :3, 3] = poses[..., :3]
    matrices[..., 3, 3] = 1.0
    return matrices


def from_matrix(matrix: npt.ArrayLike) -> PoseTuple:
    """
    Return the pose of a (4, 4) homogeneous matrix.

    :raises ValueError: not (4, 4), last row not 0 0 0 1, not a rotation, or not finite.
    """
    array = np.asarray(matrix, dtype=float)
    if array.shape != (4, 4):
        raise ValueError(f'a homogeneous matrix must have the shape (4, 4), not {array.shape}')
    x, y, z, qx, qy, qz, qw = from_matrix_many(array).tolist()
    return (x, y, z, qx, qy, qz, qw)


def from_matrix_many(matrices: Array) -> Array:
    """
    Return the poses (..., 7) of homogeneous matrices (..., 4, 4).

    :raises ValueError: a last row is not 0 0 0 1, a block is not a rotation, or a
        translation is not finite.
    """
    if not np.allclose(matrices[..., 3, :], (0.0, 0.0, 0.0, 1.0), rtol=0.0, atol=1e-9):
        raise ValueError('not a rigid transform: the last row of the matrix is not 0 0 0 1')
    if not np.isfinite(matrices[..., :3, 3]).all():
        raise ValueError('not a rigid transform: the translation is not finite')
    q = so3.from_matrix_many(matrices[..., :3, :3])
    return np.concatenate([matrices[..., :3, 3], q], axis=-1)


# The coefficients of [w] and [w]^2 in the left Jacobian V and in its inverse, as functions of
# t^2. Below t = 0.1 the closed forms suffer from cancellation, and their Taylor series to t^6
# are more accurate: their relative error is at most 6e-15, that of the closed forms 4e-14.

_TAYLOR_LIMIT = 1e-2


def _left_jacobian(square: float) -> tuple[float, float]:
    if square < _TAYLOR_LIMIT:
        return _left_jacobian_series(square)
    angle = math.sqrt(square)
    return (1.0 - math.cos(angle)) / square, (angle - math.sin(angle)) / (angle * square)


def _left_jacobian_many(square: Array) -> tuple[Array, Array]:
    small = square < _TAYLOR_LIMIT
    safe = np.where(small, 1.0, square)
    angle = np.sqrt(safe)
    first, second = _left_jacobian_series(square)
    return (np.where(small, first, (1.0 - np.cos(angle)) / safe),
            np.where(small, second, (angle - np.sin(angle)) / (angle * safe)))


def _left_jacobian_series(s: Any) -> tuple[Any, Any]:
    return (0.5 - s / 24.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0)),
            1.0 / 6.0 - s / 120.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0)))


def _inverse_left_jacobian(square: float) -> float:
    if square < _TAYLOR_LIMIT:
        return float(_inverse_left_jacobian_series(square))
    half = 0.5 * math.sqrt(square)
    return (1.0 - half / math.tan(half)) / square


def _inverse_left_jacobian_many(square: Array) -> Array:
    small = square < _TAYLOR_LIMIT
    safe = np.where(small, 1.0, square)
    half = 0.5 * np.sqrt(safe)
    series = _inverse_left_jacobian_series(square)
    return np.where(small, series, (1.0 - half / np.tan(half)) / safe)


def _inverse_left_jacobian_series(s: Any) -> Any:
    return 1.0 / 12.0 + s / 720.0 * (1.0 + s / 42.0 * (1.0 + s / 40.0))


def _jacobian_product(v: Any, w: Any, first: Any, second: Any) -> Any:
    """Return (I + first [w] + second [w]^2) v."""
    vx, vy, vz = v
    wx, wy, wz = w
    cx, cy, cz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    return (
        vx + first * cx + second * (wy * cz - wz * cy),
        vy + first * cy + second * (wz * cx - wx * cz),
        vz + first * cz + second * (wx * cy - wy * cx),
    )


def _jacobian_product_many(v: Array, w: Array, first: Array, second: Array) -> Array:
    return so3.joined(_jacobian_product(so3.columns(v), so3.columns(w), first, second))


# --- screws

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
