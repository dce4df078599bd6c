# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every edge of a tree with its findings and its present rate; the worst edges come first."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from .checks.finding import Finding, Severity
from .doctor import Doctor
from .measures.edge_record import Edge, Symptoms

# Rates are averaged over at least this time, seconds; over a shorter time they fluctuate.
_WINDOW_S = 5.0
# Sorts edges without a finding after all severities.
_WELL = len(Severity)


@dataclass(frozen=True)
class Watched:
    """
    One edge and its findings.

    :ivar rate_hz: the recent samples per second; 0 for a static edge.
    :ivar findings: the worst first.
    """

    signs: Symptoms
    rate_hz: float
    findings: tuple[Finding, ...]

    @property
    def severity(self) -> Severity | None:
        """Return the severity of the worst finding; None without findings."""
        return self.findings[0].severity if self.findings else None

    def as_dict(self) -> dict[str, object]:
        """Return the edge as plain data, always with the same keys."""
        severity = self.severity
        return {**self.signs.as_dict(), 'rate_hz': self.rate_hz,
                'severity': None if severity is None else severity.value,
                'codes': [finding.code for finding in self.findings]}


class Monitor:
    """Combines a doctor's measurements and findings repeatedly; for one thread."""

    def __init__(self, doctor: Doctor) -> None:
        self._doctor = doctor
        # The times of the last looks, seconds, and the number of samples of each edge by then.
        self._looks: deque[tuple[float, dict[Edge, int]]] = deque()

    def look(self, now: float, findings: Sequence[Finding], clock: int = 0) -> list[Watched]:
        """
        Return every edge by severity, the worst first; of one severity, moving edges first.

        :param now: the time by a monotonic clock, seconds.
        :param findings: the present findings of the doctor.
        :param clock: the time by the clock of the arrivals, nanoseconds; 0: that of the last
            arrival.
        """
        signs = self._doctor.signs(clock)
        rates = self._rates(now, signs)
        of_edge: dict[Edge, list[Finding]] = {}
        for finding in findings:
            for edge in _edges_of(finding):
                of_edge.setdefault(edge, []).append(finding)
        rows = [Watched(one, rates[one.parent, one.child],
                        tuple(of_edge.get((one.parent, one.child), ()))) for one in signs]
        return sorted(rows, key=lambda row: (
            _WELL if row.severity is None else row.severity.rank, row.signs.static))

    def _rates(self, now: float, signs: Sequence[Symptoms]) -> dict[Edge, float]:
        while len(self._looks) > 1 and now - self._looks[1][0] >= _WINDOW_S:
            self._looks.popleft()
        since, counts = self._looks[0] if self._looks else (now, {})
        self._looks.append((now, {(one.parent, one.child): one.count for one in signs}))
        return {edge: _rate(one, now - since, one.count - counts[edge] if edge in counts else 0)
                for one in signs for edge in [(one.parent, one.child)]}


def _rate(signs: Symptoms, seconds: float, count: int) -> float:
    """Return the rate over the last seconds if several samples arrived; else the overall rate."""
    if signs.static or not signs.rate_hz:
        return 0.0
    if count > 1 and seconds > 0.0:
        return count / seconds
    return 0.0 if signs.stale else signs.rate_hz


def _edges_of(finding: Finding) -> list[Edge]:
    """Return the edges that a finding may concern: from each of its frames to the last one."""
    return [(parent, finding.frames[-1]) for parent in finding.frames[:-1]]
