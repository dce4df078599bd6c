# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Failures at startup: of lookups whose timeout is shorter than the arrival of the transform."""

from lab_reports import rows_of
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import LATEST, TransformException
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
        # Each failed lookup has waited for its whole timeout.
        assert one.success_s >= one.failed * timeout_s


def test_who_has_no_answer_yet_asks_again_until_there_is_one():
    """The transform arrives after lookups with a timeout of 0.1 s have failed once."""
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
    """Without a clock: a lookup fails where the transform takes longer than the timeout."""
    starts = [{timeout_s: Start(int(arrival_s > timeout_s), arrival_s)
               for timeout_s in TIMEOUTS_S} for arrival_s in recorded()]
    numbers = report(starts, 'Made up.').numbers
    assert numbers['first_failed'] == {'0.0': 50, '0.1': 50, '0.5': 8, '1.0': 0}
    assert numbers['failed_lookups'] == numbers['first_failed']
    assert (numbers['starts'], numbers['came_worst_s']) == (50, 0.628)
