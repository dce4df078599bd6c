# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The unknowns of the estimate, and the observations as they predict them.

The unknowns are static edges, time offsets and places of targets. A step (P,) has six numbers for
each edge (metres, radians), one for each sensor (seconds), and six for each target, or three if it
is a point. A pose takes its step in the convention of ROS's covariances, in the axes of the
parent: t' = t + dt, R' = Exp(dr) R.

A residual is the observed pose of the target minus the predicted one, in the sensor's axes:
(p,) with t_seen - t and Log(R_seen R^T), or only the former for points. A step of an edge is
one small rigid motion of everything behind the edge, so its derivatives have a closed form.
Let q be the position of the target in the axes of the parent, and c the origin of the child.
A sensor behind the edge sees the target move by -(dt + dr x (q - c)); a sensor before the edge
sees the opposite. The derivative by the time is the difference of two lookups.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core import se3
from tf_tree_py.core.errors import no_truth
from tf_tree_py.core.geometry import so3

from .chain import chain_between, Edge, Tree, Ways
from .observations import Array, CalibrationError, Limits, Mask, Observations


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
            made[where, where] = screws.left_jacobian_many(step[where])
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


# --- residuals and derivatives

_STENCIL_NS = 10_000_000
"""Half the time between the two lookups of the derivative by the time."""
_NANOSECONDS = 1e9


class Seen(NamedTuple):
    """Observations of one target by one sensor, and the lookups of the path between them."""

    observations: Observations
    ways: Ways


class Placed(NamedTuple):
    """
    Predicted observations, and the poses that their derivatives need.

    :ivar pose: ``sensor_T_target`` (N, 7).
    :ivar fixed_T_sensor: (N, 7)
    :ivar fixed_T_parents: the parent of each unknown edge on the path, (N, 7).
    :ivar fixed_T_stretches: the target frame of each stretch, (N, 7).
    """

    pose: Array
    fixed_T_sensor: Array
    fixed_T_parents: list[Array]
    fixed_T_stretches: list[Array]


