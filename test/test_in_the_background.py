# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tests that press Ctrl-C reach the processes that they started."""

from pathlib import Path
import sys

from programs import completed

TESTS = Path(__file__).parent
PRESSED = 'ros/test_shutdown.py::test_ctrl_c_interrupts_a_lookup_of_the_main_thread'
# It runs a program to its end, where programs ignore signals, in the process of the tests.
ENDED_HERE = 'labs/test_tf_lab.py::test_every_lab_has_a_line'


def assert_passes(*tests, begin=()):
    done = completed(*begin, sys.executable, '-m', 'pytest', '-q',
                     *(str(TESTS / test) for test in tests), cwd=TESTS.parent)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f'{len(tests)} passed' in done.stdout


def test_ctrl_c_reaches_processes_of_tests_that_ignore_it():
    assert_passes(PRESSED, begin=['sh', '-c', 'trap "" INT; exec "$@"', 'sh'])


def test_ctrl_c_reaches_processes_of_tests_after_a_program_ended_in_theirs():
    assert_passes(ENDED_HERE, PRESSED)
