# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Robust least squares over some of the unknowns."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from .model import by_rigid_motion, Model, State
from .observations import Array, Mask
from .spread import (
    first_spread,
    floored,
    loss,
    Scatter,
    scatter,
    weight,
    whitening,
)

_ROUNDS = 12
_SETTLED = 0.1
_STEPS = 30
_ROUGHLY, _EXACTLY = 1e-3, 1e-8
_AT_BOUND = 0.98
"""From this fraction of the largest offset on, an estimate counts as at the bound."""
_ROUGH = np.repeat([0.01, 0.01], 3) ** 2


class Fit(NamedTuple):
    """
    A fit of the unknowns.

    :ivar state: the values of the unknowns.
    :ivar covariances: of the observations of each set, (N, p, p).
    :ivar residuals: of each set, (N, p).
    :ivar distances: the squared Mahalanobis distances of each set, (N,).
    :ivar jitters_s: the standard deviation of the stamps of each set, seconds.
    """

    state: State
    covariances: list[Array]
    residuals: list[Array]
    distances: list[Array]
    jitters_s: tuple[float, ...] = ()

    @property
    def sizes(self) -> Array:
        """Return the size of the residual of each observation, (N,)."""
        return np.concatenate([np.full(len(each), float(each.shape[1]))
                               for each in self.residuals])

    @property
    def cost(self) -> float:
        """Return minus twice the log of the likelihood, up to a constant of the covariances."""
        return float(loss(np.concatenate(self.distances), self.sizes).sum())


def fitted(model: Model, begin: State, steps: Array, covariances: list[Array],
           accuracy: float) -> Fit:
    """
    Return the fit with given covariances.

    :param begin: where the search begins, as near as the steps allow.
    :param steps: (P, F) a basis of the steps from the values of the tree that the fit may take;
        so what they leave alone has exactly these values.
    :param covariances: of the observations of each set, (N, p, p).
    :param accuracy: the relative change of the cost at which the search ends.
    """
    white = [whitening(each) for each in covariances]
    state = model.origin(begin)
    if steps.shape[1]:
        problem = _Problem(model, begin, steps, white)
        found = least_squares(
            problem.residuals, np.ones(steps.shape[1]), problem.derivatives,
            x_scale='jac', loss=problem.loss, max_nfev=_STEPS,
            tr_solver='lsmr' if steps.shape[1] > 1 else 'exact',  # lsmr fails with one unknown
            ftol=accuracy, xtol=1e-9, gtol=1e-10)
        state = problem.state(found.x)
        state = state._replace(offsets=np.clip(state.offsets, -model.reach, model.reach))
    residuals = model.residuals(state)
    return Fit(state, covariances, residuals,
               [_distances(*pair) for pair in zip(white, residuals, strict=True)])


def roughly(model: Model, begin: State, steps: Array) -> Fit:
    """Return a fit with an assumed spread of centimetres, to choose where to begin."""
    covariances = [np.tile(np.diag(_ROUGH[:each.size]), (len(each), 1, 1))
                   for each, _ in model.seen]
    return fitted(model, begin, steps, covariances, _ROUGHLY)


def settled(model: Model, begin: State, steps: Array) -> Fit:
    """
    Return the fit with the spread of the observations.

    Both are estimated in turns until the spread no longer changes.
    """
    known = known_covariances(model, begin)
    velocities = [model.velocity(number, begin)[:, :each.size]
                  for number, (each, _) in enumerate(model.seen)]
    residuals = model.residuals(begin)
    covariances = [
        base if given is not None else base + first_spread(each)
        for given, base, each in zip(_given(model), known, residuals, strict=True)]
    if not any(given is None for given in _given(model)):
        covariances = _scaled(covariances, residuals)
    fit = fitted(model, begin, steps, covariances, _ROUGHLY)
    found = [Scatter(each) for each in covariances]
    for _ in range(_ROUNDS):
        found = _scatters(model, fit, known, velocities, steps.shape[1], found)
        before, covariances = covariances, [each.covariances for each in found]
        begin = fit.state
        if _same(before, covariances):
            break
        fit = fitted(model, begin, steps, covariances, _ROUGHLY)
    return fitted(model, begin, steps, covariances, _EXACTLY)._replace(
        jitters_s=tuple(each.jitter_s for each in found))


def _given(model: Model) -> list[Array | None]:
    return [each.observations.covariances for each in model.seen]


def _scaled(covariances: list[Array], residuals: list[Array]) -> list[Array]:
    """Return larger covariances for a start whose residuals are not yet noise alone."""
    made = []
    for covariance, each in zip(covariances, residuals, strict=True):
        distance = _distances(whitening(covariance), each)
        made.append(covariance * max(1.0, float(np.median(distance)) / each.shape[1]))
    return made


