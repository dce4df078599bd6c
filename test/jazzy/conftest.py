# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An installed Jazzy, used with its own commands; the tests skip where there is none."""

from contextlib import suppress
import json
from pathlib import Path
import re
import select
import subprocess
import warnings

from conditions import repeated
from domains import claim
from programs import completed, PATIENCE_S, Program
import pytest
from standin import standin_env

SESSION = Path(__file__).with_name('ros2_session.py')
# These commands call services, and so may wait for ever for a response that DDS dropped because
# the server had not discovered the client (github.com/ros2/rmw_fastrtps/issues/842). One that does
# not end is run up to three times. A server that never responds still fails the test.
_CALLING, _TRIES = ('action', 'param', 'service'), 3
# Longer than DDS keeps a silent node.
_MOMENT_S = 30.0


@pytest.fixture(scope='session')
def env():
    """Return the variables of a shell in which Jazzy and this package are sourced."""
    variables = standin_env()
    # Not the domain of the tests in this process: the daemon of ros2 stays there until the end.
    variables['ROS_DOMAIN_ID'] = str(claim())
    # Otherwise their output has colours and times.
    variables['RCUTILS_CONSOLE_OUTPUT_FORMAT'] = '[{severity}] [{name}]: {message}'
    variables['RCUTILS_COLORIZED_OUTPUT'] = '0'
    yield variables
    # The commands leave a daemon running for hours.
    subprocess.run(['ros2', 'daemon', 'stop'], env=variables, capture_output=True,
                   timeout=PATIENCE_S, check=False)


@pytest.fixture(scope='module')
def run(env):
    """Run commands to their end; return their status and their output."""
    return lambda *command: completed(*command, env=env, timeout=4 * PATIENCE_S)


class Session:
    """A process that runs ``ros2`` commands; a new one, after a command that does not end."""

    def __init__(self, env):
        self._env = env
        self._start()

    def _start(self):
        self._program = subprocess.Popen(['python3', SESSION], env=self._env, text=True,
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def run(self, *words):
        """
        Return the status and the output of a command.

        If the daemon does not answer at once, a command looks for nodes itself, for half a second.
        On a busy machine it may miss one.
        """
        return repeated(lambda: self._run_once(words),
                        lambda done: 'Node not found' not in done.stderr)

    def _run_once(self, words):
        tries = _TRIES if words[0] in _CALLING else 1
        for _ in range(tries):
            print(json.dumps(words), file=self._program.stdin, flush=True)
            if select.select([self._program.stdout], [], [], PATIENCE_S / tries)[0]:
                return subprocess.CompletedProcess(
                    words, *json.loads(self._program.stdout.readline()))
            self.close()
            self._start()
            warnings.warn(f'ros2 {" ".join(words)} did not end', stacklevel=1)
        raise AssertionError(f'ros2 {" ".join(words)} does not end')

    def close(self):
        self._program.kill()
        with self._program:
            pass


@pytest.fixture(scope='session')
def ros2(env):
    """Run ``ros2`` commands, all in one process; return their status and their output."""
    session = Session(env)
    yield session.run
    session.close()


@pytest.fixture(scope='session')
def output_of(ros2):
    """Return a function that returns the output of a ``ros2`` command."""
    def output_of(*words):
        done = ros2(*words)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return output_of


def _repeated(ros2, words, condition, wanted, patience_s=PATIENCE_S):
    """Repeat a command until its output fulfils a condition; return its last run."""
    done = repeated(lambda: ros2(*words), lambda done: condition(done.stdout), patience_s)
    assert condition(done.stdout), f'{wanted} in:\n{done.stdout}{done.stderr}'
    return done


@pytest.fixture(scope='session')
def await_output(ros2):
    """
    Return a function that repeats a ``ros2`` command until its output matches a pattern.

    The ``ros2`` daemon needs a moment for the discovery.
    """
    return lambda pattern, *words: _repeated(
        ros2, words, re.compile(pattern).search, f'no {pattern}')


@pytest.fixture(scope='session')
def wait_until_gone(ros2):
    """
    Return a function that repeats a ``ros2`` command until its output does not match a pattern.

    The ``ros2`` daemon lists a node for a moment after it has ended, so that another one of this
    name would seem to run before it does. Now and then it keeps one until it ends itself, so then
    it is replaced.
    """
    def wait(pattern, *words):
        def is_gone(output):
            return not re.search(pattern, output)

        with suppress(AssertionError):
            return _repeated(ros2, words, is_gone, f'still {pattern}', _MOMENT_S)
        ros2('daemon', 'stop')
        return _repeated(ros2, words, is_gone, f'still {pattern}')

    return wait


@pytest.fixture(scope='module')
def start_for_all(env):
    """Start processes, each as in a terminal; they are killed at the end of the module."""
    yield from _starter(env)


@pytest.fixture
def start(env):
    """Start processes, each as in a terminal; they are killed at the end of the test."""
    yield from _starter(env)


def _starter(env):
    programs = []

    def start(*command):
        programs.append(Program(*command, env=env, own_terminal=True))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()
