# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The errors of predictions, and their stated uncertainty."""

from lab_reports import report_of, rows_of
import pytest


def test_prediction_beats_the_newest_pose_and_its_error_is_quadratic():
    rows = rows_of('prediction')
    acceleration = report_of('prediction').numbers['acceleration']
    for row in rows:
        ahead = row['ahead_s']
        assert row['latest_m'] == pytest.approx(1.09 * ahead, rel=0.05)
        assert row['predicted_m'] < row['latest_m'] / 6.0
        law = acceleration * ahead * (ahead + 0.1) / 2.0
        assert row['predicted_m'] == pytest.approx(law, rel=0.05)


def test_covariance_knows_it():
    """It also covers a brake of half a second, so it is wider than the errors of the slalom."""
    for row in rows_of('prediction'):
        assert 0.25 < row['predicted_m'] / row['claimed_m'] < 1.0
        assert row['inside'] >= 0.95


def test_first_brake_of_half_a_second_is_covered():
    assert max(row['off_m'] / row['claimed_m'] for row in rows_of('prediction', 1)) < 2.2


def test_robots_are_covered_unless_they_do_it_for_the_first_time():
    for row in rows_of('prediction', 2):
        if row['name'].endswith('first time') and '0.5 s' not in row['name']:
            continue
        # A swing leaves the region of 68 % for half of the time.
        assert row['in_95'] > 0.86 and row['in_68'] > 0.5, row
        if row['name'].endswith(('limit given', '0.5 s, for the first time')):
            assert row['in_event'] > 0.95
        # Without noise, these two have no errors to which to compare.
        if row['noise'] or row['name'] not in ('drives in a circle', 'stands'):
            assert 0.95 < row['wider'] < 5.0, row


def test_first_start_and_first_turn_are_covered_only_with_a_limit():
    rows = {(row['name'], row['noise']): row['in_event'] for row in rows_of('prediction', 2)}
    assert rows['starts, for the first time', 0.0] < 0.6 < 0.99 < rows['starts, limit given', 0.0]
    assert rows['turns, for the first time', 0.0] < 0.6 < 0.95 < rows['turns, limit given', 0.0]
    assert rows['brakes within 0.25 s, for the first time', 0.0] < 0.85
    assert rows['brakes within 0.25 s, limit given', 0.0] > 0.99


def test_beyond_the_horizon_there_is_no_answer():
    assert 'beyond the horizon of the prediction, 500 ms' in report_of('prediction').remarks[0]
