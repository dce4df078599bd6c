# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The propagation of the errors of a path's edges.

In the convention of ``geometry.covariances``, an edge's error is one small rigid motion of
everything behind the edge, expressed in the target. So each edge has its own share of the
result, and to first order the result is the sum of the shares. For large angles it is not; the
result is then the second moment of draws about the looked-up pose, which need not be their
mean.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.tree.climb import Branches
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_rows import carried, Rows
from .covariances import rows_of, unpack
from .large_angles import with_large_angles

# Up to this sum of the variances of the angles, radians^2, the first order is exact to 0.1 %.
SMALL_ANGLES = np.radians(1.0) ** 2


class Errors(NamedTuple):
    """
    The errors of E edges at N stamps, expressed in the target, as rows (E, N).

    If nothing moves, there is one stamp for all.

    :ivar steps: the edges, from the target to the source.
    :ivar axes: nine rows, the matrices from the parents' axes to the target's.
    :ivar places: three rows, the children's origins in the target, metres.
    :ivar covariances: 21 rows, in the parents' axes, about the children's origins.
    """

    steps: list[Step]
    axes: Rows
    places: Rows
    covariances: Rows

    def shares(self, points: Array) -> Rows:
        """Return the share of each edge at points (N, 3) behind all edges, 21 rows."""
        lever = tuple(point - place for point, place in zip(points.T, self.places, strict=True))
        return carried(self.axes, lever, self.covariances)

    def at(self, number: int) -> tuple[Array, Array, Array]:
        """Return the axes (E, 3, 3), the places and the covariances (E, 6, 6) at one stamp."""
        axes, places, covariances = (
            np.stack([row[:, number if row.shape[1] > 1 else 0] for row in rows], axis=-1)
            for rows in (self.axes, self.places, self.covariances))
        return axes.reshape(-1, 3, 3), places, unpack(covariances)


def is_certain(tree: Tree) -> bool:
    """Return whether no edge has more than its samples, such as a covariance or a correction."""
    return not tree.companions


def steps_between(tree: Tree, target: str, source: str, stamp: int | None) -> list[Step]:
    """
    Return the edges from the target to the source.

    :param stamp: nanoseconds; None: use the newest samples.
    """
    return _steps_of(tree.ways.branches(target, source, stamp))


def _steps_of(branches: Branches) -> list[Step]:
    """Return the edges from the target to the source."""
    up = len(branches.target.edges)
    return [Step(parent, history, number < up)
            for number, (parent, history) in enumerate(reversed(branches.links()))]


def placed(steps: Sequence[Step], poses: Iterable[Array],
           covariances: Sequence[Array | None]) -> Errors | None:
    """
    Return the errors of the uncertain edges; None if all are certain.

    :param poses: ``parent_T_child`` of each edge, (N, 7), or (1, 7) for all stamps.
    :param covariances: of each edge, (21, N), or None.
    """
    known: list[tuple[Step, Array, Array, Array]] = []
    here = np.array([se3.IDENTITY])
    for step, pose, covariance in zip(steps, poses, covariances, strict=True):
        before = here
        here = se3.compose_many(*np.broadcast_arrays(
            before, se3.inverse_many(pose) if step.upwards else pose))
        if covariance is not None:
            parent, child = (here, before) if step.upwards else (before, here)
            known.append((step, covariance, parent, child))
    if not known:
        return None
    edges, each, parents, children = zip(*known, strict=True)
    first, second, third = so3.as_matrix(_rows(parents)[3:])
    return Errors(list(edges), (*first, *second, *third), _rows(children)[:3],
                  tuple(np.stack(each, axis=1)))


def _rows(poses: Sequence[Array]) -> Any:
    """Return poses of each edge, (N, 7) or (1, 7), as seven rows (E, N)."""
    return rows_of(np.stack(np.broadcast_arrays(*poses)))


def total(errors: Errors | None, points: Array) -> Array:
    """
    Return the covariances (N, 6, 6) of points (N, 3) behind independent errors.

    Each is the sum of the shares; for large angles it is computed by points or draws.
    """
    if errors is None:
        return np.zeros((len(points), 6, 6))
    covariances = unpack(np.stack([row.sum(axis=0) for row in errors.shares(points)], axis=-1))
    # The sum of the three variances is invariant under rotations.
    angles = np.einsum('nii->n', covariances[:, 3:, 3:])
    for number in np.flatnonzero(angles > SMALL_ANGLES).tolist():
        covariances[number] = with_large_angles(
            *errors.at(number), [step.upwards for step in errors.steps], points[number])
    return covariances
