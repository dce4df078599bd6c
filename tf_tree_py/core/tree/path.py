# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The edges between two frames, prepared for composition at any stamp, or at many.

This file only computes along a known path; ``path_finder`` finds the edges. A ``Path`` refers to
the tree's histories, so it is used with the buffer's lock, and only until the structure changes.

For many stamps, each edge is copied from its history (with the lock held) to an ``EdgeTrack``,
which evaluates its own motion. Everything else happens without the lock, with numpy. Two
methods give the same poses, apart from rounding:

- direct: interpolate every edge at every stamp, and compose;
- by polynomials, if there are many more stamps than samples: between two successive samples of
  all edges, every edge moves at constant velocity. So the composed pose is a smooth function
  of time, and the polynomial through a few of its values equals it, apart from rounding. The
  cost does not depend on the depth of the path.
"""

from collections.abc import Iterable, Sequence
from functools import cache, reduce
import math
from typing import NamedTuple

import numpy as np

from ..edges.protocol import EdgeTrack, History, moves, MovingHistory
from ..edges.static import StaticHistory
from ..errors import ExtrapolationException
from ..geometry import se3, so3
from ..geometry.chain import join_branches, PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, LATEST
from ..times import Stamps

# Stamps per block of the direct method; its temporary arrays then fit into the cache.
BLOCK = 8192
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
        for begin in range(0, len(stamps), BLOCK):
            block = stamps[begin:begin + BLOCK]
            poses[begin:begin + BLOCK] = self._compose_after(block).T
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
        for begin in range(0, len(stamps), BLOCK):
            block = stamps[begin:begin + BLOCK]
            pieces = knots[1:].searchsorted(block, side='right')
            passed = (block - knots.take(pieces)) / lengths.take(pieces)
            # Repeated for each coordinate, because broadcasting over seven is slower in numpy.
            since = np.repeat(passed, 7).reshape(-1, 7)
            block_poses = poses[begin:begin + BLOCK]
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
    q = tuple(a_T_b[3:])
    # For a few short rows, np.array is faster than np.stack.
    poses = np.array((*so3.rotate(q, tuple(b_T_c[:3])), *so3.multiply(q, tuple(b_T_c[3:]))))
    poses[:3] += a_T_b[:3]
    return poses


def _inverse(a_T_b: Array) -> Array:
    """Return b_T_a of poses (7, ...)."""
    return np.array(se3.inverse_columns(tuple(a_T_b)))


# --- the path

class Step(NamedTuple):
    """
    One edge on the path from the target to the source.

    :ivar upwards: whether the path leads from the child to the parent here.
    """

    parent: str
    history: History
    upwards: bool


class Path:
    """
    The two branches from a meeting point down to the source and to the target.

    Successive static edges are composed here once; so a path is valid only until one of them
    changes. ``fixed`` means that no edge on the path changes its parent over time. Otherwise
    the path is valid only for its own stamp. ``for_good`` means that there was no other path at
    any time: if an edge of it has no data for a stamp, its child had no parent then, and no edge
    above the meeting point ever changed its parent.
    """

    __slots__ = ('fixed', 'for_good', '_source_parts', '_target_parts', '_dynamic',
                 '_edges', '_steps')

    def __init__(self, source_edges: Sequence[History], target_edges: Sequence[History],
                 above: Sequence[History] = ()) -> None:
        """
        Take the edges of both branches, each from the leaf up to the meeting point.

        :param above: the edges above it, by the newest samples; not needed for poses.
        """
        self.fixed = all(edge.fixed_parent for edge in (*source_edges, *target_edges))
        self.for_good = self.fixed and all(edge.fixed_parent for edge in above)
        self._edges = source_edges, target_edges
        self._steps: list[Step] | None = None
        self._source_parts = _merge_static_runs(source_edges)
        self._target_parts = _merge_static_runs(target_edges)
        self._dynamic = tuple(edge for edge in (*reversed(source_edges), *reversed(target_edges))
                              if moves(edge))

    def steps(self) -> list[Step]:
        """Return all edges of a fixed path from the target to the source, including static."""
        if self._steps is None:
            source_edges, target_edges = self._edges
            self._steps = [Step(str(edge.parent), edge, upwards) for edges, upwards in (
                (target_edges, True), (reversed(source_edges), False)) for edge in edges]
        return self._steps

    def latest_common_time(self) -> int:
        """Return the newest time for which every edge has data; see ``latest_common``."""
        return latest_common(self._dynamic)

    def slowest_edges(self) -> list[MovingHistory]:
        """Return the edges whose newest sample limits the latest common time."""
        common = self.latest_common_time()
        return [edge for edge in self._dynamic
                if common in (edge.latest_stamp, edge.newest_stamp)]

    def span(self) -> tuple[int, int]:
        """Return the oldest and the newest stamp for which every moving edge has data."""
        oldest, latest = BEGINNING, FOREVER - 1
        for edge in self._dynamic:
            assert edge.oldest_stamp is not None and edge.latest_stamp is not None
            oldest, latest = max(oldest, edge.oldest_stamp), min(latest, edge.latest_stamp)
        return oldest, latest

    def track(self, first: int, last: int) -> PathTrack:
        """Return a copy of the data for lookups between two stamps in the span."""
        return PathTrack([part.track(first, last) for part in self._source_parts],
                         [part.track(first, last) for part in self._target_parts])

    def without_data(self, stamp: int) -> list[MovingHistory]:
        """Return the edges without data for a stamp."""
        return [edge for edge in self._dynamic if edge.parent_at(stamp) is None]

    def failure(self, stamp: int, error: ExtrapolationException) -> ExtrapolationException:
        """
        Return why a fixed path has no answer at a stamp, and which data may change that.

        :param error: the error of one of its edges; returned if that edge is the worst.
        """
        stuck = self.without_data(stamp)
        worst = edge_to_blame(stuck, stamp)
        if worst.child != error.child:
            error = worst.extrapolation(stamp)
        if not any(edge.is_too_old(stamp) for edge in stuck):
            error.blocked_on = tuple(
                [(edge.child, edge.next_turn(stamp)) for edge in self._dynamic])
        return error

    def pose_at(self, stamp: int) -> PoseTuple:
        """
        Return ``target_T_source``: inverse(top_T_target) top_T_source.

        :raises ExtrapolationException: an edge has no data for the stamp.
        """
        return join_branches([part.sample(stamp) for part in self._source_parts],
                             [part.sample(stamp) for part in self._target_parts])

    def samples_at(self, stamp: int) -> tuple[list[PoseTuple], list[PoseTuple], list[PoseTuple]]:
        """
        Return the samples of both branches, and ``parent_T_child`` of each of the ``steps()``.

        The branches are the arguments of ``join_branches``, in which successive static edges are
        one pose.

        :raises ExtrapolationException: an edge has no data for the stamp.
        """
        down = [part.sample(stamp) for part in self._source_parts]
        up = [part.sample(stamp) for part in self._target_parts]
        poses = [*reversed(up), *down]
        if len(poses) == len(self.steps()):
            return down, up, poses
        # Successive static edges are one part.
        parts = zip((*reversed(self._target_parts), *self._source_parts), poses, strict=True)
        moving = iter([pose for part, pose in parts if not part.is_static])
        return down, up, [
            step.history.sample(stamp) if step.history.is_static else next(moving)
            for step in self.steps()]


def latest_common(edges: Sequence[MovingHistory]) -> int:
    """
    Return the newest stamp for which every edge has data, at most that of the newest sample.

    So an edge that holds its newest sample does not make others older, and nothing is answered
    for a time of which no edge knows anything yet.

    :param edges: that move; those without samples are left out.
    :return: nanoseconds; ``LATEST`` if there is none.
    """
    common, slowest = FOREVER, None
    for edge in edges:
        stamp = edge.latest_stamp
        if stamp is not None and stamp < common:
            common, slowest = stamp, edge
    if slowest is None:
        return LATEST
    if slowest.newest_stamp != common:
        common = min(common, max(edge.newest_stamp for edge in edges
                                 if edge.newest_stamp is not None))
    return common


def edge_to_blame(edges: Iterable[MovingHistory], stamp: int) -> MovingHistory:
    """
    Return the worst of some edges without data for a stamp.

    The worst is an edge whose data for the stamp is lost permanently; then one without data so
    old; of several, the one whose data begins last. Then follows the one with the oldest newest
    sample.
    """
    def order(edge: MovingHistory) -> tuple[int, int]:
        oldest, latest = edge.oldest_stamp, edge.latest_stamp
        if oldest is None or latest is None:
            return 2, BEGINNING
        if stamp < oldest:
            return (0 if edge.is_too_old(stamp) else 1), -oldest
        return 2, latest

    return min(edges, key=order)


def _merge_static_runs(edges: Sequence[History]) -> tuple[History, ...]:
    """Return the edges from the top down, with successive static edges composed."""
    parts: list[History] = []
    for edge in reversed(edges):
        above = parts[-1] if parts else None
        if (above is not None and above.parent is not None and above.is_static
                and edge.is_static):
            parts[-1] = StaticHistory(edge.child, above.parent, se3.compose(
                above.sample(LATEST), edge.sample(LATEST)))
        else:
            parts.append(edge)
    return tuple(parts)
