# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The moment that a page shows first of a recording."""

from collections.abc import Sequence

from tf_tree_py.core import EdgeInfo
from tf_tree_py.core.stamp import LATEST

# The share of the frames that must be there. Some may appear much later.
_MOST = 0.9

Span = tuple[int, int]


def opening_stamp(edges: Sequence[EdgeInfo]) -> int | None:
    """
    Return the first stamp at which most frames are connected to their roots.

    :return: nanoseconds; None if nothing moves.
    """
    spans = [span for span in _spans(edges).values() if span is not None]
    begins = sorted({begin for begin, end in spans if begin != LATEST and begin <= end})
    if not begins:
        return None
    counts = [sum(begin <= stamp <= end for begin, end in spans) for stamp in begins]
    return next(stamp for stamp, count in zip(begins, counts, strict=True)
                if count >= _MOST * max(counts))


def _spans(edges: Sequence[EdgeInfo]) -> dict[str, Span | None]:
    """Return the first and last stamp at which each frame is connected to its last root."""
    above = {edge.child: edge for edge in edges}
    known: dict[str, Span | None] = {}
    for frame in above:
        way: list[EdgeInfo] = []
        while frame in above and frame not in known and len(way) <= len(above):
            way.append(above[frame])
            frame = above[frame].parent
        span: Span | None = known.get(frame, (LATEST, 2 ** 63 - 1))
        for edge in reversed(way):
            if span is not None and not edge.static:
                span = max(span[0], edge.oldest), min(span[1], edge.latest)
            known[edge.child] = span
    return known
