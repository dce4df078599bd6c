# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A check: a code of the catalogue, and a function that looks for it."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from tf_tree_py.core.messages.incidents import candidates, is_ambiguous

from .case import Case, Trouble
from .finding import Finding, Number, Severity
from ..measures.edge_record import Edge, EdgeRecord


class Remark(NamedTuple):
    """
    The part of a finding that the catalogue does not contain; the fields of ``Finding``.

    :ivar authorities: its publishers; one may be ``one of a, b``.
    :ivar severity: None: the code's own; likewise '' for the cause and the fix.
    """

    summary: str
    frames: tuple[str, ...]
    authorities: Collection[str]
    evidence: Mapping[str, Number]
    severity: Severity | None = None
    cause: str = ''
    fix: str = ''
    edges: tuple[Edge, ...] = ()


Look = Callable[[Case], Iterable[Remark]]


class Check(NamedTuple):
    """
    An entry of the catalogue: a code, and the function that looks for it.

    :ivar name: of the code.
    :ivar severity: the usual severity; a finding may have a different one.
    :ivar catches: a description in one sentence.
    :ivar cause: the usual cause in one sentence.
    :ivar fix: the remedy in one sentence.
    :ivar recorded_fix: the remedy for a recording; '' if it is the same.
    :ivar explains: codes of which this one is the cause if both concern the same edge.
    :ivar textbook: whether it is one of the textbook's failure modes.
    """

    name: str
    severity: Severity
    catches: str
    cause: str
    fix: str
    recorded_fix: str
    explains: frozenset[str]
    textbook: bool
    look: Look

    def findings(self, case: Case) -> Iterator[Finding]:
        """Yield the findings."""
        fix = self.recorded_fix if case.recorded and self.recorded_fix else self.fix
        for remark in self.look(case):
            yield Finding(
                self.name, remark.severity or self.severity, remark.frames,
                names_of(remark.authorities), remark.summary, remark.evidence,
                remark.cause or self.cause, remark.fix or fix, remark.edges,
                any(map(is_ambiguous, remark.authorities)))


def check(severity: Severity, *, catches: str, cause: str, fix: str, recorded_fix: str = '',
          explains: Collection[str] = (), textbook: bool = False) -> Callable[[Look], Check]:
    """Make a check from a function; the function's name becomes the code's name."""
    return lambda look: Check(look.__name__, severity, catches, cause, fix, recorded_fix,
                              frozenset(explains), textbook, look)


def of_edge(edge: EdgeRecord, summary: str, evidence: Mapping[str, Number],
            **others: Any) -> Remark:
    """Return a remark on one edge; the summary begins with the edge's names."""
    return Remark(f'{edge} {summary}', edge.frames, authorities_of(edge), evidence,
                  edges=(edge.frames,), **others)


def of_trouble(frames: tuple[str, ...], summary: str, trouble: Trouble,
               **others: Any) -> Remark:
    """Return a remark on refusals or remarks of the buffer."""
    edges = (frames,) if len(frames) == 2 else ()
    return Remark(summary, frames, trouble.authorities,
                  {'count': trouble.count, **others.pop('evidence', {})}, edges=edges, **others)


def of_edges(edges: Sequence[EdgeRecord], summary: str, evidence: Mapping[str, Number],
             **others: Any) -> Remark:
    """Return a remark on edges that have a fault in common."""
    frames = tuple(dict.fromkeys(frame for edge in edges for frame in edge.frames))
    return Remark(summary, frames, authorities_of(*edges), evidence,
                  edges=tuple(edge.frames for edge in edges), **others)


def authorities_of(*edges: EdgeRecord) -> tuple[str, ...]:
    """Return the publishers of these edges, as far as they are known."""
    return tuple(dict.fromkeys(name for edge in edges for name in edge.authorities))


def names_of(authorities: Iterable[str]) -> tuple[str, ...]:
    """Return all nodes that the authorities may mean, each once."""
    return tuple(dict.fromkeys(name for authority in authorities
                               for name in candidates(authority)))