class Model:
    """
    Predicts observations.

    :ivar unknowns: the unknowns of the estimate.
    :ivar tree_values: the values of edges and offsets in the tree, which has no places of targets.
    :ivar limits: what is known without calibration.
    :ivar scales: (Q,) the standard deviations of edges and offsets without calibration.
    :ivar seen: the sets of observations.
    :ivar reach: seconds by which stamps may be shifted; larger offsets are clipped to it.
    """

    def __init__(self, tree: Tree, edges: Sequence[Edge], sets: Sequence[Observations],
                 limits: Limits) -> None:
        """
        Find the path of each set of observations.

        :raises CalibrationError: the tree lacks a frame, or an edge lies on no path.
        """
        self._tree = tree
        self.reach = 0.0
        self._last: dict[int, tuple[State, Placed]] = {}
        chains = [chain_between(tree, each.fixed_in, each.sensor, edges) for each in sets]
        self.seen = [Seen(each, Ways(tree, chain, each.stamps))
                     for each, chain in zip(sets, chains, strict=True)]
        reached = {link.edge for chain in chains for link in chain.links}
        for number, (parent, child) in enumerate(edges):
            if number not in reached:
                raise CalibrationError(
                    f'the edge {parent} -> {child} does not lie between '
                    f'{sets[0].fixed_in!r}, where the target rests, and the sensor '
                    f'{sets[0].sensor!r}, so the observations do not depend on it')
        targets = {each.name: each.size for each in sets if each.place is None}
        self.unknowns = Unknowns(edges, list(dict.fromkeys(each.sensor for each in sets)),
                                 targets)
        self.tree_values = State(
            np.array([tree.lookup(*edge) for edge in edges], dtype=float),
            np.zeros(len(self.unknowns.sensors)), np.tile(se3.IDENTITY, (len(targets), 1)))
        self.limits = limits
        self.scales = np.array(([limits.known_m] * 3 + [limits.known_rad] * 3) * len(edges)
                               + [limits.known_s] * len(self.unknowns.sensors))

    def chosen(self, kept: Sequence[Mask], reach: float) -> 'Model':
        """
        Return a model of some of the observations, with the same unknowns.

        :param kept: of each set, which observations to keep.
        :param reach: seconds by which the stamps may be shifted.
        """
        made = copy(self)
        made.reach, made.seen, made._last = reach, [], {}
        for (each, ways), mask in zip(self.seen, kept, strict=True):
            fewer = replace(each, stamps=each.stamps[mask], seen=each.seen[mask], covariances=(
                None if each.covariances is None else each.covariances[mask]))
            made.seen.append(Seen(fewer, Ways(self._tree, ways.chain, fewer.stamps)))
        return made

    def origin(self, near: State) -> State:
        """Return the state of the step zero: the values of the tree, and the places of a state."""
        return self.tree_values._replace(places=near.places)

    def __len__(self) -> int:
        """Return how many observations there are."""
        return sum(len(each.observations) for each in self.seen)

    __bool__ = no_truth

    def moves(self, frame: str) -> bool:
        """Return whether an edge between a frame and the root of the tree moves."""
        above = {edge.child: edge for edge in self._tree.edges()}
        passed = set[str]()
        while frame in above and frame not in passed:
            passed.add(frame)
            if not above[frame].static:
                return True
            frame = above[frame].parent
        return False

    def shift(self, number: int, state: State) -> int:
        """Return the time offset of a set in nanoseconds."""
        sensor = self.seen[number].observations.sensor
        offset = float(state.offsets[self.unknowns.sensors.index(sensor)])
        return round(min(max(offset, -self.reach), self.reach) * _NANOSECONDS)

    def residuals(self, state: State) -> list[Array]:
        """Return the residuals of each set, (N, p)."""
        return [self.residual(number, self.placed(number, state))
                for number in range(len(self.seen))]

    def residual(self, number: int, placed: Placed) -> Array:
        """Return the residuals of one set, (N, p)."""
        each = self.seen[number].observations
        if each.size == 3:
            return np.asarray(each.seen - placed.pose[:, :3])
        return between_many(placed.pose, each.seen)

    def placed(self, number: int, state: State) -> Placed:
        """Return the prediction for one set; the last one is cached for its derivatives."""
        if number not in self._last or self._last[number][0] is not state:
            self._last[number] = state, self._placed(number, state, 0)
        return self._last[number][1]

    def _placed(self, number: int, state: State, later: int) -> Placed:
        """Return the prediction for one set at stamps that are later by some nanoseconds."""
        each, ways = self.seen[number]
        stretches = ways.at(self.shift(number, state) - later)
        begin = np.broadcast_to(np.array(se3.IDENTITY), stretches[0].shape)
        here, parents, begins = stretches[0], list[Array](), [begin]
        for link, stretch in zip(ways.chain.links, stretches[1:], strict=True):
            edge = state.edges[link.edge][None]
            after = se3.compose_many(here, se3.inverse_many(edge) if link.upwards else edge)
            parents.append(after if link.upwards else here)
            begins.append(after)
            here = se3.compose_many(after, stretch)
        place = self._place(each, state)
        pose = se3.compose_many(se3.inverse_many(here), place)
        return Placed(pose, here, parents, begins)

    def _place(self, each: Observations, state: State) -> Array:
        if each.place is None:
            return np.asarray(state.places[self.unknowns.targets.index(each.name)])
        return each.place if len(each.place) == 7 else np.array([*each.place, 0, 0, 0, 1.0])

    def derivatives(self, number: int, state: State, moving: Mask | None = None) -> Array:
        """
        Return the derivatives of the residuals of one set by a step, (N, p, P).

        They are taken at a step of zero from the state.

        :param moving: (P,) which columns are needed; the others are zero. None: all. The
            column of the offset takes two more lookups.
        """
        each, ways = self.seen[number]
        moving = np.ones(self.unknowns.size, dtype=bool) if moving is None else moving
        placed = self.placed(number, state)
        moved = np.zeros((len(each), 6, self.unknowns.size))
        for link, fixed_T_parent in zip(
                ways.chain.links, placed.fixed_T_parents, strict=True):
            sign, where = 1.0 if link.upwards else -1.0, self.unknowns.edge(link.edge)
            if moving[where].any():
                moved[:, :, where] += sign * by_rigid_motion(
                    placed, fixed_T_parent, state.edges[link.edge][:3])
        if moving[self.unknowns.offset(each.sensor)]:
            moved[:, :, self.unknowns.offset(each.sensor)] = -self.velocity(number, state)
        if each.place is None:
            where = self.unknowns.place(each.name)
            moved[:, :, where] = _by_place(placed)[:, :, :where.stop - where.start]
        return self._of_residuals(each, placed, moved)

    def by_place(self, number: int, state: State) -> Array:
        """Return the derivatives of the residuals by the place of their target, (N, p, p)."""
        each = self.seen[number].observations
        placed = self.placed(number, state)
        return self._of_residuals(each, placed, _by_place(placed)[:, :, :each.size])

    def _of_residuals(self, each: Observations, placed: Placed, moved: Array) -> Array:
        """Return the derivatives of residuals (N, p, K) from those of the pose, (N, 6, K)."""
        if each.size == 3:
            return -moved[:, :3]
        turn = between_many(placed.pose, each.seen)[:, 3:]
        moved[:, 3:] = np.linalg.inv(screws.left_jacobian_many(-turn)) @ moved[:, 3:]
        return -moved

    def velocity(self, number: int, state: State) -> Array:
        """Return the velocity of the target past the sensor, (N, 6): m/s and rad/s."""
        here = self.placed(number, state).pose
        ends, span = [], np.zeros(len(here))
        for later in (-_STENCIL_NS, _STENCIL_NS):
            end = self._placed(number, state, later).pose
            known = np.isfinite(end).all(axis=1)  # not at the ends of the recording
            ends.append(np.where(known[:, None], end, here))
            span += known * _STENCIL_NS
        return between_many(*ends) * (_NANOSECONDS / np.maximum(span, 1.0))[:, None]


