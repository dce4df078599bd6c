"""What arrives of each edge between two reports: how many, how late, what was refused."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import threading

from .incidents import Incident, Kind
from .observers import Observer

Edge = tuple[str, str]

# More are counted together, and those of longer names: somebody makes up frames.
_MAX_EDGES = 1_000
_LONGEST_NAMES = 10_000
_REST = ('', '')


@dataclass
class Arrivals:
    """
    What arrived of one edge.

    A delay is from the stamp to the arrival, nanoseconds; one below zero says that the
    publisher's clock is ahead.

    :ivar count: transforms, those refused included.
    :ivar timed: how many of them have a delay: all, once the clock has begun.
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
        """Return the mean delay, nanoseconds; 0 if there is none."""
        return self.total_delay / max(self.timed, 1)

    def add_delay(self, delay: int) -> None:
        """Take note of one more."""
        first = self.timed == 0
        self.longest_delay = delay if first else max(self.longest_delay, delay)
        self.shortest_delay = delay if first else min(self.shortest_delay, delay)
        self.total_delay += delay
        self.timed += 1


class Meter(Observer):
    """
    Counts what arrives in a buffer that it observes; see ``BufferCore.observers``.

    Costs about a microsecond a transform. May be fed and read from any thread.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        """
        Begin to count.

        :param now: the clock that stamps go by, nanoseconds; 0 before it has begun.
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

    def told(self, incidents: Sequence[Incident]) -> None:
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
