# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The covariances of predictions have the size of the errors: the robots of the oracle."""

from pathlib import Path

from benchmark.oracle.ahead import covered, RATES_HZ, Setting
from benchmark.oracle.movers import MOVERS, NOISE, sampled
import numpy as np
import pytest


@pytest.mark.parametrize('rate_hz', [10, 50])
@pytest.mark.parametrize('robot', MOVERS)
def test_regions_contain_what_they_say(robot, rate_hz):
    """Three drives are too few to distinguish 0.95 from 0.92: the bounds are wide."""
    found = np.concatenate([covered(Setting(robot, rate_hz, 1.0), seed) for seed in range(3)], 1)
    in_68, in_95 = found.mean(axis=1).T
    assert (in_95 > 0.78).all() and in_95.mean() > 0.89
    assert in_68.mean() > 0.62


@pytest.mark.parametrize('robot', MOVERS)
def test_robots_without_noise_are_covered_too(robot):
    found = np.concatenate([covered(Setting(robot, 50, 0.0), seed) for seed in range(3)], 1)
    assert found.mean(axis=1)[:, 1].min() > 0.78


@pytest.mark.parametrize('robot', MOVERS)
def test_samples_are_off_by_their_noise_at_trembling_stamps(robot):
    truth = MOVERS[robot](np.random.default_rng(1), 6.0)
    samples = sampled(truth, 100.0, 1.0, np.random.default_rng(2))
    assert 500 < len(samples.numbers) < 580 and len(set(np.diff(samples.numbers))) > 3
    true = truth[samples.numbers]
    off = np.concatenate([samples.poses.positions - true.positions, (
        samples.poses.rotations * true.rotations.inv()).as_rotvec()], axis=1)
    np.testing.assert_allclose(off.std(axis=0), NOISE, rtol=0.15)
    # It moves, and neither jumps nor runs away.
    steps = truth.steps()
    assert 0.0 < np.abs(steps.positions).max() + steps.rotations.magnitude().max() < 0.01


def test_page_has_the_rows_of_the_command():
    page = (Path(__file__).parents[3] / 'docs' / 'oracle.md').read_text()
    table = page.partition('<!-- predictions: begin -->')[2].partition('<!-- predictions: end -->')
    rows = [tuple(each.strip() for each in line.split('|')[1:3])
            for line in table[0].splitlines() if line.startswith('| ')][2:]
    assert rows == [(f'{robot}{more}', str(rate)) for robot in MOVERS
                    for more in ('', ', no noise') for rate in RATES_HZ]
