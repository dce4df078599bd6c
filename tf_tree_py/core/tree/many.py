# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One lookup at many stamps, with numpy.

Each edge on the path is copied from its history (with the lock held) to an ``EdgeTrack``,
which evaluates its own motion. Everything else happens here, without the lock. Two methods
give the same poses, apart from rounding:

- direct: interpolate every edge at every stamp, and compose;
- by polynomials, if there are many more stamps than samples: between two successive samples of
  all edges, every edge moves at constant velocity. So the composed pose is a smooth function
  of time, and the polynomial through a few of its values equals it, apart from rounding. The
  cost does not depend on the depth of the path.
"""

from collections.abc import Sequence
from functools import cache, reduce
import math
from typing import Any

import numpy as np

from ..edges.track import EdgeTrack
from ..geometry import se3, so3
from ..geometry.so3 import Array
from ..times import Stamps

# Stamps per block of the direct method; its temporary arrays then fit into the cache.
_BLOCK = 8192
# How far a polynomial may deviate from the function, in addition to rounding.
_TOLERANCE = 5e-13
_ROUNDING = 2.0 ** -52
# With more nodes, rounding errors of the powers exceed the gain in accuracy.
_MIN_NODES, _MAX_NODES = 3, 7

_IDENTITY = np.array(se3.IDENTITY)


class PathTrack:
    """
    Copies of the edges between two frames, to be composed at many stamps.

    :param source_parts: from the meeting point down to the source.
    :param target_parts: from the meeting point down to the target.
    """

    def __init__(self, source_parts: Sequence[EdgeTrack],
                 target_parts: Sequence[EdgeTrack]) -> None:
        self._source_parts = source_parts
        self._target_parts = target_parts
        self._moving = [part for part in (*source_parts, *target_parts)
                        if len(part.knots)]

    def poses_at(self, stamps: Stamps) -> Array:
        """
        Return ``target_T_source`` at stamps for which all edges have data.

        :param stamps: (N,) nanoseconds, in any order.
        :return: (N, 7)
        """
        if not len(stamps):
            return np.empty((0, 7))
        if not self._moving:
            return np.tile(self._compose_after(stamps[:1]).T, (len(stamps), 1))
        # All edges together have at least as many knots as the edge with the most.
        if len(stamps) <= 2 * _MIN_NODES * max(len(edge.knots) for edge in self._moving):
            return self._directly(stamps)
        first, last = stamps.min(), stamps.max()
        knots = np.unique(np.concatenate([
            [first, last], *(edge.knots for edge in self._moving)]))
        knots = knots[(knots >= first) & (knots <= last)]
        nodes = self._nodes_needed(knots)
        if nodes and len(knots) > 1 and len(stamps) > 2 * nodes * len(knots):
            return self._through_polynomials(stamps, knots, nodes)
        return self._directly(stamps)

    def _directly(self, stamps: Stamps) -> Array:
        poses = np.empty((len(stamps), 7))
        for begin in range(0, len(stamps), _BLOCK):
            block = stamps[begin:begin + _BLOCK]
            poses[begin:begin + _BLOCK] = self._compose_after(block).T
        return poses

    def _through_polynomials(self, stamps: Stamps, knots: Stamps, nodes: int) -> Array:
        """Return the poses by interpolating polynomials between the knots."""
        places, to_powers = _nodes(nodes)
        # The last piece is a single point. If there are several samples at that stamp, it contains
        # the last of them, and the piece before it ends at the first.
        lengths = np.diff(knots, append=knots[-1:])
        values = self._compose_after(knots[:, None], lengths[:, None] * places)
        # Only the change since the knot goes through the ill-conditioned inverse.
        coefficients = np.einsum('pn,csn->psc', to_powers, values - values[..., :1])
        coefficients[-1] = values[..., 0].T
        np.maximum(lengths, 1, out=lengths)
        poses = np.empty((len(stamps), 7))
        for begin in range(0, len(stamps), _BLOCK):
            block = stamps[begin:begin + _BLOCK]
            pieces = knots[1:].searchsorted(block, side='right')
            passed = (block - knots.take(pieces)) / lengths.take(pieces)
            # Repeated for each coordinate, because broadcasting over seven is slower in numpy.
            since = np.repeat(passed, 7).reshape(-1, 7)
            block_poses = poses[begin:begin + _BLOCK]
            coefficients[0].take(pieces, axis=0, out=block_poses, mode='clip')
            for coefficient in coefficients[1:]:
                block_poses *= since
                block_poses += coefficient.take(pieces, axis=0, mode='clip')
        return poses

    def _nodes_needed(self, knots: Stamps) -> int:
        """
        Return how many values determine the curve between knots to rounding; 0: too many.

        A function deviates from its interpolation at n Chebyshev nodes on an interval of
        length one by at most 2 |f^(n)| / (4^n n!). If all edges together turn by an angle a,
        move by a distance d, and reach r metres, |f^(n)| <= max(1, r) a^n + n d a^(n-1).
        """
        if len(knots) < 2:
            return 0
        angles, distances = zip(*(edge.motion(knots) for edge in self._moving), strict=True)
        angle, distance = sum(angles), sum(distances)
        reach = sum(part.reach for part in (*self._source_parts, *self._target_parts))
        tolerance = _TOLERANCE + _ROUNDING * reach
        for nodes in range(_MIN_NODES, _MAX_NODES + 1):
            derivative = (max(1.0, reach) * angle ** nodes
                          + nodes * distance * angle ** (nodes - 1))
            if 2.0 * derivative / (4.0 ** nodes * math.factorial(nodes)) < tolerance:
                return nodes
        return 0

    def _compose_after(self, stamps: Stamps, since: Array | None = None) -> Array:
        """Return the poses (7, ...) at the times ``since`` after stamps."""
        top_T_source = _product(self._source_parts, stamps, since)
        if not self._target_parts:
            return top_T_source
        top_T_target = _product(self._target_parts, stamps, since)
        if not self._source_parts:
            return _inverse(top_T_target)
        return _compose(_inverse(top_T_target), top_T_source)


@cache
def _nodes(count: int) -> tuple[Array, Array]:
    """
    Return Chebyshev nodes, and the matrix from values at them to coefficients.

    :return: the nodes of the second kind on 0 to 1, (n,), including the ends; and the
        matrix (n, n) from values to the coefficients of the powers, highest first.
    """
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
    return places, np.linalg.inv(np.vander(places))


def _product(parts: Sequence[EdgeTrack], stamps: Stamps, since: Array | None) -> Array:
    """Return the product of the edges of one branch, the highest first."""
    return reduce(_compose, [part.at(stamps, since) for part in parts] or [_IDENTITY])


def _compose(a_T_b: Array, b_T_c: Array) -> Array:
    """Return a_T_c of poses (7, ...); see ``se3.compose``."""
    # The formulas for plain floats also work for rows.
    q: Any = a_T_b[3:]
    b_t_c: Any = b_T_c[:3]
    b_q_c: Any = b_T_c[3:]
    # For a few short rows, np.array is faster than np.stack.
    poses = np.array((*so3.rotate(q, b_t_c), *so3.multiply(q, b_q_c)))
    poses[:3] += a_T_b[:3]
    return poses


def _inverse(a_T_b: Array) -> Array:
    """Return b_T_a of poses (7, ...); see ``se3.inverse``."""
    rows: Any = a_T_b
    inverse: Any = se3.inverse(rows)
    return np.array(inverse)
