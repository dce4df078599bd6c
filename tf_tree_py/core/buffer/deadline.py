# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Deadlines of blocking waits, by the wall clock; ``ros.waiting`` has those by a ROS clock."""

import threading
import time
from typing import Protocol


class Deadline(Protocol):
    """Blocks a thread until an event is set or the time is up."""

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began, by the deadline's own clock."""


class WallDeadline:
    """A timeout by the monotonic clock that begins when the object is made."""

    def __init__(self, timeout_s: float) -> None:
        self._begin = time.monotonic()
        self._end = self._begin + min(timeout_s, threading.TIMEOUT_MAX)

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""
        return event.wait(max(0.0, self._end - time.monotonic()))

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began."""
        return time.monotonic() - self._begin
