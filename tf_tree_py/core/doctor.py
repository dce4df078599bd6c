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

"""The doctor: watches a buffer, and tells at any time what is wrong."""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import islice
import threading

from .arrivals.incidents import Incident, Kind, REMARKS
from .arrivals.observers import Observer
from .arrivals.received import Endpoint, Received
from .buffer.buffer_core import BufferCore
from .checks.case import Case, Trouble
from .checks.catalogue import CHECKS, CODES
from .checks.finding import Finding
from .vitals.edge import Edge, EdgeRecord, Parents
from .vitals.gathering import Column, Gathering
from .vitals.limits import Limits
from .vitals.signs import Signs, signs_of

# A hostile publisher may invent any number of frames. Beyond these numbers nothing new is noted.
_MAX_EDGES = 10_000
_MAX_NAMES = 1_000
# At most this many findings of one code are told.
_MAX_ALIKE = 100


class Doctor(Observer):
    """
    Hears what arrives in a buffer and what it refuses, as one of its ``observers``.

    ``findings`` may be asked at any time, from any thread. A message costs next to
    nothing; some microseconds for each of its transforms are spent when thousands have
    gathered. An edge takes some kilobytes, however long it is watched.

    :ivar endpoints: who sends and hears; set from outside by whoever knows the graph.
    """

    def __init__(self, limits: Limits | None = None) -> None:
        """
        Begin with nothing known.

        :param limits: beyond which something is worth a finding.
        """
        self.limits = limits or Limits()
        self.endpoints: Sequence[Endpoint] = ()
        self._lock = threading.Lock()
        self._gathering = Gathering()
        self._edges: dict[Edge, EdgeRecord] = {}
        self._parents: dict[str, Parents] = {}
        self._troubles: dict[tuple[Kind, str, str], Trouble] = {}
        self._slashed: set[str] = set()
        self._transforms = self._first = self._last = 0

    # --- hearing

    def received(self, arrival: Received) -> None:
        """Take a message."""
        with self._lock:
            self._first = self._first or arrival.received
            self._last = arrival.received
            self._transforms += len(arrival.batch.edges)
            if arrival.batch.slashed and len(self._slashed) < _MAX_NAMES:
                self._slashed.update(arrival.batch.slashed)
            if self._gathering.add(arrival):
                self._digest()

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Take what was refused or odd."""
        with self._lock:
            for incident in incidents:
                key = incident.kind, incident.parent, incident.child
                trouble = self._troubles.get(key)
                if trouble is None:
                    if len(self._troubles) >= _MAX_NAMES:
                        continue
                    trouble = self._troubles[key] = Trouble(detail=incident.detail)
                trouble.count += 1
                if len(trouble.authorities) < len(Kind):
                    trouble.authorities.setdefault(incident.authority)

    def _digest(self) -> None:
        """Look at the messages that have gathered."""
        of_child: dict[str, list[Column]] = {}
        for column in self._gathering.take():
            edge = self._edges.get(column.edge)
            if edge is None:
                if len(self._edges) >= _MAX_EDGES:
                    continue
                edge = self._edges[column.edge] = EdgeRecord(*column.edge)
            edge.add(column, self.limits)
            of_child.setdefault(edge.child, []).append(column)
        for child, columns in of_child.items():
            self._parents.setdefault(child, Parents()).add(columns)

    # --- telling

    @property
    def transforms(self) -> int:
        """Return how many transforms have arrived."""
        return self._transforms

    @property
    def watched(self) -> int:
        """Return the time from the first message to the last, nanoseconds."""
        return self._last - self._first

    def signs(self) -> list[Signs]:
        """Return what is measured of every edge by now, in order of first appearance."""
        with self._lock:
            self._digest()
            refused: Counter[Edge] = Counter()
            for (kind, *edge), trouble in self._troubles.items():
                refused[edge[0], edge[1]] += 0 if kind in REMARKS else trouble.count
            return [signs_of(edge, refused[edge.frames], self._last)
                    for edge in self._edges.values()]

    def findings(self) -> list[Finding]:
        """Return what is wrong by now, the worst first, without mere symptoms."""
        with self._lock:
            self._digest()
            case = Case(self._edges.values(), self._parents, self._troubles, self._slashed,
                        self.endpoints, self.limits)
            found = [finding for check in CHECKS
                     for finding in islice(check.findings(case), _MAX_ALIKE)]
        return sorted(_causes(found), key=lambda finding: finding.severity.rank)


def _causes(findings: Sequence[Finding]) -> Iterable[Finding]:
    """Yield the findings that no other one about the same frames explains."""
    explained: dict[str, list[set[str]]] = {}
    for finding in findings:
        for symptom in CODES[finding.code].explains:
            explained.setdefault(symptom, []).append({*finding.frames})
    for finding in findings:
        frames = {*finding.frames}
        if not frames or not any(frames <= others for others in explained.get(finding.code, ())):
            yield finding


def examine(arrivals: Iterable[Received], doctor: Doctor,
            buffer: BufferCore | None = None) -> BufferCore:
    """
    Let recorded messages arrive in a buffer that a doctor watches.

    :param buffer: None: a new one, that keeps what the doctor's limits say.
    :return: the buffer.
    """
    buffer = buffer or BufferCore(doctor.limits.cache_time)
    buffer.observers.add(doctor)
    for arrival in arrivals:
        buffer.observers.tell_received(arrival)
        buffer.insert_batch(arrival.batch, arrival.authority, arrival.static)
    buffer.observers.remove(doctor)
    return buffer
