# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The errors of poses that share edges, or that have one edge at two stamps.

The error of an edge at a stamp is a sum of roots, each multiplied by its own unit error: the
roots of the covariance before, of the covariance after, and of the pending correction. An edge
that occurs twice has the same unit errors twice, so its common errors cancel.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_history import known_covariances, Uncertainty
from .covariances import ends_turned, rows_of, SKEW, unpack
from .propagation import SMALL_ANGLES, steps_between, with_shared_errors
from .uncertain import pending_error

# The child and the parent of an edge.
_Edge = tuple[str, str]
# An edge, and the stamp of its covariance; None for the pending correction.
_Cause = tuple[_Edge, int | None]
# An edge, and the stamp of its lookup.
_Asked = tuple[_Edge, int]


class Piece(NamedTuple):
    """A part of the path from a target to a source, at one stamp; ``LATEST`` if static."""

    target: str
    source: str
    stamp: int


class _Placed(NamedTuple):
    """An uncertain edge on a path, expressed in the target of the path."""

    asked: _Asked
    upwards: bool
    axes: Array
    place: Array


class _Way(NamedTuple):
    edges: list[_Placed]
    point: Array


class SharedErrors:
    """
    The errors of several poses: one path is added for each, then the joint covariance computed.

    :param tree: locked while paths are added.
    :param independent: see ``Queries.lookup_uncertain``. If an edge's errors at two of its stamps
        may be correlated in any way, the result is a bound: with weights w that add up to 1,
        the second moment of a sum of errors is at most the sum of their second moments, each
        divided by its w. The weights are those of the interpolation, averaged over the stamps.
    """

    def __init__(self, tree: Tree, independent: bool) -> None:
        self._tree = tree
        self._independent = independent
        self._ways: list[_Way] = []
        # The weight in the interpolation and the root (6, r) of each cause.
        self._errors: dict[_Asked, dict[_Cause, tuple[float, Array]]] = {}

    def add_way(self, pieces: Iterable[Piece]) -> None:
        """Add the path from a target to a source, piece by piece."""
        here: PoseTuple = se3.IDENTITY
        edges: list[_Placed] = []
        for piece in pieces:
            for step in self._steps(piece):
                pose = step.history.sample(piece.stamp)
                before, here = here, se3.compose(
                    here, se3.inverse(pose) if step.upwards else pose)
                asked = self._noted(step, piece.stamp, pose)
                if asked is not None:
                    parent, child = (here, before) if step.upwards else (before, here)
                    edges.append(_Placed(asked, step.upwards, np.array(
                        so3.as_matrix(parent[3:])), np.array(child[:3])))
        self._ways.append(_Way(edges, np.array(here[:3])))

    def _steps(self, piece: Piece) -> list[Step]:
        if piece.target == piece.source:
            return []
        return steps_between(self._tree, piece.target, piece.source,
                             None if piece.stamp == LATEST else piece.stamp)

    def _noted(self, step: Step, stamp: int, pose: PoseTuple) -> _Asked | None:
        """Store the error of an edge at a stamp; return its key, None if it is certain."""
        edge = step.history.child, step.parent
        asked = edge, stamp
        if asked in self._errors:
            return asked
        known = known_covariances(self._tree, step.parent, step.history.child)
        errors: dict[_Cause, tuple[float, Array]] = {}
        if known is not None:
            errors.update(_interpolated(known, edge, stamp, step))
        pending = pending_error(step.history, stamp, pose)
        if pending is not None:
            errors[edge, None] = 1.0, pending[:, None]
        if not errors:
            return None
        self._errors[asked] = errors
        return asked

    def covariance(self) -> Array:
        """Return the joint covariance of the n poses in the order of their paths, (6 n, 6 n)."""
        roots = self._roots()
        if not roots:
            return np.zeros((6 * len(self._ways), 6 * len(self._ways)))
        ways = [_as_target_sees(way, roots) for way in self._ways]
        moved = np.concatenate([_moved(*way) for way in ways])
        covariance = np.asarray(moved @ moved.T)
        angles = max((float((each**2)[:, 3:].sum()) for _, each, _, _ in ways), default=0.0)
        return covariance if angles <= SMALL_ANGLES else with_shared_errors(ways)

    def _roots(self) -> dict[_Asked, Array]:
        """Return the roots (6, D) of each error, for all D unit errors at once."""
        weights = {} if self._independent else self._mean_weights()
        columns: dict[_Cause, slice] = {}
        count = 0
        for cause, (_, root) in self._each():
            if cause not in columns:
                columns[cause] = slice(count, count + root.shape[1])
                count += root.shape[1]
        roots = {asked: np.zeros((6, count)) for asked in self._errors}
        for asked, errors in self._errors.items():
            for cause, (weight, root) in errors.items():
                share = weights.get(cause, 1.0)
                roots[asked][:, columns[cause]] = weight / np.sqrt(share) * root
        return roots

    def _each(self) -> Iterable[tuple[_Cause, tuple[float, Array]]]:
        return (each for errors in self._errors.values() for each in errors.items())

    def _mean_weights(self) -> dict[_Cause, float]:
        """Return the mean weight of each covariance of an edge over its stamps."""
        stamps: dict[_Edge, int] = {}
        weights: dict[_Cause, float] = {}
        for (edge, _), errors in self._errors.items():
            stamps[edge] = stamps.get(edge, 0) + 1
            for cause, (weight, _) in errors.items():
                weights[cause] = weights.get(cause, 0.0) + weight
        return {cause: weight / stamps[cause[0]] for cause, weight in weights.items()
                if cause[1] is not None}


