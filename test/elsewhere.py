# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The tests that passed in one environment, and need not run in the next one.

``scripts/test`` runs the tests of the core, of bags, fleets and descriptions without ROS, with the
oldest Python and numpy. Whatever passed there does not run once more with ROS; whatever was
skipped there, because it needs ROS or a library that is not there, does.
"""

from pathlib import Path

import pytest


def add_options(parser):
    """Add the two options that name a file."""
    group = parser.getgroup('environments')
    group.addoption('--passed', type=Path, metavar='FILE',
                    help='write the names of the tests that pass into FILE')
    group.addoption('--passed-elsewhere', type=Path, metavar='FILE',
                    help='leave out the tests that FILE names')


def leave_out(config, items):
    """Leave out the tests that passed elsewhere."""
    file = config.option.passed_elsewhere
    if not file:
        return
    passed = set(file.read_text(encoding='utf-8').splitlines())
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in passed])
    items[:] = [item for item in items if item.nodeid not in passed]


class Passed:
    """Writes the tests that pass; registered with pytest by test/conftest.py."""

    def __init__(self, file):
        self._file, self._ended, self._failed = file, set(), set()

    def pytest_runtest_logreport(self, report):
        if report.when == 'call' and report.passed:
            self._ended.add(report.nodeid)
        elif not report.passed:
            self._failed.add(report.nodeid)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self):
        # A run that repeats failed tests adds to the list.
        before = self._file.read_text(encoding='utf-8').split('\n') if self._file.exists() else []
        names = sorted({*filter(None, before)} | self._ended - self._failed)
        self._file.write_text(''.join(f'{name}\n' for name in names), encoding='utf-8')
