# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Logs exceptions of a user's callback in a thread of this package, which then continues."""

from contextlib import suppress
import sys
import time
import traceback
from typing import Any

from tf_tree_py.core import fork_locks

_PERIOD_S = 10.0
_EXIT = (' sys.exit() would end only the thread that receives transforms, and lookups would stop '
         'working, so it is ignored. To end the program, call rclpy.shutdown().')


class RateLimitedLog:
    """
    A log of exceptions; the same one again at most once in ten seconds, with a count.

    ``sys.exit()`` in a callback would end the thread silently, so it is logged, too.
    """

    def __init__(self, logger: Any) -> None:
        """
        Log to this logger.

        :param logger: an rclpy logger.
        """
        self._logger = logger
        self._lock = fork_locks.lock()
        self._last = ''
        self._count = 0
        self._quiet_until = 0.0

    def write(self, what: str) -> None:
        """Log the exception that is being handled; never raises."""
        text = f'{what} failed:\n{traceback.format_exc()}'
        if isinstance(sys.exc_info()[1], SystemExit):
            text += _EXIT
        with self._lock:
            now = time.monotonic()
            if text == self._last and now < self._quiet_until:
                self._count += 1
                return
            count, self._count = self._count, 0
            self._last, self._quiet_until = text, now + _PERIOD_S
        if count:
            text = f'{count} more failed like the previous one. {text}'
        try:
            self._logger.error(text)
        except Exception:  # noqa: B902 - a logger that fails must not end the thread either
            with suppress(Exception):
                print(text, file=sys.stderr)
