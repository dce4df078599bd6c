# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The unknowns of the estimate: static edges, time offsets and places of targets.

A step (P,) has six numbers for each edge (metres, radians), one for each sensor (seconds), and
six for each target, or three if it is a point. A pose takes its step in the convention of ROS's
covariances, in the axes of the parent: t' = t + dt, R' = Exp(dr) R.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from tf_tree_py.core import se3
from tf_tree_py.core.geometry import so3

from .chain import Edge
from .observations import Array


class State(NamedTuple):
    """
    Values of all unknowns.

    :ivar edges: (E, 7) ``parent_T_child``.
    :ivar offsets: (K,) seconds by which the stamps of each sensor are later than the truth.
    :ivar places: (T, 7) ``fixed_in_T_target``; the rotation of a point has no meaning.
    """

    edges: Array
    offsets: Array
    places: Array


class Unknowns:
    """
    The unknowns, and their indices in a step.

    :ivar edges: (parent, child) of each.
    :ivar sensors: the frame of each.
    :ivar targets: (fixed_in, name) of each target whose place is estimated.
    :ivar size: P, the length of a step.
    """

    def __init__(self, edges: Sequence[Edge], sensors: Sequence[str],
                 targets: dict[tuple[str, str], int]) -> None:
        """
        Lay out the numbers.

        :param targets: the number of unknowns of each: 6, or 3 for a point.
        """
        self.edges, self.sensors = list(edges), list(sensors)
        self.targets, self._sizes = list(targets), list(targets.values())
        self._offsets = 6 * len(self.edges)
        self._places = self._offsets + len(self.sensors)
        self.size = self._places + sum(self._sizes)

    @property
    def of_interest(self) -> int:
        """Return Q, how many numbers come before those of the targets."""
        return self._places

    @property
    def times(self) -> slice:
        """Return the indices of all offsets."""
        return slice(self._offsets, self._places)

    def edge(self, number: int) -> slice:
        """Return the indices of an edge."""
        return slice(6 * number, 6 * number + 6)

    def offset(self, sensor: str) -> int:
        """Return the index of the offset of a sensor."""
        return self._offsets + self.sensors.index(sensor)

    def place(self, target: tuple[str, str]) -> slice:
        """Return the indices of a target."""
        number = self.targets.index(target)
        begin = self._places + sum(self._sizes[:number])
        return slice(begin, begin + self._sizes[number])

    def moved(self, state: State, step: Array) -> State:
        """Return the values after a step."""
        edges = moved_many(state.edges, step[:self._offsets].reshape(-1, 6))
        steps = np.zeros((len(self.targets), 6))
        for number, target in enumerate(self.targets):
            where = self.place(target)
            steps[number, :where.stop - where.start] = step[where]
        return State(edges, state.offsets + step[self._offsets:self._places],
                     moved_many(state.places, steps))

    def about(self, step: Array) -> Array:
        """
        Return the matrix (P, P) from a change of a step to a step from the state after it.

        For rotations, it is the left Jacobian: Exp(r + dr) = Exp(J dr) Exp(r).
        """
        made = np.eye(self.size)
        for begin in [*range(3, self._offsets, 6),
                      *(where.start + 3 for where in map(self.place, self.targets)
                        if where.stop - where.start == 6)]:
            where = slice(begin, begin + 3)
            made[where, where] = se3.left_jacobian_many(step[where])
        return made

    def step_to(self, begin: State, end: State) -> Array:
        """Return the step from one state to another."""
        step = np.zeros(self.size)
        step[:self._offsets] = between_many(begin.edges, end.edges).ravel()
        step[self._offsets:self._places] = end.offsets - begin.offsets
        places = between_many(begin.places, end.places)
        for number, target in enumerate(self.targets):
            where = self.place(target)
            step[where] = places[number, :where.stop - where.start]
        return step


def moved_many(poses: Array, steps: Array) -> Array:
    """Return poses (N, 7) after steps (N, 6): t + dt, Exp(dr) R."""
    if not len(poses):
        return poses
    turned = so3.multiply_many(so3.exp_many(steps[:, 3:]), poses[:, 3:])
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return np.concatenate([poses[:, :3] + steps[:, :3], turned], axis=1)


def between_many(begin: Array, end: Array) -> Array:
    """Return the steps (N, 6) between poses (N, 7); the inverse of ``moved_many``."""
    if not len(begin):
        return np.zeros((0, 6))
    turned = so3.multiply_many(end[:, 3:], so3.conjugate_many(begin[:, 3:]))
    return np.concatenate([end[:, :3] - begin[:, :3], so3.log_many(turned)], axis=1)
