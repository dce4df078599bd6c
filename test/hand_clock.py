"""A clock for tests of what goes by one."""


class HandClock:
    """A clock that is set by hand, and counts how often it is read; or a module ``time``."""

    def __init__(self, now):
        self.now = now
        self.read = 0

    def __call__(self):
        self.read += 1
        return self.now

    monotonic = __call__