def as_poses(seen: Array) -> Array:
    """Return poses (N, 7) of poses or points (N, 3); the rotation of a point has no meaning."""
    if seen.shape[1] == 7:
        return seen
    return np.concatenate([seen, np.tile((0.0, 0.0, 0.0, 1.0), (len(seen), 1))], axis=1)


def by_rigid_motion(placed: Placed, fixed_T_body: Array, centre: Array) -> Array:
    """
    Return the motion of the target past the sensor by steps in a body's axes, (N, 6, 6).

    :param fixed_T_body: (N, 7) the axes of the steps.
    :param centre: (3,) or (N, 3) the centre of the rotation, in these axes.
    """
    sensor_R_body = _matrices(placed.fixed_T_sensor).transpose(0, 2, 1) @ _matrices(fixed_T_body)
    fixed_T_target = se3.compose_many(placed.fixed_T_sensor, placed.pose)
    target = se3.compose_many(se3.inverse_many(fixed_T_body), fixed_T_target)[:, :3]
    return _rigid(sensor_R_body, target - centre)


def _rigid(a_R_b: Array, lever: Array) -> Array:
    """Return the motion of points at lever arms (N, 3) by a step of their body, (N, 6, 6)."""
    made = np.zeros((len(a_R_b), 6, 6))
    made[:, :3, :3] = made[:, 3:, 3:] = a_R_b
    # dr x l = -[l] dr, and the columns of -[l] are the axes crossed with l.
    crossed = np.cross(np.eye(3)[None], lever[:, None, :]).transpose(0, 2, 1)
    made[:, :3, 3:] = a_R_b @ crossed
    return made


def _by_place(placed: Placed) -> Array:
    """Return the motion of the predicted poses by a step of the target's place, (N, 6, 6)."""
    made = np.zeros((len(placed.pose), 6, 6))
    made[:, :3, :3] = made[:, 3:, 3:] = _matrices(placed.fixed_T_sensor).transpose(0, 2, 1)
    return made


def _matrices(poses: Array) -> Array:
    return so3.as_matrix_many(poses[:, 3:])
