# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Climbing from a frame to the frames above it: at a stamp, now, or over a time interval.

``Cleared`` notes which edges a tree had before it was cleared, so that the errors of later
lookups can name the reason.

The climbs are pure functions of the histories of a tree. A frame has a parent at a stamp if its
samples include that stamp in their span; otherwise the climb ends at it as at a root, as in
tf2. "Now" uses every frame's newest sample.

They are called with the buffer's lock, and rely on the tree having no loops: ``find_loop``, which
keeps them out, would not end in one.
"""

from collections.abc import Collection, Container, Mapping
from typing import NamedTuple

from ..edges.protocol import History, moves
from ..errors import (
    ANY_STRUCTURE,
    Blocker,
    ConnectivityException,
    NoDataException,
    PastExtrapolationException,
    TransformException,
)

_ByChild = Mapping[str, History]


class Climb(NamedTuple):
    """
    The path from a frame upwards, as far as there is data.

    :ivar edges: from the lowest to the highest.
    :ivar frames: likewise, including the first frame: one more than edges.
    """

    edges: list[History]
    frames: list[str]

    @property
    def top(self) -> str:
        """Return the frame at which the climb ends."""
        return self.frames[-1]


def climb(histories: _ByChild, frame: str, stamp: int | None, stop: Container[str] = ()) -> Climb:
    """
    Climb from a frame to the first frame in ``stop``, or as far as there is data.

    :param stamp: nanoseconds; None: use the newest samples.
    """
    edges: list[History] = []
    frames = [frame]
    # There are at most as many steps as edges, because a tree has no loops.
    for _ in range(len(histories)):
        if frame in stop or frame not in histories:
            break
        history = histories[frame]
        parent = history.parent if stamp is None else history.parent_at(stamp)
        if parent is None:
            break
        edges.append(history)
        frames.append(parent)
        frame = parent
    return Climb(edges, frames)


class Branches(NamedTuple):
    """The climbs from two frames; that from the target ends where it meets the other."""

    source: Climb
    target: Climb

    @property
    def meet(self) -> bool:
        """Return whether both lead to one frame."""
        return self.target.top in self.source.frames

    def edges(self) -> tuple[list[History], list[History]]:
        """Return the edges of both branches below the meeting point, the source's first."""
        return self.source.edges[:self._height()], self.target.edges

    def frames(self) -> list[str]:
        """Return the frames from the source up to the meeting point and down to the target."""
        return [*self.source.frames[:self._height()], *reversed(self.target.frames)]

    def links(self) -> list[tuple[str, History]]:
        """Return each edge on that path with its parent, in the same order."""
        source, target = self.source, self.target
        up = list(zip(source.frames[1:], source.edges, strict=True))[:self._height()]
        down = list(zip(target.frames[1:], target.edges, strict=True))
        return up + down[::-1]

    def _height(self) -> int:
        return self.source.frames.index(self.target.top)


def climb_both(histories: _ByChild, target: str, source: str, stamp: int | None) -> Branches:
    """Climb from two frames until they meet, or as far as there is data."""
    from_source = climb(histories, source, stamp, (target,))
    return Branches(from_source, climb(histories, target, stamp, set(from_source.frames)))


# --- possible changes

class _Reach(NamedTuple):
    """
    The frames that a climb at a stamp may reach after late and new samples.

    :ivar frames: all frames that the climb may pass.
    :ivar ends: whether it cannot lead to any other frame: each of these frames has lost its
        data permanently, or has a parent. (A frame without an edge may still get any parent.)
    """

    frames: set[str]
    ends: bool


def _reach(histories: _ByChild, start: str, stamp: int) -> _Reach:
    frames, to_visit, ends = {start}, [start], True
    for frame in to_visit:
        history = histories.get(frame)
        parents = history.possible_parents(stamp) if history is not None else None
        if parents is None:
            ends = False
            continue
        to_visit += parents - frames
        frames |= parents
    return _Reach(frames, ends)