def _scatters(model: Model, fit: Fit, known: list[Array], velocities: list[Array],
              free: int, before: list[Scatter]) -> list[Scatter]:
    """Return the spread of each set that its residuals show."""
    numbers = fit.sizes.sum()
    freedom = max((numbers - free) / numbers, 0.05)
    return [
        Scatter(base) if given is not None else
        scatter(residuals, distances, freedom, base, velocity, last)
        for given, base, residuals, distances, velocity, last in zip(
            _given(model), known, fit.residuals, fit.distances, velocities,
            before, strict=True)]


def _same(before: list[Array], after: list[Array]) -> bool:
    return all(np.abs(np.log(np.einsum('nii->ni', new) / np.einsum('nii->ni', old))).max()
               < _SETTLED for old, new in zip(before, after, strict=True) if len(old))


def known_covariances(model: Model, state: State) -> list[Array]:
    """Return the known covariances of each set, those of messages and of the tree, (N, p, p)."""
    made = []
    for number, (each, ways) in enumerate(model.seen):
        known = np.zeros((len(each), 6, 6))
        placed = model.placed(number, state)
        shift = model.shift(number, state)
        for stretch, covariances in ways.covariances(shift):
            turned = by_rigid_motion(placed, placed.fixed_T_stretches[stretch],
                                     ways.at(shift)[stretch][:, :3])
            known += turned @ covariances @ turned.transpose(0, 2, 1)
        known = known[:, :each.size, :each.size]
        if each.covariances is not None:
            known = known + floored(each.covariances)
        made.append(known)
    return made


def _distances(white: Array, residuals: Array) -> Array:
    scaled = np.einsum('nij,nj->ni', white, residuals)
    return np.asarray(np.einsum('ni,ni->n', scaled, scaled))


class _Problem:
    """
    The callbacks of ``least_squares``: residuals, derivatives and the loss.

    The search begins at ones, and the coordinates of the step are those of its begin plus the
    difference from ones. The first trust region of ``least_squares`` is then about as large as
    ``Limits``. A search from zeros would begin with one standard deviation of one observation,
    and spend ten rounds on doubling it.
    """

    def __init__(self, model: Model, begin: State, steps: Array, white: list[Array]) -> None:
        self._model, self._white = model, white
        self._origin, self._basis = model.origin(begin), steps
        self._begin = np.linalg.lstsq(
            steps, model.unknowns.step_to(self._origin, begin), rcond=None)[0]
        self._last: tuple[Array, State] | None = None
        self._moving = steps.any(axis=1)
        sizes = [np.full(len(each), each.shape[1]) for each in white]
        self._sizes = np.concatenate(sizes)
        self._owner = np.repeat(np.arange(len(self._sizes)), self._sizes)

    def residuals(self, x: Array) -> Array:
        state = self.state(x)
        return np.concatenate([
            np.einsum('nij,nj->ni', white, each).ravel() for white, each
            in zip(self._white, self._model.residuals(state), strict=True)])

    def derivatives(self, x: Array) -> Array:
        state = self.state(x)
        jacobian = _whitened_derivatives(self._model, state, self._white, self._moving)
        return jacobian @ self._turned(x)

    def state(self, x: Array) -> State:
        # Derivatives are needed where residuals were just computed: both share one prediction.
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), self._model.unknowns.moved(self._origin, self._step(x))
        return self._last[1]

    def _step(self, x: Array) -> Array:
        """Return the step from the origin, (P,)."""
        return np.asarray(self._basis @ (self._begin + x - 1.0))

    def _turned(self, x: Array) -> Array:
        """Return the basis as steps from the present state: Exp(r + dr) = Exp(J dr) Exp(r)."""
        return self._model.unknowns.about(self._step(x)) @ self._basis

    def loss(self, squares: Array) -> Array:
        """Return rho and its first and second derivative for the square of each number."""
        distance = np.bincount(self._owner, squares, len(self._sizes))
        size = self._sizes.astype(float)
        return np.stack([(loss(distance, size) / size)[self._owner],
                         weight(distance, size)[self._owner], np.zeros(len(squares))])


def _whitened_derivatives(model: Model, state: State, white: list[Array],
                          moving: Mask | None = None) -> Array:
    """
    Return the derivatives of all whitened residuals by a step, (M, P).

    :param moving: (P,) which columns are needed; None: all.
    """
    return np.concatenate([
        (scale @ model.derivatives(number, state, moving)).reshape(-1, model.unknowns.size)
        for number, scale in enumerate(white)])


def is_at_bound(offset: float, reach: float) -> bool:
    """Return whether a time offset is the largest that was tried: the true one may be larger."""
    return abs(offset) >= _AT_BOUND * reach > 0.0
