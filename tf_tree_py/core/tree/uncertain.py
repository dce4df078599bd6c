"""
Lookups that say how sure they are, and which edge they owe it to.

Edges without a covariance are certain. An edge above the meeting point of the two frames
is not walked, so what it may be off by drops out.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .propagation import Errors, placed, Step, steps_of, total
from .tree import Tree
from ..geometry.covariances import between
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..times import Stamps

# Stamps that are handled at once: a covariance takes 288 bytes, and there are several of each.
_BLOCK = 2048


class Share(NamedTuple):
    """
    What one edge adds to the uncertainty of a lookup.

    :ivar covariance: (6, 6), of the source's pose in the target; those of all edges add
        up to the lookup's.
    :ivar position: its part of the variance of the position, 0 to 1.
    :ivar rotation: its part of the variance of the rotation, 0 to 1.
    """

    parent: str
    child: str
    covariance: Array
    position: float
    rotation: float


class Uncertain(NamedTuple):
    """``target_T_source``, and how far it may be off; see ``geometry.covariances``."""

    stamp: int
    pose: PoseTuple
    covariance: Array


def shares(errors: Errors | None, pose: PoseTuple) -> list[Share]:
    """Return what each edge adds, the largest part of the position first."""
    if errors is None:
        return []
    covariances = errors.shares(np.array([pose[:3]]))[:, 0]
    whole = covariances.sum(axis=0)
    each = [Share(step.parent, step.history.child, covariance,
                  _part(covariance[:3, :3], whole[:3, :3]),
                  _part(covariance[3:, 3:], whole[3:, 3:]))
            for step, covariance in zip(errors.steps, covariances, strict=True)]
    return sorted(each, key=lambda share: (-share.position, -share.rotation))


def _part(one: Array, whole: Array) -> float:
    return float(np.trace(one) / np.trace(whole)) if np.trace(whole) > 0.0 else 0.0


def errors_at(tree: Tree, target: str, source: str, stamp: int, newest: bool,
              independent: bool) -> Errors | None:
    """
    Return the errors of the edges between two frames, from the target to the source.

    :param stamp: there is an answer for it.
    :param newest: whether it is what ``LATEST`` came to, which is no time where nothing
        moves.
    """
    if target == source or not tree.uncertainty:
        return None
    steps = steps_of(tree.ways.branches(
        target, source, None if newest and stamp == LATEST else stamp))
    covariances = covariances_of(tree, steps, np.array([stamp]), independent)
    poses = (np.array([step.history.sample(stamp)]) for step in steps)
    return placed(steps, poses, covariances)[1]


def covariances_of(tree: Tree, steps: Sequence[Step], stamps: Stamps,
                   independent: bool) -> list[Array | None]:
    """Return each edge's own covariances (N, 6, 6) at stamps; None of those without."""
    covariances: list[Array | None] = [None] * len(steps)
    found = [(number, known.around(stamps, history))
             for number, (parent, history, _) in enumerate(steps)
             if (known := tree.uncertainty.get(history.child)) and known.parent == parent]
    if found:
        # All edges at once: numpy takes as long for one.
        before, after, ratio, turn = (
            np.stack(part) for part in zip(*(around for _, around in found), strict=True))
        each = between(before, after, ratio, turn, independent)
        for (number, _), covariance in zip(found, each, strict=True):
            covariances[number] = covariance
    return covariances


# --- many

def covariances_at(tree: Tree, target: str, source: str, stamps: Stamps, poses: Array,
                   independent: bool) -> Array:
    """
    Return the covariances (N, 6, 6) of poses ``target_T_source`` (N, 7) at stamps (N,).

    :param tree: one that nobody changes meanwhile.
    """
    if target == source or not tree.uncertainty:
        return np.zeros((len(stamps), 6, 6))
    points = poses[:, :3]
    if tree.ways.was_rehung:
        return _stacked([
            total(errors_at(tree, target, source, stamp, False, independent), point[None])
            for stamp, point in zip(stamps.tolist(), points, strict=True)])
    steps = steps_of(tree.ways.branches(target, source, None))
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(stamps), _BLOCK)]
    return _stacked([_total_at(tree, steps, stamps[block], points[block], independent)
                     for block in blocks])


def _total_at(tree: Tree, steps: Sequence[Step], stamps: Stamps, points: Array,
              independent: bool) -> Array:
    ends = int(stamps.min()), int(stamps.max())
    covariances = covariances_of(tree, steps, stamps, independent)
    poses = (step.history.track(*ends).at(stamps).T for step in steps)
    return total(placed(steps, poses, covariances)[1], points)


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
