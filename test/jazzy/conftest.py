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

"""An installed Jazzy, used by its own commands; the tests skip where there is none."""

import json
from pathlib import Path
import re
import select
import subprocess
import time

from domains import claim
from programs import PATIENCE_S, Program
import pytest
from standin import standin_env

SESSION = Path(__file__).with_name('ros2_session.py')


@pytest.fixture(scope='session')
def env():
    """Return the variables of a shell in which Jazzy and this package are sourced."""
    variables = standin_env()
    # Not that of the tests in this process: the daemon of ros2 stays there until the end.
    variables['ROS_DOMAIN_ID'] = str(claim())
    variables['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    # What they say would come with colours and times else.
    variables['RCUTILS_CONSOLE_OUTPUT_FORMAT'] = '[{severity}] [{name}]: {message}'
    variables['RCUTILS_COLORIZED_OUTPUT'] = '0'
    yield variables
    # The commands leave one behind, for hours.
    subprocess.run(['ros2', 'daemon', 'stop'], env=variables, capture_output=True,
                   timeout=PATIENCE_S, check=False)


@pytest.fixture(scope='module')
def run(env):
    """Run commands to their end; return their status and what they print."""
    return lambda *command: subprocess.run(
        command, env=env, capture_output=True, text=True, timeout=4 * PATIENCE_S, check=False)


@pytest.fixture(scope='session')
def ros2(env):
    """Run ``ros2`` commands, all in one process; return their status and what they print."""
    with subprocess.Popen(['python3', SESSION], env=env, text=True, stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as program:
        def ros2(*words):
            program.stdin.write(json.dumps(words) + '\n')
            program.stdin.flush()
            answered, _, _ = select.select([program.stdout], [], [], 4 * PATIENCE_S)
            assert answered, f'ros2 {" ".join(words)} does not end'
            return subprocess.CompletedProcess(words, *json.loads(program.stdout.readline()))

        yield ros2
        program.kill()


@pytest.fixture(scope='session')
def tell(ros2):
    """Return a function that gives what a ``ros2`` command prints."""
    def tell(*words):
        done = ros2(*words)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return tell


@pytest.fixture(scope='session')
def tell_at_last(ros2):
    """
    Return a function that repeats a ``ros2`` command until it prints what a pattern matches.

    Its daemon needs a moment to discover what is there.
    """
    def tell_at_last(pattern, *words):
        end = time.monotonic() + PATIENCE_S
        while True:
            done = ros2(*words)
            if re.search(pattern, done.stdout):
                return done.stdout
            assert time.monotonic() < end, f'no {pattern} in:\n{done.stdout}{done.stderr}'

    return tell_at_last


@pytest.fixture(scope='module')
def start_for_all(env):
    """Start processes, each as in a terminal; they are gone at the end of the module."""
    yield from _starter(env)


@pytest.fixture
def start(env):
    """Start processes, each as in a terminal; they are gone at the end of the test."""
    yield from _starter(env)


def _starter(env):
    programs = []

    def start(*command):
        programs.append(Program(*command, env=env, own_terminal=True))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()
