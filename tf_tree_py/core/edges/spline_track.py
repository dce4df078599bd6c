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

"""What it takes to answer many stamps of an edge on a spline."""

import math

import numpy as np

from .spline import Spline
from ..geometry.so3 import Array
from ..geometry.spline import SPLIT
from ..times import Stamps

# The pieces of a spline are cut into parts that turn by no more than this, radians. So there are
# few parts, and each is short enough for a polynomial to be the curve.
_TURN = 0.1
# Those of ``tree.many``.
_MOST_NODES = 7
# A piece that turns by more than a radian or two is evaluated at every stamp.
_MAX_PARTS = 32


class SplineTrack:
    """
    A spline, for the stamps from a first to a last.

    Its knots cut each piece into parts that are short enough for a polynomial to be the
    curve; see ``motion``.
    """

    def __init__(self, spline: Spline, first: int, last: int) -> None:
        self._spline = spline
        period = spline.knot_period
        # Without stamps, first and last may lie anywhere.
        begin, end = (min(max((stamp - spline.begin) // period, 0), spline.pieces - 1)
                      for stamp in (first, last))
        pieces = range(begin, end + 1)
        self._steps = np.abs(_lengths(spline.steps[pieces.start:pieces.stop + 2]))
        self._positions = spline.knots[pieces.start:pieces.stop + 3, :3]
        # min() and max() in this order, for the bound of a damaged file may be infinite or NaN.
        parts = min(max(1, math.ceil(min(_MAX_PARTS, self._bound()[0] / _TURN))), period)
        self.knots: Stamps = spline.cuts(pieces, parts)

    def at(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) some time after stamps."""
        return self._spline.samples(stamps, since)

    @property
    def reach(self) -> float:
        """Return how far the child is away at most: no further than a knot."""
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

        The nth derivative of a rotation is no greater than Bell's polynomial of those of the
        angle, of which there are three, for the weights are cubic. The angle a is such that
        a^n is no less, for up to the seven nodes that a polynomial may have. That of the
        position, on edges that turn by a, is then n d a^(n-1) at most, with
        d = p' + 3 p''/a + 5 p'''/a^2.
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
    """Return bounds of the weights' derivatives times a piece's three steps."""
    one, two, three = lengths[:-2], lengths[1:-1], lengths[2:]
    return (0.5 * one + 0.75 * two + 0.5 * three, one + two + three, one + 2.0 * two + three)
