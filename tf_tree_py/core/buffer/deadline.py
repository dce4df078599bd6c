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

"""How long a blocking wait may last: by the wall clock here, by a ROS clock in ``ros``."""

import threading
import time
from typing import Protocol


class Deadline(Protocol):
    """Sleeps for a blocking lookup until something happens or time is up."""

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began, by the deadline's own clock."""


class WallDeadline:
    """A timeout by the monotonic clock, which begins now."""

    def __init__(self, timeout_s: float) -> None:
        self._begin = time.monotonic()
        self._end = self._begin + min(timeout_s, threading.TIMEOUT_MAX)

    def wait(self, event: threading.Event) -> bool:
        """Sleep until the event is set (True) or time is up (False)."""
        return event.wait(max(0.0, self._end - time.monotonic()))

    def elapsed_s(self) -> float:
        """Return the seconds since the wait began."""
        return time.monotonic() - self._begin
