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
The knots of a spline from measured poses: least squares, in bands.

A pose on a piece depends on its four knots only, so the normal equations have three bands
beside the diagonal, and scipy solves them in a time that is proportional to the number of
knots. Callers know the times: here a pose lies on a piece, at a u.
"""

import numpy as np

from .so3 import Array
from .spline import difference, Group, moved, poses_on, steps_between, weights
from ..times import Stamps

# A piece hangs on so many knots.
ORDER = 4

# The fit ends after a step of the knots that is smaller than this, metres and radians. Each step
# is some twenty times smaller than the one before.
_SMALL_STEP = 1e-7
_MAX_ITERATIONS = 12
# The weight of the third differences of the knots. Where there are few poses, at the ends and in
# gaps, it keeps the curve even, so the newest knots do not follow the noise of their first poses.
# Elsewhere it is next to nothing beside the poses: its error is of the sixth order in the time
# between knots, and that of a spline is of the fourth.
_EVEN = 1e-6
_THIRD_DIFFERENCE = (-1.0, 3.0, -3.0, 1.0)
# Where there are too few poses even for that, this weight keeps a knot where it is.
_HOLD = 1e-13


def fitted(group: Group, knots: Array, free: int, pieces: Stamps, u: Array,
           poses: Array) -> Array:
    """
    Return knots with which the curve comes as close to poses as it can.

    Gauss and Newton's method: a small step of the knots moves the pose on a piece by
    sum B_j delta_j, with B the basis of the ordinary B-spline. That neglects how far the
    piece turns; the next iteration corrects the error.

    :param knots: (n, 7) where to begin.
    :param free: the first knot that may move; those before it stay.
    :param pieces: (N,) on which piece each pose lies, by the number of its first knot.
    :param u: (N,) where on it, 0 to 1.
    :param poses: (N, 7) what was measured.
    """
    # Imported here, for it takes long to load, and most programs fit nothing.
    from scipy.linalg import cho_solve_banded
    knots = knots.copy()
    basis = _basis(u)
    factor = _factor(basis, pieces, len(knots), free)
    measured = poses.T
    for _ in range(_MAX_ITERATIONS):
        steps = steps_between(group, knots)
        first, around = on_pieces(knots, steps, pieces)
        residuals = difference(group, poses_on(group, first, around, u), measured)
        slope = _gathered(basis, pieces, residuals, len(knots)) - _EVEN * _unevenness(steps)
        delta = cho_solve_banded((factor, False), slope[free:], check_finite=False)
        knots[free:] = moved(group, knots[free:].T, delta.T).T
        knots[free:, 3:] /= np.linalg.norm(knots[free:, 3:], axis=1, keepdims=True)
        if np.abs(delta).max() < _SMALL_STEP:
            break
    return knots


def on_pieces(knots: Array, steps: Array, pieces: Stamps) -> tuple[Array, Array]:
    """Return the first knots (7, ...) and the steps (3, 6, ...) of pieces (...)."""
    columns = np.ascontiguousarray(steps.T)
    return (knots.T.take(pieces, axis=1),
            np.stack([columns.take(pieces + number, axis=1) for number in range(ORDER - 1)]))


def _basis(u: Array) -> Array:
    """Return the weights of the four knots in each pose, (4, N)."""
    one, two, three = weights(u)
    return np.stack([1.0 - one, one - two, two - three, three])


def _factor(basis: Array, pieces: Stamps, count: int, free: int) -> Array:
    """Return the Cholesky factor of the normal matrix of the free knots, in scipy's bands."""
    from scipy.linalg import cholesky_banded
    bands = np.zeros((ORDER, count))
    for row in range(ORDER):
        for column in range(row, ORDER):
            bands[ORDER - 1 + row - column] += np.bincount(
                pieces + column, basis[row] * basis[column], count)
            bands[ORDER - 1 + row - column, column:count - ORDER + 1 + column] += (
                _EVEN * _THIRD_DIFFERENCE[row] * _THIRD_DIFFERENCE[column])
    bands = bands[:, free:]
    bands[-1] += _HOLD
    return np.asarray(cholesky_banded(bands, overwrite_ab=True, check_finite=False))


def _gathered(basis: Array, pieces: Stamps, residuals: Array, count: int) -> Array:
    """Return the right side of the normal equations, (count, 6)."""
    return np.stack([
        sum(np.bincount(pieces + number, basis[number] * residual, count)
            for number in range(ORDER)) for residual in residuals], axis=-1)


def _unevenness(steps: Array) -> Array:
    """Return the gradient (count, 6) of half the sum of the squares of the third differences."""
    third = np.diff(steps, n=2, axis=0)
    slope = np.zeros((len(steps) + 1, 6))
    for number, factor in enumerate(_THIRD_DIFFERENCE):
        slope[number:len(third) + number] += factor * third
    return slope
