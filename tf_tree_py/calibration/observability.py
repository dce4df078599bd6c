# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Find the directions of the unknowns that the observations do not show, and describe them.

A direction is not observable if the observations determine it less precisely than it is known
without any calibration: a mounting to some centimetres, a clock to some hundredths of a second.
Such directions keep the value of the tree.
"""

from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from tf_tree_py.core.geometry import so3

from .model import Model, State, Unknowns
from .observations import Array, Mask

_AXES = 'xyz'
_MOSTLY = 0.9
_SOME = 0.35


@dataclass(frozen=True)
class Limits:
    """
    What counts as observable, and which time offsets are tried.

    :ivar known_m: the standard deviation to which a mounting is known without calibration,
        metres; directions that the observations determine less precisely are not estimated.
    :ivar known_rad: likewise for rotations, radians.
    :ivar known_s: likewise for time offsets, seconds.
    :ivar least_turn_rad: smaller rotations (root mean square) of the edge's parent do not
        count as showing a translation: they may be noise of the poses.
    :ivar max_offset_s: the largest time offset that is tried, seconds.
    """

    known_m: float = 0.1
    known_rad: float = 0.1
    known_s: float = 0.1
    least_turn_rad: float = math.radians(0.5)
    max_offset_s: float = 0.5

    def scales(self, unknowns: Unknowns) -> Array:
        """Return the standard deviations of edges and offsets without calibration, (Q,)."""
        edge = [self.known_m] * 3 + [self.known_rad] * 3
        return np.array(edge * len(unknowns.edges) + [self.known_s] * len(unknowns.sensors))


class Unobservable(NamedTuple):
    """
    A direction that the observations do not show.

    :ivar what: in words, such as 'the z of base -> camera'.
    :ivar remedy: the motion that would show it.
    :ivar parent: the parent of the edge; '' for a time offset.
    :ivar child: the child of the edge, or the sensor of a time offset.
    :ivar kind: 'translation', 'rotation', 'both' or 'time'.
    :ivar axis: (3,) in the parent's axes; zeros for a time.
    """

    what: str
    remedy: str
    parent: str
    child: str
    kind: str
    axis: tuple[float, float, float]


def held_directions(model: Model, state: State, information: Array, free: Mask,
                    limits: Limits) -> Array:
    """
    Return the directions of edges and offsets that are not observable, (Q, H).

    They are orthonormal in units of the standard deviations without calibration.

    :param information: (P, P) the information matrix of all unknowns.
    :param free: (Q,) which numbers may be estimated at all.
    """
    unknowns = model.unknowns
    scales = limits.scales(unknowns)
    held = np.diag((~free).astype(float))[:, ~free]
    for number in range(len(unknowns.edges)):
        held = np.hstack([held, _still(model, state, number, limits)])
    basis = _orthonormal(held)
    rest = _complement(basis, len(scales))
    scaled = scales[:, None] * _schur(information, len(scales)) * scales
    values, vectors = np.linalg.eigh(rest.T @ scaled @ rest)
    return np.hstack([basis, rest @ vectors[:, values < 1.0]])


def free_basis(unknowns: Unknowns, held: Array, limits: Limits) -> Array:
    """Return a basis (P, F) of the steps that do not change the held directions."""
    count = unknowns.of_interest
    rest = _complement(held, count)
    places = unknowns.size - count
    basis = np.zeros((unknowns.size, rest.shape[1] + places))
    basis[:count, :rest.shape[1]] = limits.scales(unknowns)[:, None] * rest
    basis[count:, rest.shape[1]:] = np.eye(places)
    return basis


def at_the_tree(unknowns: Unknowns, tree: State, state: State, held: Array,
                limits: Limits) -> State:
    """Return a state with the tree's values along the held directions."""
    count, scales = unknowns.of_interest, limits.scales(unknowns)
    step = unknowns.step_to(tree, state)
    rest = _complement(held, count)
    step[:count] = scales * (rest @ (rest.T @ (step[:count] / scales)))
    return unknowns.moved(tree, step)


def covariance_of(unknowns: Unknowns, information: Array, held: Array, limits: Limits) -> Array:
    """Return the covariance (Q, Q) of edges and offsets; held directions get their ``Limits``."""
    count, scales = unknowns.of_interest, limits.scales(unknowns)
    basis = free_basis(unknowns, held, limits)
    within = np.linalg.pinv(basis.T @ information @ basis, hermitian=True)
    return np.asarray((basis @ within @ basis.T)[:count, :count]
                      + (scales[:, None] * (held @ held.T) * scales))


