# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The edges of a tree as data, and in one line.

Pure functions. Those that take a history are called with the buffer's lock; their results refer to
no history.
"""

from typing import NamedTuple

import numpy as np

from ..edges.protocol import History, moves
from ..geometry.pose import Pose
from ..stamp import BEGINNING, FOREVER, format_stamp, mean_interval
from ..times import Stamps


def stamps_of(history: History | None) -> Stamps:
    """Return the sorted stamps (N,) of an edge's samples; none for a static edge."""
    if history is None or history.oldest_stamp is None:
        return np.empty(0, dtype=np.int64)
    assert history.newest_stamp is not None
    return history.track(history.oldest_stamp, history.newest_stamp).knots


def samples_around(history: History | None, stamp: int) -> list[tuple[int, Pose]]:
    """Return the samples of an edge at or next to a stamp; see ``Queries.samples_around``."""
    if not moves(history) or history.oldest_stamp is None:
        return []
    assert history.newest_stamp is not None
    inside = min(max(stamp, history.oldest_stamp), history.newest_stamp)
    knots = history.track(inside, inside).knots.tolist()
    around = {max((knot for knot in knots if knot <= inside), default=inside),
              min((knot for knot in knots if knot >= inside), default=inside)}
    return [(knot, Pose._make(history.sample(knot))) for knot in sorted(around)]


# --- edges as data

class EdgeInfo(NamedTuple):
    """The stored data of one edge: names, its last publisher, stamps in nanoseconds."""

    parent: str
    child: str
    authority: str
    static: bool
    samples: int
    oldest: int
    latest: int

    @property
    def span(self) -> int:
        """Return the time from the oldest sample to the newest, nanoseconds."""
        return self.latest - self.oldest

    @property
    def interval(self) -> float:
        """Return the mean interval of the samples, nanoseconds; 0 with fewer than two."""
        return mean_interval(self.span, self.samples)

    @property
    def rate_hz(self) -> float:
        """Return the stored samples per second; 0 for one sample or a static edge."""
        return 1e9 / self.interval if self.interval else 0.0


def summary(frames: int, edges: list[EdgeInfo]) -> str:
    """Return the contents of a tree in one line."""
    if not frames:
        return 'empty'
    moving = [edge for edge in edges if not edge.static]
    text = (f'{counted(frames, "frame")}, {counted(len(edges), "edge")} '
            f'({len(edges) - len(moving)} static)')
    if not moving:
        return text
    oldest, latest = min(edge.oldest for edge in moving), max(edge.latest for edge in moving)
    return f'{text}, {format_stamp(oldest)} to {format_stamp(latest)} s'


def counted(number: int, noun: str) -> str:
    """Return a number of things, such as '2 frames'."""
    return f'{number} {noun}' + ('' if number == 1 else 's')


def info_at(parent: str, history: History, moment: int | None) -> EdgeInfo:
    """Return the data of an edge for the interval with its parent at a moment."""
    info = info_of(parent, history)
    if moment is None or history.fixed_parent:
        return info
    since, until = next((since, until) for _, since, until
                        in history.parents_between(BEGINNING, FOREVER) if since <= moment < until)
    stamps = stamps_of(history)
    return info._replace(oldest=since, latest=int(stamps[stamps < until][-1]))


def info_of(parent: str, history: History) -> EdgeInfo:
    """Return the stored data of an edge."""
    return EdgeInfo(parent, history.child, history.authority, history.is_static, len(history),
                    history.oldest_stamp or 0, history.newest_stamp or 0)
