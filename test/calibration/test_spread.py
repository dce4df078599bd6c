# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The spread of residuals: their correlation time, and the jitter of the stamps."""

import numpy as np
import pytest
from scipy.signal import lfilter
from tf_tree_py.calibration.spread import correlation_time, Scatter, scatter


@pytest.fixture
def rng():
    """Return a generator of random numbers, the same ones for each test."""
    return np.random.default_rng(12)


@pytest.mark.parametrize('coefficient', [0.5, 0.8, 0.9])
def test_correlation_time_of_an_autoregressive_process(coefficient, rng):
    noise = rng.normal(size=(40, 2200))
    processes = lfilter([1.0], [1.0, -coefficient], noise)[:, 200:]
    mean = np.mean([correlation_time([each[:, None]]) for each in processes])
    assert mean == pytest.approx((1.0 + coefficient) / (1.0 - coefficient), rel=0.2)


def test_independent_residuals_have_no_correlation_time(rng):
    assert [correlation_time([rng.normal(size=(count, 6))]) for count in (3, 20, 300)] == [1.0] * 3


@pytest.mark.parametrize('count', [100, 1000])
def test_jitter_is_told_from_the_spread_of_the_sensor(count, rng):
    velocity = rng.normal(size=(count, 6))
    sensor = np.array([0.001, 0.002, 0.003, 0.001, 0.001, 0.002])
    steady = sensor * rng.normal(size=(count, 6))
    jittering = steady + 0.005 * rng.normal(size=(count, 1)) * velocity
    nothing, found = (_scatter(each, velocity) for each in (steady, jittering))
    assert nothing.jitter_s == 0.0 and found.jitter_s == pytest.approx(0.005, rel=0.2)
    alone = found.covariances - found.jitter_s ** 2 * np.einsum('ni,nj->nij', velocity, velocity)
    np.testing.assert_allclose(np.sqrt(np.diag(alone.mean(axis=0))), sensor, rtol=0.35)


def test_target_at_rest_shows_no_jitter(rng):
    residuals = 0.001 * rng.normal(size=(50, 6))
    assert _scatter(residuals, np.zeros((50, 6))).jitter_s == 0.0


def _scatter(residuals, velocity):
    count = len(residuals)
    found = Scatter(np.tile(np.cov(residuals.T), (count, 1, 1)))
    for _ in range(4):
        distances = np.einsum('ni,nij,nj->n', residuals, np.linalg.inv(found.covariances),
                              residuals)
        found = scatter(residuals, distances, 1.0, np.zeros((count, 6, 6)), velocity, found)
    return found
