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

"""The list of frames as a tree, and what a search leaves of it."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

from tf_tree_py.core import EdgeInfo

from .living import links_of, reached

# More rows than this are no list; a search finds what is not among them.
MOST_ROWS = 150


class Row(NamedTuple):
    """
    One frame in the list.

    :ivar lead: what draws the tree in front of it.
    :ivar static: whether its edge never moves; None for a root.
    """

    frame: str
    lead: str
    static: bool | None


def rows(edges: Sequence[EdgeInfo], search: str = '') -> list[Row]:
    """
    Return the frames in the order of the tree, each under its parent.

    :param search: leave out frames without this in their names, upper or lower case, unless
        such a frame hangs on them.
    """
    children: dict[str, list[EdgeInfo]] = {}
    for edge in edges:
        children.setdefault(edge.parent, []).append(edge)
    hung = {edge.child for edge in edges}
    wanted = _found(edges, search.strip().casefold())
    result: list[Row] = []
    for root in dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung):
        if root in wanted:
            result.append(Row(root, '', None))
            result += _below(root, children, wanted)
    return result


def _found(edges: Sequence[EdgeInfo], part: str) -> Collection[str]:
    """Return the frames whose names have a part, and all above them."""
    parents = {edge.child: [edge.parent] for edge in edges}
    frames = dict.fromkeys(name for edge in edges for name in (edge.parent, edge.child))
    return {above for frame in frames if part in frame.casefold()
            for above in reached(frame, parents)}


def _below(root: str, children: dict[str, list[EdgeInfo]], wanted: Collection[str]) -> list[Row]:
    """Return the rows below a frame; a chain of thousands needs no recursion."""
    result: list[Row] = []
    waiting = _siblings(root, '', children, wanted)
    while waiting:
        edge, lead, more = waiting.pop()
        result.append(Row(edge.child, f'{lead}{"├─" if more else "└─"} ', edge.static))
        waiting += _siblings(edge.child, lead + ('│  ' if more else '   '), children, wanted)
    return result


def _siblings(parent: str, lead: str, children: dict[str, list[EdgeInfo]],
              wanted: Collection[str]) -> list[tuple[EdgeInfo, str, bool]]:
    """Return the edges below a frame, the first at the end; each with whether one follows."""
    shown = [edge for edge in children.get(parent, ()) if edge.child in wanted]
    return [(edge, lead, number > 0) for number, edge in enumerate(reversed(shown))]


def biggest_root(edges: Sequence[EdgeInfo]) -> str | None:
    """Return the root with the most frames below it: the fixed frame where nobody names one."""
    hung = {edge.child for edge in edges}
    roots = dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung)
    links = links_of(edges)
    return max(roots, key=lambda root: len(reached(root, links)), default=None)
