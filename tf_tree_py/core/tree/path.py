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
The edges between two frames, ready to be composed at any stamp.

Only the arithmetic along a known path; ``ways`` finds the edges.
"""

from collections.abc import Iterable, Sequence

from .many import PathTrack
from ..edges.protocol import History, moves, MovingHistory
from ..edges.static import StaticHistory
from ..errors import ExtrapolationException
from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..stamp import BEGINNING, FOREVER, LATEST


class Path:
    """
    The two branches from a meeting point down to the source and to the target.

    Runs of static edges are composed once, here; so a path is valid only until one of
    them changes. ``fixed`` says whether no edge on it changes its parent over time. If
    one does, the path is valid only for the stamp that it was found for. ``for_good`` says
    that there was no other way at any other time: where an edge of it has no data, its child
    hung on nothing, and no edge above the meeting point ever changed its parent.
    """

    __slots__ = ('fixed', 'for_good', '_source_parts', '_target_parts', '_dynamic')

    def __init__(self, source_edges: Sequence[History], target_edges: Sequence[History],
                 above: Sequence[History] = ()) -> None:
        """
        Take the edges of both branches, each from the leaf up to the meeting point.

        :param above: those above it, by the newest samples. No pose needs them.
        """
        self.fixed = all(edge.fixed_parent for edge in (*source_edges, *target_edges))
        self.for_good = self.fixed and all(edge.fixed_parent for edge in above)
        self._source_parts = _merge_static_runs(source_edges)
        self._target_parts = _merge_static_runs(target_edges)
        self._dynamic = tuple(edge for edge in (*reversed(source_edges), *reversed(target_edges))
                              if moves(edge))

    def latest_common_time(self) -> int:
        """
        Return the newest stamp for which every moving edge has data.

        :return: nanoseconds; ``LATEST`` when nothing on the path moves.
        """
        common: int | None = None
        for edge in self._dynamic:
            stamp = edge.latest_stamp
            if stamp is not None and (common is None or stamp < common):
                common = stamp
        return LATEST if common is None else common

    def slowest_edges(self) -> list[MovingHistory]:
        """Return the edges that have to go on before the latest common time does."""
        common = self.latest_common_time()
        return [edge for edge in self._dynamic if edge.latest_stamp == common]

    def span(self) -> tuple[int, int]:
        """Return the oldest and the newest stamp that every moving edge has data for."""
        oldest, latest = BEGINNING, FOREVER - 1
        for edge in self._dynamic:
            assert edge.oldest_stamp is not None and edge.latest_stamp is not None
            oldest, latest = max(oldest, edge.oldest_stamp), min(latest, edge.latest_stamp)
        return oldest, latest

    def track(self, first: int, last: int) -> PathTrack:
        """Return a copy of what it takes to answer from one stamp to another, in the span."""
        return PathTrack([part.track(first, last) for part in self._source_parts],
                         [part.track(first, last) for part in self._target_parts])

    def without_data(self, stamp: int) -> list[MovingHistory]:
        """Return the edges that keep it from answering at a stamp."""
        return [edge for edge in self._dynamic if edge.parent_at(stamp) is None]

    def failure(self, stamp: int, error: ExtrapolationException) -> ExtrapolationException:
        """
        Return why a fixed path has no answer at a stamp, and what may change that.

        :param error: of one of its edges; returned if it is that of the worst.
        """
        stuck = self.without_data(stamp)
        worst = furthest_from_cure(stuck, stamp)
        if worst.child != error.child:
            error = worst.extrapolation(stamp)
        if not any(edge.is_too_old(stamp) for edge in stuck):
            error.blocked_on = tuple(
                [(edge.child, edge.next_turn(stamp)) for edge in self._dynamic])
        return error

    def pose_at(self, stamp: int) -> PoseTuple:
        """
        Return ``target_T_source``: inverse(top_T_target) top_T_source.

        :raises ExtrapolationException: an edge has no data for the stamp.
        """
        top_T_source = se3.compose_chain([part.sample(stamp) for part in self._source_parts])
        if not self._target_parts:
            return top_T_source
        top_T_target = se3.compose_chain([part.sample(stamp) for part in self._target_parts])
        return se3.compose(se3.inverse(top_T_target), top_T_source)


def furthest_from_cure(edges: Iterable[MovingHistory], stamp: int) -> MovingHistory:
    """
    Return the worst of some edges that have no data for a stamp.

    That is first an edge whose data for the stamp is gone for good, then one that has no
    data as old, then the one whose newest data is the oldest.
    """
    def order(edge: MovingHistory) -> tuple[int, int]:
        latest = edge.latest_stamp
        if latest is None:
            return 2, BEGINNING
        if stamp < latest and (oldest := edge.oldest_stamp) is not None and stamp < oldest:
            return (0 if edge.is_too_old(stamp) else 1), -oldest
        return 2, latest

    return min(edges, key=order)


def _merge_static_runs(edges: Sequence[History]) -> tuple[History, ...]:
    """Return the edges from the top down, neighbouring static ones composed into one."""
    parts: list[History] = []
    for edge in reversed(edges):
        above = parts[-1] if parts else None
        if above and above.parent and above.is_static and edge.is_static:
            parts[-1] = StaticHistory(edge.child, above.parent, se3.compose(
                above.sample(LATEST), edge.sample(LATEST)))
        else:
            parts.append(edge)
    return tuple(parts)
