# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Ordinary runs repeat the same random examples; ``scripts/test --explore`` finds new failures."""

import os
import shlex
import sys

from programs import completed
import pytest
from small_project import small_project

NUMBERS = """
from pathlib import Path

from hypothesis import given, strategies as st
from hypothesis.stateful import rule, RuleBasedStateMachine


@given(st.integers(0, 10**6))
def test_number_is_small(number):
    assert number < 1000


class Counter(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.count = 0

    @rule()
    def step(self):
        self.count += 1
        assert self.count < 3


TestCounter = Counter.TestCase


@given(st.lists(st.floats(), min_size=20))
def test_examples_are_recorded(numbers):
    with Path('examples.txt').open('a') as file:
        print(numbers, file=file)
"""


# One round, in one process.
EXPLORE = 'test/explore.py', '-n', '0', '--minutes', '0'


@pytest.fixture
def project(tmp_path):
    """Return a project with this one's settings of pytest and hypothesis, and its own tests."""
    small_project(tmp_path)
    (tmp_path / 'test' / 'test_numbers.py').write_text(NUMBERS)
    return tmp_path


def run(project, *arguments, **variables):
    """Run Python there; return its status and output."""
    done = completed(sys.executable, *arguments, cwd=project, env={**os.environ, **variables})
    return done.returncode, done.stdout + done.stderr


def explore(project, *arguments):
    return run(project, *EXPLORE, *arguments)


def examples_of(project, *arguments, **variables):
    """Return the examples that a run of a test draws."""
    file = project / 'examples.txt'
    file.unlink(missing_ok=True)
    run(project, *arguments, 'test/test_numbers.py::test_examples_are_recorded', **variables)
    return file.read_text()


def test_every_run_draws_the_same_examples(project):
    once = examples_of(project, '-m', 'pytest', PYTHONHASHSEED='1')
    assert once.count('\n') >= 20
    # Constants of other modules do not count, nor do failures that an earlier run has found.
    (project / 'package.py').write_text(f'{[number + 0.25 for number in range(500)]}\n')
    (project / 'test' / 'test_other.py').write_text('import package\n')
    run(project, '-m', 'pytest')
    assert examples_of(project, '-m', 'pytest', 'test', PYTHONHASHSEED='2') == once
    assert not (project / '.hypothesis' / 'examples').exists()


def test_exploration_draws_new_examples_with_every_seed(project):
    first, again, second = (examples_of(project, *EXPLORE, '--seed', seed) for seed in '112')
    assert first == again != second


def test_exploration_prints_the_shortest_example_and_repeats_it(project):
    status, output = explore(project, '--seed', '7')
    assert status == 1
    assert output.startswith('seed 7: the first round')
    assert 'number=1000' in output
    steps = output[output.index('state = Counter()'):output.index('state.teardown()')]
    assert steps.count('state.step()') == 3
    *_, one, other = output.splitlines()
    assert {line.partition('::')[2] for line in (one, other)} == {
        'test_number_is_small', 'TestCounter::runTest'}
    script, *arguments = shlex.split(one)
    assert script == 'scripts/test' and arguments[0] == '--explore'
    status, output = explore(project, *arguments[1:])
    assert status == 1 and output.endswith(one + '\n')


def test_later_rounds_leave_out_what_has_failed(project):
    status, output = explore(project, '--minutes', '1e9', '--seed', '7',
                             'test/test_numbers.py::test_number_is_small')
    assert status == 1 and output.count('seed 7: 1 failed') == 1
    assert '1 rounds, 1 tests failed' in output


def test_exploration_without_failures_succeeds(project):
    (project / 'test' / 'test_numbers.py').write_text(
        NUMBERS.replace('number < 1000', 'True'))
    status, output = explore(project, 'test/test_numbers.py::test_number_is_small')
    assert status == 0 and '1 rounds, 0 tests failed' in output
    assert explore(project, 'test/near.py')[0] == 5, 'there is no test in it'


# What a test leaves here is no state that conftest.py knows.
SHARED = 'left = []\n'
LEAVES = """
import shared

def test_leaves():
    shared.left.append(1)
"""
MINDS = """
import shared

def test_minds():
    assert not shared.left
"""


def test_files_run_in_random_orders_in_one_process(project):
    files = {'shared': SHARED, 'test_first': LEAVES, 'test_other': MINDS}
    for name, text in files.items():
        (project / 'test' / f'{name}.py').write_text(text)
    (project / 'test' / 'test_numbers.py').write_text(
        'from hypothesis import given, strategies as st\n'
        '@given(st.booleans())\ndef test_any(value): pass\n')
    status, output = explore(project, 'test', '--seed', '0')
    assert status == 0 and '1 rounds, 0 tests failed' in output
    status, output = explore(project, 'test', '--seed', '1')
    assert status == 1 and 'seed 1, 3 files in one process: 1 failed, 2 passed' in output
    script, *arguments = shlex.split(output.splitlines()[-1])
    assert script == 'scripts/test'
    assert arguments[-1] == 'test/test_other.py' and 'test/test_first.py' in arguments
    assert run(project, '-m', 'pytest', *arguments)[0] == 1
