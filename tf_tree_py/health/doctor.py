# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The doctor: observes a buffer, and returns findings at any time.

The monitor combines them with the present rate of every edge; the worst edges come first.
"""

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

from tf_tree_py.core import fork_locks
from tf_tree_py.core.messages.incidents import Incident, Kind, REMARKS
from tf_tree_py.core.messages.observers import Endpoint, Observer, ReceivedMessage
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.text import shorten

from .checks.case import Case, is_frozen_now, Trouble
from .checks.catalogue import CHECKS, CODES
from .checks.finding import Check, Finding, Severity
from .measures.edge_record import Edge, EdgeRecord, is_stale, Parents, Symptoms, symptoms_of
from .measures.sample_rows import MessageColumn, MessageColumns, RecentSamples
from .measures.thresholds import Thresholds
from .ros_graph import NO_GRAPH

# A hostile publisher may invent any number of frames. Beyond these numbers nothing is added.
_MAX_EDGES = 10_000
_MAX_NAMES = 1_000
# Nor is an edge with a name of more characters than this; a buffer accepts 1024 bytes by default.
_LONGEST = 1_000
# A comparison of the clocks is reused for this long.
_A_MOMENT = from_seconds(0.1)
# At most this many findings of one code are returned.
_MAX_ALIKE = 100
_PLACES = {code: place for place, code in enumerate(CODES)}


class Doctor(Observer):
    """
    Examines the messages and refusals of a buffer, as one of its ``observers``.

    ``findings`` may be called at any time, from any thread. Receiving a message costs almost
    nothing; when thousands of transforms have accumulated, they are processed at some
    microseconds each. An edge takes some kilobytes, regardless of how long it is watched.

    :ivar endpoints: the publishers and subscriptions; set by callers with access to the graph.
    :ivar graph: what else the ROS graph shows; likewise.
    """

    def __init__(self, limits: Thresholds | None = None, *, recorded: bool = False) -> None:
        """
        Begin without data.

        :param limits: the limits beyond which something becomes a finding.
        :param recorded: whether the messages are of a recording: there, waiting is no remedy.
        """
        self.recorded = recorded
        self.limits = limits or Thresholds()
        self.endpoints: Sequence[Endpoint] = ()
        self.graph = NO_GRAPH
        self._lock = fork_locks.lock()
        self._gathering = MessageColumns()
        self._edges: dict[Edge, EdgeRecord] = {}
        self._parents: dict[str, Parents] = {}
        self._troubles: dict[tuple[Kind, str, str], Trouble] = {}
        self._recent: dict[Edge, RecentSamples] = {}
        self._slashed: set[str] = set()
        self._transforms = self._first = self._last = 0
        # The last case that was examined.
        self._compared: Case | None = None

    # --- receiving

    def received(self, arrival: ReceivedMessage) -> None:
        """Record a message."""
        with self._lock:
            self._first = self._first or arrival.received
            self._last = arrival.received or self._last
            self._transforms += len(arrival.batch.edges)
            if arrival.batch.slashed and len(self._slashed) < _MAX_NAMES:
                self._slashed.update(arrival.batch.slashed)
            if self._gathering.add(arrival):
                self._digest()

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Record refusals and remarks."""
        with self._lock:
            for incident in incidents:
                edge = shorten(incident.parent, _LONGEST), shorten(incident.child, _LONGEST)
                key = incident.kind, *edge
                trouble = self._troubles.get(key)
                if trouble is None:
                    if len(self._troubles) >= _MAX_NAMES:
                        continue
                    trouble = self._troubles[key] = Trouble(detail=incident.detail)
                trouble.count += 1
                self._recent.setdefault(edge, RecentSamples()).incidents[incident.kind] += 1
                if len(trouble.authorities) < len(Kind):
                    trouble.authorities.setdefault(incident.authority)

    def _digest(self) -> None:
        """Process the messages that have accumulated."""
        of_child: dict[str, list[MessageColumn]] = {}
        for column in self._gathering.pop():
            edge = self._edges.get(column.edge)
            if edge is None:
                if (len(self._edges) >= _MAX_EDGES
                        or max(map(len, column.edge)) > _LONGEST):
                    continue
                edge = self._edges[column.edge] = EdgeRecord(*column.edge)
            edge.add(column, self.limits)
            if not column.static:
                self._recent.setdefault(column.edge, RecentSamples()).add(column.rows)
            of_child.setdefault(edge.child, []).append(column)
        for child, columns in of_child.items():
            self._parents.setdefault(child, Parents()).add(columns)

    # --- reporting

    @property
    def transforms(self) -> int:
        """Return the number of transforms that have arrived."""
        return self._transforms

    @property
    def watched(self) -> int:
        """Return the time from the first message to the last, nanoseconds."""
        return self._last - self._first

    def pop_recent(self) -> dict[Edge, RecentSamples]:
        """Return the data since the last call, by (parent, child); for one caller only."""
        with self._lock:
            self._digest()
            taken, self._recent = self._recent, {}
        return taken

    def signs(self, now: int = 0) -> list[Symptoms]:
        """
        Return the present measurements of every edge, in order of first appearance.

        :param now: the time by the clock of the arrivals, nanoseconds; 0: that of the last
            arrival.
        """
        with self._lock:
            self._digest()
            refused: Counter[Edge] = Counter()
            for (kind, *edge), trouble in self._troubles.items():
                refused[edge[0], edge[1]] += 0 if kind in REMARKS else trouble.count
            now = max(now, self._last)
            timebase = self._recent_case(now).timebase
            return [symptoms_of(edge, refused[edge.frames], now, timebase)
                    for edge in self._edges.values()]

    def left_behind(self, now: int = 0) -> set[Edge]:
        """
        Return the edges that cannot answer a lookup for the present.

        They are silent, or their stamps are frozen or come from another clock.

        :param now: as for ``signs``.
        """
        with self._lock:
            self._digest()
            now = max(now, self._last)
            case = self._recent_case(now)
            return {edge.frames for edge, moving in case.moving()
                    if is_stale(edge, now, case.timebase) or is_frozen_now(moving)
                    or (moving.timing.last and not case.goes_by_main_clock(edge))}

    def findings(self, now: int = 0, checks: Iterable[Check] = CHECKS) -> list[Finding]:
        """
        Return the present findings, the worst first, without mere symptoms.

        :param now: as for ``signs``.
        :param checks: the checks to apply.
        """
        with self._lock:
            self._digest()
            case = self._compared = self._case(now)
            found = [finding for check in checks
                     for finding in islice(check.findings(case), _MAX_ALIKE)]
        return sorted(_causes(found), key=lambda finding: (
            finding.severity.rank, _PLACES[finding.code], -finding.evidence.get('count', 0)))

    def _recent_case(self, now: int) -> Case:
        """Return the last case if it is recent: comparing the clocks takes the most time."""
        if self._compared is None or not 0 <= now - self._compared.now < _A_MOMENT:
            self._compared = self._case(now)
        return self._compared

    def _case(self, now: int) -> Case:
        return Case(self._edges.values(), self._parents, self._troubles, self._slashed,
                    self.endpoints, self.limits, max(now, self._last), self.recorded,
                    self.graph)


def _causes(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings that are not symptoms of another one."""
    causes = [(finding, CODES[finding.code].explains) for finding in findings
              if CODES[finding.code].explains]
    return [finding for finding in findings
            if not any(cause.causes(finding, explains) for cause, explains in causes)]


# --- the edges with their findings

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

    def look(self, now: float, findings: Sequence[Finding], clock: int) -> list[Watched]:
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
        return {edge: _rate(one, now - since, one.count - counts.get(edge, one.count))
                for one in signs for edge in [(one.parent, one.child)]}


def _rate(signs: Symptoms, seconds: float, count: int) -> float:
    """Return the rate over the last seconds if several samples arrived; else the overall rate."""
    if not signs.rate_hz:
        return 0.0
    if count > 1 and seconds > 0.0:
        return count / seconds
    return 0.0 if signs.stale else signs.rate_hz


def _edges_of(finding: Finding) -> list[Edge]:
    """Return the edges that a finding may concern: from each of its frames to the last one."""
    return [(parent, finding.frames[-1]) for parent in finding.frames[:-1]]
