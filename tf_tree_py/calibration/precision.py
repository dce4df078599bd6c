# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The precision of a fit, also where the spread of the observations is not what the fit assumes.

A fit assumes one spread for all observations of a set. Real errors grow with the distance, are
those of the robot's own place turned about it, and a fifth of them are false detections. The
estimate remains good then, but its covariance is no longer the inverse of the curvature A of the
loss. It is A^-1 B A^-1, with the sum B of the squares of each observation's own gradient (Huber,
"The behavior of maximum likelihood estimates under nonstandard conditions", Proc. Fifth Berkeley
Symposium 1, 1967; White, Econometrica 48(4), 1980): a sandwich. Two corrections make it hold with
some hundred observations:

- A fit comes near to its observations. What remains of each is enlarged to what it would be if
  that one observation had no part in the fit (HC3: MacKinnon and White, Journal of Econometrics
  29, 1985).
- B is shrunk towards a multiple of A, the more the less the observations contradict that (Ledoit
  and Wolf, "A well-conditioned estimator for large-dimensional covariance matrices", Journal of
  Multivariate Analysis 88, 2004). With few observations, that is the usual covariance.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .model import Model
from .observations import Array
from .solve import Fit
from .spread import bend, correlation_time, inefficiency, weight, whitening

_LEAST_FREEDOM = 0.05
"""The least part of a residual that counts as left by the fit."""
_LEAST_CURVATURE = 0.1
"""The least curvature of the loss, relative to that of the weighted squares."""
_RANK = 1e-12


class Precision(NamedTuple):
    """
    The precision of a fit.

    The steps (F,) are those of the fit's basis, and then those of additional columns.

    :ivar information: (P, P) the information matrix of all unknowns if the spread is as assumed.
    :ivar correlation_time: how many successive observations carry as much information as one.
    :ivar curvature: (F, F) of the loss by the steps.
    :ivar covariance: (F, F) of the steps.
    :ivar onto: (F, P + D) from a step of all unknowns to the step of the fit that is nearest in
        its effect on the loss.
    :ivar newton: (F,) the step to where the loss would be least.
    """

    information: Array
    correlation_time: float
    curvature: Array
    covariance: Array
    onto: Array
    newton: Array

    @property
    def free(self) -> int:
        """Return how many directions were estimated."""
        return len(self.covariance)

    def likelihood_ratio(self, step: Array, cost: float) -> float:
        """
        Return minus twice the log of a likelihood ratio, from a difference of the loss.

        The loss is scaled such that it has the curvature of the covariance along the step
        (Chandler and Bate, "Inference for clustered data using the independence loglikelihood",
        Biometrika 94(1), 2007, "vertical" adjustment).

        :param step: (P + D,) from this fit to another one.
        :param cost: the loss of the other one minus that of this fit.
        """
        along = self.onto @ step
        by_loss = float(along @ self.curvature @ along)
        if by_loss <= 0.0:
            return cost / self.correlation_time
        inverse = np.linalg.pinv(self.covariance, hermitian=True)
        return cost * float(along @ inverse @ along) / by_loss


class _Rows(NamedTuple):
    """
    The observations of a set in units of their spread.

    :ivar slopes: (N, p, P + D) the derivatives of the residuals.
    :ivar left: (N, p) the residuals.
    :ivar weights: (N,)
    :ivar bends: (N,) see ``spread.bend``.
    """

    slopes: Array
    left: Array
    weights: Array
    bends: Array

    @property
    def weighted(self) -> Array:
        """Return the weighted residuals, (N, p)."""
        return np.asarray(self.left * self.weights[:, None])

    def gradients(self) -> Array:
        """Return the gradient of half the loss of each observation, (N, P + D)."""
        return np.asarray(np.einsum('nik,ni->nk', self.slopes, self.weighted))


def precision(model: Model, fit: Fit, steps: Array,
              more: Sequence[Array] | None = None) -> Precision:
    """
    Return the precision of a fit.

    :param steps: (P, F) a basis of the steps that the fit may take.
    :param more: derivatives of the residuals of each set by additional unknowns, (N, p, D).
    """
    rows = [_rows(model, fit, number, None if more is None else more[number])
            for number in range(len(model.seen))]
    time = correlation_time([each.weighted for each in rows])
    count = model.unknowns.size
    slopes = np.concatenate([each.slopes[:, :, :count].reshape(-1, count) for each in rows])
    factor = _factor(fit, steps.shape[1], time)
    turned = model.unknowns.about(
        model.unknowns.step_to(model.origin(fit.state), fit.state)) @ steps
    extra = rows[0].slopes.shape[2] - count
    basis = np.zeros((count + extra, steps.shape[1] + extra))
    basis[:count, :steps.shape[1]], basis[count:, steps.shape[1]:] = turned, np.eye(extra)
    return Precision(slopes.T @ slopes / factor, time, *_sandwich(rows, basis, time))


