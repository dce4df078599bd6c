# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups at many stamps at once, by numpy.

One path serves all stamps, or several do if a frame changed its parent. The buffer's lock is held
only while the path is found and each edge is copied from its history to an ``EdgeTrack``, which
evaluates its own motion; so other threads do not wait for the arithmetic. What needs more than one
path works on a copy of the tree. Two methods give the same poses, apart from rounding:

- direct: interpolate every edge at every stamp, and compose;
- by polynomials, if there are many more stamps than samples: between two successive samples of
  all edges, every edge moves at constant velocity. So the composed pose is a smooth function
  of time, and the polynomial through a few of its values equals it, apart from rounding. The
  cost does not depend on the depth of the path.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import cache, partial, reduce
import math
from typing import cast, Literal, overload

import numpy as np
from tf_tree_py.core.edges.protocol import EdgeTrack
from tf_tree_py.core.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
    warn,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.pose import Poses
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import TransformWarning
from tf_tree_py.core.messages.observers import newest_of
from tf_tree_py.core.stamp import format_stamp, unit_that_fits
from tf_tree_py.core.times import Mask, Stamps, StampsLike
from tf_tree_py.core.tree.path import Path
from tf_tree_py.core.tree.path_finder import PathFinder
from tf_tree_py.core.tree.queries import FramesInErrors, PlainSnapshot, Queries
from tf_tree_py.core.tree.tree import Tree

# Stamps per block of the direct method; its temporary arrays then fit into the cache.
BLOCK = 8192
# How far a polynomial may deviate from the function, in addition to rounding.
_TOLERANCE = 5e-13
_ROUNDING = 2.0 ** -52
# With more nodes, rounding errors of the powers exceed the gain in accuracy.
_MIN_NODES, _MAX_NODES = 3, 7

_IDENTITY = np.array(se3.IDENTITY)


class ManyStampQueries(Queries):
    """The queries of a tree, and lookups at many stamps."""

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['raise'] = 'raise') -> Poses: ...

    @overload
    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: Literal['mask']) -> tuple[Poses, Mask]: ...

    def lookup_many(self, target_frame: str, source_frame: str, stamps: StampsLike,
                    outside: str = 'raise') -> Poses | tuple[Poses, Mask]:
        """
        Return ``target_T_source`` at many stamps, as one ``lookup`` for each would.

        :param stamps: (N,) integer nanoseconds, in any order. 0 is an ordinary stamp. Masked
            stamps have no answer.
        :param outside: how to treat stamps without an answer: 'raise' an error, or 'mask':
            return NaN for them, and which stamps are valid.
        :return: (N, 7) poses x y z qx qy qz qw with ``@``, ``.inverse()``,
            ``.translation``, ``.rotation`` and ``.as_matrix()``; with 'mask' also (N,)
            booleans.
        :raises InvalidArgumentException: stamps that are not integers, or not of shape (N,).
        :raises TransformException: as in ``lookup``; with 'mask' only if a frame is unknown,
            or the two were never connected.

        The numbers equal those of ``lookup`` to 1e-12 (metres, and components of quaternions);
        for edges longer than 100 metres, to 1e-14 of their length.
        """
        stamps, given = _without_mask(stamps)
        array = self._stamps_of(stamps)
        if outside not in ('raise', 'mask'):
            raise InvalidArgumentException(f"outside must be 'raise' or 'mask', not {outside!r}")
        return self.observers.watch(
            newest_of(target_frame, source_frame, array),
            self._lookup_many, target_frame, source_frame, array, given, outside)

    def _lookup_many(self, target_frame: str, source_frame: str, array: Stamps,
                     given: Mask | None, outside: str) -> Poses | tuple[Poses, Mask]:
        with FramesInErrors(self._tree, target_frame, source_frame):
            poses, valid = poses_at(self._tree, self._lock, target_frame, source_frame, array)
        if given is not None:
            valid &= given
            poses[~given] = np.nan
        if outside == 'mask':
            if len(array) and not valid.any():
                _warn_of_units(partial(self.lookup_at, target_frame, source_frame), array)
            return Poses(poses), valid
        _refuse_missing(partial(self.lookup_at, target_frame, source_frame), array, given, valid)
        return Poses(poses)

    def snapshot(self) -> 'ManyStampSnapshot':
        """Return a copy of the present state, for several lookups that must be consistent."""
        return cast(ManyStampSnapshot, super().snapshot())

    def _snapshot_of(self, tree: Tree) -> 'ManyStampSnapshot':
        return ManyStampSnapshot(tree)


