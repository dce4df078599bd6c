# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pieces of a spline: its knots, the beginning of each piece, and the poses on them."""

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .spline_fit import on_pieces, ORDER
from .spline_samples import places
from .spline_segment import Group, poses_on


class SplinePieces:
    """
    A cumulative cubic B-spline as numbers; see ``Spline``, which has the same attributes.

    :ivar steps: (n - 1, 6) the tangents from each knot to the next.
    """

    __slots__ = ('oldest', 'latest', 'begin', 'knot_period', 'knots', 'steps', 'group')

    oldest: int
    latest: int
    begin: int
    knot_period: int
    knots: Array
    steps: Array
    group: Group

    def __len__(self) -> int:
        return len(self.knots)

    @property
    def pieces(self) -> int:
        """Return the number of pieces."""
        return len(self.knots) - ORDER + 1

    def cuts(self, pieces: range, parts: int) -> Stamps:
        """Return the stamps that cut pieces into equal parts, from end to end."""
        begins = self.begin + self.knot_period * np.arange(pieces.start, pieces.stop + 1)
        cuts = [self.knot_period * part // parts for part in range(parts)]
        return np.unique(np.clip((begins[:, None] + cuts).ravel(), self.oldest, self.latest))

    def samples(self, stamps: Stamps, since: Array | None = None) -> Array:
        """
        Return the poses (7, ...) at stamps within the spline, or at times after them.

        :param since: (...) the times after the stamps, nanoseconds.
        """
        return poses_on(self.group, *self.pieces_at(stamps, since))

    def pieces_at(self, stamps: Stamps, since: Array | None = None) -> tuple[Array, Array, Array]:
        """Return the first knot of each stamp's piece, its steps, and the place on it (u)."""
        numbers, u = places(stamps, self.begin, self.knot_period, self.pieces)
        if since is not None:
            numbers, u = np.broadcast_arrays(numbers, u + since / self.knot_period)
        return *on_pieces(self.knots, self.steps, numbers), u
