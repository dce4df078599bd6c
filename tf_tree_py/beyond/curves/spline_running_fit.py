# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The last knots of a spline, updated with one pose at a time.

This is recursive least squares. A fit ends where the gradients of all poses add up to zero, so a
new pose contributes the only gradient, and one step of the knots restores the sum of zero. The
earlier poses stay in the normal matrix, linearised where the knots were when they were added.
That neglects terms of the second order in the steps; ``spline_fit.fitted`` neglects nothing.
"""

from itertools import pairwise

import numpy as np
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .spline_fit import basis_weights, normal_bands, ORDER, SMALL_STEP
from .spline_segment import Group, Numbers, pose_on

# How far the new pose may be from the result of a linear step, as a share of its residual.
_NOT_LINEAR = 0.05


class RunningFit:
    """
    Adds poses on the last piece of a fitted spline. The formulas are on plain floats.

    :param group: the group of the spline.
    :param free: the number of the last knots that move, at least four.
    :param pieces: (N,) the pieces of the poses of the fit, by the number of the first knot.
    :param u: (N,) the place of each pose on its piece, 0 to 1.
    :param count: the number of knots.
    """

    def __init__(self, group: Group, free: int, pieces: Stamps, u: Array, count: int) -> None:
        self._group = group
        self._free = free
        self._bands = normal_bands(np.stack(basis_weights(u)), pieces, count)[:, -free:].copy()

    def add(self, knots: Array, steps: Array, u: float,
            pose: Array) -> tuple[Array, Array] | None:
        """
        Return the knots (n, 7) and steps (n - 1, 6) with another pose on the last piece.

        Return None if the step is too large to be linear: then all poses have to be fitted again.

        :param u: the place of the pose on the last piece, 0 to 1.
        :param pose: (7,) the measurement.
        """
        # Imported here because it takes long to load, and most programs fit nothing.
        from scipy.linalg import solveh_banded
        basis = basis_weights(u)
        for row in range(ORDER):
            for column in range(row, ORDER):
                self._bands[ORDER - 1 + row - column, column - ORDER] += basis[row] * basis[column]
        measured = pose.tolist()
        residual = np.array(self._step(self._on_last_piece(knots, steps, u), measured))
        slope = np.zeros((self._free, 6))
        slope[-ORDER:] = np.outer(basis, residual)
        tangents = solveh_banded(self._bands, slope, check_finite=False)
        knots, steps = self._moved(knots, steps, tangents)
        left = self._step(self._on_last_piece(knots, steps, u), measured)
        wrong = residual - basis @ tangents[-ORDER:] - left
        # At rest the residuals are rounding errors, and their shares mean nothing.
        if wrong @ wrong > max(_NOT_LINEAR**2 * (residual @ residual), SMALL_STEP**2):
            return None
        return knots, steps

    def _on_last_piece(self, knots: Array, steps: Array, u: float) -> Numbers:
        return pose_on(self._group, knots[-ORDER].tolist(), steps[1 - ORDER:].tolist(), u)

    def _moved(self, knots: Array, steps: Array, tangents: Array) -> tuple[Array, Array]:
        knots, steps = knots.copy(), steps.copy()
        group = self._group
        free = []
        for knot, tangent in zip(knots[-self._free:].tolist(), tangents.tolist(), strict=True):
            element = group.compose(knot, group.exp(tangent))
            free.append((*element[:3], *so3.normalize(element[3:])))
        knots[-self._free:] = free
        changed = knots[-self._free - 1:-self._free].tolist() + free
        steps[1 - len(changed):] = [self._step(a, b) for a, b in pairwise(changed)]
        return knots, steps

    def _step(self, a: Numbers, b: Numbers) -> Numbers:
        """Return the tangent (6,) at element a that leads to b."""
        return self._group.log(self._group.compose(self._group.inverse(a), b))