class ManyStampSnapshot(ManyStampQueries, PlainSnapshot):
    """A tree at one moment, which never changes."""


def poses_at(tree: Tree, lock: AbstractContextManager[object], target: str, source: str,
             stamps: Stamps) -> tuple[Array, Mask]:
    """
    Return ``target_T_source`` (N, 7) at stamps (N,), and which of them have an answer.

    :param lock: of the tree; held only while samples are copied.
    """
    if target == source:
        return np.tile(se3.IDENTITY, (len(stamps), 1)), np.ones(len(stamps), dtype=bool)
    with lock:
        path, has_changed_parent = _path_for_all(tree.paths, target, source)
        valid = np.zeros(len(stamps), dtype=bool)
        if path is not None:
            oldest, latest = path.span()
            valid = (stamps >= oldest) & (stamps <= latest)
            inside = stamps if valid.all() else stamps[valid]
            track = PathTrack(*path.tracks(*ends_of(inside)))
        # At stamps without data on this path, frames may have had other parents.
        still = tree.copy() if has_changed_parent and not valid.all() else None
    if path is not None and inside is stamps:
        return track.poses_at(stamps), valid
    poses = np.full((len(stamps), 7), np.nan)
    if path is not None:
        poses[valid] = track.poses_at(inside)
    if still is not None:
        _add_one_by_one(still.paths, target, source, stamps, poses, valid)
    return poses, valid


def _path_for_all(paths: PathFinder, target: str, source: str) -> tuple[Path | None, bool]:
    """Return the path if it is fixed, else None; and whether any parent ever changed."""
    has_changed_parent = paths.has_changed_parent
    try:
        path = paths.newest_path(target, source)
    except ConnectivityException:
        if not has_changed_parent:
            raise
        return None, True
    return (path if path.fixed else None), has_changed_parent


def _add_one_by_one(paths: PathFinder, target: str, source: str, stamps: Stamps, poses: Array,
                    valid: Mask) -> None:
    """Look up the remaining stamps one by one: frames may have had other parents."""
    for number in np.flatnonzero(~valid).tolist():
        try:
            poses[number] = paths.pose_at(target, source, int(stamps[number]))
        except (ConnectivityException, ExtrapolationException):
            continue
        valid[number] = True


def _without_mask(stamps: StampsLike) -> tuple[StampsLike, Mask | None]:
    """Return stamps with zeros for masked ones, and which are valid; None without a mask."""
    if not isinstance(stamps, np.ma.MaskedArray):
        return stamps, None
    masked, data = np.ma.getmaskarray(stamps), np.ma.getdata(stamps)
    return np.where(masked, np.zeros_like(data), data), ~masked


def _refuse_missing(lookup_at: Callable[[int], object], stamps: Stamps, given: Mask | None,
                    valid: Mask) -> None:
    """
    Raise the error of the first stamp that has no answer, if there is one.

    :param lookup_at: raises the error of a stamp.
    :param given: which stamps are not masked; None: all of them.
    """
    if valid.all():
        return
    first = int(np.argmin(valid))
    count = len(stamps) - int(valid.sum())
    many = (f'{count} of {len(stamps)} stamps have no answer, the first is stamps[{first}]'
            "{}; lookup_many with outside='mask' returns the others")
    if given is not None and not given[first]:
        raise InvalidArgumentException(many.format(', which is masked'))
    stamp = int(stamps[first])
    try:
        lookup_at(stamp)
    except TransformException as error:
        of_all = many.format(f' = {format_stamp(stamp)} s')
        error.hint = f'{error.hint}. {of_all}' if error.hint else of_all
        raise
    raise InvalidArgumentException(
        f'{count} of {len(stamps)} stamps had no answer at the time of the lookup')


def _warn_of_units(lookup_at: Callable[[int], object], stamps: Stamps) -> None:
    """Warn if no stamp has an answer, but the stamps would fit in another unit."""
    try:
        lookup_at(int(stamps[0]))
    except ExtrapolationException as error:
        if None in (error.requested, error.oldest, error.latest):
            return
        meant = unit_that_fits(
            *cast('tuple[int, int, int]', (error.requested, error.oldest, error.latest)))
        if meant:
            warn(f'None of {len(stamps)} stamps has an answer. {meant}', TransformWarning)


def ends_of(stamps: Stamps) -> tuple[int, int]:
    """Return the smallest and the largest of stamps in any order; 0 without stamps."""
    return (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)


# --- the arithmetic

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
