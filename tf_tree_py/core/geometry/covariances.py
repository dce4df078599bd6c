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
Covariances of poses, (6, 6): how far a pose may be off, and how that propagates.

The order is x, y, z, rotation about x, y, z, in metres and radians, and the convention
that of ROS's ``PoseWithCovariance``: t' = t + dt in the parent's axes, and R' = Exp(dr) R
about the parent's fixed axes through the child's origin. The formulas take arrays
(..., 6, 6). To the first order they are those of Barfoot and Furgale, "Associating
Uncertainty with Three-Dimensional Poses", IEEE T-RO 30(3), 2014, in these coordinates.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from .se3 import left_jacobian_many, PoseTuple
from .so3 import Array
from ..errors import InvalidArgumentException
from ..geometry import so3

PACKED_FLOATS = 21

_ROWS, _COLUMNS = np.triu_indices(6)
# Where each entry of the matrix lies in the packed row.
_PLACES = np.zeros((6, 6), dtype=np.intp)
_PLACES[_ROWS, _COLUMNS] = _PLACES[_COLUMNS, _ROWS] = np.arange(PACKED_FLOATS)

# Sums of larger variances, over edges and lever arms, might overflow.
_MOST = 1e100

# As a part of an entry's scale: the rounding errors of sums in float32 are less.
_TOLERANCE = 1e-6
_AXES = ('x', 'y', 'z', 'rotation about x', 'rotation about y', 'rotation about z')

# This close to the end of an interval nothing is divided by what is left of it.
_LEAST_REST = 1e-9

# Pairs of draws: with this many a variance is right to a percent where angles are large.
_PAIRS = 2048
_SEED = 6


def checked_covariance(given: Any) -> Array:
    """
    Return a covariance as a symmetric array (6, 6).

    :param given: (6, 6), or (36,) row-major as messages have it.
    :raises InvalidArgumentException: another shape, not finite or beyond all measure, not
        symmetric, or not positive semidefinite.
    """
    try:
        if np.iscomplexobj(given):
            raise TypeError
        matrix = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidArgumentException(
            f'Invalid argument covariance {given!r:.80}: it is (6, 6) numbers') from None
    if matrix.shape == (36,):
        matrix = matrix.reshape(6, 6)
    if matrix.shape != (6, 6):
        raise InvalidArgumentException(
            'Invalid argument covariance: it is (6, 6) of x, y, z and rotation about x, y, z, or '
            f'(36,) as messages have it, not {matrix.shape}; np.diag makes one of six variances')
    if not np.isfinite(matrix).all():
        raise InvalidArgumentException('Invalid argument covariance: it is not finite')
    variances = matrix.diagonal()
    if variances.min() < 0.0:
        raise InvalidArgumentException(
            f'Invalid argument covariance: the variance of {_AXES[int(variances.argmin())]} is '
            f'{variances.min():g}, and none is negative; in messages -1 means that it is unknown')
    if variances.max() > _MOST:
        raise InvalidArgumentException(
            f'Invalid argument covariance: the variance of {_AXES[int(variances.argmax())]} is '
            f'{variances.max():g}, more than can be added up ({_MOST:g})')
    _check_correlations(matrix, np.sqrt(variances))
    return np.asarray(0.5 * (matrix + matrix.T))


def _check_correlations(matrix: Array, deviations: Array) -> None:
    """Refuse what is not symmetric or not positive semidefinite, whatever its units."""
    units = np.where(deviations > 0.0, deviations, 1.0)
    scaled = matrix / np.outer(units, units)
    if np.abs(scaled - scaled.T).max() > _TOLERANCE:
        row, column = np.unravel_index(np.abs(scaled - scaled.T).argmax(), (6, 6))
        raise InvalidArgumentException(
            f'Invalid argument covariance: it is not symmetric, [{row}, {column}] is '
            f'{matrix[row, column]:g} and [{column}, {row}] is {matrix[column, row]:g}')
    least = float(np.linalg.eigvalsh(scaled)[0])
    if least < -_TOLERANCE:
        raise InvalidArgumentException(
            'Invalid argument covariance: it is not positive semidefinite, so in some direction '
            f'the variance would be negative (an eigenvalue of its correlations is {least:g})')


def pack(covariance: Array) -> Array:
    """Return the 21 different numbers of a covariance."""
    return np.asarray(covariance[..., _ROWS, _COLUMNS])


def unpack(packed: Array) -> Array:
    """Return the covariances (..., 6, 6) of packed ones (..., 21)."""
    return np.asarray(packed[..., _PLACES])


# --- to the first order

