# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The findings of a doctor."""

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from enum import Enum
import math

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
