# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Find the directions of the unknowns that the observations do not show.

A direction is not observable if the observations determine it less precisely than it is known
without any calibration: a mounting to some centimetres, a clock to some hundredths of a second.

Such a direction often mixes several things: of two edges in a row, only the product shows. Then
the part that is held at the value of the tree is a *plain* direction: a translation or a rotation
of one edge, or one time. So a value that is kept is kept exactly, and the others make up for it.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from tf_tree_py.core.geometry import so3

from .model import Model, State, Unknowns
from .observations import Array, Mask

MOSTLY = 0.9
"""From this share of its square on, a direction counts as plain."""
_PREFERRED = 0.05
"""An edge is held rather than a later one, unless that has this much more share."""


class Held(NamedTuple):
    """
    The directions of edges and offsets that keep the values of the tree.

    Both arrays are in units of the standard deviations without calibration.

    :ivar plain: (Q, H) orthonormal: a translation or a rotation of one edge, or one time.
    :ivar hidden: (Q, H) of unit length: what the observations do not show, and for which the
        plain direction stands. The two differ where several things can make up for each other.
    """

    plain: Array
    hidden: Array

    @property
    def size(self) -> int:
        """Return H."""
        return int(self.plain.shape[1])


def fixed(free: Mask) -> Held:
    """Return the numbers (Q,) that are not free, as directions."""
    columns = np.diag((~free).astype(float))[:, ~free]
    return Held(columns, columns)


def held_directions(model: Model, state: State, information: Array, free: Mask) -> Held:
    """
    Return the directions of edges and offsets that are not observable.

    :param information: (P, P) the information matrix of all unknowns, at the state.
    :param free: (Q,) which numbers may be estimated at all.
    """
    unknowns = model.unknowns
    held = fixed(free).plain
    for number in range(len(unknowns.edges)):
        held = _extended(held, _still(model, state, number))
    rest = _complement(held)
    scaled = _scaled(model, state, information)
    values, vectors = np.linalg.eigh(rest.T @ scaled @ rest)
    plain, hidden = _plain(unknowns, rest @ vectors[:, values < 1.0], held)
    return Held(plain, np.hstack([held, hidden]))


def free_steps(model: Model, held: Held) -> Array:
    """Return a basis (P, F) of the steps from the tree that keep the held directions."""
    rest = _complement(held.plain)
    places = model.unknowns.size - model.unknowns.of_interest
    return np.asarray(block_diag(model.scales[:, None] * rest, np.eye(places)))


def covariance_of(model: Model, state: State, covariance: Array, held: Held) -> Array:
    """
    Return the covariance (Q, Q) of edges and offsets at a state.

    Held directions have the standard deviations of ``Limits``. What makes up for their errors
    """
    rest = _complement(held.plain)
    within, units = covariance[:rest.shape[1], :rest.shape[1]], _units(model, state)
    with_held = held.hidden @ np.linalg.inv(held.plain.T @ held.hidden)
    return np.asarray(units @ (rest @ within @ rest.T + with_held @ with_held.T) @ units.T)


def _still(model: Model, state: State, number: int) -> Array:
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
    still = vectors[:, values < model.limits.least_turn_rad ** 2]
    made = np.zeros((model.unknowns.of_interest, still.shape[1]))
    made[model.unknowns.edge(number)][:3] = still
    return made


def _schur(information: Array, count: int) -> Array:
    """Return the information of the first numbers, with the others unknown (Schur complement)."""
    inner = information[:count, count:]
    return np.asarray(information[:count, :count] - inner @ np.linalg.pinv(
        information[count:, count:], hermitian=True) @ inner.T)


def _units(model: Model, state: State) -> Array:
    """Return the matrix (Q, Q) from a step from the tree in ``Limits`` to one from a state."""
    count = model.unknowns.of_interest
    step = model.unknowns.step_to(model.origin(state), state)
    return np.asarray(model.unknowns.about(step)[:count, :count] * model.scales)


def _scaled(model: Model, state: State, information: Array) -> Array:
    """Return the information of edges and offsets (Q, Q), in units of ``Limits``."""
    count = model.unknowns.of_interest
    units = _units(model, state)
    return np.asarray(units.T @ _schur(information, count) @ units)


def _extended(basis: Array, columns: Array) -> Array:
    """Return an orthonormal basis with more columns, each of which stays plain."""
    for column in columns.T:
        rest = column - basis @ (basis.T @ column)
        if (length := np.linalg.norm(rest)) > 1e-4:
            basis = np.hstack([basis, rest[:, None] / length])
    return basis


def _complement(basis: Array) -> Array:
    """Return an orthonormal basis of the orthogonal complement of an orthonormal basis."""
    count = len(basis)
    left = np.linalg.svd(np.eye(count) - basis @ basis.T)[0]
    return np.asarray(left[:, :count - basis.shape[1]])


# --- plain directions

def _plain(unknowns: Unknowns, hidden: Array, held: Array) -> tuple[Array, Array]:
    """
    Return the plain directions for some hidden ones, after those that are held already.

    Each in turn has the largest share in the hidden directions. Those that are left are the
    hidden directions in which it does not change.

    :param hidden: (Q, K) orthonormal, and orthogonal to the held ones.
    :param held: (Q, H) plain, orthonormal.
    :return: (Q, H + K) and the hidden directions in their order, (Q, K).
    """
    found = np.zeros((len(hidden), 0))
    while hidden.shape[1]:
        direction = _largest(unknowns, hidden, held)
        held = np.hstack([held, direction[:, None]])
        share = hidden.T @ direction
        along = hidden @ share
        found = np.hstack([found, along[:, None] / np.linalg.norm(along)])
        hidden = hidden @ _complement(share[:, None] / np.linalg.norm(share))
    return held, found


def _largest(unknowns: Unknowns, hidden: Array, held: Array) -> Array:
    """
    Return the plain direction (Q,) with the largest share: along an axis, if possible.

    Where an edge and a time make up for each other, it is the edge.
    """
    every = np.eye(len(hidden))
    for place, shares in enumerate((hidden ** 2).sum(axis=1)):
        if shares > MOSTLY and not np.abs(held[place]).max(initial=0.0) > 1e-9:
            return np.asarray(every[place])
    best, share = every[0], -1.0
    for part in parts(unknowns):
        if part.start >= unknowns.times.start and share > _PREFERRED:
            break
        axes, lengths, _ = np.linalg.svd(hidden[part], full_matrices=False)
        if lengths[0] ** 2 > share + _PREFERRED:
            best, share = every[:, part] @ axes[:, 0], float(lengths[0]) ** 2
    return np.asarray(best)


def parts(unknowns: Unknowns) -> list[slice]:
    """Return the indices of each translation and rotation, and then of each time, in order."""
    begins = range(0, unknowns.times.start, 3)
    times = range(unknowns.times.start, unknowns.times.stop)
    return [*(slice(begin, begin + 3) for begin in begins),
            *(slice(begin, begin + 1) for begin in times)]
