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

"""Every edge of a tree with what is wrong with it and its present rate, trouble first."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .checks.finding import Finding, Severity
from .doctor import Doctor
from .vitals.edge import Edge
from .vitals.signs import Signs

# Rates are taken over at least this time, seconds: over less they flicker.
_WINDOW_S = 5.0
# An edge has stopped if it was silent for a second and for this many usual intervals.
_MISSED = 3.0
_SILENT_S = 1.0
# Sorts edges without a finding behind all severities.
_WELL = len(Severity)


@dataclass(frozen=True)
class Watched:
    """
    One edge, and what is wrong with it.

    :ivar rate_hz: how many arrived a second of late; 0 for a static edge.
    :ivar findings: the worst first.
    """

    signs: Signs
    rate_hz: float
    findings: tuple[Finding, ...]

    @property
    def severity(self) -> Severity | None:
        """Return the severity of the worst finding; None without findings."""
        return self.findings[0].severity if self.findings else None

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data: always the same keys."""
        severity = self.severity
        return {**self.signs.as_dict(), 'rate_hz': self.rate_hz,
                'severity': None if severity is None else severity.value,
                'codes': [finding.code for finding in self.findings]}


class Monitor:
    """Looks at what a doctor knows, again and again; in one thread."""

    def __init__(self, doctor: Doctor) -> None:
        self._doctor = doctor
        # The times of the last looks, seconds, and how many of each edge had arrived by then.
        self._looks: deque[tuple[float, dict[Edge, int]]] = deque()

    def look(self, now: float, findings: Sequence[Finding]) -> list[Watched]:
        """
        Return every edge, those with the worst trouble first, static ones last.

        :param now: by a monotonic clock, seconds.
        :param findings: of the doctor, just now.
        """
        signs = self._doctor.signs()
        rates = self._rates(now, signs)
        of_edge: dict[Edge, list[Finding]] = {}
        for finding in findings:
            for edge in _edges_of(finding):
                of_edge.setdefault(edge, []).append(finding)
        rows = [Watched(one, rates[one.parent, one.child],
                        tuple(of_edge.get((one.parent, one.child), ()))) for one in signs]
        return sorted(rows, key=lambda row: (
            _WELL if row.severity is None else row.severity.rank, row.signs.static))

    def _rates(self, now: float, signs: Sequence[Signs]) -> dict[Edge, float]:
        while len(self._looks) > 1 and now - self._looks[1][0] >= _WINDOW_S:
            self._looks.popleft()
        since, counts = self._looks[0] if self._looks else (now, {})
        self._looks.append((now, {(one.parent, one.child): one.count for one in signs}))
        return {edge: _rate(one, now - since, one.count - counts[edge] if edge in counts else 0)
                for one in signs for edge in [(one.parent, one.child)]}


def _rate(signs: Signs, seconds: float, count: int) -> float:
    """Return the rate over the last seconds, if several came then; else that of all time."""
    if signs.static or not signs.rate_hz:
        return 0.0
    if count > 1 and seconds > 0.0:
        return count / seconds
    silent_s = (signs.silence or 0) / 1e9
    return 0.0 if silent_s > _SILENT_S + _MISSED / signs.rate_hz else signs.rate_hz


def _edges_of(finding: Finding) -> list[Edge]:
    """Return the edges that a finding may be about: from each of its frames to the last one."""
    return [(parent, finding.frames[-1]) for parent in finding.frames[:-1]]