def _factor(fit: Fit, free: int, time: float) -> float:
    sizes = fit.sizes
    independent = sizes.sum() / time
    freedom = max((independent - free) / independent, _LEAST_FREEDOM)
    return max(inefficiency(np.concatenate(fit.distances), sizes) / freedom * time, 1e-18)


def _rows(model: Model, fit: Fit, number: int, more: Array | None) -> _Rows:
    scale = whitening(fit.covariances[number])
    slopes = model.derivatives(number, fit.state)
    if more is not None:
        slopes = np.concatenate([slopes, more], axis=2)
    distance, size = fit.distances[number], float(slopes.shape[1])
    return _Rows(scale @ slopes, np.einsum('nij,nj->ni', scale, fit.residuals[number]),
                 weight(distance, size), bend(distance, size))


def _sandwich(rows: Sequence[_Rows], basis: Array,
              time: float) -> tuple[Array, Array, Array, Array]:
    """Return curvature, covariance, ``onto`` and the step of Newton, as in ``Precision``."""
    squares = np.sum([_squares(each) for each in rows], axis=0)
    whole = squares - np.sum([_bent(each) for each in rows], axis=0)
    curvature, root = _curvature(basis.T @ whole @ basis, basis.T @ squares @ basis)
    inverse = root @ root.T
    own = np.concatenate([_without_itself(each, basis, inverse) for each in rows])
    gradient = np.concatenate([each.gradients() for each in rows]).sum(axis=0) @ basis
    return (curvature, time * root @ _shrunk(own @ root) @ root.T, inverse @ basis.T @ whole,
            -inverse @ gradient)


def _squares(each: _Rows) -> Array:
    """Return the curvature of the weighted squares, (P + D, P + D)."""
    flat = (each.slopes * np.sqrt(each.weights)[:, None, None]).reshape(-1, each.slopes.shape[2])
    return np.asarray(flat.T @ flat)


def _bent(each: _Rows) -> Array:
    """Return by how much less the loss is curved, because larger residuals weigh less."""
    along = np.einsum('nik,ni->nk', each.slopes, each.left)
    return np.asarray((along.T * each.bends) @ along)


def _curvature(found: Array, squares: Array) -> tuple[Array, Array]:
    """
    Return a curvature (F, F) of at least a part of that of the squares, and R (F, r).

    R R^T is the inverse of the curvature. With few observations and many outliers, the loss may
    be curved the other way.
    """
    units = 1.0 / np.sqrt(np.maximum(np.diag(squares), 1e-300))
    values, vectors = np.linalg.eigh(squares * np.outer(units, units))
    kept = values > _RANK * values.max(initial=0.0)
    white = units[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    values, vectors = np.linalg.eigh(white.T @ found @ white)
    values = np.maximum(values, _LEAST_CURVATURE)
    back = squares @ white @ vectors
    return np.asarray((back * values) @ back.T), np.asarray(white @ vectors / np.sqrt(values))


def _without_itself(each: _Rows, basis: Array, inverse: Array) -> Array:
    """Return the gradients (N, F) that the observations have if each is left out of the fit."""
    slopes = each.slopes @ basis
    share = slopes @ inverse @ slopes.transpose(0, 2, 1) * each.weights[:, None, None]
    values, vectors = np.linalg.eigh(share)
    freedom = np.maximum(1.0 - values, _LEAST_FREEDOM)
    left = np.einsum('nij,nj,nkj,nk->ni', vectors, 1.0 / freedom, vectors, each.weighted)
    return np.asarray(np.einsum('nik,ni->nk', slopes, left))


def _shrunk(numbers: Array) -> Array:
    """Return the sum of squares (F, F) of vectors (N, F), shrunk towards a multiple of one."""
    count, size = numbers.shape
    found = numbers.T @ numbers
    if not size:
        return found
    even = np.trace(found) / size * np.eye(size)
    apart = float(((found - even) ** 2).sum())
    chance = float(((numbers ** 2).sum(axis=1) ** 2).sum() - (found ** 2).sum() / count)
    share = min(max(chance, 0.0) / max(apart, 1e-300), 1.0)
    return np.asarray(share * even + (1.0 - share) * found)
