# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The moment that a page shows: the newest one, a selected one, one that advances, or a finding's.

Of a recording, a page first shows a moment that is chosen here. The slider marks the stamps of
refused and odd samples.
"""

from collections import deque
from collections.abc import Collection, Sequence
import threading
from typing import Final

import numpy as np
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import EdgeInfo, TransformException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.health.checks.finding import Finding

from .moment import LeftBehind, live_moment, Moment, moment_at, window

# The share of the frames that must be there. Some may appear much later.
_MOST = 0.9

_Span = tuple[int, int]


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


def _spans(edges: Sequence[EdgeInfo]) -> dict[str, _Span | None]:
    """Return the first and last stamp at which each frame is connected to its last root."""
    above = {edge.child: edge for edge in edges}
    known: dict[str, _Span | None] = {}
    for frame in above:
        way: list[EdgeInfo] = []
        while frame in above and frame not in known and len(way) <= len(above):
            way.append(above[frame])
            frame = above[frame].parent
        span: _Span | None = known.get(frame, (LATEST, 2 ** 63 - 1))
        for edge in reversed(way):
            if span is not None and not edge.static:
                span = max(span[0], edge.oldest), min(span[1], edge.latest)
            known[edge.child] = span
    return known


# --- the playhead

# A lookup at stamp 0 would return the latest transform.
_FIRST = LATEST + 1


class Playhead:
    """
    The position of a page in time.

    A page that is paused or playing shows a copy of the buffer, made when the page left live
    mode, so that nothing within its window expires.

    :ivar tree: the tree that is shown.
    :ivar live: whether the page follows the newest moment.
    :ivar playing: whether the moment advances.
    :ivar speed: of playing, recorded seconds per second.
    :ivar stamp: of the moment, nanoseconds; while live, of the last moment that was shown.
    """

    def __init__(self, tree: AllQueries, live: bool) -> None:
        """
        Begin with the newest moment of a live tree, or with the opening moment of a recording.

        :param live: whether transforms still arrive in the tree.
        """
        self.speed = 1.0
        self._begin(tree, live)

    def _begin(self, tree: AllQueries, live: bool) -> None:
        self._given = self.tree = tree
        self.has_live = self.live = live
        self.playing = False
        self._stamps: dict[str, Stamps] = {}
        oldest, newest = self.window()
        opening = None if live else opening_stamp(AllQueries.edges(tree))
        self.stamp = newest if live else max(oldest if opening is None else opening, _FIRST)

    def use(self, tree: AllQueries, live: bool) -> None:
        """Show another tree; if it is the same, do nothing."""
        if tree is not self._given:
            self._begin(tree, live)

    def window(self) -> tuple[int, int]:
        """Return the oldest and the newest stamp that the page can show, nanoseconds."""
        return window(AllQueries.edges(self.tree), self.tree.cache_time)

    def moment(self, fixed_frame: str, now: int, left_behind: LeftBehind | None = None) -> Moment:
        """
        Return the frames at the present position.

        :param now: the time from which the ages of a live moment are counted, nanoseconds.
        :param left_behind: as for ``live_moment``.
        """
        if not self.live:
            return moment_at(self.tree, fixed_frame, self.stamp)
        moment = live_moment(self.tree, fixed_frame, now, left_behind)
        self.stamp = moment.stamp
        return moment

    # --- changing the position

    def go_live(self) -> None:
        """Follow the newest moment, if the tree is live."""
        if self.has_live:
            self.tree = self._given
            self.live, self.playing = True, False
            self._stamps.clear()

    def pause(self) -> None:
        """Stop at the present moment."""
        self.playing = False
        if self.live:
            self.live = False
            self.tree = self._given.snapshot()

    def play(self) -> None:
        """Play from the present moment, or from the beginning if it is the last one."""
        self.pause()
        oldest, newest = self.window()
        if self.stamp >= newest:
            self.seek(oldest)
        self.playing = True

    def seek(self, stamp: int) -> None:
        """Go to a stamp, or to the nearest end of the window."""
        self.pause()
        oldest, newest = self.window()
        self.stamp = max(min(max(stamp, oldest), newest), _FIRST)

    def step(self, frame: str | None, count: int) -> None:
        """
        Go to another sample.

        :param frame: whose samples to visit; None, or a frame that never moves: those of all
            frames.
        :param count: the number of samples to go forward; negative: backward.
        """
        self.pause()
        stamps = self._samples(frame)
        if not len(stamps):
            stamps = self._samples(None)
        if not len(stamps):
            return
        first = stamps.searchsorted(self.stamp, 'right' if count > 0 else 'left')
        place = int(first) + count - (count > 0)
        self.seek(int(stamps[min(max(place, 0), len(stamps) - 1)]))

    def _samples(self, frame: str | None) -> Stamps:
        key = frame or ''
        if key not in self._stamps:
            frames = self.tree.frames() if frame is None else [frame]
            self._stamps[key] = np.unique(np.concatenate(
                [np.empty(0, np.int64), *(self.tree.stamps_of(each) for each in frames)]))
        return self._stamps[key]

    def advance(self, seconds: float) -> None:
        """Advance the moment by the time that has passed, if the page plays."""
        if not self.playing:
            return
        newest = self.window()[1]
        self.stamp = min(self.stamp + round(seconds * self.speed * 1e9), newest)
        self.playing = self.stamp < newest


# --- refused and odd samples

# More marks cannot be distinguished on a slider.
_MOST_INCIDENTS = 200


class IncidentLog(Observer):
    """Keeps the stamps of the last incidents of a buffer, as one of its observers."""

    def __init__(self) -> None:
        """Begin without incidents."""
        self._lock = threading.Lock()
        self._kept: deque[tuple[int, frozenset[str]]] = deque(maxlen=_MOST_INCIDENTS)

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Remember incidents."""
        with self._lock:
            self._kept.extend((incident.stamp, frozenset((incident.parent, incident.child)))
                              for incident in incidents if incident.stamp != LATEST)

    def stamps(self, frames: Collection[str] | None = None) -> list[int]:
        """
        Return the stamps of the incidents, nanoseconds, in order.

        :param frames: only those about one of these frames; None: all.
        """
        with self._lock:
            return sorted({stamp for stamp, about in self._kept
                           if frames is None or not about.isdisjoint(frames)})


