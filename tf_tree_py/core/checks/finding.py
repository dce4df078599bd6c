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

"""What a doctor finds, and the catalogue of what can be found."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import Enum
import math
from typing import Any, NamedTuple

Number = int | float


class Severity(Enum):
    """How bad it is; the worst first."""

    ERROR = 'error'
    WARNING = 'warning'
    NOTE = 'note'

    @property
    def rank(self) -> int:
        """Return 0 for the worst."""
        return list(Severity).index(self)


class Code(NamedTuple):
    """
    What can be found.

    :ivar name: of the code.
    :ivar severity: the usual one; a finding may have another.
    :ivar catches: one sentence: what it is.
    :ivar cause: one sentence: where it usually comes from.
    :ivar fix: one sentence: what to do.
    :ivar explains: codes that are only symptoms of it where they concern the same frames.
    :ivar textbook: whether it is one of the textbook's failure modes.
    """

    name: str
    severity: Severity
    catches: str
    cause: str
    fix: str
    explains: frozenset[str] = frozenset()
    textbook: bool = False


@dataclass(frozen=True)
class Finding:
    """
    Something that is wrong, or worth knowing.

    :ivar code: its name in the catalogue.
    :ivar frames: whom it concerns; of an edge first the parent, then the child.
    :ivar publishers: who sends it, as far as that is known.
    :ivar summary: one sentence: what is wrong, with its numbers.
    :ivar evidence: the numbers by their names, which end in a unit: ``_s``, ``_m``,
        ``_deg``, ``_hz``; those without are counts.
    :ivar cause: where it most likely comes from.
    :ivar fix: what to do.
    """

    code: str
    severity: Severity
    frames: tuple[str, ...]
    publishers: tuple[str, ...]
    summary: str
    evidence: Mapping[str, Number] = field(default_factory=dict)
    cause: str = ''
    fix: str = ''

    def as_dict(self) -> dict[str, Any]:
        """
        Return it as plain data: always the same keys.

        A number of the evidence that is not finite becomes None, for JSON has no such number.
        """
        return {**asdict(self), 'severity': self.severity.value, 'frames': list(self.frames),
                'publishers': list(self.publishers),
                'evidence': {name: number if math.isfinite(number) else None
                             for name, number in self.evidence.items()}}
