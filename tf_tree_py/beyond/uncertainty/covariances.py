# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Covariances of poses, (6, 6), and their propagation.

The order is x, y, z, rotation about x, y, z, in metres and radians. The convention is that of
ROS's ``PoseWithCovariance``: t' = t + dt in the parent's axes, and R' = Exp(dr) R about the
parent's fixed axes through the child's origin. The formulas accept arrays (..., 6, 6). To first
order they are those of Barfoot and Furgale, "Associating Uncertainty with Three-Dimensional
Poses", IEEE T-RO 30(3), 2014, in these coordinates.
"""

from collections.abc import Callable, Sequence
import math
import struct

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Number, Three
from tf_tree_py.files.edges import Bytes

from .covariance_rows import product, Rows, turned, weighted_sum

PACKED_FLOATS = 21

_ROWS, _COLUMNS = np.triu_indices(6)
# The index in the packed row of each entry of the matrix.
_PLACES = np.zeros((6, 6), dtype=np.intp)
_PLACES[_ROWS, _COLUMNS] = _PLACES[_COLUMNS, _ROWS] = np.arange(PACKED_FLOATS)
DIAGONAL = _PLACES.diagonal()
"""The indices of the six variances in the packed row."""
_DIAGONAL_PLACES: tuple[int, ...] = tuple(DIAGONAL.tolist())

# Sums of larger variances, over edges and lever arms, might overflow.
_MOST = 1e100

# Relative to an entry's scale: rounding errors of sums in float32 are smaller.
_TOLERANCE = 1e-6
_AXES = ('x', 'y', 'z', 'rotation about x', 'rotation about y', 'rotation about z')

# The smallest divisors: the remaining part of an interval, and an angle in radians.
_LEAST_REST, _LEAST_TURN = 1e-9, 1e-6
# Rotations by less have no effect on a covariance.
_LEAST_SINE = 1e-12
# The smallest part of an interval, chosen so that its sine is not yet zero.
_LEAST_PART = 1e-200

_Matrix9 = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix (3, 3), row by row."""
_UNTURNED: _Matrix9 = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

# Gives the matrix of a cross product, row by row: v @ SKEW is [v].
SKEW = np.zeros((3, 9))
SKEW[[0, 0, 1, 1, 2, 2], [7, 5, 2, 6, 3, 1]] = 1.0, -1.0, 1.0, -1.0, 1.0, -1.0


def checked_covariance(given: npt.ArrayLike) -> Array:
    """
    Return a covariance as a symmetric array (6, 6).

    :param given: (6, 6), or (36,) row-major as in messages.
    :raises InvalidArgumentException: another shape, not finite or too large, not symmetric, or
        not positive semidefinite.
    """
    try:
        if np.iscomplexobj(given):
            raise TypeError
        matrix = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidArgumentException(
            f'Invalid argument covariance {given!r:.80}: it must be (6, 6) numbers') from None
    if matrix.shape == (36,):
        matrix = matrix.reshape(6, 6)
    if matrix.shape != (6, 6):
        raise InvalidArgumentException(
            'Invalid argument covariance: it must be (6, 6) of x, y, z and rotation about x, y, '
            f'z, or (36,) as in messages, not {matrix.shape}; np.diag makes one from six '
            'variances')
    if not np.isfinite(matrix).all():
        raise InvalidArgumentException('Invalid argument covariance: it is not finite')
    variances = matrix.diagonal()
    if variances.min() < 0.0:
        raise InvalidArgumentException(
            f'Invalid argument covariance: the variance of {_AXES[int(variances.argmin())]} is '
            f'{variances.min():g}, which must not be negative; in messages -1 means unknown')
    if variances.max() > _MOST:
        raise InvalidArgumentException(
            f'Invalid argument covariance: the variance of {_AXES[int(variances.argmax())]} is '
            f'{variances.max():g}, which is more than the limit of {_MOST:g}')
    _check_correlations(matrix, np.sqrt(variances))
    return np.asarray(0.5 * (matrix + matrix.T))


def _check_correlations(matrix: Array, deviations: Array) -> None:
    """Raise an error if a matrix is not symmetric or not positive semidefinite, in any units."""
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


def packed_squares(errors: Array) -> Array:
    """Return the packed e e^T (n, 21) of errors e (n, 6)."""
    return pack(errors[:, :, None] * errors[:, None, :])


def errors_of(poses: Array) -> Array:
    """Return how far poses (..., 7) are off the identity, (..., 6): metres and radians."""
    return np.concatenate([poses[..., :3], so3.log_many(poses[..., 3:])], axis=-1)


def unpack(packed: Array) -> Array:
    """Return the covariances (..., 6, 6) of packed ones (..., 21)."""
    return packed.take(_PLACES, axis=-1)