def blockers(histories: _ByChild, target: str, source: str,
             stamp: int) -> tuple[Blocker, ...] | None:
    """
    Return all edges whose next samples may decide whether two climbs meet.

    At a stamp without data, later samples may give a frame one of several parents. Both climbs
    are followed through all of these.

    :return: None if they can never meet: the data of one side is lost permanently.
    """
    from_source = _reach(histories, source, stamp)
    from_target = _reach(histories, target, stamp)
    if (from_source.ends or from_target.ends) and not from_source.frames & from_target.frames:
        return None
    awaited = [histories[frame] for frame in from_source.frames | from_target.frames
               if frame in histories]
    return tuple((history.child, history.next_turn(stamp)) for history in awaited
                 if moves(history)) or ANY_STRUCTURE


# --- loops

class Loop(NamedTuple):
    """The edges from a frame up to a frame that is to become its child: a loop."""

    edges: list[History]
    frames: list[str]


_Trail = tuple[History, str, '_Trail | None']


def find_loop(histories: _ByChild, parent: str, child: str, begin: int, end: int,
              without: Collection[History] = ()) -> Loop | None:
    """
    Return a path from a parent up to its new child at any time in an interval.

    An edge that has not ended is assumed to continue after its newest sample, because the next
    sample would confirm it.

    :param begin: nanoseconds; the interval ends before ``end``.
    :param without: edges that are treated as ended.
    :return: the edges from the parent upwards, and the frames that they lead to; None if the
        child is never above the parent.
    """
    Visit = tuple[str, int, int, _Trail | None]
    to_visit: list[Visit] = [(parent, begin, end, None)]
    while to_visit:
        frame, first, last, trail = to_visit.pop()
        history = histories.get(frame)
        if history is None or history in without:
            continue
        for above, since, until in history.parents_between(first, last):
            way: _Trail = (history, above, trail)
            since, until = max(since, first), min(until, last)
            if since < until:
                if above == child:
                    return _loop(way)
                to_visit.append((above, since, until, way))
    return None


def _loop(trail: _Trail | None) -> Loop:
    steps = []
    while trail is not None:
        history, frame, trail = trail
        steps.append((history, frame))
    steps.reverse()
    return Loop([history for history, _ in steps], [frame for _, frame in steps])


# --- edges that were cleared

class ClearedEdge(NamedTuple):
    """The parent of an edge that was cleared, and its first and last stamp, nanoseconds."""

    parent: str | None
    oldest: int
    latest: int


class Cleared(NamedTuple):
    """
    The last time that a tree was cleared.

    :ivar why: the reason as a clause, such as ``the clock jumped back by 3.000 s``.
    :ivar edges: what the tree had, by child frame; see ``edges_to_clear``.
    """

    why: str
    edges: Mapping[str | None, ClearedEdge]

    def explain(self, error: TransformException, histories: _ByChild) -> None:
        """
        Replace the hint of an error if the lookup failed because the tree was cleared.

        :param error: with its frames.
        :param histories: those of the tree now.
        """
        what = self._lost(error, histories)
        if what:
            error.hint = f'{what}: {self.why}'

    def _lost(self, error: TransformException, histories: _ByChild) -> str:
        """Return which data the lookup lacks because of it; '' if it would have failed anyway."""
        if isinstance(error, ConnectivityException):
            above_target, above_source = (
                self._above(frame, histories)
                for frame in (error.target_frame, error.source_frame))
            return ('' if above_target.isdisjoint(above_source) else
                    'The buffer forgot an edge between them, and has received none since')
        if not isinstance(error, NoDataException | PastExtrapolationException):
            return ''
        edge = self.edges.get(error.child)
        if edge is None:
            return ''
        if error.requested is not None and edge.oldest <= error.requested <= edge.latest:
            return 'The buffer had data of this edge for that time, and forgot it'
        return ('The buffer forgot the data of this edge, and has received none since'
                if isinstance(error, NoDataException) else '')

    def _above(self, frame: str | None, histories: _ByChild) -> set[str]:
        """Return a frame and those above it, by edges of now and by those cleared since."""
        above: set[str] = set()
        while frame is not None and frame not in above:
            above.add(frame)
            history = histories.get(frame)
            parent = None if history is None else history.parent
            if parent is None and frame in self.edges:
                parent = self.edges[frame].parent
            frame = parent
        return above


def edges_to_clear(histories: _ByChild) -> dict[str | None, ClearedEdge]:
    """Return what a tree is about to forget, by child frame."""
    return {child: ClearedEdge(history.parent, oldest, latest)
            for child, history in histories.items() if moves(history)
            and (oldest := history.oldest_stamp) is not None
            and (latest := history.latest_stamp) is not None}
