# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The forklift's camera: each fault is identified, with its share."""

from math import radians

from lab_reports import report_of, rows_of
import pytest


def test_each_fault_is_named():
    verdicts = {row['wrong']: row['verdict'] for row in rows_of('calibrate') if 'wrong' in row}
    assert verdicts == {
        'nothing': 'nothing', 'the mounting': 'edge', 'the stamps': 'time',
        'both': 'edge and time', 'both, never turning': 'edge and time'}


def test_offset_and_angle_are_found():
    numbers = report_of('calibrate').numbers
    assert abs(numbers['offset_s'] - 0.08) < 3.0 * numbers['offset_sigma_s'] < 0.003
    assert numbers['turned_rad'] == pytest.approx(radians(1.0), abs=radians(0.08))


def test_both_faults_have_their_share_and_together_explain_all():
    numbers = report_of('calibrate').numbers
    assert numbers['nothing_m'] > numbers['edge_m'] > numbers['time_m'] > 0.01
    assert numbers['edge_and_time_m'] < 0.006


def test_height_is_unobservable_and_so_is_translation_without_a_turn():
    hidden = {row['wrong']: row['hidden'] for row in rows_of('calibrate') if 'wrong' in row}
    assert hidden.pop('both, never turning') == 'x, y, z'
    assert set(hidden.values()) == {'z'}


def test_calibrated_edge_has_no_share_of_the_budget():
    numbers = report_of('calibrate').numbers
    assert numbers['share_before'] > 0.9 and numbers['share_after'] < 0.01
