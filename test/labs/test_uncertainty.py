# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A degree compared with a centimetre, and the shares of the edges."""

from math import radians, sqrt

from lab_reports import report_of, rows_of
import numpy as np
import pytest
from tf_tree_py.labs.uncertainty import robot


def test_angle_grows_with_the_distance_and_a_shift_does_not():
    for row in rows_of('uncertainty'):
        assert row['by_angle_m'] == pytest.approx(row['distance_m'] * radians(1.0), rel=1e-3)
        assert row['drawn_m'] == pytest.approx(row['by_angle_m'], rel=0.02)
        assert row['by_shift_m'] == pytest.approx(0.01)
    numbers = report_of('uncertainty').numbers
    assert numbers['by_angle_m'] == pytest.approx(0.087, abs=5e-4)
    assert numbers['equal_at_m'] == pytest.approx(0.573, abs=1e-3)


def test_shares_are_all_of_it_and_the_mounting_is_the_largest():
    rows = rows_of('uncertainty', 1)
    assert [row['edge'] for row in rows][:2] == ['head -> camera', 'map -> odom']
    assert sum(row['position'] for row in rows) == pytest.approx(1.0)
    assert sum(row['rotation'] for row in rows) == pytest.approx(1.0)
    _, covariance = robot().lookup_uncertain('map', 'thing')
    whole = sqrt(sum(row['sigma_m'] ** 2 for row in rows))
    assert whole == pytest.approx(sqrt(np.trace(covariance[:3, :3])), rel=0.01)


def test_what_is_above_the_frame_that_asks_drops_out():
    sigmas = [row['sigma_m'] for row in rows_of('uncertainty', 2)]
    assert sigmas == sorted(sigmas, reverse=True) and sigmas[-1] == 0.0
