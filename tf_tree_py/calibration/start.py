# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The starts of the search: the edge of the tree, and a closed form in case that edge is far off.

The closed form solves A X = Y B for absolute poses (Shah, "Solving the Robot-World/Hand-Eye
Calibration Problem Using the Kronecker Product", J. Mechanisms Robotics 5(3), 2013). It is
computed from random draws of a few observations. The draw with the least median of squares
wins, so that outliers have no effect.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation
from tf_tree_py.core import se3
from tf_tree_py.core.geometry import so3

from .model import as_poses, between_many, Model, Placed, State
from .observations import Array

_DRAWS, _OF = 40, 5
_MOST = 150
_SEED = 25
_NEAR_M, _NEAR_RAD = 0.01, 0.01
_RANK = 1e-3


def starts(few: Model, offsets: Sequence[float]) -> list[State]:
    """
    Return the starts, the best first: one with the tree's edges, one with closed forms.

    :param few: a model of some observations.
    :param offsets: seconds; each is tried for all sensors.
    """
    tree = few.tree_values
    found: list[list[tuple[float, State]]] = [[], []]
    for offset in offsets:
        begin = _with_places(few, tree._replace(offsets=np.full(len(tree.offsets), offset)))
        found[0].append((_cost(few, begin), begin))
        closed = begin
        for number in range(len(tree.edges)):
            closed = _with_edge(few, closed, number)
        found[1].append((_cost(few, closed), closed))
    best = [min(each, key=lambda pair: pair[0]) for each in found if each]
    return [state for _, state in sorted(best, key=lambda pair: pair[0])]


def some_of(model: Model) -> Model:
    """Return a model of some observations, evenly from the first of each set to the last."""
    kept = []
    for each, _ in model.seen:
        mask = np.zeros(len(each), dtype=bool)
        if len(each):
            mask[np.linspace(0, len(each) - 1, min(len(each), _MOST)).astype(int)] = True
        kept.append(mask)
    return model.chosen(kept, model.reach)


def _cost(model: Model, state: State) -> float:
    """Return the cost of a state, in which large errors count little more than small ones."""
    return sum(float(np.log1p(_nominal(each)).sum()) for each in model.residuals(state))


def _nominal(residuals: Array) -> Array:
    """Return the squared norms (...,) of residuals (..., p), in units of 1 cm and 0.01 rad."""
    distance = (residuals[..., :3] ** 2).sum(axis=-1) / _NEAR_M ** 2
    return np.asarray(distance + (residuals[..., 3:] ** 2).sum(axis=-1) / _NEAR_RAD ** 2)


# --- the places of the targets

def _with_places(model: Model, state: State) -> State:
    """Return a state with the targets where most observations see them."""
    places = state.places.copy()
    for number, target in enumerate(model.unknowns.targets):
        seen = [
            se3.compose_many(model.placed(index, state).fixed_T_sensor, as_poses(each.seen))
            for index, (each, _) in enumerate(model.seen) if each.name == target and len(each)]
        if seen:
            places[number] = _where_most_are(np.concatenate(seen))
    return state._replace(places=places)


def _where_most_are(poses: Array) -> Array:
    """Return the pose of (N, 7) with the least median distance to the others."""
    tried = poses[_generator().permutation(len(poses))[:_DRAWS]]
    apart = between_many(np.repeat(tried, len(poses), axis=0), np.tile(poses, (len(tried), 1)))
    medians = np.median(_nominal(apart).reshape(len(tried), len(poses)), axis=1)
    return np.asarray(tried[int(medians.argmin())])


# --- an edge

def _with_edge(model: Model, state: State, number: int) -> State:
    """Return a state with one edge from a closed form; the others are unchanged."""
    sets = [index for index, (each, ways) in enumerate(model.seen)
            if any(link.edge == number for link in ways.chain.links) and len(each) >= 3]
    if not sets:
        return state
    index = max(sets, key=lambda index: len(model.seen[index].observations))
    edge = _edge_of(model, state, number, index)
    if edge is None:
        return state
    edges = state.edges.copy()
    edges[number] = edge
    return _with_places(model, state._replace(edges=edges))


def _edge_of(model: Model, state: State, number: int, index: int) -> Array | None:
    each, ways = model.seen[index]
    link = next(i for i, link in enumerate(ways.chain.links) if link.edge == number)
    upwards = ways.chain.links[link].upwards
    placed = model.placed(index, state)
    edge = state.edges[number]
    fixed_T_near, far_T_target = _around(placed, link, edge, upwards, as_poses(each.seen))
    guess = se3.inverse_many(edge) if upwards else edge
    if each.size == 3:
        if each.place is None:
            return None
        near_p = se3.inverse_many(fixed_T_near)
        solved = _by_points(far_T_target[:, :3], se3.apply_many(
            near_p, np.tile(each.place, (len(each), 1))))
    elif each.place is None:
        solved = _by_poses(fixed_T_near, se3.inverse_many(far_T_target), guess)
    else:
        solved = _where_most_are(se3.compose_many(
            se3.compose_many(se3.inverse_many(fixed_T_near), each.place),
            se3.inverse_many(far_T_target)))
    return se3.inverse_many(solved) if upwards else solved


def _around(placed: Placed, link: int, edge: Array, upwards: bool,
            seen: Array) -> tuple[Array, Array]:
    """Return the poses before an edge, and of the target seen from behind it, (N, 7)."""
    before = placed.fixed_T_parents[link]
    if upwards:
        before = se3.compose_many(before, edge)
    after = placed.fixed_T_stretches[link + 1]
    fixed_T_target = se3.compose_many(placed.fixed_T_sensor, seen)
    return before, se3.compose_many(se3.inverse_many(after), fixed_T_target)


def _by_points(far_p: Array, near_p: Array) -> Array:
    """Return near_T_far from points (N, 3) that are known in both, by Kabsch's formula."""
    generator, best, found = _generator(), np.inf, np.array(se3.IDENTITY)
    for _ in range(_DRAWS):
        drawn = generator.choice(len(far_p), min(_OF, len(far_p)), replace=False)
        turn, _ = Rotation.align_vectors(
            near_p[drawn] - near_p[drawn].mean(axis=0), far_p[drawn] - far_p[drawn].mean(axis=0))
        shift = near_p[drawn].mean(axis=0) - turn.apply(far_p[drawn].mean(axis=0))
        error = float(np.median(np.linalg.norm(turn.apply(far_p) + shift - near_p, axis=1)))
        if error < best:
            best, found = error, np.concatenate([shift, turn.as_quat()])
    return found


def _by_poses(a: Array, b: Array, guess: Array) -> Array:
    """Return X of A X = Y B, poses (N, 7), with the least median of squares."""
    generator, count = _generator(), len(a)
    of = min(_OF, count)
    drawn = np.argsort(generator.random((_DRAWS, count)), axis=1)[:, :of]
    R_a, R_b = (so3.as_matrix_many(each[:, 3:]) for each in (a, b))
    R_x, R_y = _rotations(R_a[drawn], R_b[drawn])
    rows = np.concatenate([R_a[drawn], np.tile(-np.eye(3), (_DRAWS, of, 1, 1))], axis=-1)
    right = np.einsum('dij,dnj->dni', R_y, b[drawn, :3]) - a[drawn, :3]
    right -= np.einsum('dnij,j->dni', R_a[drawn], guess[:3])
    # Where the draw does not determine the translation, it keeps the value of the tree.
    t = np.einsum('dij,dj->di', np.linalg.pinv(rows.reshape(_DRAWS, 3 * of, 6), rcond=_RANK),
                  right.reshape(_DRAWS, -1))
    t_x, t_y = t[:, :3] + guess[:3], t[:, 3:]
    apart = (np.einsum('nij,dj->dni', R_a, t_x) + a[None, :, :3]
             - np.einsum('dij,nj->dni', R_y, b[:, :3]) - t_y[:, None])
    alike = np.einsum('dnij,dnij->dn', R_a[None] @ R_x[:, None], R_y[:, None] @ R_b[None])
    angle = np.arccos(np.clip(0.5 * (alike - 1.0), -1.0, 1.0))
    medians = np.median((apart ** 2).sum(axis=-1) / _NEAR_M ** 2 + (angle / _NEAR_RAD) ** 2,
                        axis=1)
    best = int(medians.argmin())
    return np.concatenate([t_x[best], Rotation.from_matrix(R_x[best]).as_quat()])


def _rotations(R_a: Array, R_b: Array) -> tuple[Array, Array]:
    """Return the rotations of X and Y of draws (D, n, 3, 3), by equations 23 to 29 of Shah."""
    kronecker = np.einsum('dnik,dnjl->dijkl', R_b, R_a).reshape(-1, 9, 9)
    left, _, right = np.linalg.svd(kronecker)
    x = right[:, 0].reshape(-1, 3, 3).transpose(0, 2, 1)
    y = left[:, :, 0].reshape(-1, 3, 3).transpose(0, 2, 1)
    sign = np.where(np.linalg.det(x) < 0.0, -1.0, 1.0)[:, None, None]
    return _nearest_rotation(sign * x), _nearest_rotation(sign * y)


def _nearest_rotation(matrices: Array) -> Array:
    left, _, right = np.linalg.svd(matrices)
    flip = np.ones((len(matrices), 3))
    flip[:, 2] = np.linalg.det(left @ right)
    return np.asarray((left * flip[:, None, :]) @ right)


def _generator() -> np.random.Generator:
    return np.random.default_rng(_SEED)
