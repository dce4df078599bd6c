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

"""Which edges go on, and up to when: what a live page goes by."""

from collections.abc import Collection, Mapping, Sequence

from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.stamp import LATEST

# An edge may miss two samples, and be as late as this, before the page goes on without it.
_MISSED = 3.0
_LATE = 100_000_000
# Of a single sample it is not known how often they come.
_UNKNOWN_INTERVAL = 1_000_000_000


def interval(edge: EdgeInfo) -> float:
    """Return the mean time between two samples of a moving edge, nanoseconds."""
    return edge.span / (edge.samples - 1) if edge.samples > 1 else _UNKNOWN_INTERVAL


def living(edges: Sequence[EdgeInfo]) -> list[EdgeInfo]:
    """Return the moving edges that go on: they keep up with the newest, as often as they come."""
    moving = [edge for edge in edges if not edge.static]
    newest = max((edge.latest for edge in moving), default=LATEST)
    return [edge for edge in moving
            if newest - edge.latest <= _LATE + _MISSED * interval(edge)]


def window(edges: Sequence[EdgeInfo], cache_time: int) -> tuple[int, int]:
    """
    Return the oldest and the newest stamp that a page can go to, nanoseconds.

    An edge that stopped long ago keeps its samples; they do not stretch the window.
    """
    moving = [edge for edge in edges if not edge.static]
    latest = max((edge.latest for edge in moving), default=LATEST)
    oldest = min((edge.oldest for edge in moving), default=LATEST)
    return max(oldest, latest - cache_time), latest


def reached(frame: str, links: Mapping[str, Collection[str]]) -> set[str]:
    """Return the frames that a frame is linked to, over any number of links, and itself."""
    known = {frame}
    waiting = [frame]
    while waiting:
        for other in links.get(waiting.pop(), ()):
            if other not in known:
                known.add(other)
                waiting.append(other)
    return known


def links_of(edges: Sequence[EdgeInfo]) -> dict[str, list[str]]:
    """Return the neighbours of each frame."""
    links: dict[str, list[str]] = {}
    for edge in edges:
        links.setdefault(edge.parent, []).append(edge.child)
        links.setdefault(edge.child, []).append(edge.parent)
    return links
