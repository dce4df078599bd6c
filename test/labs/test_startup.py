"""Who fails at startup: whose timeout is shorter than the transform takes to come."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.labs.startup import recorded, start, STARTS, TIMEOUTS_S


def test_fifty_starts_were_recorded():
    assert len(recorded()) == STARTS == 50


def test_without_a_timeout_every_first_lookup_fails():
    assert report_of('startup').numbers['first_failed']['0.0'] == 50


def test_with_a_timeout_those_fail_that_it_does_not_cover():
    failed = report_of('startup').numbers['first_failed']
    for timeout in TIMEOUTS_S:
        # Some arrive close to a timeout; on a busy machine that goes either way.
        late = sum(arrival > timeout for arrival in recorded())
        assert failed[str(timeout)] == pytest.approx(late, abs=5)


def test_nobody_has_an_answer_before_the_transform_came():
    assert all(row['median_s'] > 0.150 and row['worst_s'] > 0.5 for row in rows_of('startup'))


@pytest.mark.parametrize('arrival_s', [0.0, 0.05])
def test_a_long_timeout_never_fails(arrival_s):
    outcome = start(arrival_s)
    assert outcome[1.0].failed == 0


def test_a_short_timeout_fails_until_the_transform_comes():
    outcome = start(0.35)
    assert outcome[0.1].failed >= 1 and outcome[0.1].success_s >= 0.35
