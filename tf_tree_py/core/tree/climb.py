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

"""
Climbing from a frame to the frames above it: at a stamp, now, over a stretch of time.

Pure functions over the histories of a tree. A frame has a parent at a stamp where
its samples reach over that stamp; elsewhere the climb ends there as at a root, as
in tf2. "Now" goes by every frame's newest sample.
"""

from collections.abc import Collection, Container, Mapping
from typing import NamedTuple

from ..edges.protocol import History, moves
from ..errors import ANY_STRUCTURE, Blocker

Histories = Mapping[str, History]


class Climb(NamedTuple):
    """
    The way from a frame up, as far as it goes.

    :ivar edges: from the lowest to the highest.
    :ivar frames: likewise, with the one it begins at: one more than edges.
    """

    edges: list[History]
    frames: list[str]

    @property
    def top(self) -> str:
        """Return where it ends."""
        return self.frames[-1]


def climb(histories: Histories, frame: str, stamp: int | None, stop: Container[str] = ()) -> Climb:
    """
    Climb from a frame to the first one to stop at, or as far as there is data.

    :param stamp: nanoseconds; None goes by the newest samples.
    """
    edges: list[History] = []
    frames = [frame]
    # As many steps as there are edges lead to the top, for a tree has no loops.
    for _ in range(len(histories)):
        history = None if frame in stop else histories.get(frame)
        parent = _parent(history, stamp)
        if history is None or parent is None:
            break
        edges.append(history)
        frames.append(parent)
        frame = parent
    return Climb(edges, frames)


def _parent(history: History | None, stamp: int | None) -> str | None:
    if history is None or stamp is None:
        return history.parent if history else None
    return history.parent_at(stamp)


class Branches(NamedTuple):
    """The climbs from two frames; from the target no further than to the source's."""

    source: Climb
    target: Climb

    @property
    def meet(self) -> bool:
        """Return whether they lead to one frame."""
        return self.target.top in self.source.frames

    def edges(self) -> tuple[list[History], list[History]]:
        """Return the edges of both below the meeting point, the source's first."""
        return self.source.edges[:self._height()], self.target.edges

    def frames(self) -> list[str]:
        """Return the frames from the source up to the meeting point and down to the target."""
        return [*self.source.frames[:self._height()], *reversed(self.target.frames)]

    def links(self) -> list[tuple[str, History]]:
        """Return each edge on that way, in its order, with its parent."""
        source, target = self.source, self.target
        up = list(zip(source.frames[1:], source.edges, strict=True))[:self._height()]
        down = list(zip(target.frames[1:], target.edges, strict=True))
        return up + down[::-1]

    def _height(self) -> int:
        return self.source.frames.index(self.target.top)


def climb_both(histories: Histories, target: str, source: str, stamp: int | None) -> Branches:
    """Climb from two frames until they meet, or as far as there is data."""
    from_source = climb(histories, source, stamp, (target,))
    return Branches(from_source, climb(histories, target, stamp, set(from_source.frames)))


# --- what may yet change

class _Reach(NamedTuple):
    """
    What a climb at a stamp may still lead to, when late and new samples arrive.

    :ivar frames: all that it may pass.
    :ivar ends: whether it can lead to no other frame: each of these has lost its data for
        good, or has a parent. (A frame without any edge may still get any parent.)
    """

    frames: set[str]
    ends: bool


def _reach(histories: Histories, start: str, stamp: int) -> _Reach:
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


def blockers(histories: Histories, target: str, source: str,
             stamp: int) -> tuple[Blocker, ...] | None:
    """
    Return all edges whose next samples may decide whether two climbs meet.

    At a stamp without data a frame may still turn out to have had one of several
    parents. Both climbs are followed through all of these.

    :return: None if they can never meet: the data of one side is gone for good.
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
    """The edges from a frame up to another one that is to hang below it: a loop."""

    edges: list[History]
    frames: list[str]


_Trail = tuple[History, str, '_Trail | None']


def find_loop(histories: Histories, parent: str, child: str, begin: int, end: int,
              without: Collection[History] = ()) -> Loop | None:
    """
    Return a way from a parent up to its would-be child at any time in a stretch of time.

    An edge that has not ended counts as one that goes on after its newest sample, for the next
    sample will show that it did.

    :param begin: nanoseconds; the stretch ends before ``end``.
    :param without: edges that are treated as ended.
    :return: edges from the parent upwards, and the frames that these lead to; None if the
        child is up there at no time.
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
            if since < until and above == child:
                return _loop(way)
            if since < until:
                to_visit.append((above, since, until, way))
    return None


def _loop(trail: _Trail | None) -> Loop:
    steps = []
    while trail is not None:
        history, frame, trail = trail
        steps.append((history, frame))
    steps.reverse()
    return Loop([history for history, _ in steps], [frame for _, frame in steps])
