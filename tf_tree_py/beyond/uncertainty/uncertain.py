# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups with a covariance, and the share of each edge in it.

Edges without a covariance are certain. An edge above the meeting point of the two frames is
not on the path, so its errors have no effect.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_history import Around, has_pending, interpolated
from .covariances import pack
from .edge_covariances import known_covariances
from .propagation import is_certain, placed, steps_between, total
from .uncertain_lookup import EdgeErrors, errors_at

# Stamps per block: a covariance takes 288 bytes, and each stamp needs several.
_BLOCK = 2048


class Share(NamedTuple):
    """
    The share of one edge in the uncertainty of a lookup.

    :ivar covariance: (6, 6), of the source's pose in the target, to first order; for small
        angles the sum over all edges is the lookup's covariance.
    :ivar position: its part of the variance of the position, 0 to 1.
    :ivar rotation: its part of the variance of the rotation, 0 to 1.
    """

    parent: str
    child: str
    covariance: Array
    position: float
    rotation: float


class Uncertain(NamedTuple):
    """``target_T_source`` and its covariance; see ``geometry.covariances``."""

    stamp: int
    pose: PoseTuple
    covariance: Array


def shares(errors: EdgeErrors, pose: PoseTuple) -> list[Share]:
    """Return the share of each edge, the largest part of the position first."""
    covariances = errors.shares(pose[:3])
    variances = covariances.reshape(-1, 36)[:, ::7].tolist()
    # For a few edges, sums of plain floats are faster than those of numpy.
    of_position = [sum(each[:3]) for each in variances]
    of_rotation = [sum(each[3:]) for each in variances]
    position, rotation = sum(of_position) or 1.0, sum(of_rotation) or 1.0
    each = [Share(step.parent, step.history.child, covariance, there / position, turn / rotation)
            for step, covariance, there, turn in zip(
                errors.steps, covariances, of_position, of_rotation, strict=True)]
    return sorted(each, key=lambda share: (-share.position, -share.rotation))


def around_of(tree: Tree, steps: Sequence[Step], stamps: Stamps) -> list[Around | None]:
    """Return each edge's own covariances around stamps; None for edges without."""
    return [known.around(stamps, history)
            if (known := known_covariances(tree, parent, history.child)) else None
            for parent, history, _ in steps]


def covariances_of(around: Sequence[Around | None], independent: bool) -> list[Array | None]:
    """Return the interpolated covariances (21, N) of edges; None for edges without."""
    covariances: list[Array | None] = [None] * len(around)
    found = [(number, one) for number, one in enumerate(around) if one is not None]
    if found:
        each = np.stack(interpolated([one for _, one in found], independent), axis=1)
        for (number, _), covariance in zip(found, each, strict=True):
            covariances[number] = covariance
    return covariances


def pending_of(steps: Sequence[Step], stamps: Stamps,
               poses: Sequence[Array]) -> list[Array | None]:
    """
    Return the pending correction of each edge, (N, 6) errors; None for other edges.

    :param poses: of each edge, (N, 7), or (1, 7) of static edges.
    """
    return [step.history.pending(stamps, pose)
            if has_pending(step.history) and len(stamps) else None
            for step, pose in zip(steps, poses, strict=True)]


def inflated(covariances: Sequence[Array | None],
             pending: Sequence[Array | None]) -> list[Array | None]:
    """Return covariances (21, N) plus d d^T of the pending corrections d."""
    inflated = list(covariances)
    for number, (covariance, error) in enumerate(zip(covariances, pending, strict=True)):
        if error is not None:
            known = pack(error[:, :, None] * error[:, None, :]).T
            inflated[number] = known if covariance is None else covariance + known
    return inflated


# --- many stamps

def covariances_at(tree: Tree, target: str, source: str, stamps: Stamps, poses: Array,
                   independent: bool) -> Array:
    """
    Return the covariances (N, 6, 6) of poses ``target_T_source`` (N, 7) at stamps (N,).

    :param tree: must not change meanwhile.
    """
    if target == source or is_certain(tree):
        return np.zeros((len(stamps), 6, 6))
    points = poses[:, :3]
    if tree.ways.was_rehung:
        return _stacked([
            errors_at(tree, target, source, stamp, False, independent).total(tuple(point))[None]
            for stamp, point in zip(stamps.tolist(), points.tolist(), strict=True)])
    steps = steps_between(tree, target, source, None)
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(stamps), _BLOCK)]
    return _stacked([_total_at(tree, steps, stamps[block], points[block], independent)
                     for block in blocks])


def _total_at(tree: Tree, steps: Sequence[Step], stamps: Stamps, points: Array,
              independent: bool) -> Array:
    ends = int(stamps.min()), int(stamps.max())
    poses = [step.history.track(*ends).at(stamps).T for step in steps]
    covariances = inflated(covariances_of(around_of(tree, steps, stamps), independent),
                           pending_of(steps, stamps, poses))
    return total(placed(steps, poses, covariances), points)


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
