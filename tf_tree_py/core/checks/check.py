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

"""What a check is: a code of the catalogue, and a function that looks for it."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from .case import Case, Trouble
from .finding import Code, Finding, Number, Severity
from ..arrivals.incidents import candidates
from ..vitals.edge import EdgeRecord


class Remark(NamedTuple):
    """
    What a check adds to the catalogue about one finding. Fields as those of ``Finding``.

    :ivar severity: None: the code's own; likewise '' for the cause and the fix.
    """

    summary: str
    frames: tuple[str, ...]
    publishers: tuple[str, ...]
    evidence: Mapping[str, Number]
    severity: Severity | None = None
    cause: str = ''
    fix: str = ''


Look = Callable[[Case], Iterable[Remark]]


class Check(NamedTuple):
    """A code, and the function that looks for it."""

    code: Code
    look: Look

    def findings(self, case: Case) -> Iterator[Finding]:
        """Yield the findings."""
        code = self.code
        for remark in self.look(case):
            yield Finding(
                code.name, remark.severity or code.severity, remark.frames, remark.publishers,
                remark.summary, remark.evidence, remark.cause or code.cause,
                remark.fix or code.fix)


def check(severity: Severity, *, catches: str, cause: str, fix: str,
          explains: Collection[str] = (), textbook: bool = False) -> Callable[[Look], Check]:
    """Make a check of a function; its name is that of the code."""
    def make(look: Look) -> Check:
        return Check(Code(look.__name__, severity, catches, cause, fix, frozenset(explains),
                          textbook), look)
    return make


def of_edge(edge: EdgeRecord, summary: str, evidence: Mapping[str, Number],
            **others: Any) -> Remark:
    """Return a remark on one edge; its names go in front of the summary."""
    return Remark(f'{edge} {summary}', edge.frames, publishers_of(edge), evidence, **others)


def of_trouble(frames: tuple[str, ...], summary: str, trouble: Trouble,
               **others: Any) -> Remark:
    """Return a remark on what the buffer refused or found odd."""
    return Remark(summary, frames, names_of(trouble.authorities),
                  {'count': trouble.count, **others.pop('evidence', {})}, **others)


def publishers_of(*edges: EdgeRecord) -> tuple[str, ...]:
    """Return who sends these edges, as far as that is known."""
    return names_of(authority for edge in edges for authority in edge.authorities)


def names_of(authorities: Iterable[str]) -> tuple[str, ...]:
    """Return all who may be meant by authorities, each once."""
    return tuple(dict.fromkeys(name for authority in authorities
                               for name in candidates(authority)))
