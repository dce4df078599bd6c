# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A test that leaves something behind, which others in its process would meet, fails."""

import locale
import logging
import os
import socket
import sys
import textwrap
import threading

from leftovers import differences, left_behind, state_of_file, state_of_test
import numpy as np
from programs import completed
import pytest
from small_project import small_project
import tf_tree_py.core

# --- what each kind of it is called


@pytest.fixture
def left():
    """Return a function that returns what was left since the test began."""
    before = state_of_file()
    return lambda: differences(before, state_of_file())


def test_nothing_is_nothing(left):
    assert left() == []


def test_environment(left, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '999')
    monkeypatch.delenv('HOME')
    assert sorted(each.partition(' -> ')[0].partition("'")[0] for each in left()) == [
        'environment: HOME: ', 'environment: ROS_DOMAIN_ID: ']


def test_working_folder_path_and_modules(left, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, tf_tree_py.core.__name__)
    text = '\n'.join(left())
    assert 'working folder' in text and 'sys.path' in text and 'modules: tf_tree_py.core' in text


def test_module_that_was_only_imported_is_nothing(left):
    sys.modules['tf_tree_py.nothing'] = sys
    try:
        assert left() == []
    finally:
        del sys.modules['tf_tree_py.nothing']


@pytest.mark.parametrize(('change', 'undo', 'name'), [
    (lambda: os.umask(0o77), os.umask, 'mask of new files'),
    (lambda: np.seterr(divide='raise'), lambda old: np.seterr(**old), 'errors of numpy'),
    (lambda: np.get_printoptions() | {'none': np.set_printoptions(precision=3)},
     lambda old: np.set_printoptions(precision=old['precision']), 'print options of numpy'),
    (lambda: (sys.getswitchinterval(), sys.setswitchinterval(1.0))[0], sys.setswitchinterval,
     'switch interval'),
    (lambda: (locale.setlocale(locale.LC_ALL), locale.setlocale(locale.LC_ALL, 'C.UTF-8'))[0],
     lambda old: locale.setlocale(locale.LC_ALL, old), 'locale'),
    (lambda: logging.getLogger('some').setLevel('DEBUG'),
     lambda _: logging.getLogger('some').setLevel('NOTSET'), 'loggers: some'),
], ids=lambda each: each if isinstance(each, str) else '')
def test_settings(left, change, undo, name):
    old = change()
    try:
        now = left()
    finally:
        undo(old)
    assert len(now) == 1 and name in now[0]
    assert left() == []


def test_handlers_of_loggers_that_do_nothing_are_nothing(left):
    handlers = [logging.NullHandler(), logging.StreamHandler()]
    logger = logging.getLogger('another')
    try:
        logger.addHandler(handlers[0])
        assert left() == []
        logger.addHandler(handlers[1])
        assert len(left()) == 1 and left()[0].startswith('loggers: another: ')
    finally:
        for handler in handlers:
            logger.removeHandler(handler)


def test_figures_and_settings_of_matplotlib(left):
    matplotlib = pytest.importorskip('matplotlib')
    from matplotlib import pyplot
    assert left() == [], 'importing it is no change'
    figure = pyplot.figure()
    with matplotlib.rc_context({'svg.hashsalt': 'a'}):
        assert sorted(each[:20] for each in left()) == [
            'figures of pyplot: 1', 'settings of matplotl']
    pyplot.close(figure)
    assert left() == []


def test_sockets_and_threads(left):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind(('127.0.0.1', 0))
        # Those of participants of DDS are also those of a single test.
        assert [each.partition(': udp')[0] for each in left()] == ['sockets of DDS', 'sockets']
        assert f'port {bound.getsockname()[1]}' in left()[0]
    end = threading.Event()
    thread = threading.Thread(target=end.wait, name='waiting')
    thread.start()
    assert len(left()) == 1 and left()[0].startswith('threads: waiting')
    end.set()
    thread.join()
    assert left() == []


def test_thread_may_end_a_moment_later():
    before = state_of_file()
    end = threading.Event()
    threading.Thread(target=end.wait).start()
    assert differences(before, state_of_file())
    threading.Timer(0.05, end.set).start()
    assert left_behind(before, state_of_file) == []


def test_rclpy_that_stays_initialized(left):
    rclpy = pytest.importorskip('rclpy')
    rclpy.init(args=[])
    try:
        assert any(each.startswith('ROS: rclpy is initialized') for each in left())
    finally:
        rclpy.shutdown()


def test_state_of_a_test_is_part_of_that_of_a_file():
    assert state_of_file().keys() - state_of_test().keys() == {'sockets', 'threads'}


# --- which test fails


@pytest.fixture
def project(tmp_path):
    """Return a project with this one's conftest.py."""
    return small_project(tmp_path)


def outcome(project, **files):
    """Run test files in one process, in this order; return the end of pytest's output."""
    for name, text in files.items():
        (project / 'test' / f'{name}.py').write_text(textwrap.dedent(text))
    done = completed(sys.executable, '-m', 'pytest', '-q', '-r', 'fE',
                     *(f'test/{name}.py' for name in files), cwd=project)
    return done.stdout[done.stdout.index('short test summary'):]


def test_the_test_or_the_file_that_leaves_it_fails_and_no_other(project):
    summary = outcome(project, test_one="""
        import os, threading

        def test_leaves_a_variable():
            os.environ['LEFT'] = '1'

        def test_passes(monkeypatch):
            monkeypatch.setenv('NOT_LEFT', '1')
        """, test_other="""
        import pytest, threading

        @pytest.fixture(scope='module')
        def thread():
            thread = threading.Thread(target=threading.Event().wait, daemon=True)
            thread.start()

        def test_uses_the_thread(thread): pass

        def test_uses_it_too(thread): pass
        """, test_third='def test_passes(): pass')
    assert 'ERROR test/test_one.py::test_leaves_a_variable' in summary
    assert 'ERROR test/test_other.py::test_uses_it_too' in summary
    assert '5 passed, 2 errors' in summary


def test_every_test_draws_the_same_numbers(project):
    draws = """
        import random, numpy

        def test_first():
            print(random.random(), numpy.random.random())
            assert False

        def test_second():
            print(random.random(), numpy.random.random())
            assert False
        """
    for name in ('test_one', 'test_other'):
        (project / 'test' / f'{name}.py').write_text(textwrap.dedent(draws))
    done = completed(sys.executable, '-m', 'pytest', '-q', 'test', cwd=project)
    printed = [line for line in done.stdout.splitlines() if line.startswith('0.')]
    assert len(printed) == 4 and len(set(printed)) == 1
