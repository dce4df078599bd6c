# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Long jobs in steps: the oldest first, and at once where too many messages wait."""

import pytest
from tf_tree_py.ros.threads.backlog import Backlog


def job(done, name, steps):
    for step in range(steps):
        done.append(f'{name}{step}')
        yield


def test_oldest_job_is_done_first_step_by_step():
    done, backlog = [], Backlog(100)
    assert backlog.step() is False
    backlog.add(job(done, 'a', 2), 40)
    backlog.add(job(done, 'b', 1), 60)
    assert (done, len(backlog)) == ([], 2), 'a hundred bytes are not too many'
    # The last step of a job only finds that it is over.
    for expected, left, count in ((['a0'], True, 2), (['a0', 'a1'], True, 2),
                                  (['a0', 'a1'], True, 1), (['a0', 'a1', 'b0'], True, 1),
                                  (['a0', 'a1', 'b0'], False, 0),
                                  (['a0', 'a1', 'b0'], False, 0)):
        assert backlog.step() is left
        assert (done, len(backlog)) == (expected, count)


def test_too_many_bytes_are_worked_off_at_once_from_the_oldest():
    done, backlog = [], Backlog(100)
    for name in 'abc':
        backlog.add(job(done, name, 2), 50)
    assert (done, len(backlog)) == (['a0', 'a1'], 2)
    backlog.add(job(done, 'd', 1), 1)
    assert (done, len(backlog)) == (['a0', 'a1', 'b0', 'b1'], 2)
    backlog.add(job(done, 'e', 1), 101)
    assert len(backlog) == 0, 'a message that alone is too large is done at once, too'
    assert done[4:] == ['c0', 'c1', 'd0', 'e0']
    backlog.add(job(done, 'f', 1), 100)
    assert len(backlog) == 1, 'no byte of the others is left'


def test_job_that_raises_is_over_and_gives_its_bytes_back():
    def failing():
        yield
        raise ValueError('as of a message')

    done, backlog = [], Backlog(100)
    backlog.add(failing(), 100)
    assert backlog.step() is True
    with pytest.raises(ValueError, match='as of a message'):
        backlog.step()
    assert len(backlog) == 0
    backlog.add(job(done, 'a', 1), 100)
    assert (done, len(backlog)) == ([], 1)


def test_number_of_jobs_is_not_taken_for_a_truth():
    with pytest.raises(TypeError):
        bool(Backlog(1))
