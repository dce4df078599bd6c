"""
How the errors of a path's edges add up.

In the convention of ``geometry.covariances`` each edge's error is one small rigid motion,
of all that lies behind the edge as the target sees it. So each has a share of its own in
the answer, and the shares add up: nothing is folded edge by edge.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from .climb import Branches
from ..edges.protocol import History
from ..geometry import se3, so3
from ..geometry.covariances import carried, sampled
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array

# Up to this variance of all angles together, radians^2, the first order is right to 0.1 %.
_SMALL_ANGLES = np.radians(1.0) ** 2


class Step(NamedTuple):
    """
    One edge on the way from the target to the source.

    :ivar upwards: whether the way leads from the child to the parent here.
    """

    parent: str
    history: History
    upwards: bool


class Error(NamedTuple):
    """
    What may be wrong about one edge at N stamps, as the target sees it.

    :ivar axes: (N, 3, 3) from the parent's axes to the target's.
    :ivar place: (N, 3) the child's origin in the target, metres.
    :ivar covariance: (N, 6, 6) in the parent's axes, about the child's origin.
    """

    step: Step
    axes: Array
    place: Array
    covariance: Array

    def share(self, point: Array) -> Array:
        """Return what it makes of a point (N, 3) behind it, (N, 6, 6) in the target's axes."""
        return carried(self.axes, point - self.place, self.covariance)


def steps_of(branches: Branches) -> list[Step]:
    """Return the edges from the target to the source."""
    up = len(branches.target.edges)
    return [Step(parent, history, number < up)
            for number, (parent, history) in enumerate(reversed(branches.links()))]


def placed(steps: Sequence[Step], poses: Iterable[Array],
           covariances: Sequence[Array | None]) -> tuple[Array, list[Error]]:
    """
    Return ``target_T_source`` (N, 7), and the errors of those edges that have one.

    :param poses: ``parent_T_child`` of each edge, (N, 7) or (1, 7).
    :param covariances: of each edge, (N, 6, 6), or None.
    """
    errors = []
    here = np.array([se3.IDENTITY])
    for step, pose, covariance in zip(steps, poses, covariances, strict=True):
        before = here
        here = se3.compose_many(*np.broadcast_arrays(
            before, se3.inverse_many(pose) if step.upwards else pose))
        parent, child = (here, before) if step.upwards else (before, here)
        if covariance is not None:
            errors.append(Error(step, so3.as_matrix_many(parent[:, 3:]), child[:, :3], covariance))
    return here, errors


def total(errors: Sequence[Error], points: Array) -> Array:
    """
    Return the covariances (N, 6, 6) of points (N, 3) behind independent errors.

    Each is the sum of the shares, or where angles are large, what draws say.
    """
    if not errors:
        return np.zeros((len(points), 6, 6))
    covariances = np.zeros((len(points), 6, 6))
    angles = np.zeros(len(points))
    for error in errors:
        covariances += error.share(points)
        angles += np.einsum('...ii->...', error.covariance[:, 3:, 3:])
    for number in np.flatnonzero(angles > _SMALL_ANGLES).tolist():
        covariances[number] = sampled(
            [(_row(error.axes, number), _row(error.place, number),
              _row(error.covariance, number), error.step.upwards) for error in errors],
            points[number])
    return covariances


def total_at(errors: Sequence[Error], pose: PoseTuple) -> Array:
    """Return the covariance (6, 6) of one pose behind independent errors."""
    return np.asarray(total(errors, np.array([pose[:3]]))[0])


def _row(array: Array, number: int) -> Array:
    """Return the row of a number; one row may stand for all."""
    return np.asarray(array[number if len(array) > 1 else 0])
