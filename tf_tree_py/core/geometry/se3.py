# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rigid transforms as seven floats: x, y, z, qx, qy, qz, qw; metres, unit quaternion.

The scalar form works on tuples of plain floats, the form whose name ends in ``_many`` on arrays
(..., 7). Each formula is written once per form, next to each other, and a test checks that they
are equal. ``pose`` wraps the scalar form in a class with ``@``; rotations are in ``so3``. The
formulas of a lookup are in ``chain``, because they also exist in C.

A pose named ``a_T_b`` transforms coordinates in b to coordinates in a, so inner names cancel:
``a_T_c = compose(a_T_b, b_T_c)`` and ``a_p = apply(a_T_b, b_p)``.

Pure functions: no state, any thread.
"""

import math

import numpy as np
import numpy.typing as npt

from . import chain, so3
from .so3 import Array, Number, Seven, Vector3

PoseTuple = chain.PoseTuple

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


def inverse_columns(a_T_b: Seven[Number]) -> Seven[Number]:
    """Return b_T_a of seven numbers, or of an array (...) for each coordinate."""
    x, y, z, *_ = a_T_b
    b_q_a = so3.conjugate(a_T_b[3:])
    return so3.rotate(b_q_a, (-x, -y, -z)) + b_q_a


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

    :param ratio: 0 for a, 1 for b; outside of these it extrapolates both motions.
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
