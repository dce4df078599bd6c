# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error grows as speed times delay, and is zero with the stamp in the header."""

from math import hypot, sin

from lab_reports import report_of, rows_of
import pytest

SPEEDS = (0.25, 0.5, 1.0)


def test_every_speed_and_delay_of_the_text_is_in_the_table():
    assert {(row['speed'], row['delay_s']) for row in rows_of('latency')} == {
        (speed, delay) for speed in SPEEDS for delay in (0.0, 0.020, 0.050, 0.100)}


def test_error_is_speed_times_delay():
    for row in rows_of('latency'):
        assert row['asked_late_m'] == pytest.approx(row['speed'] * row['delay_s'], abs=1e-9)
        assert row['law_m'] == pytest.approx(row['speed'] * row['delay_s'])


def test_one_metre_a_second_for_fifty_milliseconds_is_five_centimetres():
    [row] = [row for row in rows_of('latency') if (row['speed'], row['delay_s']) == (1.0, 0.05)]
    assert row['asked_late_m'] == pytest.approx(0.05, rel=1e-6)


def test_fitted_slopes_are_the_speeds_within_a_percent():
    slopes = report_of('latency').numbers['slopes']
    assert slopes == {str(speed): pytest.approx(speed, rel=0.01) for speed in SPEEDS}


def test_with_the_stamp_of_the_header_the_error_collapses():
    rows = rows_of('latency') + rows_of('latency', 1)
    assert all(row['stamped_m'] < 1e-4 for row in rows)
    # On a curve, it is the interpolation error, and not zero.
    assert 0.0 < report_of('latency').numbers['worst_stamped_m'] < 1e-4


def test_latest_is_late_too_by_less_as_it_is_itself_old():
    for row in rows_of('latency'):
        if row['delay_s'] > 0.0:
            age = row['delay_s'] - row['latest_m'] / row['speed']
            assert 0.0 <= age < 0.010
    assert all(row['latest_m'] > 0.0 for row in rows_of('latency') if row['delay_s'] == 0.0)


def test_turning_error_is_the_chord():
    for row in rows_of('latency', 1):
        rate, delay = row['turn_rate'], row['delay_s']
        speed = hypot(0.5, rate * 1.0)
        chord = 2.0 * speed / rate * sin(0.5 * rate * delay) if rate else speed * delay
        assert row['chord_m'] == pytest.approx(chord)
        assert row['asked_late_m'] == pytest.approx(chord, abs=2e-5)
        assert row['tangent_m'] == pytest.approx(speed * delay)


def test_tangent_is_good_at_first_and_not_later():
    rows = {(row['turn_rate'], row['delay_s']): row for row in rows_of('latency', 1)}
    early, late = rows[2.0, 0.050], rows[2.0, 0.500]
    assert early['tangent_m'] == pytest.approx(early['asked_late_m'], rel=0.002)
    assert late['tangent_m'] > 1.04 * late['asked_late_m']


def test_asking_for_now_raises_where_the_latest_answers():
    numbers = report_of('latency').numbers
    assert numbers['now_raised'] == numbers['latest_answered'] == numbers['now_asked'] == 40
    assert 'into the future' in report_of('latency').remarks[0]
