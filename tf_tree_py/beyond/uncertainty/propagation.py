# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The propagation of the errors of a path's edges.

In the convention of ``covariances``, an edge's error is one small rigid motion of
everything behind the edge, expressed in the target. So each edge has its own share of the
result, and to first order the result is the sum of the shares. For large angles it is not; the
result is then the second moment of draws about the looked-up pose, which need not be their
mean.

Up to a limit of the angles, that moment is computed by a cubature that is exact to fourth
order, like Barfoot and Furgale's formulas ("Associating Uncertainty with Three-Dimensional
Poses", IEEE T-RO 30(3), 2014, section III), but with the exact composition; beyond the limit by
draws.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
import itertools
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Indices, Mask
from tf_tree_py.core.tree.path import Step
from tf_tree_py.core.tree.tree import Tree

from .covariance_rows import carried, Rows
from .covariances import rows_of, unpack

# The limit for the sum of the variances of all angles, radians^2. The error of the cubature grows
# with the sixth power of the angle: at 5 degrees it is 2e-5 of the variance, and the error of
# 4,096 draws is 4e-4. At the limit the two differ by half a percent, the error of the draws.
_OF_CUBATURE = np.radians(15.0) ** 2
# The number of points grows with the square of the number of edges: with more edges, there are
# fewer draws than points.
_MOST_EDGES = 10

# The number of pairs of draws: variances are accurate to one percent for large angles.
_PAIRS = 2048
_SEED = 6


def with_large_angles(axes: Array, places: Array, covariances: Array, upwards: Sequence[bool],
                      point: Array) -> Array:
    """
    Return the covariance (6, 6) of a pose behind several errors.

    The errors are in order from the frame of the result to the point.

    :param axes: (E, 3, 3) from the axes of each error to those of the result.
    :param places: (E, 3) the origin of each error's child in the frame of the result.
    :param covariances: (E, 6, 6)
    :param upwards: for each edge, whether the path goes from the child to the parent.
    :param point: (3,) the point that the errors move.
    """
    whole = _doubled(axes)
    turned = whole @ covariances @ whole.swapaxes(1, 2)
    angles = float(np.einsum('eii->', turned[:, 3:, 3:]))
    ways = np.array(upwards, dtype=bool)
    if angles <= _OF_CUBATURE and len(axes) <= _MOST_EDGES:
        return by_cubature(places, turned, ways, point)
    return by_draws(places, turned, ways, point)


def with_shared_errors(ways: Sequence[tuple[Array, Array, Sequence[bool], Array]]) -> Array:
    """
    Return the covariance (6 n, 6 n) of n poses behind shared errors, by draws.

    :param ways: for each pose the places (E, 3), the roots (E, 6, D) of the errors in the axes of
        the result, the directions and the point; see ``with_large_angles``. An error is its root
        times D independent unit errors, which all poses share.
    """
    draws = exact_draws(ways[0][1].shape[-1])
    errors = np.concatenate([_moved(places, roots @ draws, np.array(upwards, dtype=bool), point)
                             for places, roots, upwards, point in ways])
    return np.asarray(errors @ errors.T / draws.shape[-1])


def _doubled(axes: Array) -> Array:
    """Return (E, 6, 6) with the axes (E, 3, 3) twice on the diagonal."""
    whole = np.zeros((len(axes), 6, 6))
    whole[:, :3, :3] = whole[:, 3:, 3:] = axes
    return whole


def by_cubature(places: Array, covariances: Array, upwards: Mask, point: Array) -> Array:
    """
    Return the covariance from points for the rotations, and formulas for the translations.

    The error of a translation is the sum of its regression on the error of the rotation, and an
    independent rest. Other errors only rotate the rest.
    """
    points, chosen, weights = cubature(len(places))
    values, vectors = np.linalg.eigh(covariances[:, 3:, 3:])
    sizes = np.sqrt(np.maximum(values, 0.0))
    least = 1e-8 * sizes[:, -1:] + 1e-300
    roots = vectors * sizes[:, None, :]
    # C_tr root^-T: the translation per unit of the rotation's root.
    slopes = covariances[:, :3, 3:] @ vectors * np.where(
        sizes > least, 1.0 / np.maximum(sizes, least), 0.0)[:, None, :]
    both = np.concatenate([slopes, roots], axis=1) @ points
    errors = _moved(places, both, upwards, point, chosen)
    covariance = (errors * weights) @ errors.T
    rest = covariances[:, :3, :3] - slopes @ slopes.swapaxes(1, 2)
    covariance[:3, :3] += _rotated(rest, covariances[:, 3:, 3:], upwards).sum(axis=0)
    return np.asarray(covariance)