def root_of(covariance: Array) -> Array:
    """Return a root S of a covariance (n, n), so that S S^T is the covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def at_least(packed: list[float], deviations: Sequence[float]) -> list[float]:
    """Return a packed covariance whose six deviations are at least as large as others."""
    for place, deviation in zip(_DIAGONAL_PLACES, deviations, strict=True):
        packed[place] = max(packed[place], deviation * deviation)
    return packed


def largest_deviation(covariance: Array) -> float:
    """Return the standard deviation in the worst direction of a covariance (n, n)."""
    # Rounding may make an eigenvalue of a nearly singular covariance negative.
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def with_less_correlation(covariance: Array, part: float) -> Array:
    """Return a covariance (n, n) of which a part of all correlations remains, 0 to 1."""
    return part * covariance + (1.0 - part) * np.diag(covariance.diagonal())


# --- sums of terms

Terms = tuple[tuple[float, ...], bytes, Bytes]
"""
The contributions of n covariances C at a stamp, the sum of w M C M^T: the n weights w, the
rotation blocks of M (its lower right), nine doubles each, and the C, 21 doubles each.
"""

_TURN_AS_BYTES = struct.Struct('9d').pack
_COVARIANCE_AS_BYTES = struct.Struct(f'{PACKED_FLOATS}d').pack
_ONE_WEIGHT, _NO_TURN = (1.0,), _TURN_AS_BYTES(*_UNTURNED)


def one_term(packed: Bytes) -> Terms:
    """Return a covariance, 21 doubles, as the only term."""
    return _ONE_WEIGHT, _NO_TURN, packed


def packed_term(packed: Sequence[float]) -> Terms:
    """Return a packed covariance, 21 numbers, as the only term."""
    return one_term(_COVARIANCE_AS_BYTES(*packed))


def with_term(terms: Terms | None, covariance: Array) -> Terms:
    """Return terms plus a covariance (6, 6)."""
    packed = pack(covariance).tobytes()
    if terms is None:
        return one_term(packed)
    weights, turns, others = terms
    return weights + _ONE_WEIGHT, turns + _NO_TURN, b''.join((others, packed))


# --- first order

def carried(a_R_b: Array, lever: Array, covariance: Array) -> Array:
    """
    Return the covariance of another point on the same rigid body, from that of one point.

    It is M C M^T with M = [[R, -[l]x R], [0, R]]: the body rotates about the place of the error.

    :param a_R_b: (3, 3), from the axes of the covariance to those of the result.
    :param lever: (3,) from the place of the error to the point, in the axes of a.
    :param covariance: (6, 6)
    """
    return np.asarray(carried_by(a_R_b[None], -lever[None], None, covariance[None])[0])


def carried_by(a_R_b: Array, lever: Array, turns: Array | None, covariances: Array) -> Array:
    """
    Return ``carried`` for n covariances whose rotations are multiplied by turns first.

    :param a_R_b: (n, 3, 3)
    :param lever: (n, 3) from the points to the places of the errors: the opposite of that of
        ``carried``.
    :param turns: (n, 3, 3); None: without.
    :param covariances: (n, 6, 6)
    """
    turned = a_R_b if turns is None else a_R_b @ turns
    matrix = np.zeros(covariances.shape)
    matrix[:, :3, :3] = a_R_b
    matrix[:, 3:, 3:] = turned
    # For small matrices, dot takes half as long as @, which can do many at once.
    crossed = lever.dot(SKEW).reshape(-1, 3, 3)
    np.matmul(crossed, turned, out=matrix[:, :3, 3:])
    return np.asarray(matrix @ covariances @ matrix.swapaxes(1, 2))


def turned_by(turns: Array | None, covariances: Array) -> Array:
    """Return covariances (n, 6, 6) with rotations multiplied by (n, 3, 3), unless None."""
    if turns is None:
        return covariances
    whole = np.zeros(covariances.shape)
    whole[:, :3, :3] = np.eye(3)
    whole[:, 3:, 3:] = turns
    return whole @ covariances @ np.swapaxes(whole, -1, -2)


def composed(a_T_b: PoseTuple, of_a_T_b: Array, b_T_c: PoseTuple, of_b_T_c: Array) -> Array:
    """Return the covariance of a_T_c from two poses with independent errors."""
    turn = np.array(so3.as_matrix(a_T_b[3:]))
    lever = turn @ np.array(b_T_c[:3])
    return carried(np.eye(3), lever, of_a_T_b) + carried(turn, np.zeros(3), of_b_T_c)


def between_rows(before: Rows, after: Rows, ratio: Array, turn: Rows, independent: bool,
                 back: Rows | None = None) -> Rows:
    """
    Return the covariance of a pose that is interpolated between two.

    The error is M0 e0 + M1 e1. For the translation M0 and M1 are 1 - u and u; for the rotation
    M1 = G u Jl(u f) Jl(f)^-1 and M0 = I - M1, with the Jacobians of SO(3). If rotations are
    interpolated, f is the rotation from one to the other, and G = I. If a gyroscope measures
    R0 dR(t) Exp(u r), f = R1 r is its remaining error, and G = R0 dR(t) dR(t1)^-1 R0^-1 is the
    measured rotation back from the end. Unless the two errors are independent, the result is
    M0 C0 M0^T / (1 - u) + M1 C1 M1^T / u. This is a bound for any correlation, because
    (a + b)(a + b)^T <= a a^T / (1 - u) + b b^T / u for any two vectors. If both errors are the
    same, and the edge does not rotate, the bound equals their covariance. It is of first order:
    a rotation by f with variances that add up to t lacks up to about |f| t / 14 radians.

    :param before: 21 rows; ``after`` likewise.
    :param ratio: u, 0 to 1.
    :param turn: f, three rows, radians, in the parent's axes.
    :param independent: whether the two errors are independent of each other.
    :param back: G, nine rows; None: the identity.
    """
    rest = 1.0 - ratio
    first, last = ends_turned(ratio, turn, back)
    weights = (rest * rest, ratio * ratio) if independent else (rest, ratio)
    return weighted_sum(weights[0], turned(first, before), weights[1], turned(last, after))


def ends_turned(ratio: Array, turn: Rows, back: Rows | None = None) -> tuple[Rows, Rows]:
    """Return the matrices M0 / (1 - u) and M1 / u of ``between_rows``."""
    x, y, z = turn
    angle = np.maximum(np.sqrt(x * x + y * y + z * z), _LEAST_TURN)
    u, rest = np.maximum(ratio, _LEAST_PART), np.maximum(1.0 - ratio, _LEAST_PART)
    ends = _turn_matrices((x, y, z), *turning(
        u, rest, 0.5 * angle, np.sin(0.5 * angle), angle, np.sin, np.cos))
    first, last = ends[:9], ends[9:]
    if back is not None:
        last = product(back, last)
        rest = np.maximum(1.0 - ratio, _LEAST_REST)
        first = weighted_sum(1.0 / rest, _UNTURNED, -ratio / rest, last)
    return first, last


def rows_of(array: Array) -> Rows:
    """Return the rows (...) of an array (..., n), each contiguous in memory."""
    return tuple(np.ascontiguousarray(np.moveaxis(array, -1, 0)))


def turning(u: Number, rest: Number, half: Number, sine: Number, size: Number,
            sin: Callable[[Number], Number], cos: Callable[[Number], Number],
            ) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
    """
    Return the matrices M0 / (1 - u) and M1 / u of ``between_rows`` as coefficients.

    They are the coefficients (b, c) of I + b [n] + c [n]^2, with any vector n along f. Both
    matrices are functions of [f], whose eigenvalues are 0 and +-i t with t = |f|. There Jl(x) is
    (exp(i x) - 1) / (i x), so M0 is exp(i u t / 2) sin((1 - u) t / 2) / sin(t / 2), and M1 is
    exp(-i (1 - u) t / 2) sin(u t / 2) / sin(t / 2): the weights of slerp.

    :param u: a number or an array, greater than zero; ``rest``: 1 - u, likewise.
    :param half: t / 2, greater than zero; ``sine``: its sine.
    :param size: |n|.
    """
    on, back, square = u * half, rest * half, size * size
    sine_on, sine_back = sin(on), sin(back)
    before, after = sine_back / (rest * sine), sine_on / (u * sine)
    return ((before * sine_on / size, (1.0 - before * cos(on)) / square),
            (-after * sine_back / size, (1.0 - after * cos(back)) / square))


def ends_turned_once(ratio: float, turn: so3.Quaternion) -> tuple[float, ...]:
    """
    Return ``ends_turned`` for plain floats, as 18 numbers.

    :param ratio: greater than 0 and less than 1.
    :param turn: Exp(f), the rotation from one pose to the other.
    """
    x, y, z, w = turn if turn[3] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < _LEAST_SINE:
        return _UNTURNED + _UNTURNED
    return _turn_matrices((x, y, z), *turning(
        ratio, 1.0 - ratio, math.atan2(sine, w), sine, sine, math.sin, math.cos))


def _turn_matrices(turn: Three[Number], first: tuple[Number, Number],
                   last: tuple[Number, Number]) -> tuple[Number, ...]:
    """Return I + b [f] + c [f]^2 for two pairs (b, c) of coefficients, 18 rows."""
    x, y, z = turn
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    b, c = first
    bx, by, bz, cxy, cxz, cyz = b * x, b * y, b * z, c * xy, c * xz, c * yz
    d, e = last
    dx, dy, dz, exy, exz, eyz = d * x, d * y, d * z, e * xy, e * xz, e * yz
    return (1.0 - c * (yy + zz), cxy - bz, cxz + by,
            cxy + bz, 1.0 - c * (xx + zz), cyz - bx,
            cxz - by, cyz + bx, 1.0 - c * (xx + yy),
            1.0 - e * (yy + zz), exy - dz, exz + dy,
            exy + dz, 1.0 - e * (xx + zz), eyz - dx,
            exz - dy, eyz + dx, 1.0 - e * (xx + yy))
