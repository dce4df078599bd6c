# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups with a covariance, and the share of each edge in it.

Edges without a covariance are certain. An edge above the meeting point of the two frames is
not on the path, so its errors have no effect.

For one stamp this file does what ``propagation`` does for arrays of stamps: edge by edge with
plain floats, and then with a few products for all edges at once, because numpy takes as long
for one edge as for all of them.
"""

from collections.abc import Sequence
from itertools import accumulate
from operator import attrgetter
import struct
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.chain import join_branches
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.path import Path, sample_of, Step
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Bytes

from .covariance_history import (
    covariances_by_edge,
    interpolated,
    known_covariances,
    pending,
    Uncertainty,
)
from .covariances import (
    carried_by,
    pack,
    PACKED_FLOATS,
    Terms,
    turned_by,
    unpack,
    with_term,
)
from .propagation import is_certain, placed, SMALL_ANGLES, steps_between, total, with_large_angles


class EdgeErrors:
    """
    The errors of the uncertain edges on a path, at one stamp.

    An edge has one or more terms w M C M^T; see ``covariances.Terms``. The numbers are stored as
    bytes until they are evaluated, without the lock: ``b''.join`` is faster than long lists.

    :ivar steps: the edges, from the target to the source.
    """

    __slots__ = ('steps', '_poses', '_owners', '_weights', '_turns', '_packed')

    def __init__(self) -> None:
        self.steps: list[Step] = []
        # For each term the index of its edge, its weight w, and 12 numbers: the matrix from the
        # errors' axes to the target's, row by row, and the errors' position in the target.
        self._owners: list[int] = []
        self._weights: list[float] = []
        self._poses: list[bytes] = []
        # For each edge the other numbers of its terms; see ``covariances.Terms``.
        self._turns: list[bytes] = []
        self._packed: list[Bytes] = []

    def add_edge(self, step: Step, before: PoseTuple, here: PoseTuple, terms: Terms) -> None:
        """
        Add the errors of an edge.

        :param before: the pose in the target of the edge's first frame on the path; ``here``: of
            its second frame.
        """
        parent, child = (here, before) if step.upwards else (before, here)
        self.add(step, parent[3:], child[:3], terms)

    def add(self, step: Step, axes: so3.Quaternion, place: so3.Vector3, terms: Terms) -> None:
        """
        Add errors of an edge.

        :param axes: of the errors, in the target; ``place``: the point that they move, likewise.
        """
        weights, turns, packed = terms
        first, second, third = so3.as_matrix(axes)
        self._owners += (len(self.steps),) * len(weights)
        self.steps.append(step)
        self._weights += weights
        self._poses.append(_POSE_AS_BYTES(*first, *second, *third, *place) * len(weights))
        self._turns.append(turns)
        self._packed.append(packed)

    def shares(self, point: so3.Vector3) -> Array:
        """Return the share of each edge at a point of the target, (E, 6, 6)."""
        if not self.steps:
            return np.zeros((0, 6, 6))
        axes, levers, turns, _ = self._at(point)
        return self._summed(carried_by(axes, levers, turns, self._covariances()))

    def total(self, point: so3.Vector3) -> Array:
        """Return the covariance (6, 6) of a point of the target behind all edges."""
        if not self.steps:
            return np.zeros((6, 6))
        axes, levers, turns, weights = self._at(point)
        covariances = self._covariances()
        parts = carried_by(axes, levers, turns, covariances)
        total: Array = weights.dot(parts.reshape(-1, 36)).reshape(6, 6)
        # The sum of the three variances is invariant under rotations.
        if total.item(3, 3) + total.item(4, 4) + total.item(5, 5) <= SMALL_ANGLES:
            return total
        firsts = [self._owners.index(edge) for edge in range(len(self.steps))]
        return with_large_angles(
            axes[firsts], levers[firsts], self._summed(turned_by(turns, covariances)),
            [step.upwards for step in self.steps], np.zeros(3))

    def _at(self, point: so3.Vector3) -> tuple[Array, Array, Array | None, Array]:
        """
        Return the numbers of all n terms.

        :return: the axes (n, 3, 3) in the target, the places (n, 3) from a point, the rotation
            blocks (n, 3, 3), or None if all are the identity, and the weights (n,).
        """
        poses = _joined(self._poses).reshape(-1, 12)
        turns = None if len(poses) == len(self.steps) else (
            _joined(self._turns).reshape(-1, 3, 3))
        numbers = _array((*point, *self._weights))
        return poses[:, :9].reshape(-1, 3, 3), poses[:, 9:] - numbers[:3], turns, numbers[3:]

    def _covariances(self) -> Array:
        """Return the covariances C of all terms, (n, 6, 6)."""
        return unpack(_joined(self._packed).reshape(-1, PACKED_FLOATS))

    def _summed(self, parts: Array) -> Array:
        """Return the weighted sums of the terms (n, 6, 6) of each edge."""
        if len(parts) == len(self.steps):
            return parts
        weights = np.zeros((len(self.steps), len(parts)))
        weights[self._owners, np.arange(len(parts))] = self._weights
        return np.asarray(weights.dot(parts.reshape(-1, 36)).reshape(-1, 6, 6))


_POSE_AS_BYTES = struct.Struct('12d').pack


def _joined(parts: Sequence[Bytes]) -> Array:
    """Return the numbers of several parts, read-only."""
    return np.frombuffer(b''.join(parts))


def _array(numbers: Sequence[float]) -> Array:
    """Return ``np.array(numbers)``, read-only, in less than half of its time."""
    return np.frombuffer(struct.pack(f'{len(numbers)}d', *numbers))


def errors_on_fixed_path(tree: Tree, target: str, source: str, stamp: int,
                         independent: bool) -> tuple[int, PoseTuple, EdgeErrors] | None:
    """
    Return the stamp, with ``LATEST`` resolved, the pose, and its errors; the tree is locked.

    :return: None if the path changes with the stamp, or there is no answer: then ``lookup`` finds
        the path, or raises an error with the reason.
    """
    if target == source:
        return None
    try:
        path = tree.paths.fixed_path(target, source)
        if path is None:
            return None
        found = path.latest_common_time() if stamp == LATEST else stamp
        down, up, poses = _samples_of(path, found)
    except TransformException:
        return None
    here, errors = _along(tree, path.steps(), poses, found, independent)
    # If all edges lead down one by one, ``join_branches`` would return the same again. Otherwise
    # it rounds differently, and the pose is that of ``lookup`` to the last bit.
    return found, here if len(down) == len(poses) else join_branches(down, up), errors


def _samples_of(path: Path, stamp: int) -> tuple[list[PoseTuple], list[PoseTuple],
                                                 list[PoseTuple]]:
    """
    Return the samples of both branches, and ``parent_T_child`` of each of the path's steps.

    The branches are the arguments of ``join_branches``.

    :raises ExtrapolationException: an edge has no data for the stamp.
    """
    steps = path.steps()
    down = [sample_of(part, stamp) for part in path.source_parts]
    up = [sample_of(part, stamp) for part in path.target_parts]
    poses = [*reversed(up), *down]
    if len(poses) == len(steps):
        return down, up, poses
    # Successive static edges are one part.
    parts = zip((*reversed(path.target_parts), *path.source_parts), poses, strict=True)
    moving = iter([pose for part, pose in parts if not part.is_static])
    return down, up, [step.history.sample(stamp) if step.history.is_static else next(moving)
                      for step in steps]


def errors_at(tree: Tree, target: str, source: str, stamp: int, newest: bool,
              independent: bool) -> EdgeErrors:
    """
    Return the errors of a lookup that has an answer; the tree is locked.

    :param newest: whether the lookup was for ``LATEST``; that stays unresolved if all edges are
        static.
    """
    if target == source or is_certain(tree):
        return EdgeErrors()
    steps = steps_between(tree, target, source, None if newest and stamp == LATEST else stamp)
    poses = [sample_of(step.history, stamp) for step in steps]
    return _along(tree, steps, poses, stamp, independent)[1]


def _along(tree: Tree, steps: Sequence[Step], poses: Sequence[PoseTuple], stamp: int,
           independent: bool) -> tuple[PoseTuple, EdgeErrors]:
    """
    Return ``target_T_source``, and its errors.

    :param poses: ``parent_T_child`` of each edge; there is at least one.
    """
    errors, by_edge = EdgeErrors(), covariances_by_edge(tree)
    before = se3.IDENTITY
    passed = [se3.inverse(pose) if step.upwards else pose
              for step, pose in zip(steps, poses, strict=True)]
    for step, pose, after in zip(steps, poses, accumulate(passed, se3.compose), strict=True):
        parent, history, _ = step
        terms = terms_of(by_edge.get((parent, history.child)), history, stamp, pose, independent)
        if terms is not None:
            errors.add_edge(step, before, after, terms)
        before = after
    return before, errors


def terms_of(known: Uncertainty | None, history: History, stamp: int, pose: PoseTuple,
             independent: bool) -> Terms | None:
    """
    Return the errors of an edge, including its pending correction; None if it is certain.

    :param known: its covariances; None if it has none.
    :param pose: of the edge at the stamp.
    """
    terms = None if known is None else known.terms_at(stamp, history, independent)
    error = pending_error(history, stamp, pose)
    return terms if error is None else with_term(terms, np.outer(error, error))


def pending_error(history: History, stamp: int, pose: PoseTuple) -> Array | None:
    """Return the pending correction, d (6,); None if there is none."""
    error = pending(history, np.array([stamp]), np.array([pose]))
    return None if error is None or not error.any() else error[0]


# --- lookups

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
    """``target_T_source`` and its covariance; see ``covariances``."""

    stamp: int
    pose: PoseTuple
    covariance: Array


def shares(errors: EdgeErrors, pose: PoseTuple) -> list[Share]:
    """Return the share of each edge, the largest part of the position first."""
    covariances = errors.shares(pose[:3])
    variances = covariances.reshape(-1, 36)[:, ::7].tolist()
    # For a few edges, sums of plain floats are faster than those of numpy.
    of_position = [x + y + z for x, y, z, _, _, _ in variances]
    of_rotation = [x + y + z for _, _, _, x, y, z in variances]
    position, rotation = sum(of_position) or 1.0, sum(of_rotation) or 1.0
    each = [Share(step.parent, step.history.child, covariance, there / position, turn / rotation)
            for step, covariance, there, turn in zip(
                errors.steps, covariances, of_position, of_rotation, strict=True)]
    return sorted(each, key=attrgetter('position', 'rotation'), reverse=True)


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
    if tree.paths.has_changed_parent:
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
    covariances = _covariances_of(tree, steps, stamps, poses, independent)
    return total(placed(steps, poses, covariances), points)


def _covariances_of(tree: Tree, steps: Sequence[Step], stamps: Stamps, poses: Sequence[Array],
                    independent: bool) -> list[Array | None]:
    """
    Return the covariances (21, N) of edges at stamps; None for those that are certain.

    The pending corrections d of an edge add d d^T.

    :param poses: of each edge, (N, 7), or (1, 7) of static edges.
    """
    around = {number: known.around_poses(stamps, history)
              for number, (parent, history, _) in enumerate(steps)
              if (known := known_covariances(tree, parent, history.child)) is not None}
    found: list[Array | None] = [None] * len(steps)
    if around:
        each = np.stack(interpolated([*around.values()], independent), axis=1)
        for number, covariance in zip(around, each, strict=True):
            found[number] = covariance
    for number, (step, pose) in enumerate(zip(steps, poses, strict=True)):
        error = pending(step.history, stamps, pose)
        if error is not None:
            own, more = found[number], pack(error[:, :, None] * error[:, None, :]).T
            found[number] = more if own is None else own + more
    return found


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
