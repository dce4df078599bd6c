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

"""Incidents as log lines that stay readable when a thousand happen in a second."""

from collections import Counter
from collections.abc import Iterable
import threading
import time
from typing import Protocol

from .incidents import Incident, Kind

_PERIOD_S = 10.0
_LINES_PER_KIND = 5


class Logger(Protocol):
    """Where lines go: a logger of rclpy's, or of Python's ``logging``."""

    def warning(self, message: str, /) -> object:
        """Write one line."""


class IncidentLog:
    """
    Writes each edge's incident of a kind once per period, and not too many of a kind.

    What was left out is counted, and said when the next period begins.
    """

    def __init__(self, logger: Logger) -> None:
        """Take where to write."""
        self._logger = logger
        self._lock = threading.Lock()
        self._begin = -_PERIOD_S
        self._shown: set[tuple[Kind, str, str]] = set()
        self._lines: Counter[Kind] = Counter()
        self._omitted: Counter[Kind] = Counter()

    def report(self, incidents: Iterable[Incident]) -> None:
        """Write down what happened, or count it."""
        lines: list[str] = []
        with self._lock:
            now = time.monotonic()
            if now - self._begin > _PERIOD_S:
                lines += [f'{count} more like this: {kind.value}'
                          for kind, count in self._omitted.items()]
                self._begin = now
                self._shown.clear()
                self._lines.clear()
                self._omitted.clear()
            for incident in incidents:
                key = (incident.kind, incident.parent, incident.child)
                if key in self._shown or self._lines[incident.kind] >= _LINES_PER_KIND:
                    self._omitted[incident.kind] += 1
                    continue
                self._shown.add(key)
                self._lines[incident.kind] += 1
                lines.append(str(incident))
        for line in lines:
            self._logger.warning(line)
