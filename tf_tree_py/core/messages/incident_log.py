# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rate-limited log lines about incidents, readable even at a thousand incidents a second."""

from collections import Counter
from collections.abc import Iterable
import time
from typing import Protocol

from .incidents import Incident, Kind
from .. import fork_locks

_PERIOD_S = 10.0
_LINES_PER_KIND = 5


class Logger(Protocol):
    """Where lines are written: a logger of rclpy or of Python's ``logging``."""

    def warning(self, message: str, /) -> object:
        """Write one line."""


class IncidentLog:
    """
    Writes each edge's incident of a kind once per period, and a few lines of each kind.

    Omitted incidents are counted, and the counts are written when the next period begins.
    """

    def __init__(self, logger: Logger) -> None:
        """Start without incidents."""
        self._logger = logger
        self._lock = fork_locks.lock()
        self._begin = -_PERIOD_S
        self._shown: set[tuple[Kind, str, str]] = set()
        self._lines: Counter[Kind] = Counter()
        self._omitted: Counter[Kind] = Counter()

    def report(self, incidents: Iterable[Incident]) -> None:
        """Write a line for each incident, or count it as omitted."""
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
