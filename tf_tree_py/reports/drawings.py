# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A graph of frames in DOT and Mermaid, which other programs draw; the styles of edges."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tf_tree_py.core.text import shorten

from .frame_graph import FrameGraph, GraphEdge
from .plain_text import quoted

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
