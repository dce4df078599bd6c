# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The effect of a gyroscope between poses."""

from lab_reports import report_of, rows_of
import numpy as np
import pytest
from tf_tree_py.core.geometry import so3
from tf_tree_py.labs.gyro import true_poses, true_rates


def test_rates_are_the_derivative_of_the_rotations():
    stamps = np.arange(0, 2 * 10**9, 123_456_789)
    before, after = (true_poses(stamps + step)[:, 3:] for step in (-1000, 1000))
    turned = so3.log_many(so3.multiply_many(so3.conjugate_many(before), after)) / 2e-6
    np.testing.assert_allclose(turned, true_rates(stamps), atol=1e-4)


def test_error_of_slerp_grows_with_the_square_of_the_period():
    numbers = report_of('gyro').numbers
    assert numbers['alone_rad'] > 0.15 and numbers['aided_rad'] < 0.001
    rows = rows_of('gyro')
    assert rows[2]['alone_rad'] / rows[3]['alone_rad'] == pytest.approx(4.0, rel=0.1)
    assert all(row['aided_rad'] < 2e-4 for row in rows)


def test_bias_cancels_but_for_a_little():
    rows = rows_of('gyro', 1)
    assert [row['aided_rad'] for row in rows] == sorted(row['aided_rad'] for row in rows)
    # Without the poses, it would be 50 mrad after 50 ms for each rad/s.
    assert report_of('gyro').numbers['of_bias_s'] < 0.015


def test_short_gaps_are_bridged_and_long_ones_are_not():
    offs = {round(1e3 * row['gap_s']): row['off_rad'] for row in rows_of('gyro', 3)}
    assert offs[20] < 4e-4 and offs[30] < 1.5e-3
    assert list(offs.values()) == sorted(offs.values())
    assert offs[90] < 0.02 < 0.1 < offs[120]


def test_half_the_rate_of_the_gyroscope_is_four_times_the_error():
    rows = rows_of('gyro', 2)
    assert rows[0]['aided_rad'] / rows[1]['aided_rad'] == pytest.approx(4.0, rel=0.1)
