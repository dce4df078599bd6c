# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""After a worker of pytest-xdist has crashed: the tests that did not run count as failed."""

import pytest

# The exit status of such a run; pytest's own end at 5. scripts/test --again checks for it.
CRASHED = 40

# The tests that failed in the last run: what pytest's own --last-failed repeats.
_LAST_FAILED = 'cache/lastfailed'


class Unfinished:
    """
    Watches for a crash; registered with pytest by test/conftest.py.

    pytest-xdist ends a run after a crash. Only the test that crashed has failed then, so
    ``--last-failed`` would leave out the tests that the workers still had to run.
    """

    def __init__(self):
        self._is_crashed, self._collected, self._ended = False, (), set()

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids):
        self._collected = ids

    def pytest_runtest_logfinish(self, nodeid):
        self._ended.add(nodeid)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, error):
        self._is_crashed |= bool(error)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session):
        # If it was just sending a test to a worker that crashes, pytest-xdist raises an error.
        broke = self._collected and session.exitstatus == pytest.ExitCode.INTERNAL_ERROR
        if not (self._is_crashed or broke):
            return
        waiting = set(self._collected) - self._ended
        # A worker that crashed while it collected the tests leaves no list of them.
        session.exitstatus = CRASHED if waiting else pytest.ExitCode.INTERNAL_ERROR
        if waiting and (cache := getattr(session.config, 'cache', None)):
            failed = cache.get(_LAST_FAILED, {})
            cache.set(_LAST_FAILED, {**failed, **dict.fromkeys(sorted(waiting), True)})
