# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Hooks for the tests of all folders."""

import faulthandler
from functools import cache
import gc
from importlib.util import find_spec
import os
from pathlib import Path
import re
import signal
import sys

from _pytest.faulthandler import fault_handler_stderr_fd_key
from domains import isolate
import effort  # noqa: F401 - it loads the profile of hypothesis
import elsewhere
from leftovers import differences, forget, left_behind, seed, state_of_file, state_of_test
import near
from programs import Program
import pytest
from unfinished import Unfinished

_TESTS = Path(__file__).parent

# The folders whose files are slow, or wait for programs that they start. Workers begin with these
# files, so that no worker is left with the longest at the end.
_BEGIN_WITH = ['jazzy', 'view', 'docs', 'labs', 'tools', 'nodes', 'dropin', 'ros']

# What marks the tests of a file: it, or a test helper that it uses, imports one of these.
_MARKS = {'processes': near.PROCESSES, 'dds': near.DDS, 'health': {'tf_tree_py.health'},
          'house': {'house'}, 'benchmark': {'benchmark'}}

# The handlers of the signals with which every test begins.
_HANDLERS = {}


def pytest_addoption(parser):
    """Add the options with which one environment leaves tests to another."""
    elsewhere.add_options(parser)


def pytest_configure(config):
    """
    Isolate this process, and let those that it starts receive Ctrl-C, even if it ignores it.

    A shell makes background jobs ignore SIGINT, and child processes inherit that. They do not
    inherit a handler, so this installs a handler that also ignores the signal.
    """
    # Plots are files. Otherwise it depends on the screen of the machine.
    os.environ['MPLBACKEND'] = 'Agg'
    if find_spec('rclpy'):
        # Before rclpy.init, here and in the processes that tests start.
        isolate()
    # Otherwise pytest-xdist begins with the files that have the most tests.
    config.option.loadscopereorder = False
    config.pluginmanager.register(Unfinished())
    if config.option.passed and not hasattr(config, 'workerinput'):
        config.pluginmanager.register(elsewhere.Passed(config.option.passed))
    if file := config.option.passed_elsewhere:
        config.pluginmanager.register(elsewhere.PassedElsewhere(file))
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)
    _HANDLERS.update({number: signal.getsignal(number)
                      for number in (signal.SIGINT, signal.SIGTERM)})


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    """
    Undo what the last test did to the signals.

    A program that ends ignores them; if a test ran it in this process, all processes that later
    tests start would inherit that.
    """
    for number, handler in _HANDLERS.items():
        signal.signal(number, handler)


@pytest.hookimpl(trylast=True)
def pytest_exception_interact(node):
    """
    Limit the time of the teardown of a test that has failed, too.

    pytest cancels its own limit here, in case a person looks at the failure.
    """
    limit_s = float(node.config.getini('faulthandler_timeout'))
    if limit_s > 0:
        faulthandler.dump_traceback_later(
            limit_s, file=node.config.stash[fault_handler_stderr_fd_key], exit=True)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Schedule by file; tests of the labs' reports share a worker, which runs the labs once."""
    from xdist.scheduler import LoadFileScheduling

    class Sharing(LoadFileScheduling):

        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return 'labs' if file in reported else file

    reported = {f'test/labs/{path.name}' for path in (_TESTS / 'labs').glob('test_*.py')
                if 'lab_reports' in path.read_text()}
    return Sharing(config, log) if config.option.dist == 'loadfile' else None


def pytest_collection_modifyitems(config, items):
    """Mark tests by what their files use, if -m asks; put the slowest folders first."""
    # Each worker would read all tests for it, in several seconds.
    for mark in _MARKS.keys() & re.findall(r'\w+', config.option.markexpr):
        for item in items:
            if _is_marked(item.path, mark):
                item.add_marker(mark)
    # pytest runs files that are named on the command line in the order in which they are named.
    if not any('::' in argument or argument.endswith('.py') for argument in config.args):
        items.sort(key=_turn_of)


@cache
def _is_marked(path, mark):
    return near.needs(path, _MARKS[mark])


def _turn_of(item):
    folder = item.path.parent.name
    return _BEGIN_WITH.index(folder) if folder in _BEGIN_WITH else len(_BEGIN_WITH)


@pytest.fixture(autouse=True, scope='module')
def process_is_as_before_the_file():
    """Fail a file that leaves what other files could meet; yield what its tests left."""
    forget()
    seed()
    before, reported = state_of_file(), []
    yield reported
    if differences(before, state_of_file()):
        gc.collect()  # some threads end when their executor is collected
    left = [each for each in left_behind(before, state_of_file) if each not in reported]
    assert not left, left


@pytest.fixture(autouse=True)
def process_is_as_before_the_test(process_is_as_before_the_file):
    """Fail a test that leaves what the next ones could meet."""
    seed()
    before = state_of_test()
    yield
    left = left_behind(before, state_of_test)
    process_is_as_before_the_file.extend(left)
    assert not left, left


@pytest.fixture
def start_program():
    """Start programs that are killed at the end of the test."""
    programs = []

    def start(*command):
        programs.append(Program(*command))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()


@pytest.fixture
def log_file(tmp_path):
    """Return the file that receives what a test writes to standard error."""
    file = tmp_path / 'stderr'
    file.touch()
    return file


@pytest.fixture
def log(log_file):
    """
    Return a function that reads everything written to standard error since the test began.

    ``capfd.readouterr`` empties its file after reading it, so a line that is written in
    between is lost. Here every call reads the whole file, and removes nothing.
    """
    return log_file.read_text


# Innermost: pytest redirects standard error to a file of its own just before.
@pytest.hookimpl(hookwrapper=True, trylast=True)
def pytest_runtest_call(item):
    file = item.funcargs.get('log_file')
    if file is None:
        yield
        return
    kept, kept_stream = os.dup(2), sys.stderr
    # Appending, because ROS's log and Python both write to it.
    with file.open('a', buffering=1) as stream:
        os.dup2(stream.fileno(), 2)
        sys.stderr = stream
        yield
        sys.stderr = kept_stream
        os.dup2(kept, 2)
    os.close(kept)
    # To explain failed tests.
    sys.stderr.write(file.read_text())