def carried(a_R_b: Array, lever: Array, covariance: Array) -> Array:
    """
    Return the covariance of another point on the same rigid body, from that of one point.

    M C M^T with M = [[R, -[l]x R], [0, R]]: the whole turns about the place of the error.

    :param a_R_b: (..., 3, 3), from the axes of the covariance to those of the answer.
    :param lever: (..., 3) from the place of the error to the point, in the axes of a.
    """
    turned = np.cross(a_R_b, lever[..., None], axis=-2)
    matrix = np.zeros((*turned.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = a_R_b
    matrix[..., :3, 3:] = turned
    return matrix @ covariance @ np.swapaxes(matrix, -1, -2)


def composed(a_T_b: PoseTuple, of_a_T_b: Array, b_T_c: PoseTuple, of_b_T_c: Array) -> Array:
    """Return the covariance of a_T_c out of two poses whose errors are independent."""
    turn = np.array(so3.as_matrix(a_T_b[3:]))
    lever = turn @ np.array(b_T_c[:3])
    return carried(np.eye(3), lever, of_a_T_b) + carried(turn, np.zeros(3), of_b_T_c)


def between(before: Array, after: Array, ratio: Array, turn: Array,
            independent: bool) -> Array:
    """
    Return the covariance of a pose that is interpolated between two.

    The error is M0 e0 + M1 e1: of the translation 1 - u and u, of the rotation
    M1 = u Jl(u f) Jl(f)^-1 and M0 = Exp(u f) - u Jl(u f) Jr(f)^-1, with the rotation f from
    one to the other and the Jacobians of SO(3). Unless the two errors are independent,
    the answer is M0 C0 M0^T / (1 - u) + M1 C1 M1^T / u: a bound however they are
    correlated, for (a + b)(a + b)^T <= a a^T / (1 - u) + b b^T / u of any two vectors.
    If both errors are the same one, and the edge does not turn, the bound is their covariance.

    :param before: (..., 6, 6), and ``after`` too.
    :param ratio: (...) u, 0 to 1.
    :param turn: (..., 3) f, radians, in the parent's axes.
    :param independent: whether the two errors are independent of each other.
    """
    u = ratio[..., None, None]
    rest = 1.0 - u
    turned = ratio[..., None] * turn
    jacobian, forward, backward = left_jacobian_many(np.stack([turned, turn, -turn]))
    last, left = jacobian @ np.linalg.inv(np.stack([forward, backward]))
    first = (so3.as_matrix_many(so3.exp_many(turned)) - u * left) / np.maximum(rest, _LEAST_REST)
    weights = (rest * rest, u * u) if independent else (rest, u)
    return (weights[0] * _turned(first, before)) + (weights[1] * _turned(last, after))


def _turned(matrix: Array, covariance: Array) -> Array:
    """Return a covariance whose rotation is multiplied by (..., 3, 3) from the left."""
    whole = np.zeros(covariance.shape)
    whole[..., :3, :3] = np.eye(3)
    whole[..., 3:, 3:] = matrix
    return whole @ covariance @ np.swapaxes(whole, -1, -2)


# --- where angles are large

def sampled(axes: Array, places: Array, covariances: Array, upwards: Sequence[bool],
            point: Array) -> Array:
    """
    Return the covariance (6, 6) of a pose behind several errors, by drawing them.

    The second moment of 4,096 fixed draws, in pairs of opposite ones, whose own moments
    are exact: so it is the formula of the first order where errors are small, and holds
    at large angles too. The errors come from the frame of the answer to the point.

    :param axes: (E, 3, 3) from the axes of each error to the answer's.
    :param places: (E, 3) the origin of each error's child in the answer.
    :param covariances: (E, 6, 6)
    :param upwards: of each, whether its edge is walked from the child to the parent.
    :param point: (3,) what the errors move.
    """
    draws = _draws(6 * len(axes))
    moved = np.tile(point, (len(draws), 1))
    turned = np.tile(so3.IDENTITY, (len(draws), 1))
    for number in reversed(range(len(axes))):
        errors = draws[:, 6 * number:6 * number + 6] @ _root(covariances[number])
        shift, vector = errors[:, :3] @ axes[number].T, errors[:, 3:] @ axes[number].T
        back = upwards[number]
        turn = so3.exp_many(-vector if back else vector)
        moved = so3.rotate_many(turn, moved - places[number] - back * shift)
        moved += places[number] + (not back) * shift
        turned = so3.multiply_many(turn, turned)
    errors = np.concatenate([moved - point, so3.log_many(turned)], axis=-1)
    return np.asarray(errors.T @ errors / len(errors))


def _root(covariance: Array) -> Array:
    """Return the symmetric square root."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


@lru_cache(maxsize=8)
def _draws(count: int) -> Array:
    """Return draws (4096 or more, count) with the mean 0 and the covariance I, exactly."""
    half = np.random.default_rng(_SEED).normal(size=(max(_PAIRS, 2 * count), count))
    values, vectors = np.linalg.eigh(half.T @ half / len(half))
    half = half @ (vectors / np.sqrt(values)) @ vectors.T
    return np.concatenate([half, -half])
