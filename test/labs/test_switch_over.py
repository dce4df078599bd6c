# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The effect of a switch between two odometries on a planner."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.labs.switch_over import MAX_SPEED


def test_one_message_is_a_jump_and_a_switch_is_none():
    _, at_once, ours = rows_of('switch-over')
    assert at_once['step_m'] > 0.3 and ours['step_m'] < 0.02
    assert 0.9 * MAX_SPEED < report_of('switch-over').numbers['added_mps'] <= MAX_SPEED + 1e-9


def test_both_end_at_the_same_place_and_the_wheels_elsewhere():
    wheels, at_once, ours = rows_of('switch-over')
    assert ours['drift_m'] == pytest.approx(at_once['drift_m'])
    assert wheels['drift_m'] > 3.0 * ours['drift_m']


def test_rule_notices_the_slip_within_a_second():
    assert 0.0 < report_of('switch-over').numbers['noticed_s'] < 1.0
