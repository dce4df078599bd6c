# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The track of an edge on a spline, for lookups at many stamps."""

import math

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .spline_pieces import SplinePieces
from .spline_segment import SPLIT

# The pieces of a spline are cut into parts that rotate by at most this angle, radians. So there
# are few parts, and on each a polynomial equals the curve apart from rounding.
_TURN = 0.1
# As in ``tree.many``.
_MOST_NODES = 7
# With this limit, a piece that rotates by more than a radian or two is evaluated at every stamp.
_MAX_PARTS = 32


class SplineTrack:
    """
    A spline for the stamps from a first to a last.

    Its knots cut each piece into parts that are short enough for polynomials; see ``motion``.
    """

    def __init__(self, spline: SplinePieces, first: int, last: int) -> None:
        self._spline = spline
        period = spline.knot_period
        # Without stamps, first and last may be anywhere.
        begin, end = (min(max((stamp - spline.begin) // period, 0), spline.pieces - 1)
                      for stamp in (first, last))
        pieces = range(begin, end + 1)
        self._steps = np.abs(_lengths(spline.steps[pieces.start:pieces.stop + 2]))
        self._positions = spline.knots[pieces.start:pieces.stop + 3, :3]
        # This order of min() and max() is safe for an infinite or NaN bound of a damaged file.
        parts = min(max(1, math.ceil(min(_MAX_PARTS, self._bound()[0] / _TURN))), period)
        self.knots: Stamps = spline.cuts(pieces, parts)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at times ``since`` after stamps."""
        return self._spline.samples(stamps, since)

    @property
    def reach(self) -> float:
        """Return the largest distance of the child, metres: at most that of a knot."""
        return float(np.linalg.norm(self._positions, axis=1).max())

    def motion(self, knots: Stamps) -> tuple[float, float]:
        """
        Return an angle and a distance that bound the derivatives between knots.

        On SE(3) there is no bound, so both are infinite.
        """
        if self._spline.group is not SPLIT:
            return math.inf, math.inf
        part = float(np.diff(knots).max()) / self._spline.knot_period
        angle, distance = self._bound()
        return part * angle, part * distance

    def _bound(self) -> tuple[float, float]:
        """
        Return an angle and a distance that bound the derivatives on every piece.

        The nth derivative of a rotation is at most Bell's polynomial of the derivatives of the
        angle, of which there are three, because the weights are cubic. The angle a is chosen
        such that a^n is at least this bound for n up to seven, the largest number of nodes of a
        polynomial. The nth derivative of the position, on edges that rotate by a, is then at
        most n d a^(n-1), with d = p' + 3 p''/a + 5 p'''/a^2.
        """
        turns, ways = self._steps
        bell, angles = [np.ones(len(turns) - 2)], _derivatives(turns)
        for n in range(_MOST_NODES):
            bell.append(sum((math.comb(n, k) * bell[n - k] * angles[k]
                             for k in range(min(n, 2) + 1)), np.zeros(1)))
        angle = max(1.0, *(bell[n].max() ** (1.0 / n) for n in range(1, _MOST_NODES + 1)))
        first, second, third = _derivatives(ways)
        distance = (first + 3.0 * second / angle + 5.0 * third / angle ** 2).max()
        return float(angle), float(distance)


def _lengths(steps: Array) -> Array:
    """Return the angles and the lengths of steps (n, 6), as (2, n)."""
    return np.linalg.norm(steps.reshape(-1, 2, 3), axis=2).T[::-1]


def _derivatives(lengths: Array) -> tuple[Array, Array, Array]:
    """Return bounds of the weights' derivatives multiplied by a piece's three steps."""
    one, two, three = lengths[:-2], lengths[1:-1], lengths[2:]
    return (0.5 * one + 0.75 * two + 0.5 * three, one + two + three, one + 2.0 * two + three)
