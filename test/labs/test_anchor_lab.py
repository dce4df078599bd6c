# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What a late relocaliser does to the place of a robot, published in four ways."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.labs.anchor import LIMITS, SIGMA_M, STEP


def test_naive_is_wrong_by_what_the_robot_goes_meanwhile_and_jumps():
    _, naive, _, _ = rows_of('anchor')
    assert naive['median_m'] == pytest.approx(0.2, abs=0.1)  # 0.7 m/s for 300 ms
    assert naive['step_m'] > 1.0


def test_old_stamp_alone_is_right_but_for_the_outliers():
    _, _, old, ours = rows_of('anchor')
    assert old['median_m'] == pytest.approx(ours['median_m'], rel=0.3)
    assert old['step_m'] > 1.0


def test_anchor_is_as_good_as_the_relocaliser_and_never_jumps():
    ours, numbers = rows_of('anchor')[3], report_of('anchor').numbers
    assert ours['median_m'] < 2.0 * SIGMA_M and ours['worst_m'] < 0.06
    added = ours['step_m'] - numbers['own_step_m']
    # It turns about where the robot was; since then that has gone on a bit.
    assert added < 1.2 * LIMITS.max_speed * as_seconds(STEP)
    assert numbers['refused'] < 10
