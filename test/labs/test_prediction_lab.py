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
    for row in rows_of('prediction'):
        assert 0.8 < row['predicted_m'] / row['claimed_m'] < 1.2
        assert row['inside'] >= 0.9


def test_first_brake_is_more_than_it_knows_of():
    assert max(row['off_m'] / row['claimed_m'] for row in rows_of('prediction', 1)) > 4.0


def test_beyond_the_horizon_there_is_no_answer():
    assert 'beyond the horizon of the prediction, 500 ms' in report_of('prediction').remarks[0]
