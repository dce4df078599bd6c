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

"""The frames of a buffer as a graph: what hangs on what, and what somebody should look at."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .diagnosis import diagnose, EdgeDiagnosis
from ..stamp import format_span, from_seconds, LATEST
from ..text import listed
from ..tree.outline import EdgeInfo
from ..tree.queries import Queries

# An edge is stale if it missed this many samples and is silent for this long.
_MISSED = 10.0
_SILENT = from_seconds(1.0)
# Stamps further from the clock than this come from another clock.
_ANOTHER_CLOCK = from_seconds(3600.0)


class RefusedEdge(NamedTuple):
    """
    An edge that would have closed a loop.

    :ivar publishers: who may have sent it.
    :ivar times: how often it was refused.
    """

    parent: str
    child: str
    publishers: tuple[str, ...]
    times: int


@dataclass(frozen=True)
class GraphEdge:
    """
    One edge of a graph.

    :ivar info: what is stored of it, and who sent it last.
    :ivar age: from its newest sample to now, nanoseconds; None for a static edge.
    :ivar stale: whether it has stopped.
    """

    info: EdgeInfo
    age: int | None
    stale: bool

    @property
    def rate_hz(self) -> float:
        """Return how many samples a second are stored; 0 for a static edge."""
        return EdgeDiagnosis(self.info).rate_hz

    @property
    def remark(self) -> str:
        """Return its kind and its state in words."""
        if self.info.static:
            return 'static'
        rate = f'{self.rate_hz:.1f} Hz' if self.rate_hz else 'one sample'
        return f'{rate}, stale for {format_span(self.age or 0)}' if self.stale else rate


@dataclass(frozen=True)
class FrameGraph:
    """
    The frames of a buffer, and what hangs on what.

    :ivar frames: every name, in order of first appearance.
    :ivar roots: the frames on top; several: the trees below them are not connected.
    :ivar edges: what the buffer took.
    :ivar refused: what would have closed a loop.
    """

    frames: tuple[str, ...]
    roots: tuple[str, ...]
    edges: tuple[GraphEdge, ...]
    refused: tuple[RefusedEdge, ...] = ()

    @property
    def remarks(self) -> list[str]:
        """Return in words what somebody should look at."""
        found = []
        if len(self.roots) > 1:
            found.append(f'{len(self.roots)} trees that are not connected, below '
                         f'{listed(self.roots, 8)}')
        found += [f'{edge.parent} -> {edge.child} would close a loop and is refused; from '
                  f'{listed(edge.publishers) or "nobody knows whom"}' for edge in self.refused]
        found += [f'{edge.info.parent} -> {edge.info.child} is stale: its newest sample is '
                  f'{format_span(edge.age or 0)} old' for edge in self.edges if edge.stale]
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data, always with the same keys."""
        return {
            'frames': list(self.frames), 'roots': list(self.roots),
            'edges': [{**edge.info._asdict(), 'rate_hz': edge.rate_hz, 'age': edge.age,
                       'stale': edge.stale} for edge in self.edges],
            'refused': [{**edge._asdict(), 'publishers': list(edge.publishers)}
                        for edge in self.refused],
            'remarks': self.remarks,
        }


def frame_graph(tree: Queries, now: int = 0, refused: Sequence[RefusedEdge] = ()) -> FrameGraph:
    """
    Return the frames of a buffer or a snapshot as a graph.

    :param now: the time by the clock of the stamps, nanoseconds; 0: not known.
    :param refused: what would have closed a loop, from whoever watched.
    """
    diagnosis = diagnose(tree)
    newest = max((edge.info.latest for edge in diagnosis.edges if not edge.info.static),
                 default=LATEST)
    # If the stamps come from another clock, the newest stamp is taken for the time.
    now = now if abs(now - newest) < _ANOTHER_CLOCK else newest
    return FrameGraph(diagnosis.frames, diagnosis.roots,
                      tuple(_judged(edge, now) for edge in diagnosis.edges), tuple(refused))


def _judged(edge: EdgeDiagnosis, now: int) -> GraphEdge:
    if edge.info.static:
        return GraphEdge(edge.info, None, False)
    age = now - edge.info.latest
    return GraphEdge(edge.info, age, age > max(_SILENT, _MISSED * edge.interval))
