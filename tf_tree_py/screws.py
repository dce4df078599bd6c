# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Exp and log of poses; screws in other frames.

Twists and wrenches are screws, six numbers each: three that depend on the origin, and three
that do not. For a twist these are the linear velocity of the body's point at the origin, and
the angular velocity; for a wrench the torque about the origin, and the force.

Poses are seven floats, as in ``se3``. The scalar form works on tuples of plain floats, the form
whose name ends in ``_many`` on arrays (..., 6) and (..., 7); a test checks that they are equal.
"""

from collections.abc import Sequence
import math

import numpy as np
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Number, Six, Three, Vector3

__all__ = [
    'adjoint', 'carry', 'carry_many', 'cross', 'exp', 'exp_many', 'left_jacobian_many',
    'left_jacobian_product', 'log', 'log_many', 'plus', 'Screw', 'times', 'Twist',
]

Screw = Six[float]
Twist = Screw


def exp(twist: Twist) -> PoseTuple:
    """
    Return the pose reached by a constant twist in unit time.

    It is (V v, exp w) with V = I + (1 - cos t)/t^2 [w] + (t - sin t)/t^3 [w]^2 and
    t = |w|: Murray, Li, Sastry, "A Mathematical Introduction to Robotic
    Manipulation", equation 2.36.

    :param twist: (vx, vy, vz, wx, wy, wz): metres, radians.
    """
    vx, vy, vz, wx, wy, wz = twist
    first, second = _left_jacobian(wx * wx + wy * wy + wz * wz)
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
    wx, wy, wz = so3.log(pose[3:])
    third = _inverse_left_jacobian(wx * wx + wy * wy + wz * wz)
    return (*_jacobian_product(pose[:3], (wx, wy, wz), -0.5, third), wx, wy, wz)


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
    return _jacobian_product(rate, rotation_vector, *_left_jacobian(x * x + y * y + z * z))


def carry(a_T_b: PoseTuple, screw: Screw) -> Screw:
    """
    Transform a screw from b's axes and origin to a's axes and origin.

    This is the adjoint, (R v + t x R w, R w): Murray, Li, Sastry, "A Mathematical
    Introduction to Robotic Manipulation", section 2.4.

    :param screw: (vx, vy, vz, wx, wy, wz); see the module docstring.
    """
    tx, ty, tz, *_ = a_T_b
    vx, vy, vz = so3.rotate(a_T_b[3:], screw[:3])
    wx, wy, wz = so3.rotate(a_T_b[3:], screw[3:])
    return (vx + ty * wz - tz * wy, vy + tz * wx - tx * wz, vz + tx * wy - ty * wx, wx, wy, wz)


def carry_many(a_T_b: Array, screws: Array) -> Array:
    """Transform screws (..., 6) from b to a by poses (..., 7), elementwise; see ``carry``."""
    v = so3.rotate_many(a_T_b[..., 3:], screws[..., :3])
    w = so3.rotate_many(a_T_b[..., 3:], screws[..., 3:])
    return np.concatenate([v + np.cross(a_T_b[..., :3], w), w], axis=-1)


def adjoint(a_T_b: PoseTuple) -> Array:
    """Return the matrix (6, 6) that transforms a screw from b to a, as ``carry`` does."""
    return carry_many(np.array(a_T_b), np.eye(6)).T


# --- sums and products

def times(factor: Number, screw: Sequence[Number]) -> Six[Number]:
    """Return a multiple of a screw."""
    a, b, c, d, e, f = screw
    return factor * a, factor * b, factor * c, factor * d, factor * e, factor * f


def plus(one: Screw, factor: float, other: Screw) -> Screw:
    """Return one + factor other."""
    a, b, c, d, e, f = one
    g, h, i, j, k, m = times(factor, other)
    return a + g, b + h, c + i, d + j, e + k, f + m


def cross(a: Sequence[Number], b: Sequence[Number]) -> Three[Number]:
    """Return the cross product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


# --- Jacobians

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


def _left_jacobian_series(s: Number) -> tuple[Number, Number]:
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


def _inverse_left_jacobian_series(s: Number) -> Number:
    return 1.0 / 12.0 + s / 720.0 * (1.0 + s / 42.0 * (1.0 + s / 40.0))


def _jacobian_product(v: Three[Number], w: Three[Number], first: Number,
                      second: Number) -> Three[Number]:
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
