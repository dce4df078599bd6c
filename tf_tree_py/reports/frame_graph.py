# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The frames of a buffer as a graph, with its problems."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tf_tree_py.core.stamp import ANOTHER_CLOCK, format_span, is_silent, LATEST
from tf_tree_py.core.text import listed
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.core.tree.queries import Queries

Edge = tuple[str, str]


class RefusedEdge(NamedTuple):
    """
    An edge that would have closed a loop.

    :ivar publishers: the possible senders.
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

    :ivar info: its stored samples and its last sender.
    :ivar age: from its newest sample to now, nanoseconds; None for a static edge.
    :ivar stale: whether it is silent: its next sample is overdue.
    :ivar silence: how long it has been silent, nanoseconds.
    """

    info: EdgeInfo
    age: int | None
    stale: bool
    silence: int = 0

    @property
    def rate_hz(self) -> float:
        """Return the number of stored samples per second; 0 for a static edge."""
        return self.info.rate_hz

    @property
    def remark(self) -> str:
        """Return its kind and its state in words."""
        if self.info.static:
            return 'static'
        rate = f'{self.rate_hz:.1f} Hz' if self.rate_hz else 'one sample'
        return f'{rate}, stale for {format_span(self.silence)}' if self.stale else rate


@dataclass(frozen=True)
class FrameGraph:
    """
    The frames of a buffer, and the edges between them.

    :ivar frames: every name, in order of first appearance.
    :ivar roots: the frames without a parent; if there are several, their trees are not
        connected.
    :ivar edges: the edges in the buffer.
    :ivar refused: edges that would have closed a loop.
    """

    frames: tuple[str, ...]
    roots: tuple[str, ...]
    edges: tuple[GraphEdge, ...]
    refused: tuple[RefusedEdge, ...] = ()

    @property
    def remarks(self) -> list[str]:
        """Return a description of each problem."""
        found = []
        if len(self.roots) > 1:
            found.append(f'{len(self.roots)} trees that are not connected, below '
                         f'{listed(self.roots, 8)}')
        found += [f'{edge.parent} -> {edge.child} would close a loop and is refused; from '
                  f'{listed(edge.publishers) or "an unknown publisher"}' for edge in self.refused]
        found += [f'{edge.info.parent} -> {edge.info.child} is stale: silent for '
                  f'{format_span(edge.silence)}' for edge in self.edges if edge.stale]
        return found

    def as_dict(self) -> dict[str, object]:
        """Return the graph as plain data, always with the same keys."""
        return {
            'frames': list(self.frames), 'roots': list(self.roots),
            'edges': [{**edge.info._asdict(), 'rate_hz': edge.rate_hz, 'age': edge.age,
                       'stale': edge.stale} for edge in self.edges],
            'refused': [{**edge._asdict(), 'publishers': list(edge.publishers)}
                        for edge in self.refused],
            'remarks': self.remarks,
        }


def frame_graph(tree: Queries, now: int = 0, refused: Sequence[RefusedEdge] = (),
                silent: Mapping[Edge, int] | None = None) -> FrameGraph:
    """
    Return the frames of a buffer or a snapshot as a graph.

    :param now: the time by the clock of the stamps, nanoseconds; 0: unknown.
    :param refused: edges that would have closed a loop, from an observer.
    :param silent: the silent edges and how long each has been silent, from an observer. None:
        this is derived from the stamps, which do not distinguish silent edges from late ones.
    """
    infos = tree.edges()
    children = {info.child for info in infos}
    newest = max((info.latest for info in infos if not info.static), default=LATEST)
    # If the stamps come from another clock, the newest stamp is used as the current time.
    now = now if abs(now - newest) < ANOTHER_CLOCK else newest
    return FrameGraph(
        tuple(tree.frames()),
        tuple(dict.fromkeys(info.parent for info in infos if info.parent not in children)),
        tuple(_judged(info, now, silent) for info in infos), tuple(refused))


def _judged(info: EdgeInfo, now: int, silent: Mapping[Edge, int] | None) -> GraphEdge:
    if info.static:
        return GraphEdge(info, None, False)
    age = now - info.latest
    if silent is None:
        return GraphEdge(info, age, is_silent(age, info.interval), age)
    edge = info.parent, info.child
    return GraphEdge(info, age, edge in silent, silent.get(edge, 0))
