"""Saying loudly what a caller's code raised in a thread of ours, which has to go on."""

from contextlib import suppress
import sys
import threading
import time
import traceback
from typing import Any

_PERIOD_S = 10.0
_EXIT = (' sys.exit() would end nothing but the thread in which transforms arrive, and that would '
         'be the end of all lookups: it goes on. To end the program, call rclpy.shutdown().')


class Complaint:
    """
    Writes down exceptions, one that comes over and over once in a period.

    A thread that ends by ``sys.exit()`` ends without a word, so that has to be said too.
    """

    def __init__(self, logger: Any) -> None:
        """
        Take where to write.

        :param logger: an rclpy logger.
        """
        self._logger = logger
        self._lock = threading.Lock()
        self._last = ''
        self._count = 0
        self._quiet_until = 0.0

    def write(self, what: str) -> None:
        """Write down the exception that is just being handled; raises nothing itself."""
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
            text = f'{count} more failed like the one before. {text}'
        try:
            self._logger.error(text)
        except Exception:  # noqa: B902 - a logger that fails must not end the thread either
            with suppress(Exception):
                print(text, file=sys.stderr)
