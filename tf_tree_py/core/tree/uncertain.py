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

"""
Lookups with a covariance, and the share of each edge in it.

Edges without a covariance are certain. An edge above the meeting point of the two frames is
not on the way, so its errors do not matter.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .propagation import Errors, placed, Step, steps_of, total
from .tree import Tree
from ..edges.corrected import CorrectedHistory
from ..edges.uncertainty import Around
from ..geometry.covariances import between
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import LATEST
from ..times import Stamps

# Stamps that are handled at once: a covariance takes 288 bytes, and each stamp needs several.
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


class Gathered(NamedTuple):
    """
    What a tree knows of the edges between two frames, for some stamps.

    Copied under the lock; everything else is computed without it.

    :ivar poses: of each edge, ``parent_T_child`` (N, 7), or (1, 7) for all stamps.
    :ivar around: of each edge, its covariances; None of those that are certain.
    :ivar pending: of each edge, what is still to be corrected; see ``pending_of``.
    """

    steps: list[Step]
    poses: list[Array]
    around: list[Around | None]
    pending: list[Array | None]

    def errors(self, independent: bool) -> Errors | None:
        """Return what may be wrong about these edges; None if they are all certain."""
        covariances = inflated(covariances_of(self.around, independent), self.pending)
        return placed(self.steps, self.poses, covariances)[1]


def gathered_at(tree: Tree, target: str, source: str, stamp: int, newest: bool) -> Gathered:
    """
    Return what is known of the edges between two frames at a stamp that has an answer.

    :param newest: whether the question was for ``LATEST``; where nothing moves, that comes to no
        time.
    """
    if target == source or is_certain(tree):
        return Gathered([], [], [], [])
    steps = steps_of(tree.ways.branches(
        target, source, None if newest and stamp == LATEST else stamp))
    poses = [np.array([step.history.sample(stamp)]) for step in steps]
    stamps = np.array([stamp])
    return Gathered(steps, poses, around_of(tree, steps, stamps),
                    pending_of(steps, stamps, poses))


def is_certain(tree: Tree) -> bool:
    """Return whether no edge ever got a covariance or a correction."""
    return not tree.uncertainty and not tree.corrections


def around_of(tree: Tree, steps: Sequence[Step], stamps: Stamps) -> list[Around | None]:
    """Return each edge's own covariances around stamps; None of those without."""
    return [known.around(stamps, history)
            if (known := tree.uncertainty.get(history.child)) and known.parent == parent else None
            for parent, history, _ in steps]


def covariances_of(around: Sequence[Around | None], independent: bool) -> list[Array | None]:
    """Return the covariances (N, 6, 6) of edges, interpolated; None of those without."""
    covariances: list[Array | None] = [None] * len(around)
    found = [(number, one) for number, one in enumerate(around) if one is not None]
    if found:
        # All edges at once: numpy takes as long for one.
        before, after, ratio, turn = (
            np.stack(part) for part in zip(*(one for _, one in found), strict=True))
        each = between(before, after, ratio, turn, independent)
        for (number, _), covariance in zip(found, each, strict=True):
            covariances[number] = covariance
    return covariances


def pending_of(steps: Sequence[Step], stamps: Stamps,
               poses: Sequence[Array]) -> list[Array | None]:
    """
    Return what is still to be corrected of each edge, (N, 6) errors; None of the others.

    :param poses: of each, (N, 7), or (1, 7) of edges that do not move.
    """
    return [step.history.pending(stamps, pose)
            if isinstance(step.history, CorrectedHistory) and len(stamps) else None
            for step, pose in zip(steps, poses, strict=True)]


def inflated(covariances: Sequence[Array | None],
             pending: Sequence[Array | None]) -> list[Array | None]:
    """Return covariances (N, 6, 6) plus d d^T of the errors d that are still to be corrected."""
    inflated = list(covariances)
    for number, (covariance, error) in enumerate(zip(covariances, pending, strict=True)):
        if error is not None:
            known = error[:, :, None] * error[:, None, :]
            inflated[number] = known if covariance is None else covariance + known
    return inflated


# --- many

def covariances_at(tree: Tree, target: str, source: str, stamps: Stamps, poses: Array,
                   independent: bool) -> Array:
    """
    Return the covariances (N, 6, 6) of poses ``target_T_source`` (N, 7) at stamps (N,).

    :param tree: one that nobody changes meanwhile.
    """
    if target == source or is_certain(tree):
        return np.zeros((len(stamps), 6, 6))
    points = poses[:, :3]
    if tree.ways.was_rehung:
        return _stacked([
            total(gathered_at(tree, target, source, stamp, False).errors(independent), point[None])
            for stamp, point in zip(stamps.tolist(), points, strict=True)])
    steps = steps_of(tree.ways.branches(target, source, None))
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(stamps), _BLOCK)]
    return _stacked([_total_at(tree, steps, stamps[block], points[block], independent)
                     for block in blocks])


def _total_at(tree: Tree, steps: Sequence[Step], stamps: Stamps, points: Array,
              independent: bool) -> Array:
    ends = int(stamps.min()), int(stamps.max())
    poses = [step.history.track(*ends).at(stamps).T for step in steps]
    around = around_of(tree, steps, stamps)
    pending = pending_of(steps, stamps, poses)
    return total(Gathered(list(steps), poses, around, pending).errors(independent), points)


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
