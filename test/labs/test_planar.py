# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of a planar tree on a slope: h sin(tilt)."""

from math import cos, degrees, radians, sin

from lab_reports import report_of, rows_of
import pytest


def test_error_on_the_floor_is_h_sin_of_the_tilt_about_either_axis():
    rows = rows_of('planar')
    assert {(row['height_m'], round(degrees(row['tilt_rad']))) for row in rows} == {
        (height, tilt) for height in (0.3, 1.0, 2.0) for tilt in range(6)}
    for row in rows:
        law = row['height_m'] * sin(row['tilt_rad'])
        assert row['pitch_error_m'] == pytest.approx(law, abs=1e-12)
        assert row['roll_error_m'] == pytest.approx(law, abs=1e-12)


def test_numbers_of_the_text():
    numbers = report_of('planar').numbers
    assert round(numbers['error_0.3m_5deg_m'], 3) == 0.026
    assert round(numbers['error_1m_5deg_m'], 3) == 0.087
    assert numbers['slope'] == pytest.approx(1.0, rel=1e-9)


def test_residual_reports_the_tilt_that_was_dropped():
    for row in rows_of('planar'):
        assert row['residual_tilt_rad'] == pytest.approx(row['tilt_rad'], abs=1e-12)


def test_tilt_of_roll_and_pitch_together():
    # The z axis of Ry(pitch) Rx(roll) has the height cos(pitch) cos(roll).
    tilt = report_of('planar').numbers['tilt_of_roll_3_pitch_4_rad']
    assert cos(tilt) == pytest.approx(cos(radians(3.0)) * cos(radians(4.0)), abs=1e-12)


def test_ahead_the_height_is_lost_and_above_the_place():
    ahead, beside, above, _ = rows_of('planar', 1)
    assert ahead['up_m'] == pytest.approx(2.0 * sin(radians(5.0)))
    assert ahead['floor_m'] == pytest.approx(2.0 * (1.0 - cos(radians(5.0))))
    assert beside['up_m'] == pytest.approx(0.0, abs=1e-12)
    assert (above['floor_m'], above['up_m']) == (
        pytest.approx(ahead['up_m']), pytest.approx(ahead['floor_m']))
