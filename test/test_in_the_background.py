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
