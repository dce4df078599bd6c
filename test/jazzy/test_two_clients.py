# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Both clients, tf2's and ours, get the same results from both servers, tf2's and ours."""

import json
from pathlib import Path

from programs import completed, PATIENCE_S
import pytest

PROGRAM = Path(__file__).with_name('two_clients.py')


@pytest.fixture(scope='module', params=['tf2_ros', 'tf_tree_py'])
def package(request):
    """Return the package whose server is used."""
    return request.param


@pytest.fixture(scope='module')
def said(env, package, start_for_all):
    """Return the results of both clients with that server."""
    server = start_for_all('ros2', 'run', package, 'buffer_server')
    # These folders are on the path for the modules that other programs and tests share.
    found = {**env, 'PYTHONPATH': f'{PROGRAM.parent}:{PROGRAM.parents[1]}:{env["PYTHONPATH"]}'}
    done = completed('python3', str(PROGRAM), env=found, timeout=4 * PATIENCE_S)
    server.interrupt()
    server.end()
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def is_error(answer):
    return isinstance(answer[0], str)


def test_answers_and_classes_of_errors_are_the_same(said):
    errors = set()
    for each in said['found']:
        theirs, ours = each['theirs'], each['ours']
        assert is_error(theirs) == is_error(ours), each
        if is_error(theirs):
            assert theirs[0] in ours, each
            errors.add(theirs[0])
        else:
            assert ours == pytest.approx(theirs, abs=1e-9), each
    assert errors == {'LookupException', 'ConnectivityException', 'ExtrapolationException',
                      'InvalidArgumentException'}
    assert sum(not is_error(each['theirs']) for each in said['found']) >= 12


def test_what_comes_meanwhile_is_waited_for(said):
    assert said['waited']['ours'][:3] == said['waited']['theirs'][:3] == [110, 0, 110.0]


def test_what_never_comes_is_a_timeout(said, package):
    assert said['never']['ours'][0] == 'TimeoutException'
    if package == 'tf_tree_py':
        assert said['never']['theirs'][0] == 'TimeoutException'
    else:
        # tf2's server does not report it, and its client returns an identity.
        assert said['never']['theirs'] == [0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
