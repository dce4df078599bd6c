# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The findings of a doctor, and the checks that look for them."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import Enum
import math
from typing import Any, NamedTuple

from tf_tree_py.core.messages.incidents import candidates, is_ambiguous

from .case import Case, Trouble
from ..measures.edge_record import Edge, EdgeRecord

Number = int | float


class Severity(Enum):
    """The severity of a finding; the worst comes first."""

    ERROR = 'error'
    WARNING = 'warning'
    NOTE = 'note'

    @property
    def rank(self) -> int:
        """Return the place in the order; 0 for the worst."""
        return list(Severity).index(self)


@dataclass(frozen=True)
class Finding:
    """
    A problem, or something worth knowing.

    :ivar code: its name in the catalogue.
    :ivar frames: the affected frames; for an edge first the parent, then the child.
    :ivar edges: the affected edges, (parent, child); none if frames are affected.
    :ivar publishers: the publishers, as far as they are known.
    :ivar summary: the problem in one sentence, with its numbers.
    :ivar evidence: the numbers by name; a name ends in its unit: ``_s``, ``_m``, ``_deg``,
        ``_hz``; numbers without a unit are counts.
    :ivar cause: the most likely cause.
    :ivar fix: the remedy.
    :ivar one_of: whether it is not known which of the publishers it is.
    """

    code: str
    severity: Severity
    frames: tuple[str, ...]
    publishers: tuple[str, ...]
    summary: str
    evidence: Mapping[str, Number] = field(default_factory=dict)
    cause: str = ''
    fix: str = ''
    edges: tuple[tuple[str, str], ...] = ()
    one_of: bool = False

    @property
    def senders(self) -> str:
        """Return the publishers in words."""
        several = self.one_of and len(self.publishers) > 1
        return ('one of ' if several else '') + ', '.join(self.publishers)

    def causes(self, other: 'Finding', explains: Collection[str]) -> bool:
        """
        Return whether another finding is only a symptom of this one, and may be omitted.

        A warning never hides an error, nor does an edge hide its inverse.

        :param explains: of this finding's code.
        """
        return (other.code in explains and self.severity.rank <= other.severity.rank
                and bool(other.edges) and {*other.edges} <= {*self.edges})

    def as_dict(self) -> dict[str, object]:
        """
        Return the finding as plain data, always with the same keys.

        Evidence that is not finite becomes None, because JSON has no such numbers.
        """
        return {**asdict(self), 'severity': self.severity.value, 'frames': list(self.frames),
                'edges': [list(edge) for edge in self.edges],
                'publishers': list(self.publishers),
                'evidence': {name: number if math.isfinite(number) else None
                             for name, number in self.evidence.items()}}


# --- checks

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


def times(count: int) -> str:
    """Return a number of times, in words."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')
