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
import struct
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.storage import Bytes
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_history import (
    Around,
    has_pending,
    interpolated,
    known_covariances,
    Term,
    whole_term,
)
from .covariances import (
    carried_by,
    pack,
    PACKED_FLOATS,
    SKEW,
    Terms,
    turned_by,
    unpack,
)
from .propagation import is_certain, placed, SMALL_ANGLES, steps_between, total, with_large_angles


class EdgeErrors:
    """
    The errors of the uncertain edges on a path, at one stamp.

    An edge has one or more terms w M C M^T; see ``edges.uncertainty.Term``. The numbers are
    stored in rows until they are evaluated, without the lock.

    :ivar steps: the edges, from the target to the source.
    """

    __slots__ = ('steps', '_poses', '_firsts', '_owners', '_terms', '_packed')

    def __init__(self) -> None:
        self.steps: list[Step] = []
        # 12 numbers for each edge: the matrix from its errors' axes to the target's, row by row,
        # and the position of the errors in the target.
        self._poses: list[float] = []
        # The index of each edge's first term.
        self._firsts: list[int] = []
        # For each term the index of its edge, ten numbers w and M, and C.
        self._owners: list[int] = []
        self._terms: list[float] = []
        self._packed: list[Bytes] = []

    def add_edge(self, step: Step, before: PoseTuple, here: PoseTuple,
                 terms: Sequence[Term]) -> None:
        """
        Add the errors of an edge, if it has any.

        :param before: the pose in the target of the edge's first frame on the path; ``here``: of
            its second frame.
        """
        if terms:
            parent, child = (here, before) if step.upwards else (before, here)
            self.add(step, parent[3:], child[:3], terms)

    def add(self, step: Step, axes: so3.Quaternion, place: so3.Vector3,
            terms: Sequence[Term]) -> None:
        """
        Add errors of an edge.

        :param axes: of the errors, in the target; ``place``: the point that they move, likewise.
        """
        if not terms:
            return
        owner = len(self.steps)
        self.steps.append(step)
        self._firsts.append(len(self._owners))
        first, second, third = so3.as_matrix(axes)
        self._poses += (*first, *second, *third, *place)
        for weight, turn, packed in terms:
            self._owners.append(owner)
            self._terms += (weight, *turn)
            self._packed.append(packed)

    def shares(self, point: so3.Vector3) -> Array:
        """Return the share of each edge at a point of the target, (E, 6, 6)."""
        if not self.steps:
            return np.zeros((0, 6, 6))
        return self._summed(_parts(point, *self._axes_and_places(), *self._covariances()))

    def total(self, point: so3.Vector3) -> Array:
        """Return the covariance (6, 6) of a point of the target behind all edges."""
        if not self.steps:
            return np.zeros((6, 6))
        axes, places = self._axes_and_places()
        terms, covariances = self._covariances()
        total = np.asarray(np.add.reduce(_parts(point, axes, places, terms, covariances)))
        # The sum of the three variances is invariant under rotations.
        if total.item(3, 3) + total.item(4, 4) + total.item(5, 5) <= SMALL_ANGLES:
            return total
        return with_large_angles(
            axes, places, self._summed(turned_by(terms and terms.turns, covariances)),
            [step.upwards for step in self.steps], np.array(point))

    def _axes_and_places(self) -> tuple[Array, Array]:
        """Return the errors' axes (E, 3, 3) and places (E, 3), in the target."""
        poses = _array(self._poses).reshape(-1, 12)
        return poses[:, :9].reshape(-1, 3, 3), poses[:, 9:]

    def _covariances(self) -> tuple[Terms | None, Array]:
        """Return the rotations of the terms, None if there are none, and w C (n, 6, 6)."""
        covariances = unpack(np.frombuffer(b''.join(self._packed)).reshape(-1, PACKED_FLOATS))
        if len(self._owners) == len(self.steps):
            return None, covariances
        numbers = _array(self._terms).reshape(-1, 10)
        covariances *= numbers[:, 0, None, None]
        return Terms(np.array(self._owners), numbers[:, 1:].reshape(-1, 3, 3)), covariances

    def _summed(self, parts: Array) -> Array:
        """Return the sums of the terms (n, 6, 6) of each edge."""
        if len(parts) == len(self.steps):
            return parts
        return np.asarray(np.add.reduceat(parts, self._firsts, axis=0))


def _parts(point: so3.Vector3, axes: Array, places: Array, terms: Terms | None,
           covariances: Array) -> Array:
    """Return the share of each term at a point, (n, 6, 6)."""
    crossed = ((places - point) @ SKEW).reshape(-1, 3, 3) @ axes
    return carried_by(axes, crossed, terms, covariances)


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
        pose, poses = path.poses_at(found)
    except TransformException:
        return None
    return found, pose, _errors_along(tree, path.steps(), poses, found, independent)


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
    return _errors_along(tree, steps, [step.history.sample(stamp) for step in steps], stamp,
                         independent)


def _errors_along(tree: Tree, steps: Sequence[Step], poses: Sequence[PoseTuple], stamp: int,
                  independent: bool) -> EdgeErrors:
    errors = EdgeErrors()
    here: PoseTuple = se3.IDENTITY
    for step, pose in zip(steps, poses, strict=True):
        before, here = here, se3.compose(here, se3.inverse(pose) if step.upwards else pose)
        errors.add_edge(step, before, here, terms_of(tree, step, stamp, pose, independent))
    return errors


def terms_of(tree: Tree, step: Step, stamp: int, pose: PoseTuple,
             independent: bool) -> Sequence[Term]:
    """Return the errors of an edge with its pose at a stamp; empty if it is certain."""
    history = step.history
    known = known_covariances(tree, step.parent, history.child)
    terms: Sequence[Term] = ()
    if known is not None:
        terms = known.terms_at(stamp, history, independent)
    error = pending_error(history, stamp, pose)
    if error is not None:
        terms = [*terms, whole_term(np.outer(error, error))]
    return terms


def pending_error(history: History, stamp: int, pose: PoseTuple) -> Array | None:
    """Return the pending correction, d (6,); None if there is none."""
    if not has_pending(history):
        return None
    error = history.pending(np.array([stamp]), np.array([pose]))
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
    covariances = inflated(covariances_of(around_of(tree, steps, stamps), independent),
                           pending_of(steps, stamps, poses))
    return total(placed(steps, poses, covariances), points)


def _stacked(covariances: Sequence[Array]) -> Array:
    return np.concatenate(covariances) if covariances else np.empty((0, 6, 6))
