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

"""Who fails at startup: whose timeout is shorter than the transform takes to come."""

from lab_reports import rows_of
import pytest
from tf_tree_py.core import BufferCore, LATEST, TransformException
from tf_tree_py.labs.startup import (
    CHILD,
    measure,
    PARENT,
    POSE,
    recorded,
    report,
    Start,
    start,
    STARTS,
    TIMEOUTS_S,
)


def test_fifty_starts_were_recorded():
    assert len(recorded()) == STARTS == 50


def test_nobody_has_an_answer_before_the_transform_came():
    assert all(row['median_s'] > 0.150 and row['worst_s'] > 0.5 for row in rows_of('startup'))


@pytest.mark.parametrize('arrival_s', [0.0, 0.05])
def test_whoever_waits_has_the_answer_when_it_came_and_not_before(arrival_s):
    for timeout_s, one in start(arrival_s).items():
        assert one.success_s >= arrival_s
        # Each lookup that failed has waited for as long as it may.
        assert one.success_s >= one.failed * timeout_s


def test_who_has_no_answer_yet_asks_again_until_there_is_one():
    """The transform comes when those that may wait for 0.1 s have failed once."""
    buffer = BufferCore()

    def ask(timeout_s):
        try:
            buffer.lookup_within(timeout_s, PARENT, CHILD)
        except TransformException:
            if timeout_s == 0.1:
                buffer.insert(PARENT, CHILD, LATEST, POSE, static=True)
            raise

    outcome = measure(ask, lambda: None)
    assert outcome[0.1].failed == 1 and outcome[0.1].success_s >= 0.1


def test_what_is_there_from_the_start_is_answered_without_a_timeout():
    buffer = BufferCore()
    outcome = measure(
        lambda timeout_s: buffer.lookup_within(timeout_s, PARENT, CHILD),
        lambda: buffer.insert(PARENT, CHILD, LATEST, POSE, static=True))
    assert {one.failed for one in outcome.values()} == {0}


def test_report_counts_the_starts_whose_first_lookup_failed():
    """Without a clock: one lookup fails wherever the transform takes longer than the timeout."""
    starts = [{timeout_s: Start(int(arrival_s > timeout_s), arrival_s)
               for timeout_s in TIMEOUTS_S} for arrival_s in recorded()]
    numbers = report(starts, 'Made up.').numbers
    assert numbers['first_failed'] == {'0.0': 50, '0.1': 50, '0.5': 8, '1.0': 0}
    assert numbers['failed_lookups'] == numbers['first_failed']
    assert (numbers['starts'], numbers['came_worst_s']) == (50, 0.628)
