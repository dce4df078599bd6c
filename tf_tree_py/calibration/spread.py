# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The spread of the observations about their predictions, and the weight of each observation.

The residuals of one observation belong together: a false detection is wrong in all of them. So
the loss is that of a multivariate Student t with few degrees of freedom, on the Mahalanobis
distance of the whole observation (Lange, Little and Taylor, "Robust Statistical Modeling Using
the t Distribution", JASA 84, 1989).

Part of the spread grows with speed: the jitter of the stamps. A stamp that is off by e moves the
residual by e times the velocity of the target past the sensor. So the covariance of a residual is
S + s^2 v v^T, with the covariance S of the sensor and the variance s^2 of the stamps. Without the
second term, the fast observations, which alone show the time offset, would count too much, and the
offset would look more precise than it is. Both are estimated in turns: S by expectation
maximization, with the errors of the stamps as the hidden numbers, and s^2 by Fisher scoring
(Harville, "Maximum Likelihood Approaches to Variance Component Estimation", JASA 72, 1977).
"""

from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from .observations import Array, Mask

_FREEDOM = 5.0
"""Degrees of freedom of the Student t."""

_PLENTY = 300
"""A set with this many observations gets a full covariance."""
_PRIOR = 5.0
"""The assumption that a sensor is equally good in all axes counts as so many observations."""
_FITTED = 2.0
"""A mounting and the place of a target, 12 numbers, use up this many observations."""
_FLOOR = 1e-3
"""The least deviation in any direction, relative to the mean deviation of metres or radians."""
_LEAST_M, _LEAST_RAD = 1e-5, 1e-5
"""No sensor is more precise; a smaller spread would only lose digits."""
_SIGNIFICANT = 3.5
"""Autocorrelations of independent numbers rarely reach this many standard deviations."""
_RATIO = 8.0
"""The prior ratio of one radian to one metre counts as this many residuals."""


def weight(distance: Array, size: Array | float) -> Array:
    """Return the weights of observations from their squared distances."""
    return np.asarray((_FREEDOM + size) / (_FREEDOM + distance))


def loss(distance: Array, size: Array | float) -> Array:
    """Return minus twice the logarithm of the density, up to a constant."""
    return np.asarray((_FREEDOM + size) * np.log1p(distance / _FREEDOM))


def bend(distance: Array, size: Array | float) -> Array:
    """Return minus twice the derivatives of the weights by the squared distances."""
    return np.asarray(2.0 * (_FREEDOM + size) / (_FREEDOM + distance) ** 2)


def inefficiency(distance: Array, size: Array) -> float:
    """
    Return the factor from the covariance of least squares to the covariance with this loss.

    It is E[w^2 d^2 / p] / E[w + 2 w' d^2 / p]^2, which also accounts for the true scale of the
    residuals: Maronna, "Robust M-Estimators of Multivariate Location and Scatter", Annals
    of Statistics 4(1), 1976; for regression Huber, "Robust Statistics", 7.6.
    """
    weights, numbers = weight(distance, size), size.sum()
    above = float((weights ** 2 * distance).sum() / numbers)
    below = float((size * weights - bend(distance, size) * distance).sum() / numbers)
    return above / max(below, 1e-3) ** 2


def floored(covariances: Array) -> Array:
    """Return covariances (N, p, p) plus the least spread of any sensor."""
    least = np.repeat([_LEAST_M, _LEAST_RAD], 3)[:covariances.shape[-1]]
    return covariances + np.diag(least ** 2)


def whitening(covariances: Array) -> Array:
    """Return L^-1 (..., p, p) of covariances L L^T."""
    return np.linalg.inv(np.linalg.cholesky(covariances))


def first_spread(residuals: Array) -> Array:
    """Return a rough covariance (p, p) from medians, which outliers do not affect."""
    size = residuals.shape[1]
    if not len(residuals):
        return np.eye(size)
    parts = [residuals[:, begin:begin + 3] for begin in range(0, size, 3)]
    least = (_LEAST_M, _LEAST_RAD)
    return np.diag(np.repeat([max(
        float(np.median(np.einsum('ni,ni->n', part, part))) / 2.366, floor ** 2)
        for part, floor in zip(parts, least, strict=False)], 3))


def spread(residuals: Array, weights: Array, freedom: float, known: Array) -> Array:
    """
    Return the covariance (p, p) of residuals that the known covariance does not explain.

    :param residuals: (N, p)
    :param weights: (N,) the weight of each observation.
    :param freedom: the fraction of the residuals that the fit leaves free, 0 to 1.
    :param known: (p, p) the mean of the known covariances.
    """
    count, size = residuals.shape
    if not count:
        return np.eye(size)
    found = (residuals.T * weights) @ residuals / (count * freedom)
    if count < _PLENTY:
        found = np.diag(_pooled(np.diag(found), count))
    found = found - known
    units = np.sqrt(np.repeat([_mean_variance(np.diag(found + known)[begin:begin + 3], least)
                               for begin, least in zip(range(0, size, 3), (_LEAST_M, _LEAST_RAD),
                                                       strict=False)], 3))
    values, vectors = np.linalg.eigh(found / np.outer(units, units))
    made = (vectors * np.maximum(values, _FLOOR ** 2)) @ vectors.T
    return np.asarray(made * np.outer(units, units))


def _mean_variance(variances: Array, least: float) -> float:
    return max(float(variances.mean()), least ** 2)


def _pooled(variances: Array, count: int) -> Array:
    """
    Return variances (p,) that are shrunk towards their mean, more with fewer observations.

    The variance of an axis is the mean of its own and that of all three, weighted by degrees of
    freedom (Smyth, "Linear Models and Empirical Bayes Methods for Assessing Differential
    Expression", Stat. Appl. Genet. Mol. Biol. 3(1), 2004). With very few observations, one
    radian counts as one metre.
    """
    made, freedom = variances.copy(), max(count - _FITTED, 0.0)
    share = freedom / (freedom + _PRIOR)
    for begin in range(0, len(made), 3):
        part = made[begin:begin + 3]
        made[begin:begin + 3] = share * part + (1.0 - share) * part.mean()
    if len(made) == 6:
        logs = np.log(np.maximum([made[:3].mean(), made[3:].mean()], 1e-18))
        share = 3.0 * count / (3.0 * count + _RATIO)
        shrunk = logs.mean() + share * (logs - logs.mean())
        made *= np.repeat(np.exp(shrunk - logs), 3)
    return made


def are_outliers(distance: Array, size: Array) -> Mask:
    """
    Return which observations (N,) are outliers.

    The scale of the squared distances comes from their median. One in ten thousand observations
    with normal errors counts as an outlier.
    """
    if not len(distance):
        return np.zeros(0, dtype=bool)
    scale = float(np.median(distance / chdtri(size, 0.5)))
    return np.asarray(distance > chdtri(size, 1e-4) * max(scale, 1e-12))


def correlation_time(residuals: Sequence[Array]) -> float:
    """
    Return how many successive observations carry as much information as one: 1 if independent.

    It is twice the sum of the autocorrelations minus one, over Geyer's initial monotone sequence
    ("Practical Markov Chain Monte Carlo", Statistical Science 7(4), 1992). The number of the
    observation with the longest time decides.

    :param residuals: of each set, whitened and weighted, in order of time.
    """
    return max((_correlation_time(column) for each in residuals for column in each.T),
               default=1.0)


def _correlation_time(values: Array) -> float:
    count, power = len(values), max(float(values @ values), 1e-300)

    def correlation(lag: int) -> float:
        return float(values[lag:] @ values[:count - lag]) / power

    if count < 2 or correlation(1) < _SIGNIFICANT / math.sqrt(count):
        return 1.0
    total, least = -1.0, math.inf
    for lag in range(0, count - 1, 2):
        least = min(least, correlation(lag) + correlation(lag + 1))
        if least <= 0.0:
            break
        total += 2.0 * least
    return max(total, 1.0)


# --- the jitter of stamps

_TURNS = 8
"""How often both are estimated before the next fit of the unknowns."""
_SIGNIFICANT_JITTER = 3.0
"""A smaller variance, in standard errors, may be chance: the stamps count as steady."""


class Scatter(NamedTuple):
    """
    The spread of the residuals of a set of observations.

    :ivar covariances: of each observation, (N, p, p).
    :ivar jitter_s: the standard deviation of the stamps, seconds; 0 if none is visible.
    """

    covariances: Array
    jitter_s: float = 0.0


def scatter(residuals: Array, distances: Array, freedom: float, known: Array,
            velocity: Array, before: Scatter) -> Scatter:
    """
    Return the spread of the residuals of a set of observations.

    :param residuals: (N, p)
    :param distances: (N,) their squared distances by the estimate so far.
    :param freedom: the fraction of the residuals that the fit leaves free, 0 to 1.
    :param known: (N, p, p) the known covariances.
    :param velocity: (N, p) of the target past the sensor, metres and radians a second.
    :param before: the estimate so far; the search goes on from its jitter, if it has any.
    """
    explained = known.sum(axis=0) / max(len(known), 1)
    steady = known + spread(residuals, weight(distances, residuals.shape[1]), freedom, explained)
    found, variance = (
        (before.covariances, before.jitter_s ** 2) if before.jitter_s else (steady, 0.0))
    for _ in range(_TURNS):
        weights, along, expected = _along(velocity, found, residuals)
        late, left = variance * along, variance - variance ** 2 * expected
        information = max(float(expected @ expected), 1e-300)
        score = float((weights * along ** 2 / freedom - expected).sum())
        variance = max(variance + score / information, 0.0)
        if variance <= _SIGNIFICANT_JITTER * math.sqrt(2.0 / information):
            return Scatter(steady)
        rest = (velocity.T * left) @ velocity / max(len(left), 1)
        found = known + variance * _squares(velocity) + spread(
            residuals - late[:, None] * velocity, weights, freedom, explained - rest)
    return Scatter(found, math.sqrt(variance))


def _along(velocity: Array, covariances: Array, residuals: Array) -> tuple[Array, Array, Array]:
    """
    Return what residuals r with the covariances C show of late stamps at the velocity v.

    :return: the weights of the observations, v^T C^-1 r, and v^T C^-1 v, which is the expectation
        of the square of the former; (N,) each.
    """
    inverse = np.linalg.inv(covariances)
    distances = np.einsum('ni,nij,nj->n', residuals, inverse, residuals)
    scaled = np.einsum('nij,nj->ni', inverse, velocity)
    return (weight(distances, residuals.shape[1]), np.einsum('ni,ni->n', scaled, residuals),
            np.einsum('ni,ni->n', scaled, velocity))


def _squares(velocity: Array) -> Array:
    return velocity[:, :, None] * velocity[:, None, :]