def _rotated(rest: Array, rotations: Array, upwards: Mask) -> Array:
    """
    Return the mean of Q S Q^T for rests S (E, 3, 3), to fourth order in the errors.

    Q is the rotation by all errors between the result and the edge of S; including that of the
    edge if the path goes upwards there. With A the covariance of the rotation a,
    E([a][a]) = A - tr(A) I, and
    E([a] S [a]^T) = (tr A tr S - tr AS) I - tr(A) S - tr(S) A + AS + SA.
    """
    before = np.cumsum(rotations, axis=0)
    before[~upwards] -= rotations[~upwards]
    product = before @ rest
    both = product + product.swapaxes(1, 2)
    trace, of_rest, of_product = (np.einsum('eii->e', one)[:, None, None]
                                  for one in (before, rest, product))
    eye = np.eye(3)
    turned = (trace * of_rest - of_product) * eye - trace * rest - of_rest * before + both
    return np.asarray(rest + turned + 0.5 * both - trace * rest)


def by_draws(places: Array, covariances: Array, upwards: Mask, point: Array) -> Array:
    """
    Return the second moment of 4,096 fixed draws, in pairs of opposite ones.

    Their mean and covariance are exact: so the result equals the first-order formula for small
    errors, and is also valid for large angles.
    """
    draws = exact_draws(6 * len(places))
    values, vectors = np.linalg.eigh(covariances)
    roots = (vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]) @ vectors.swapaxes(1, 2)
    errors = _moved(places, roots @ draws.reshape(-1, 6, draws.shape[-1]), upwards, point)
    return np.asarray(errors @ errors.T / draws.shape[-1])


def _moved(places: Array, errors: Array, upwards: Mask, point: Array,
           chosen: Indices | None = None) -> Array:
    """
    Return how far errors move and rotate a point, by the exact composition.

    :param errors: (E, 6, L) of each edge, in the axes of the result.
    :param chosen: (E, K) the index of each edge's error in each case; None: K is L, and each case
        has its own errors.
    :return: (6, K)
    """
    signs = np.where(upwards, -1.0, 1.0)[:, None]
    turns = np.array(so3.exp_columns(*(signs * errors[:, 3 + axis] for axis in range(3))))
    matrices = np.array(so3.as_matrix(tuple(turns)))
    moved = point[:, None]
    turned: tuple[Any, ...] = ()
    for number in reversed(range(len(places))):
        turn, matrix, shift = (
            part if chosen is None else part.take(chosen[number], axis=-1)
            for part in (turns[:, number], matrices[:, :, number], errors[number, :3]))
        place = places[number, :, None]
        if upwards[number]:
            moved = np.einsum('ijk,jk->ik', matrix, moved - place - shift) + place
        else:
            moved = np.einsum('ijk,jk->ik', matrix, moved - place) + (place + shift)
        turned = so3.multiply(tuple(turn), turned) if turned else tuple(turn)
    vectors = np.stack(so3.log_columns(*turned))
    return np.concatenate([moved - point[:, None], vectors])


@lru_cache(maxsize=16)
def cubature(edges: int) -> tuple[Array, Indices, Array]:
    """
    Return a formula for normal deviates, three of each edge, that is exact to the fifth degree.

    McNamee, Stenger, "Construction of fully symmetric numerical integration formulas",
    Numerische Mathematik 10, 1967: the origin, one deviate at +-sqrt(3), and two at +-sqrt(3).
    The deviates of one edge have only 19 different values.

    :return: the values (3, 19), for each edge and point the index of one of them (E, K), and the
        weights (K,) of the points.
    """
    count = 3 * edges
    parts = np.array(list(_signs(count))).reshape(-1, edges, 3)
    values, chosen = np.unique(parts.reshape(-1, 3), axis=0, return_inverse=True)
    touched = np.count_nonzero(parts, axis=(1, 2))
    weights = np.choose(touched, [1.0 + (count * count - 7.0 * count) / 18.0,
                                  (4.0 - count) / 18.0, 1.0 / 36.0])
    return (np.ascontiguousarray(np.sqrt(3.0) * values.T),
            np.ascontiguousarray(chosen.reshape(-1, edges).T), weights)


def _signs(count: int) -> Iterator[tuple[int, ...]]:
    """Yield all points with at most two coordinates of 1 or -1, and 0 elsewhere."""
    yield (0,) * count
    for size in (1, 2):
        for places in itertools.combinations(range(count), size):
            for signs in itertools.product((-1, 1), repeat=size):
                point = [0] * count
                for place, sign in zip(places, signs, strict=True):
                    point[place] = sign
                yield tuple(point)


