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

"""What going over from one odometry to another looks like to a planner."""

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
