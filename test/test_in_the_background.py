"""Tests that press Ctrl-C do so for the processes that they started, however they are run."""

from pathlib import Path
import subprocess
import sys

from programs import PATIENCE_S

TESTS = Path(__file__).parent


def test_ctrl_c_reaches_processes_of_tests_that_ignore_it():
    test = TESTS / 'ros' / 'test_shutdown.py'
    done = subprocess.run(
        ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', sys.executable, '-m', 'pytest', '-q',
         f'{test}::test_ctrl_c_interrupts_a_lookup_of_the_main_thread'],
        cwd=TESTS.parent, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
