# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The list of frames as a tree, with a search and with folded subtrees."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from tf_tree_py.core import EdgeInfo

from .moment import links_of, reached

# The longest list. A search finds the other frames.
MOST_ROWS = 150
# Fewer static frames than this are not folded.
_WORTH_A_FOLD = 4

Children = Mapping[str, Sequence[EdgeInfo]]


class FrameRow(NamedTuple):
    """
    One row of the list: a frame, or a line that stands for folded static frames.

    :ivar lead: the lines of the tree in front of the frame.
    :ivar static: whether its edge is static; None for a root.
    :ivar folds: None: the row is a frame. Else the text of a row that shows or hides the static
        frames below ``frame``.
    """

    frame: str
    lead: str
    static: bool | None
    folds: str | None = None


def rows(edges: Sequence[EdgeInfo], search: str = '',
         unfolded: Collection[str] | None = None) -> list[FrameRow]:
    """
    Return the rows of the list in the order of the tree, each child below its parent.

    :param search: list only frames whose names contain this text, in upper or lower case, and
        the frames above them.
    :param unfolded: frames whose static subtrees are listed. Large static subtrees of other
        frames are one row, unless the whole tree is static or there is a search. None: list
        all frames.
    """
    children: dict[str, list[EdgeInfo]] = {}
    for edge in edges:
        children.setdefault(edge.parent, []).append(edge)
    hung = {edge.child for edge in edges}
    part = search.strip().casefold()
    wanted = _found(edges, part)
    all_static = all(edge.static for edge in edges)
    folds = {} if unfolded is None or part or all_static else _folds(children)
    tree = _Tree(children, wanted, folds, unfolded or ())
    result: list[FrameRow] = []
    for root in dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung):
        if root in wanted:
            result.append(FrameRow(root, '', None))
            result += tree.below(root)
    return result


def _found(edges: Sequence[EdgeInfo], part: str) -> Collection[str]:
    """Return the frames whose names contain a text, and all frames above them."""
    parents = {edge.child: [edge.parent] for edge in edges}
    frames = dict.fromkeys(name for edge in edges for name in (edge.parent, edge.child))
    return {above for frame in frames if part in frame.casefold()
            for above in reached(frame, parents)}


def _folds(children: Children) -> dict[str, dict[str, int]]:
    """Return, by frame, its children whose subtrees are static, with the sizes of these."""
    sizes: dict[str, int] = {}
    edges = [edge for siblings in children.values() for edge in siblings]
    order = list(dict.fromkeys(edge.child for edge in edges))
    static = {edge.child: edge.static for edge in edges}
    waiting = order[::-1]
    while waiting:  # not recursive, because a chain may have thousands of frames
        frame = waiting[-1]
        below = [edge.child for edge in children.get(frame, ())]
        missing = [child for child in below if child not in sizes]
        if missing:
            waiting += missing
            continue
        waiting.pop()
        all_static = static[frame] and all(sizes[child] for child in below)
        sizes[frame] = 1 + sum(sizes[child] for child in below) if all_static else 0
    folds = {parent: {edge.child: sizes[edge.child] for edge in siblings if sizes[edge.child]}
             for parent, siblings in children.items()}
    return {parent: fold for parent, fold in folds.items() if sum(fold.values()) >= _WORTH_A_FOLD}


class _Tree(NamedTuple):
    """The tree while it is being listed."""

    children: Children
    wanted: Collection[str]
    folds: Mapping[str, Mapping[str, int]]
    unfolded: Collection[str]

    def below(self, root: str) -> list[FrameRow]:
        """Return the rows below a frame, without recursion, because a chain may be long."""
        result: list[FrameRow] = []
        waiting = self._siblings(root, '')
        while waiting:
            row = waiting.pop()
            more = row.lead.endswith('│  ')
            result.append(row._replace(lead=f'{row.lead[:-3]}{"├─" if more else "└─"} '))
            if row.folds is None:
                waiting += self._siblings(row.frame, row.lead)
        return result

    def _siblings(self, parent: str, lead: str) -> list[FrameRow]:
        """Return the rows directly below a frame, in reverse order."""
        fold = self.folds.get(parent, {})
        folded = parent not in self.unfolded
        rows = [FrameRow(edge.child, lead, edge.static) for edge in self.children.get(parent, ())
                if edge.child in self.wanted and not (folded and edge.child in fold)]
        if fold:
            count = sum(fold.values())
            sign = '▸' if folded else '▾'
            rows.append(FrameRow(parent, lead, None, f'{sign} {count} static on {parent}'))
        return [row._replace(lead=lead + ('│  ' if number else '   '))
                for number, row in enumerate(reversed(rows))]


def biggest_root(edges: Sequence[EdgeInfo]) -> str | None:
    """Return the root with the most frames below it, which is the default fixed frame."""
    hung = {edge.child for edge in edges}
    roots = dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung)
    links = links_of(edges)
    return max(roots, key=lambda root: len(reached(root, links)), default=None)
