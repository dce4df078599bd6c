# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A clock for tests of code that depends on the time."""


class HandClock:
    """A clock that is set by hand, and counts its readings; also replaces the module ``time``."""

    def __init__(self, now):
        self.now = now
        self.read = 0

    def __call__(self):
        self.read += 1
        return self.now

    monotonic = __call__


def clock_of_logs(monkeypatch):
    """Return the clock of limited logs, which stands still until the test sets it."""
    clock = HandClock(1000.0)
    monkeypatch.setattr('tf_tree_py.limited_log.time', clock)
    return clock
