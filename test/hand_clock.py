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
