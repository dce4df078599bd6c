# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The tests that passed in one environment, and need not run in the next one.

``scripts/test`` runs the tests of the core, of bags, fleets and descriptions without ROS, with the
oldest Python and numpy. Whatever passed there does not run once more with ROS; whatever was
skipped there, because it needs ROS or a library that is not there, does. A file in which all tests
passed is not even imported.
"""

from pathlib import Path

import pytest


def add_options(parser):
    """Add the two options that name a file."""
    group = parser.getgroup('environments')
    group.addoption('--passed', type=Path, metavar='FILE',
                    help='write the names of the tests that pass, and of files in which all do, '
                         'into FILE')
    group.addoption('--passed-elsewhere', type=Path, metavar='FILE',
                    help='leave out the tests and files that FILE names')


class PassedElsewhere:
    """Leaves out the tests and files that passed; registered with pytest by test/conftest.py."""

    def __init__(self, file):
        self._names = {*file.read_text(encoding='utf-8').splitlines()}

    def pytest_ignore_collect(self, collection_path, config):
        within = collection_path.is_relative_to(config.rootpath)
        name = collection_path.relative_to(config.rootpath).as_posix() if within else ''
        return True if name in self._names else None

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, config, items):
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid in self._names])
        items[:] = [item for item in items if item.nodeid not in self._names]


class Passed:
    """Writes the tests that pass; registered with pytest by test/conftest.py."""

    def __init__(self, file):
        self._file, self._collected, self._ended, self._failed = file, set(), set(), set()

    def pytest_collection_finish(self, session):
        self._collected |= {item.nodeid for item in session.items}

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids):
        self._collected |= set(ids)

    def pytest_runtest_logreport(self, report):
        if report.when == 'call' and report.passed:
            self._ended.add(report.nodeid)
        elif not report.passed:
            self._failed.add(report.nodeid)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self):
        passed = self._ended - self._failed
        if self._file.exists() and (before := self._file.read_text(encoding='utf-8')):
            # A run that repeats failed tests adds to the list. It does not know all of a file.
            passed |= {*before.splitlines()}
        else:
            passed |= _files_of(self._collected) - _files_of(self._collected - passed)
        self._file.write_text(''.join(f'{name}\n' for name in sorted(passed)), encoding='utf-8')


def _files_of(names):
    return {name.partition('::')[0] for name in names}