# --- the time of a finding

# A gap between samples is at least so many times as long as the median.
_WIDE: Final = 3.0


def time_of(finding: Finding, tree: AllQueries, log: IncidentLog) -> int | None:
    """
    Return the stamp of a finding, nanoseconds; None: it has no time.

    This is the stamp of the first incident about its frames. Without incidents, it is the
    beginning of the widest gap between the samples of its last frame. Without gaps, it is the
    sample at which this frame moves most.
    """
    incidents = log.stamps(finding.frames)
    if incidents:
        return incidents[0]
    for frame in reversed(finding.frames):
        stamp = _worst(tree, frame)
        if stamp is not None:
            return stamp
    return None


def _worst(tree: AllQueries, frame: str) -> int | None:
    if frame not in tree.frames():
        return None
    stamps = np.asarray(tree.stamps_of(frame))
    if len(stamps) < 3:
        return int(stamps[0]) if len(stamps) else None
    gaps = np.diff(stamps)
    if gaps.max() > _WIDE * np.median(gaps):
        return int(stamps[int(gaps.argmax())])
    parent = next((edge.parent for edge in tree.edges() if edge.child == frame), None)
    if parent is None:
        return None
    try:
        poses, valid = tree.lookup_many(parent, frame, stamps, outside='mask')
    except TransformException:
        return None
    steps = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1)
    steps[~(valid[1:] & valid[:-1])] = 0.0
    return int(stamps[int(steps.argmax()) + 1])
