# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The effect of a late relocaliser on the position of a robot, published in four ways."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.labs.anchor import LIMITS, SIGMA_M, STEP


def test_naive_is_wrong_by_what_the_robot_goes_meanwhile_and_jumps():
    _, naive, *_ = rows_of('anchor')
    assert naive['median_m'] == pytest.approx(0.2, abs=0.1)  # 0.7 m/s for 300 ms
    assert naive['step_m'] > 1.0


def test_old_stamp_alone_is_right_but_for_the_outliers():
    _, _, old, ours, _ = rows_of('anchor')
    assert old['median_m'] == pytest.approx(ours['median_m'], rel=0.3)
    assert old['step_m'] > 1.0


def test_anchor_is_as_good_as_the_relocaliser_and_never_jumps():
    ours, numbers = rows_of('anchor')[3], report_of('anchor').numbers
    assert ours['median_m'] < 2.0 * SIGMA_M and ours['worst_m'] < 0.06
    added = ours['step_m'] - numbers['own_step_m']
    # It rotates about the robot's position at the stamp; the robot has since moved a little.
    assert added < 1.2 * LIMITS.max_speed * as_seconds(STEP)
    assert numbers['refused'] < 10


def test_anchor_at_thirty_hertz_is_better_and_no_faster():
    *_, ours, often = rows_of('anchor')
    assert often['median_m'] < ours['median_m'] and often['worst_m'] < 0.05
    added = often['step_m'] - report_of('anchor').numbers['own_step_m']
    assert added < 1.2 * LIMITS.max_speed * as_seconds(STEP)