@lru_cache(maxsize=8)
def exact_draws(count: int) -> Array:
    """Return draws (count, 4096 or more) with the mean 0 and the covariance I, exactly."""
    half = np.random.default_rng(_SEED).normal(size=(max(_PAIRS, 2 * count), count))
    values, vectors = np.linalg.eigh(half.T @ half / len(half))
    half = half @ (vectors / np.sqrt(values)) @ vectors.T
    return np.ascontiguousarray(np.concatenate([half, -half]).T)


# --- along a path

# Up to this sum of the variances of the angles, radians^2, the first order is exact to 0.1 %.
SMALL_ANGLES = np.radians(1.0) ** 2


class Errors(NamedTuple):
    """
    The errors of E edges at N stamps, expressed in the target, as rows (E, N).

    If nothing moves, there is one stamp for all.

    :ivar steps: the edges, from the target to the source.
    :ivar axes: nine rows, the matrices from the parents' axes to the target's.
    :ivar places: three rows, the children's origins in the target, metres.
    :ivar covariances: 21 rows, in the parents' axes, about the children's origins.
    """

    steps: list[Step]
    axes: Rows
    places: Rows
    covariances: Rows

    def shares(self, points: Array) -> Rows:
        """Return the share of each edge at points (N, 3) behind all edges, 21 rows."""
        lever = tuple(point - place for point, place in zip(points.T, self.places, strict=True))
        return carried(self.axes, lever, self.covariances)

    def at(self, number: int) -> tuple[Array, Array, Array]:
        """Return the axes (E, 3, 3), the places and the covariances (E, 6, 6) at one stamp."""
        axes, places, covariances = (
            np.stack([row[:, number if row.shape[1] > 1 else 0] for row in rows], axis=-1)
            for rows in (self.axes, self.places, self.covariances))
        return axes.reshape(-1, 3, 3), places, unpack(covariances)


def is_certain(tree: Tree) -> bool:
    """Return whether no edge has more than its samples, such as a covariance or a correction."""
    return not tree.companions


def steps_between(tree: Tree, target: str, source: str, stamp: int | None) -> list[Step]:
    """
    Return the edges from the target to the source.

    :param stamp: nanoseconds; None: use the newest samples.
    """
    branches = tree.paths.branches(target, source, stamp)
    up = len(branches.target.edges)
    return [Step(parent, history, number < up)
            for number, (parent, history) in enumerate(reversed(branches.links()))]


def placed(steps: Sequence[Step], poses: Iterable[Array],
           covariances: Sequence[Array | None]) -> Errors | None:
    """
    Return the errors of the uncertain edges; None if all are certain.

    :param poses: ``parent_T_child`` of each edge, (N, 7), or (1, 7) for all stamps.
    :param covariances: of each edge, (21, N), or None.
    """
    known: list[tuple[Step, Array, Array, Array]] = []
    here = np.array([se3.IDENTITY])
    for step, pose, covariance in zip(steps, poses, covariances, strict=True):
        before = here
        here = se3.compose_many(*np.broadcast_arrays(
            before, se3.inverse_many(pose) if step.upwards else pose))
        if covariance is not None:
            parent, child = (here, before) if step.upwards else (before, here)
            known.append((step, covariance, parent, child))
    if not known:
        return None
    edges, each, parents, children = zip(*known, strict=True)
    x, y, z, w = _rows(parents)[3:]
    first, second, third = so3.as_matrix((x, y, z, w))
    return Errors(list(edges), (*first, *second, *third), _rows(children)[:3],
                  tuple(np.stack(each, axis=1)))


def _rows(poses: Sequence[Array]) -> Rows:
    """Return poses of each edge, (N, 7) or (1, 7), as seven rows (E, N)."""
    return rows_of(np.stack(np.broadcast_arrays(*poses)))


def total(errors: Errors | None, points: Array) -> Array:
    """
    Return the covariances (N, 6, 6) of points (N, 3) behind independent errors.

    Each is the sum of the shares; for large angles it is computed by points or draws.
    """
    if errors is None:
        return np.zeros((len(points), 6, 6))
    covariances = unpack(np.stack([row.sum(axis=0) for row in errors.shares(points)], axis=-1))
    # The sum of the three variances is invariant under rotations.
    angles = np.einsum('nii->n', covariances[:, 3:, 3:])
    for number in np.flatnonzero(angles > SMALL_ANGLES).tolist():
        covariances[number] = with_large_angles(
            *errors.at(number), [step.upwards for step in errors.steps], points[number])
    return covariances
