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

"""
How the edges of a tree are: data first, with text and JSON beside it.

What is stored comes from a buffer or a snapshot. How often, how late and with what
trouble it arrived is known only to a ``Meter`` that watched, or to an archive.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
import json
from typing import Any

from .table import as_lines
from ..arrivals.meters import Arrivals, Edge
from ..stamp import format_span, format_stamp
from ..text import shorten
from ..tree.outline import EdgeInfo
from ..tree.queries import Queries

# Longer names are no help in a table.
_LONGEST_NAME = 80


@dataclass(frozen=True)
class EdgeDiagnosis:
    """
    How one edge is.

    :ivar info: what is stored of it; no samples if the tree does not hold it.
    :ivar arrivals: what arrived of it while somebody counted; static transforms are not
        counted.
    """

    info: EdgeInfo
    arrivals: Arrivals = field(default_factory=Arrivals)

    @property
    def interval(self) -> float:
        """Return the mean time between two samples, nanoseconds; 0 if there are not two."""
        return self.info.span / max(self.info.samples - 1, 1)

    @property
    def rate_hz(self) -> float:
        """Return how many samples a second come; 0 for a single one, and for static edges."""
        return 1e9 / self.interval if self.interval else 0.0

    @property
    def ahead(self) -> int:
        """Return how far a stamp was ahead of the clock at most, nanoseconds."""
        return max(0, -self.arrivals.shortest_delay)


@dataclass(frozen=True)
class Diagnosis:
    """
    How a tree is.

    :ivar frames: every frame name, in order of first appearance.
    :ivar roots: the frames that have children and no parent. More than one: the tree is
        in pieces, and no lookup goes from one to another.
    :ivar edges: the edges that the tree holds.
    :ivar absent: the edges of which something arrived, but that the tree does not hold:
        all was refused, or they were forgotten. One without names stands for messages that
        could not be read, and for edges beyond the number that a ``Meter`` tells apart.
    """

    frames: tuple[str, ...]
    roots: tuple[str, ...]
    edges: tuple[EdgeDiagnosis, ...]
    absent: tuple[EdgeDiagnosis, ...] = ()


_NOTHING: Mapping[Edge, Arrivals] = {}


def diagnose(tree: Queries, arrived: Mapping[Edge, Arrivals] = _NOTHING) -> Diagnosis:
    """
    Return how the edges of a buffer or a snapshot are.

    :param tree: the buffer or snapshot.
    :param arrived: what arrived, by (parent, child): of ``Meter.take``, or several of
        these ``merged``.
    """
    infos = {(info.parent, info.child): info for info in tree.edges()}
    children = {child for _, child in infos}
    parents = dict.fromkeys(parent for parent, _ in infos)
    return Diagnosis(
        tuple(tree.frames()),
        tuple(parent for parent in parents if parent not in children),
        tuple(EdgeDiagnosis(info, arrived.get(names, Arrivals()))
              for names, info in infos.items()),
        tuple(EdgeDiagnosis(EdgeInfo(*names, '', False, 0, 0, 0), arrivals)
              for names, arrivals in arrived.items() if names not in infos))


# --- text

_HEADINGS = ('parent -> child', 'from', 'rate [Hz]', 'samples', 'span', 'newest stamp [s]',
             'arrived', 'delay [ms]', 'at least', 'at most', 'refused or odd')
_NUMBERS = range(2, 10)


def as_text(diagnosis: Diagnosis) -> str:
    """Return a table for a terminal, a line for each edge."""
    pieces = ', '.join(map(_shown, diagnosis.roots)) or 'none'
    title = f'{len(diagnosis.frames)} frames, {len(diagnosis.edges)} edges, roots: {pieces}'
    edges = diagnosis.edges + diagnosis.absent
    if not edges:
        return title
    return '\n'.join([title, *as_lines([_HEADINGS, *map(_cells, edges)], _NUMBERS, rule=True)])


def _cells(edge: EdgeDiagnosis) -> tuple[str, ...]:
    info, arrivals = edge.info, edge.arrivals
    stored = ['static' if info.static else f'{edge.rate_hz:.3f}', str(info.samples)]
    stored += ['-', '-'] if info.static else [format_span(info.span), format_stamp(info.latest)]
    delays = [f'{delay / 1e6:.1f}' for delay in _delays(arrivals).values()]
    names = f'{_shown(info.parent)} -> {_shown(info.child)}'
    return (names if info.parent or info.child else 'others', _shown(info.authority) or '-',
            *(stored if info.samples else ['not in the tree', '-', '-', '-']),
            str(arrivals.count), *(delays or ['-'] * 3),
            ', '.join(f'{count} {kind}' for kind, count in _incidents(arrivals).items()))


def _shown(name: str) -> str:
    short = shorten(name, _LONGEST_NAME)
    return short if short.isprintable() else repr(short)


# --- JSON

def as_json(diagnosis: Diagnosis) -> str:
    """
    Return it as JSON, with the same keys always.

    Stamps, spans and delays are nanoseconds; ``delay`` is null where none was measured.
    Incidents go by the names that ``Kind`` prints.
    """
    return json.dumps({
        'frames': diagnosis.frames,
        'roots': diagnosis.roots,
        'edges': [_plain(edge) for edge in diagnosis.edges],
        'absent': [_plain(edge) for edge in diagnosis.absent],
    }, indent=2)


def _plain(edge: EdgeDiagnosis) -> dict[str, Any]:
    arrivals = edge.arrivals
    return {**edge.info._asdict(), 'span': edge.info.span, 'rate_hz': edge.rate_hz,
            'arrived': arrivals.count, 'delay': _delays(arrivals) or None,
            'incidents': _incidents(arrivals)}


def _delays(arrivals: Arrivals) -> dict[str, float]:
    """Return the three delays by their names; nothing where none was measured."""
    if not arrivals.timed:
        return {}
    return {'mean': arrivals.mean_delay, 'shortest': arrivals.shortest_delay,
            'longest': arrivals.longest_delay}


def _incidents(arrivals: Arrivals) -> dict[str, int]:
    return {kind.value: count for kind, count in arrivals.incidents.items()}
