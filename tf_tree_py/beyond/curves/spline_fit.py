# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The knots of a spline from measured poses, by least squares with band matrices.

A pose on a piece depends only on its four knots, so the normal equations have three bands
besides the diagonal, and scipy solves them in a time proportional to the number of knots. In
the fit a pose is on a piece, at a parameter u; only its input, a caller's poses, has times.
"""

import math

import numpy as np
from tf_tree_py.core.edges.tracks import InterpolatedTrack
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.poses import checked_poses, judged
from tf_tree_py.core.geometry.so3 import Array, Four, Number
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.times import checked_stamps, Stamps, StampsLike

from .spline_segment import (
    difference,
    Group,
    moved,
    poses_on,
    steps_between,
    weights,
)

# The number of knots that a piece depends on.
ORDER = 4

# The fit ends after a step of the knots that is smaller than this, metres and radians. Each step
# is about twenty times smaller than the previous one.
SMALL_STEP = 1e-7
_MAX_ITERATIONS = 12
# The weight of the third differences of the knots. With few poses, at the ends and in gaps, it
# keeps the curve smooth, so that the newest knots do not follow the noise of their first poses.
# Elsewhere its effect is negligible: its error is of sixth order in the time between knots, and
# that of a spline is of fourth order.
_EVEN = 1e-6
_THIRD_DIFFERENCE = (-1.0, 3.0, -3.0, 1.0)
# If there are too few poses even for that, this weight keeps a knot at its place.
_HOLD = 1e-13


def fitted(group: Group, knots: Array, free: int, pieces: Stamps, u: Array,
           poses: Array) -> Array:
    """
    Return the knots whose curve fits poses best.

    This is the Gauss-Newton method: a small step of the knots moves the pose on a piece by
    sum B_j delta_j, with B the basis of the ordinary B-spline. That neglects the rotation of
    the piece; the next iteration corrects the error.

    :param knots: (n, 7) the initial knots.
    :param free: the first knot that may move; those before it stay.
    :param pieces: (N,) the piece of each pose, as the number of its first knot.
    :param u: (N,) the place on the piece, 0 to 1.
    :param poses: (N, 7) the measured poses.
    """
    # Imported here, because it loads slowly, and most programs do not fit splines.
    from scipy.linalg import cho_solve_banded, cholesky_banded
    knots = knots.copy()
    basis = np.stack(basis_weights(u))
    factor = cholesky_banded(normal_bands(basis, pieces, len(knots))[:, free:],
                             overwrite_ab=True, check_finite=False)
    measured = poses.T
    places = np.add.outer(np.arange(6), 6 * pieces).ravel()
    for _ in range(_MAX_ITERATIONS):
        steps = steps_between(group, knots)
        first, around = on_pieces(knots, steps, pieces)
        residuals = difference(group, poses_on(group, first, around, u), measured)
        slope = _gathered(basis, places, residuals, len(knots)) - _EVEN * _unevenness(steps)
        delta = cho_solve_banded((factor, False), slope[free:], check_finite=False)
        knots[free:] = moved(group, knots[free:].T, delta.T).T
        knots[free:, 3:] /= np.linalg.norm(knots[free:, 3:], axis=1, keepdims=True)
        if np.abs(delta).max() < SMALL_STEP:
            break
    return knots


def on_pieces(knots: Array, steps: Array, pieces: Stamps) -> tuple[Array, Array]:
    """Return the first knots (7, ...) and the steps (3, 6, ...) of pieces (...)."""
    columns = np.ascontiguousarray(steps.T)
    return (knots.T.take(pieces, axis=1),
            np.stack([columns.take(pieces + number, axis=1) for number in range(ORDER - 1)]))


def basis_weights(u: Number) -> Four[Number]:
    """Return the weights of the four knots in a pose, each (...) as u is."""
    one, two, three = weights(u)
    return 1.0 - one, one - two, two - three, three


def normal_bands(basis: Array, pieces: Stamps, count: int) -> Array:
    """Return the normal matrix of count knots in the upper bands of scipy, (4, count)."""
    bands = np.zeros((ORDER, count))
    for row in range(ORDER):
        for column in range(row, ORDER):
            bands[ORDER - 1 + row - column] += np.bincount(
                pieces + column, basis[row] * basis[column], count)
            bands[ORDER - 1 + row - column, column:count - ORDER + 1 + column] += (
                _EVEN * _THIRD_DIFFERENCE[row] * _THIRD_DIFFERENCE[column])
    bands[-1] += _HOLD
    return bands


def _gathered(basis: Array, places: Stamps, residuals: Array, count: int) -> Array:
    """
    Return the right side of the normal equations, (count, 6).

    :param places: the index in it of each residual (6, N) for the first knot, row by row.
    """
    slope = np.zeros((count, 6))
    for number in range(ORDER):
        part = np.bincount(places, (basis[number] * residuals).ravel(), 6 * count)
        slope[number:] += part.reshape(count, 6)[:count - number]
    return slope


def _unevenness(steps: Array) -> Array:
    """Return the gradient (count, 6) of half the sum of the squares of the third differences."""
    third = np.diff(steps, n=2, axis=0)
    slope = np.zeros((len(steps) + 1, 6))
    for number, factor in enumerate(_THIRD_DIFFERENCE):
        slope[number:len(third) + number] += factor * third
    return slope


# --- a caller's poses

# Nanoseconds: differences of stamps must fit into 64 bits.
_LONGEST = 2**62


def checked_samples(stamps: StampsLike, poses: object) -> tuple[Stamps, Array]:
    """
    Return a caller's samples, sorted by stamp, with unit quaternions.

    :return: (N,) and (N, 7), N > 0.
    :raises InvalidArgumentException: no samples, different numbers of stamps and poses, or a
        pose that is not finite or not a rotation.
    """
    times = checked_stamps(stamps)
    array = checked_poses(poses) if len(times) or np.asarray(poses).size else np.empty((0, 7))
    if len(array) != len(times) or not len(times):
        raise InvalidArgumentException(
            f'there must be one pose (N, 7) for each stamp (N,), and at least one: not '
            f'{len(times)} stamps and {len(array)} poses')
    unit, good = judged(array)
    if not good.all():
        first = int(np.argmin(good))
        raise InvalidArgumentException(
            f'poses[{first}] is not a pose: {array[first].tolist()} is not finite, or not a '
            'rotation')
    if int(times.max()) - int(times.min()) > _LONGEST:
        raise InvalidArgumentException(
            f'the stamps range from {format_stamp(int(times.min()))} to '
            f'{format_stamp(int(times.max()))}, which is too long for one spline')
    order = np.argsort(times, kind='stable')
    return times[order], unit[order]


def checked_rate(given: float, name: str = 'knot_rate_hz') -> float:
    """
    Return a caller's rate as a float.

    :raises InvalidArgumentException: it is not a valid rate.
    """
    try:
        rate = float(given)
    except (TypeError, ValueError, OverflowError):
        rate = math.nan
    if not 2e-10 <= rate <= 1e9:  # its period fits into 64 bits of nanoseconds
        raise InvalidArgumentException(
            f'Invalid argument {name} {given!r}: it must be a number per second, from 2e-10 '
            'to 1e9')
    return rate


def places(stamps: Stamps, begin: int, period: int, pieces: int) -> tuple[Stamps, Array]:
    """Return the pieces that contain stamps, and the places on these pieces (u); each (...)."""
    since = stamps - begin
    numbers = np.minimum(since // period, pieces - 1)
    return numbers, (since - numbers * period) / period


def first_guess(group: Group, begin: int, period: int, pieces: int, stamps: Stamps,
                poses: Array, before: Array | None = None) -> Array:
    """
    Return initial knots (n, 7) for a fit.

    Each is the pose in the middle of the time that it influences: interpolated between the
    poses, and extrapolated beyond the last pose at the same velocity.

    :param stamps: (N,) sorted; ``poses``: (N, 7).
    :param before: (m, 7) the first knots, if they are known.
    """
    count = pieces + ORDER - 1
    if before is not None and len(before) >= count:
        return before[:count].copy()
    times = begin + period * (np.arange(count) - 1)
    inside = np.clip(times, stamps[0], stamps[-1])
    knots = InterpolatedTrack(stamps, poses).at(inside).T
    if before is not None:
        knots[:len(before)] = before[:count]
    for number in range(1 if before is None else len(before), count):
        if times[number] > stamps[-1] and number > 1:
            step = difference(group, knots[number - 2], knots[number - 1])
            knots[number] = moved(group, knots[number - 1], step)
    if before is None:
        knots[0] = moved(group, knots[1], -difference(group, knots[1], knots[2]))
    return knots
