# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The frames of a buffer as a graph with its problems, also in DOT and Mermaid."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tf_tree_py.core.stamp import ANOTHER_CLOCK, format_span, is_silent, LATEST
from tf_tree_py.core.text import listed, shorten
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.core.tree.queries import Queries

from .plain_text import quoted

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


# --- drawings

# Characters of a name in a drawing.
_LONGEST = 48


class Style(NamedTuple):
    """How an edge and its child are drawn: two colours."""

    fill: str
    line: str


STYLES = {'moving': Style('#ffffff', '#222222'), 'static': Style('#f2f2f2', '#8a8a8a'),
          'stale': Style('#ffd9cc', '#c43c00')}
REFUSED, ROOT, ROOT_ALONE = '#c00000', '#e8eef7', '#ffe3b3'
"""The colours of a refused edge, of the only root, and of one of several."""


def as_dot(graph: FrameGraph) -> str:
    """Return the graph for graphviz, from left to right, with problems in colour and words."""
    return '\n'.join(['digraph frames {', '  rankdir=LR; nodesep=0.12; ranksep=0.35;',
                      '  node [shape=box, style="rounded,filled", fillcolor=white, '
                      'fontname="Helvetica", fontsize=11, height=0.3];',
                      '  edge [arrowsize=0.6];', *_dot_lines(graph), '}', ''])


def _dot_lines(graph: FrameGraph) -> Iterator[str]:
    alone = len(graph.roots) <= 1
    for root in graph.roots:
        label, colour = '\n'.join(label_of_root(graph, root)), ROOT if alone else ROOT_ALONE
        yield f'  {quoted(root)} [label={quoted(label)}, fillcolor="{colour}", penwidth=2];'
    for edge in graph.edges:
        look = STYLES[style_of(edge)]
        yield (f'  {quoted(edge.info.child)} [label={quoted(chr(10).join(label_of(edge)))}, '
               f'fillcolor="{look.fill}", color="{look.line}"];')
        yield (f'  {quoted(edge.info.parent)} -> {quoted(edge.info.child)} '
               f'[color="{look.line}", style={"dashed" if edge.info.static else "solid"}];')
    for bad in graph.refused:
        yield (f'  {quoted(bad.parent)} -> {quoted(bad.child)} [constraint=false, '
               f'color="{REFUSED}", fontcolor="{REFUSED}", style=bold, '
               f'label={quoted("refused: a loop")}];')


def as_mermaid(graph: FrameGraph) -> str:
    """Return the graph as a flowchart of Mermaid, which Markdown pages draw."""
    numbers = {frame: f'f{number}' for number, frame in enumerate(graph.frames)}
    lines = ['flowchart LR']
    labels: dict[str, Sequence[str]] = {
        edge.info.child: label_of(edge) for edge in graph.edges}
    for frame, name in numbers.items():
        label = labels.get(frame) or label_of_root(graph, frame)
        text = '<br/>'.join(_mermaid_text(line) for line in label)
        lines.append(f'  {name}["{text}"]')
    for edge in graph.edges:
        arrow = '-.->' if edge.info.static else '-->'
        lines.append(f'  {numbers[edge.info.parent]} {arrow} {numbers[edge.info.child]}')
        if edge.stale:
            lines.append(f'  style {numbers[edge.info.child]} fill:{STYLES["stale"].fill}')
    lines += [f'  {numbers[bad.parent]} ==>|refused: a loop| {numbers[bad.child]}'
              for bad in graph.refused if {bad.parent, bad.child} <= numbers.keys()]
    if len(graph.roots) > 1:
        lines += [f'  style {numbers[root]} fill:{ROOT_ALONE}' for root in graph.roots]
    return '\n'.join(lines) + '\n'


def _mermaid_text(text: str) -> str:
    """Return untrusted text, escaped for a quoted string of Mermaid."""
    return ''.join(char if char.isalnum() or char in ' _-/.,:' else f'#{ord(char)};'
                   for char in text)


def style_of(edge: GraphEdge) -> str:
    """Return the name of an edge's style."""
    return 'stale' if edge.stale else 'static' if edge.info.static else 'moving'


def label_of(edge: GraphEdge) -> list[str]:
    """Return the lines of a child's label, which describe its edge."""
    sender = f', {short(edge.info.authority)}' if edge.info.authority else ''
    return [short(edge.info.child), f'{edge.remark}{sender}']


def label_of_root(graph: FrameGraph, root: str) -> list[str]:
    """Return the lines of the label of a frame without a parent."""
    return [short(root)] if len(graph.roots) <= 1 else [short(root), 'a separate tree']


def short(name: str) -> str:
    """Return a name, shortened for a drawing."""
    return shorten(name, _LONGEST) if name.isprintable() else repr(shorten(name, _LONGEST))
