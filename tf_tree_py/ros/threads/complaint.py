# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Logging what a user's callback raised in a thread of ours, which then goes on."""

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
    Logs exceptions; the same one again at most once in ten seconds, with a count.

    ``sys.exit()`` in a callback would end the thread silently, so it is logged too.
    """

    def __init__(self, logger: Any) -> None:
        """
        Log to this logger.

        :param logger: an rclpy logger.
        """
        self._logger = logger
        self._lock = threading.Lock()
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
            text = f'{count} more failed like the one before. {text}'
        try:
            self._logger.error(text)
        except Exception:  # noqa: B902 - a logger that fails must not end the thread either
            with suppress(Exception):
                print(text, file=sys.stderr)
