# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Over many scenes, errors match their covariance, and verdicts are correct.

The thorough profile of hypothesis uses 200 drives and the whole grid; an ordinary run uses some
of them.
"""

import itertools

from calibration_scenes import EDGE, errors, scene
from hypothesis import settings
import numpy as np
from scipy.stats import chi2
from tf_tree_py.calibration import calibrate, Limits, Verdict

NEAR = Limits(max_offset_s=0.2)
DRIVES = settings().max_examples
EACH = min(200 // DRIVES | 1, 3)
"""Which points of the grid: with an odd step, all values of each axis take part."""
VERDICTS = {(False, False): Verdict.NOTHING, (True, False): Verdict.EDGE,
            (False, True): Verdict.TIME, (True, True): Verdict.BOTH}


def bounds(freedom):
    """Return the bounds of a sum of squares of normal numbers in 99 of 100 cases."""
    return chi2.ppf([0.005, 0.995], freedom)


def test_errors_are_as_large_as_their_covariance_says():
    edges, times = 0.0, 0.0
    for seed in range(DRIVES):
        given = scene(seed, 100, duration_s=8.0, noise_m=0.004, noise_rad=0.001)
        found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
        error = errors(found.edge.after, given.true)
        edges += error @ np.linalg.solve(found.edge.covariance, error)
        times += ((found.time_offset_s - 0.08) / found.time_offset_sigma_s) ** 2
    for total, freedom in ((edges, 6 * DRIVES), (times, DRIVES)):
        least, greatest = bounds(freedom)
        assert least < total < greatest, (edges / 6 / DRIVES, times / DRIVES)


def test_verdict_is_right_over_a_grid():
    grid = enumerate(itertools.product((0.0, 1.0), (0.0, 0.03, 0.08), (0.0, 0.3, 1.0),
                                       (0.001, 0.005), (False, True)))
    wrong, count = [], 0
    for seed, (turned, late, speed, noise, planar) in itertools.islice(grid, 0, None, EACH):
        given = scene(1000 + seed, 80, turned_deg=turned, offset_s=late, speed=speed,
                      noise_m=noise, noise_rad=noise, planar=planar)
        found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
        right = VERDICTS[turned > 0.0, late > 0.0] if speed else Verdict.UNKNOWN
        count += 1
        if found.verdict is not right:
            wrong.append((turned, late, speed, noise, planar, str(found.verdict)))
    assert len(wrong) <= 0.05 * count, wrong
