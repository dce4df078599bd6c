# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The spread of the residuals, part of which grows with speed: the jitter of the stamps.

A stamp that is off by e moves the residual by e times the velocity of the target past the
sensor. So the covariance of a residual is S + s^2 v v^T, with the covariance S of the sensor
and the variance s^2 of the stamps. Without the second term, the fast observations, which alone
show the time offset, would count too much, and the offset would look more precise than it is.

Both are estimated in turns: S by expectation maximization, with the errors of the stamps as the
hidden numbers, and s^2 by Fisher scoring (Harville, "Maximum Likelihood Approaches to Variance
Component Estimation", JASA 72, 1977).
"""

import math
from typing import NamedTuple

import numpy as np

from .observations import Array
from .spread import spread, weight

_TURNS = 8
"""How often both are estimated before the next fit of the unknowns."""
_SIGNIFICANT = 3.0
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
        seen = _Seen.by(found, residuals, velocity)
        late, left = seen.stamp_errors(variance)
        variance = seen.scored(variance, freedom)
        if variance <= _SIGNIFICANT * seen.standard_error:
            return Scatter(steady)
        rest = (velocity.T * left) @ velocity / max(len(left), 1)
        found = known + variance * _squares(velocity) + spread(
            residuals - late[:, None] * velocity, seen.weights, freedom, explained - rest)
    return Scatter(found, math.sqrt(variance))


class _Seen(NamedTuple):
    """
    The residuals r along the velocity v, with the covariances C.

    :ivar weights: of the observations, (N,).
    :ivar along: v^T C^-1 r, (N,).
    :ivar expected: v^T C^-1 v, the expectation of the square of ``along``, (N,).
    """

    weights: Array
    along: Array
    expected: Array

    @classmethod
    def by(cls, covariances: Array, residuals: Array, velocity: Array) -> '_Seen':
        inverse = np.linalg.inv(covariances)
        distances = np.einsum('ni,nij,nj->n', residuals, inverse, residuals)
        scaled = np.einsum('nij,nj->ni', inverse, velocity)
        return cls(weight(distances, residuals.shape[1]),
                   np.einsum('ni,ni->n', scaled, residuals),
                   np.einsum('ni,ni->n', scaled, velocity))

    @property
    def information(self) -> float:
        return max(float(self.expected @ self.expected), 1e-300)

    @property
    def standard_error(self) -> float:
        return math.sqrt(2.0 / self.information)

    def scored(self, variance: float, freedom: float) -> float:
        """Return the next estimate of the variance of the stamps."""
        score = float((self.weights * self.along ** 2 / freedom - self.expected).sum())
        return max(variance + score / self.information, 0.0)

    def stamp_errors(self, variance: float) -> tuple[Array, Array]:
        """Return the expected error of each stamp, seconds, and the variance that is left."""
        return variance * self.along, variance - variance ** 2 * self.expected


def _squares(velocity: Array) -> Array:
    return velocity[:, :, None] * velocity[:, None, :]
