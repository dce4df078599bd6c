# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which edges still receive data, and which times a page can show."""

from collections.abc import Callable, Collection, Mapping, Sequence
import math
import threading
import time

from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.stamp import is_silent, LATEST

Edge = tuple[str, str]

# An edge is silent after a second at the soonest.
_EVERY_S = 0.5

LeftBehind = Callable[[int], Collection[Edge]]
"""Returns the edges that answer no lookup for a time, nanoseconds; 0: that of the last arrival."""


class Remembered:
    """Caches which edges are left behind for half a second, as pages are drawn more often."""

    def __init__(self, judge: LeftBehind) -> None:
        self._judge = judge
        self._lock = threading.Lock()
        # By whether it was for the last arrival: when, and what was found.
        self._known: dict[bool, tuple[float, Collection[Edge]]] = {}

    def __call__(self, now: int) -> Collection[Edge]:
        """Return a recent judgement; see ``LeftBehind``."""
        with self._lock:
            present = time.monotonic()
            judged, found = self._known.get(now == LATEST, (-math.inf, ()))
            if present - judged >= _EVERY_S:
                found = self._judge(now)
                self._known[now == LATEST] = present, found
            return found


def left_behind_by_stamps(edges: Sequence[EdgeInfo]) -> LeftBehind:
    """Return what judges edges by their stamps, which cannot show whether one is only late."""
    moving = [edge for edge in edges if not edge.static]
    newest = max((edge.latest for edge in moving), default=LATEST)
    return lambda now: {(edge.parent, edge.child) for edge in moving
                        if is_silent((now or newest) - edge.latest, edge.interval)}


def without(edges: Sequence[EdgeInfo], left: Collection[Edge]) -> list[EdgeInfo]:
    """Return the edges that are not among those that are left behind."""
    return [edge for edge in edges if (edge.parent, edge.child) not in left]


def window(edges: Sequence[EdgeInfo], cache_time: int) -> tuple[int, int]:
    """
    Return the oldest and the newest stamp that a page can show, nanoseconds.

    Samples of an edge that stopped long ago do not extend the window.
    """
    moving = [edge for edge in edges if not edge.static]
    latest = max((edge.latest for edge in moving), default=LATEST)
    oldest = min((edge.oldest for edge in moving), default=LATEST)
    return max(oldest, latest - cache_time), latest


def reached(frame: str, links: Mapping[str, Collection[str]]) -> set[str]:
    """Return a frame and all frames that are linked to it, directly or indirectly."""
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
