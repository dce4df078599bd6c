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
How the errors of a path's edges add up.

In the convention of ``geometry.covariances`` an edge's error is one small rigid motion of all
that lies behind the edge, as the target sees it. So each edge has a share of its own in the
answer, and the shares add up.
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


class Errors(NamedTuple):
    """
    What may be wrong about E edges at N stamps, as the target sees it.

    :ivar steps: the edges, from the target to the source.
    :ivar axes: (E, N, 3, 3) from the parents' axes to the target's.
    :ivar places: (E, N, 3) the children's origins in the target, metres.
    :ivar covariances: (E, N, 6, 6) in the parents' axes, about the children's origins.
    """

    steps: list[Step]
    axes: Array
    places: Array
    covariances: Array

    def shares(self, points: Array) -> Array:
        """Return the share of each edge at points (N, 3) behind all edges, (E, N, 6, 6)."""
        return carried(self.axes, points - self.places, self.covariances)


def steps_of(branches: Branches) -> list[Step]:
    """Return the edges from the target to the source."""
    up = len(branches.target.edges)
    return [Step(parent, history, number < up)
            for number, (parent, history) in enumerate(reversed(branches.links()))]


def placed(steps: Sequence[Step], poses: Iterable[Array],
           covariances: Sequence[Array | None]) -> tuple[Array, Errors | None]:
    """
    Return ``target_T_source`` (N, 7), and the errors of those edges that have one.

    :param poses: ``parent_T_child`` of each edge, (N, 7), or (1, 7) for all stamps.
    :param covariances: of each edge, (N, 6, 6), or None.
    """
    ends: list[tuple[Array, Array]] = []
    here = np.array([se3.IDENTITY])
    for step, pose in zip(steps, poses, strict=True):
        before = here
        here = se3.compose_many(*np.broadcast_arrays(
            before, se3.inverse_many(pose) if step.upwards else pose))
        ends.append((here, before) if step.upwards else (before, here))
    known = [(step, covariance, *both) for step, covariance, both in zip(
        steps, covariances, ends, strict=True) if covariance is not None]
    if not known:
        return here, None
    edges, each, parents, children = zip(*known, strict=True)
    return here, Errors(
        list(edges), so3.as_matrix_many(_stacked(parents, len(here))[..., 3:]),
        _stacked(children, len(here))[..., :3], np.stack(each))


def _stacked(poses: Sequence[Array], count: int) -> Array:
    """Return poses, (N, 7) or (1, 7) each, as one array (E, N, 7)."""
    return np.stack([np.broadcast_to(pose, (count, 7)) for pose in poses])


def total(errors: Errors | None, points: Array) -> Array:
    """
    Return the covariances (N, 6, 6) of points (N, 3) behind independent errors.

    Each is the sum of the shares; where angles are large, it is computed by draws.
    """
    if errors is None:
        return np.zeros((len(points), 6, 6))
    covariances = np.asarray(errors.shares(points).sum(axis=0))
    angles = np.einsum('enii->n', errors.covariances[..., 3:, 3:])
    for number in np.flatnonzero(angles > _SMALL_ANGLES).tolist():
        covariances[number] = sampled(
            errors.axes[:, number], errors.places[:, number], errors.covariances[:, number],
            [step.upwards for step in errors.steps], points[number])
    return covariances


def total_at(errors: Errors | None, pose: PoseTuple) -> Array:
    """Return the covariance (6, 6) of one pose behind independent errors."""
    return np.asarray(total(errors, np.array([pose[:3]]))[0])