def _interpolated(known: Uncertainty, edge: _Edge, stamp: int,
                  step: Step) -> dict[_Cause, tuple[float, Array]]:
    """Return the errors of the two covariances around a stamp, or of the one valid there."""
    first, last = known.knots_around(stamp, step.history)
    around = known.around(np.array([stamp]), step.history)
    ratio = float(around.ratio[0])
    back = None if around.back is None else rows_of(around.back.reshape(-1, 9))
    turns: Array = np.array(ends_turned(around.ratio, rows_of(around.turn), back)).reshape(2, 3, 3)
    both = ((first, 1.0 - ratio, unpack(around.before[0]), turns[0]),
            (last, ratio, unpack(around.after[0]), turns[1]))
    errors: dict[_Cause, tuple[float, Array]] = {}
    for knot, weight, covariance, turn in both:
        if weight > 0.0:
            root = _root(covariance)
            root[3:] = (turn if ratio else np.eye(3)) @ root[3:]
            errors[edge, knot] = weight, root
    return errors


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _as_target_sees(way: _Way, roots: dict[_Asked, Array],
                    ) -> tuple[Array, Array, list[bool], Array]:
    """Return places (E, 3), roots (E, 6, D) in the target's axes, directions and the point."""
    count = next(iter(roots.values())).shape[1]
    turned = np.zeros((len(way.edges), 6, count))
    for number, edge in enumerate(way.edges):
        root = roots[edge.asked]
        turned[number] = np.concatenate([edge.axes @ root[:3], edge.axes @ root[3:]])
    places = np.array([edge.place for edge in way.edges]).reshape(-1, 3)
    return places, turned, [edge.upwards for edge in way.edges], way.point


def _moved(places: Array, roots: Array, upwards: Sequence[bool], point: Array) -> Array:
    """Return how unit errors move a point, (6, D), to first order."""
    signs = np.where(upwards, -1.0, 1.0)[:, None, None]
    crossed = ((point - places) @ SKEW).reshape(-1, 3, 3)
    shifts = roots[:, :3] - crossed @ roots[:, 3:]
    return np.concatenate([(signs * part).sum(axis=0) for part in (shifts, roots[:, 3:])])
