# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Hints about data that is missing from an answer: from the ROS graph, and from refusals."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
import threading
from typing import NamedTuple

from tf_tree_py.core.messages.guards import CURE, FAR, WHY_OLD
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import format_span, format_stamp
from tf_tree_py.core.text import shorten
from tf_tree_py.health.checks.finding import Finding
from tf_tree_py.health.checks.graph import graph_findings
from tf_tree_py.health.ros_graph import RosGraph
from tf_tree_py.reports.explanation import ExplainedEdge, Explanation

Edge = tuple[str, str]

# A hostile publisher may invent any number of edges; beyond this number none is recorded.
_MAX_EDGES = 1_000
_OTHER_TOPIC = 'other_topic'


class Hint(NamedTuple):
    """
    A hint.

    :ivar about: differs from that of another hint; of a text with numbers that grow, without them.
    :ivar text: one or several sentences.
    """

    about: str
    text: str


def hint_of(finding: Finding) -> str:
    """Return a finding with its remedy, in sentences."""
    return f'{_sentence(finding.summary)}. {_sentence(finding.fix)}'


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def hints_of_graph(graph: RosGraph, explanation: Explanation | None) -> list[Hint]:
    """
    Return what the graph shows that may explain a missing answer.

    :param explanation: of the lookup; other topics matter only if it lacks a frame or an edge.
        None: nothing has arrived at all.
    """
    lacks_edge = explanation is None or bool(explanation.unknown) or (
        explanation.pose is None and not explanation.frames)
    texts = [hint_of(finding) for finding in graph_findings(graph)
             if lacks_edge or finding.code != _OTHER_TOPIC]
    return [Hint(text, text) for text in texts]


# --- refusals

@dataclass
class _Refused:
    """
    The samples of one edge that were refused since its newest stamp has been in the buffer.

    :ivar newest: that stamp, nanoseconds.
    :ivar first: the stamp of the first of them.
    :ivar last: the newest of their stamps.
    :ivar seen: how many of them were reported in an earlier look.
    """

    newest: int
    first: int
    last: int
    authority: str
    count: int = 0
    seen: int = 0


class Refusals(Observer):
    """The samples that a buffer refuses because they are older than it keeps, by edge."""

    def __init__(self, *, recorded: bool) -> None:
        """
        Begin without any.

        :param recorded: whether the samples are of a recording: it does not change.
        """
        self._recorded = recorded
        self._lock = threading.Lock()
        self._edges: dict[Edge, _Refused] = {}

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Record the refusals."""
        for one in incidents:
            if one.kind is Kind.OLD_DATA:
                with self._lock:
                    self._record((one.parent, one.child), one)

    def _record(self, edge: Edge, incident: Incident) -> None:
        refused = self._edges.get(edge)
        if refused is None and len(self._edges) >= _MAX_EDGES:
            return
        if refused is None or refused.newest != incident.newest:
            refused = self._edges[edge] = _Refused(
                incident.newest, incident.stamp, incident.stamp, incident.authority)
        refused.count += 1
        refused.last = max(refused.last, incident.stamp)
        refused.authority = incident.authority

    def hints(self, edges: Iterable[ExplainedEdge], now: int) -> Iterator[Hint]:
        """
        Yield a hint for each edge whose samples have been refused since the last look.

        Their stamps go on, and the newest stamp in the buffer does not: the sender has begun a
        new run. A single late sample causes no hint.

        :param edges: of the path of a lookup.
        :param now: the time by the clock of the stamps, nanoseconds; 0: unknown.
        """
        for edge in edges:
            with self._lock:
                refused = self._edges.get((edge.info.parent, edge.info.child))
                if refused is None or refused.newest != edge.info.latest:
                    continue
                news, refused.seen = refused.count - refused.seen, refused.count
                if news and refused.last > refused.first:
                    yield self._hint(edge, refused, now)

    def _hint(self, edge: ExplainedEdge, refused: _Refused, now: int) -> Hint:
        name = f'{shorten(edge.info.parent, 80)} -> {shorten(edge.info.child, 80)}'
        sender = f' from {refused.authority}' if refused.authority else ''
        return Hint(f'old {name} {refused.newest}', (
            f'{refused.count} transforms of {name}{sender} were refused, because they are older '
            f'than the buffer keeps: its newest stamp is {format_stamp(refused.newest)}, and the '
            f'newest of theirs {format_stamp(refused.last)}. {self._why(refused.newest, now)}'))

    def _why(self, newest: int, now: int) -> str:
        """Return why samples are older than the newest one, and what to do."""
        if self._recorded:
            return f'{WHY_OLD}. --at STAMP answers for every stamp of the recording'
        again = 'Restart tf_echo to see the new data'
        if now and newest - now > FAR:
            return (f'The newest stamp is {format_span(newest - now)} ahead of the clock, and '
                    f'wrong: Buffer(max_future=...) in your node refuses such stamps. {again}')
        return f'{WHY_OLD}. {CURE} in your node. {again}'
