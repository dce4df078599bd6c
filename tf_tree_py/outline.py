# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A tree as text, with each frame under its parent."""

from collections.abc import Iterable, Iterator
import html
from typing import NamedTuple

from tf_tree_py.core.stamp import format_span, format_stamp
from tf_tree_py.core.tree.edge_info import counted, EdgeInfo

# More lines than this are not readable, and longer names do not fit on a screen.
_MAX_LINES = 200
_MAX_NAME = 80


def as_html(title: str, edges: list[EdgeInfo]) -> str:
    """Return a tree as HTML for a notebook."""
    lines = html.escape('\n'.join(outline(edges)))
    return f'<div>{html.escape(title)}</div><pre>{lines}</pre>'


def outline(edges: Iterable[EdgeInfo]) -> list[str]:
    """Return a line for each frame, below the line of its parent."""
    lines = [_shown(branch.frame) if branch.edge is None else
             f'{branch.lead}{_shown(branch.frame)}  {_remark(branch.edge)}'
             for branch in branches(edges)]
    if len(lines) > _MAX_LINES:
        lines[_MAX_LINES:] = [f'and {len(lines) - _MAX_LINES} more']
    return lines


class Branch(NamedTuple):
    """
    One frame of a tree that is drawn with characters.

    :ivar lead: the lines in front of its name, from its parent and from the frames above.
    :ivar edge: the edge to its parent; None for a root.
    """

    lead: str
    frame: str
    edge: EdgeInfo | None


def branches(edges: Iterable[EdgeInfo]) -> Iterator[Branch]:
    """Yield each frame under its parent, the roots in order of first appearance."""
    children: dict[str, list[EdgeInfo]] = {}
    for edge in edges:
        children.setdefault(edge.parent, []).append(edge)
    below = {edge.child for siblings in children.values() for edge in siblings}
    for root in children:
        if root not in below:
            yield Branch('', root, None)
            yield from _branches_below(root, children)


def _branches_below(root: str, children: dict[str, list[EdgeInfo]]) -> Iterator[Branch]:
    # The remaining edges, the next one last, each with the lead of its line, and whether a
    # sibling follows.
    waiting = [(edge, '', number > 0) for number, edge in enumerate(reversed(children[root]))]
    while waiting:
        edge, lead, more = waiting.pop()
        yield Branch(f'{lead}{"├─" if more else "└─"} ', edge.child, edge)
        lead += '│  ' if more else '   '
        waiting += [(below, lead, number > 0) for number, below
                    in enumerate(reversed(children.get(edge.child, ())))]


def _remark(edge: EdgeInfo) -> str:
    if edge.static:
        return 'static'
    if edge.samples == 1:
        return f'1 sample at {format_stamp(edge.latest)}'
    return (f'{counted(edge.samples, "sample")} in {format_span(edge.span)}, '
            f'the last at {format_stamp(edge.latest)}')


def _shown(name: str) -> str:
    short = name if len(name) <= _MAX_NAME else name[:_MAX_NAME - 1] + '…'
    return short if short.isprintable() else repr(short)
