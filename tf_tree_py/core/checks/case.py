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

"""All that was watched of a tree, and what several checks ask of it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..arrivals.incidents import Kind
from ..arrivals.received import Endpoint
from ..stamp import from_seconds
from ..vitals.edge import Edge, EdgeRecord, MovingEdge, Parents
from ..vitals.limits import Limits

# If the delays of two edges differ by more than this, their stamps come from different clocks.
_ANOTHER_CLOCK = from_seconds(30.0)


@dataclass
class Trouble:
    """
    The incidents of one kind and one edge.

    :ivar count: how many.
    :ivar authorities: who may have sent them.
    :ivar detail: what the first of them says.
    """

    count: int = 0
    authorities: dict[str, None] = field(default_factory=dict)
    detail: str = ''


class Clock:
    """
    Edges whose stamps come from one clock, as their delays show.

    :ivar edges: each of them moves.
    :ivar delay: the median of their usual delays, nanoseconds.
    """

    def __init__(self, edges: Sequence[EdgeRecord]) -> None:
        self.edges = edges
        self.delay = float(np.median([delay_of(edge) for edge in edges]))


class Case:
    """
    What a doctor has watched up to now; it does not change any more.

    :ivar edges: every edge that arrived and whose names can be those of an edge.
    :ivar parents: of children that have several, by child.
    :ivar troubles: what the buffer refused or found odd, by kind, parent and child.
    :ivar slashed: the names that arrived with a leading slash.
    :ivar endpoints: who sends and hears.
    :ivar now: when something arrived last, nanoseconds.
    """

    def __init__(self, edges: Collection[EdgeRecord], parents: Mapping[str, Parents],
                 troubles: Mapping[tuple[Kind, str, str], Trouble], slashed: Collection[str],
                 endpoints: Sequence[Endpoint], limits: Limits) -> None:
        self.edges = [edge for edge in edges
                      if edge.parent and edge.child and edge.parent != edge.child]
        self.parents = parents
        self.troubles = troubles
        self.slashed = slashed
        self.endpoints = endpoints
        self.limits = limits
        self.now = max((moving.timing.last for _, moving in self.moving()), default=0)

    # --- edges

    def moving(self) -> Iterator[tuple[EdgeRecord, MovingEdge]]:
        """Yield the edges that arrived on topics of what moves."""
        for edge in self.edges:
            if edge.moving is not None:
                yield edge, edge.moving

    def of_kind(self, *kinds: Kind) -> Iterator[tuple[Edge, Trouble]]:
        """Yield (parent, child) and the incidents of some kinds."""
        for (kind, parent, child), trouble in self.troubles.items():
            if kind in kinds:
                yield (parent, child), trouble

    # --- the tree

    @cached_property
    def frames(self) -> list[str]:
        """Return every frame, in order of first appearance."""
        return list(dict.fromkeys(frame for edge in self.edges for frame in edge.frames))

    @cached_property
    def above(self) -> dict[str, list[EdgeRecord]]:
        """Return the edges to a child's parents, without loops: one, unless there is a fight."""
        found: dict[str, list[EdgeRecord]] = {}
        for edge in self.edges:
            if (Kind.LOOP, *edge.frames) not in self.troubles:
                found.setdefault(edge.child, []).append(edge)
        return found

    @cached_property
    def roots(self) -> dict[str, None]:
        """Return the frames that nothing has as a child."""
        return {frame: None for frame in self.frames if frame not in self.above}

    @cached_property
    def downward(self) -> list[EdgeRecord]:
        """Return the edges from the top down; if a child has several parents, the first one's."""
        below: dict[str, list[EdgeRecord]] = {}
        for edges in self.above.values():
            below.setdefault(edges[0].parent, []).append(edges[0])
        found = [edge for root in self.roots for edge in below.get(root, ())]
        for edge in found:  # it grows
            found += below.get(edge.child, ())
        return found

    @cached_property
    def trees(self) -> list[list[str]]:
        """Return the frames of each connected tree, the largest first."""
        neighbours: dict[str, list[str]] = {frame: [] for frame in self.frames}
        for parent, child in (edge.frames for edge in self.edges):
            neighbours[parent].append(child)
            neighbours[child].append(parent)
        trees, seen = [], set[str]()
        for frame in self.frames:
            if frame not in seen:
                trees.append(_reached(frame, neighbours))
                seen.update(trees[-1])
        return sorted(trees, key=len, reverse=True)

    def is_correction(self, edge: EdgeRecord) -> bool:
        """
        Return whether an edge is a localiser's: it corrects what moves by itself below it.

        REP 105's map -> odom is one: a root above, a moving edge below.
        """
        return edge.parent in self.roots and edge.child in self._parents_of_moving

    @cached_property
    def _parents_of_moving(self) -> set[str]:
        return {edge.parent for edge, _ in self.moving()}

    # --- clocks

    @cached_property
    def clocks(self) -> list[Clock]:
        """Return the edges that move, by clock; the clock of most of them first."""
        edges = sorted((edge for edge, moving in self.moving() if moving.timing.delays.count),
                       key=delay_of)
        groups: list[list[EdgeRecord]] = []
        for edge in edges:
            if not groups or delay_of(edge) - delay_of(groups[-1][-1]) > _ANOTHER_CLOCK:
                groups.append([])
            groups[-1].append(edge)
        return [Clock(group) for group in sorted(groups, key=len, reverse=True)]

    @cached_property
    def _main_clock(self) -> set[Edge]:
        return {edge.frames for edge in self.clocks[0].edges} if self.clocks else set()

    def goes_by_main_clock(self, edge: EdgeRecord) -> bool:
        """Return whether an edge is stamped by the clock of most of them."""
        return edge.frames in self._main_clock

    @cached_property
    def offset(self) -> float:
        """
        Return what all delays have in common because the stamps come from another clock.

        0 where they come from the clock of the arrivals, as far as can be seen.
        """
        common = self.clocks[0].delay if self.clocks else 0.0
        return common if abs(common) > _ANOTHER_CLOCK else 0.0


def delay_of(edge: EdgeRecord) -> float:
    """Return the usual delay of an edge that moves, nanoseconds."""
    assert edge.moving is not None
    return edge.moving.timing.delays.median


def _reached(frame: str, neighbours: Mapping[str, Sequence[str]]) -> list[str]:
    reached, waiting = {frame: None}, [frame]
    while waiting:
        for other in neighbours[waiting.pop()]:
            if other not in reached:
                reached[other] = None
                waiting.append(other)
    return list(reached)
