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

"""Counts of what arrives, by edge: how many transforms, how late, how many refused."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import threading

from .incidents import count_refused, Incident, Kind
from .observers import Observer

Edge = tuple[str, str]

# A hostile publisher may invent any number of frames, with names of any length. Edges beyond
# this number, and those with longer names, are counted together as one, _REST.
_MAX_EDGES = 1_000
_LONGEST_NAMES = 10_000
_REST = ('', '')


@dataclass
class Arrivals:
    """
    What arrived of one edge.

    A delay is the time from the stamp to the arrival, nanoseconds. It is negative if the
    publisher's clock is ahead.

    :ivar count: transforms, with those that were refused.
    :ivar timed: how many of them have a delay: all that arrived after the clock began.
    :ivar incidents: how often each kind happened.
    """

    count: int = 0
    timed: int = 0
    total_delay: int = 0
    longest_delay: int = 0
    shortest_delay: int = 0
    incidents: Counter[Kind] = field(default_factory=Counter)

    @property
    def mean_delay(self) -> float:
        """Return the mean delay, nanoseconds; 0 if no delay was measured."""
        return self.total_delay / max(self.timed, 1)

    @property
    def refused(self) -> int:
        """Return how many were not taken."""
        return count_refused(self.incidents)

    def add_delay(self, delay: int) -> None:
        """Count one more delay."""
        first = self.timed == 0
        self.longest_delay = delay if first else max(self.longest_delay, delay)
        self.shortest_delay = delay if first else min(self.shortest_delay, delay)
        self.total_delay += delay
        self.timed += 1

    def __add__(self, other: 'Arrivals') -> 'Arrivals':
        """Return what arrived in two times together; ``merging.merged`` adds whole tables."""
        if not isinstance(other, Arrivals):
            return NotImplemented
        timed = [arrivals for arrivals in (self, other) if arrivals.timed]
        return Arrivals(
            self.count + other.count,
            self.timed + other.timed,
            self.total_delay + other.total_delay,
            max((arrivals.longest_delay for arrivals in timed), default=0),
            min((arrivals.shortest_delay for arrivals in timed), default=0),
            self.incidents + other.incidents)


class Meter(Observer):
    """
    Counts what arrives in a buffer that it observes; see ``BufferCore.observers``.

    Costs about a microsecond a transform. May be fed and read from any thread.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        """
        Start with no counts.

        :param now: the clock that the stamps were taken from, nanoseconds; it returns 0
            before it has begun.
        """
        self._now = now
        self._lock = threading.Lock()
        self._edges: dict[Edge, Arrivals] = {}

    def arrived(self, edges: Sequence[tuple[str, str]], stamps: Sequence[int]) -> None:
        """Take note of moving transforms that arrived just now, whatever becomes of them."""
        now = self._now()
        with self._lock:
            for (parent, child), stamp in zip(edges, stamps, strict=True):
                arrivals = self._of(parent, child)
                arrivals.count += 1
                if now > 0:
                    arrivals.add_delay(now - stamp)

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Take note of what was refused or odd."""
        with self._lock:
            for incident in incidents:
                self._of(incident.parent, incident.child).incidents[incident.kind] += 1

    def take(self) -> dict[Edge, Arrivals]:
        """Return what arrived since the last time, by (parent, child)."""
        with self._lock:
            taken, self._edges = self._edges, {}
        return taken

    def _of(self, parent: str, child: str) -> Arrivals:
        edge = parent, child
        if edge not in self._edges:
            if len(self._edges) >= _MAX_EDGES or len(parent) + len(child) > _LONGEST_NAMES:
                edge = _REST
            return self._edges.setdefault(edge, Arrivals())
        return self._edges[edge]
