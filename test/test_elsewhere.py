# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What passed in one environment does not run in the next one, and everything else does."""

import sys

from programs import completed, PATIENCE_S
import pytest
from small_project import small_project, TESTS as FOLDER

TESTS = """
import os
import pytest

HERE = os.environ['HERE']

@pytest.fixture
def ends_badly():
    yield
    assert HERE != 'first'

def test_passes(): pass
def test_skips(): HERE == 'first' and pytest.skip()
def test_fails(): assert HERE != 'first'
def test_ends_badly(ends_badly): pass
"""

ALL_PASS = """
import os

assert os.environ['HERE'] == 'first'

def test_passes(): pass
"""


@pytest.mark.parametrize('workers', [[], ['-n', '2']], ids=['alone', 'workers'])
def test_only_what_passed_is_left_out(tmp_path, monkeypatch, workers):
    if workers:
        pytest.importorskip('xdist')
    project, passed = small_project(tmp_path), tmp_path / 'passed'
    (project / 'test' / 'test_some.py').write_text(TESTS)
    (project / 'test' / 'test_all.py').write_text(ALL_PASS)

    def run(here, *options):
        monkeypatch.setenv('HERE', here)
        return completed(sys.executable, '-m', 'pytest', '-q', *workers, *options, 'test',
                         cwd=project).stdout

    everything_of_one = ['test/test_all.py', 'test/test_all.py::test_passes']
    assert '3 passed, 1 skipped, 1 error' in run('first', f'--passed={passed}')
    assert passed.read_text().splitlines() == [
        *everything_of_one, 'test/test_some.py::test_passes']
    # The other file can no longer be imported.
    assert '3 passed' in run('next', f'--passed-elsewhere={passed}')
    # A second run, of what failed, takes nothing out of the list, and knows no file as a whole.
    run('next', f'--passed={passed}', '--deselect=test/test_some.py::test_passes',
        '--ignore=test/test_all.py')
    assert passed.read_text().splitlines() == [
        *everything_of_one, *(f'test/test_some.py::test_{name}' for name in (
            'ends_badly', 'fails', 'passes', 'skips'))]


def test_files_that_are_left_out_have_no_other_tests_here(request):
    option = request.config.option
    if not option.passed_elsewhere:
        pytest.skip('only where scripts/test ran some tests elsewhere before')
    names = {*option.passed_elsewhere.read_text(encoding='utf-8').splitlines()}
    files = sorted(name for name in names if '::' not in name)
    done = completed(sys.executable, '-m', 'pytest', '-q', '--collect-only', '-p',
                     'no:cacheprovider', '-k', option.keyword, '-m', option.markexpr, *files,
                     cwd=FOLDER.parent, timeout=4 * PATIENCE_S)
    here = {line for line in done.stdout.splitlines() if '::' in line}
    assert here and not here - names, done.stdout[-3000:]