def _still(model: Model, state: State, number: int, limits: Limits) -> Array:
    """Return the translations (Q, H) of an edge that no rotation of its parent shows."""
    scatter, count = np.zeros((3, 3)), 0
    for index, (each, ways) in enumerate(model.seen):
        for place, link in enumerate(ways.chain.links):
            if link.edge == number and len(each):
                if each.place is not None:
                    return np.zeros((model.unknowns.of_interest, 0))
                turns = so3.as_matrix_many(
                    model.placed(index, state).fixed_T_parents[place][:, 3:])
                apart = turns - turns.mean(axis=0)
                scatter += np.einsum('nij,nik->jk', apart, apart)
                count += len(each)
    values, vectors = np.linalg.eigh(scatter / max(count, 1))
    still = vectors[:, values < limits.least_turn_rad ** 2]
    made = np.zeros((model.unknowns.of_interest, still.shape[1]))
    made[model.unknowns.edge(number)][:3] = still
    return made


def _schur(information: Array, count: int) -> Array:
    """Return the information of the first numbers, with the others unknown (Schur complement)."""
    inner = information[:count, count:]
    return np.asarray(information[:count, :count] - inner @ np.linalg.pinv(
        information[count:, count:], hermitian=True) @ inner.T)


def _orthonormal(columns: Array) -> Array:
    if not columns.shape[1]:
        return columns
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, values > 1e-9])


def _complement(basis: Array, count: int) -> Array:
    """Return an orthonormal basis of the orthogonal complement of an orthonormal basis."""
    left = np.linalg.svd(np.eye(count) - basis @ basis.T)[0]
    return np.asarray(left[:, :count - basis.shape[1]])


# --- in words

def described(unknowns: Unknowns, held: Array) -> list[Unobservable]:
    """Describe directions (Q, H) in words, along the axes of the parent where possible."""
    found, rest = list[Unobservable](), held @ held.T
    for place in range(unknowns.of_interest):
        if rest[place, place] > _MOSTLY:
            direction = rest[:, place] / math.sqrt(rest[place, place])
            direction /= np.linalg.norm(direction)
            rest = rest - np.outer(direction, direction)
            axis = np.zeros(unknowns.of_interest)
            axis[place] = 1.0
            found.append(_described(unknowns, axis))
    values, vectors = np.linalg.eigh(rest)
    found += [_described(unknowns, vectors[:, place]) for place in np.flatnonzero(values > 0.5)]
    return list(dict.fromkeys(found))


def _described(unknowns: Unknowns, direction: Array) -> Unobservable:
    part = int(np.argmax([np.linalg.norm(direction[unknowns.edge(number)])
                          for number in range(len(unknowns.edges))]))
    edge = direction[unknowns.edge(part)]
    times = direction[6 * len(unknowns.edges):unknowns.of_interest]
    sensor = unknowns.sensors[int(np.abs(times).argmax())]
    parent, child = unknowns.edges[part]
    moved, turned = np.linalg.norm(edge[:3]), np.linalg.norm(edge[3:])
    if np.abs(times).max() > _MOSTLY:
        return Unobservable(
            f'the time of {sensor}', 'move faster: a time offset shows only while the '
            'target moves past the sensor', '', sensor, 'time', (0.0, 0.0, 0.0))
    axis = edge[:3] if moved >= turned else edge[3:]
    axis = axis / np.linalg.norm(axis) * np.sign(axis[np.abs(axis).argmax()])
    name = _axis_name(axis, parent)
    if np.abs(times).max() > _SOME:
        return Unobservable(
            f'{name} of {parent} -> {child} apart from the time of {sensor}',
            'vary the speed, and drive backwards too: at one constant speed, a late stamp and '
            'a shifted mounting look the same', parent, child, 'both', tuple(axis.tolist()))
    if moved >= turned:
        return Unobservable(
            f'the translation along {name} of {parent} -> {child}',
            f'turn {parent} about an axis that is not {name}: only a rotation shows '
            'the lever arm', parent, child, 'translation', tuple(axis.tolist()))
    return Unobservable(
        f'the rotation about {name} of {parent} -> {child}',
        f'turn {parent} about two axes that are not parallel, or move it across {name}',
        parent, child, 'rotation', tuple(axis.tolist()))


def _axis_name(axis: Array, parent: str) -> str:
    place = int(np.abs(axis).argmax())
    if abs(axis[place]) > 0.98:
        return f'{_AXES[place]}'
    return '(' + ', '.join(f'{value:.2f}' for value in axis) + ')'
