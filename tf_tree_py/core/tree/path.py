# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The edges between two frames, prepared for composition at any stamp.

This file only computes along a known path; ``path_finder`` finds the edges. A ``Path`` refers to
the tree's histories, so it is used with the buffer's lock, and only until the structure changes.
A reader of a shared tree uses it without the lock, and finds out afterwards whether another thread
has changed a history: see ``shared/mirror``. So ``pose_at`` changes nothing.

``path_in_c.c`` repeats ``Path.pose_at`` in C. It reads the slots of ``StaticHistory`` and
``Samples`` directly, and what was built may be older than the Python code. So the slots, a
revision, and a few poses are compared when this file is imported.
"""

from collections.abc import Callable, Iterable, Sequence
import os
from typing import NamedTuple

from ..edges.protocol import EdgeTrack, History, moves, MovingHistory
from ..edges.samples import Samples
from ..edges.static import StaticHistory
from ..errors import ExtrapolationException, warn
from ..geometry.chain import compose, inverse, join_branches, PoseTuple
from ..stamp import BEGINNING, FOREVER, LATEST


class Step(NamedTuple):
    """
    One edge on the path from the target to the source.

    :ivar upwards: whether the path leads from the child to the parent here.
    """

    parent: str
    history: History
    upwards: bool


class Path:
    """
    The two branches from a meeting point down to the source and to the target.

    Successive static edges are composed here once; so a path is valid only until one of them
    changes. ``fixed`` means that no edge on the path changes its parent over time. Otherwise
    the path is valid only for its own stamp. ``for_good`` means that there was no other path at
    any time: if an edge of it has no data for a stamp, its child had no parent then, and no edge
    above the meeting point ever changed its parent.

    :ivar moving: all edges that are not static.
    """

    __slots__ = ('fixed', 'for_good', 'source_parts', 'target_parts', 'moving', '_edges', '_steps')

    def __init__(self, source_edges: Sequence[History], target_edges: Sequence[History],
                 above: Sequence[History] = ()) -> None:
        """
        Take the edges of both branches, each from the leaf up to the meeting point.

        :param above: the edges above it, by the newest samples; not needed for poses.
        """
        self.fixed = all(edge.fixed_parent for edge in (*source_edges, *target_edges))
        self.for_good = self.fixed and all(edge.fixed_parent for edge in above)
        self._edges = source_edges, target_edges
        self._steps: list[Step] | None = None
        self.source_parts = _merge_static_runs(source_edges)
        self.target_parts = _merge_static_runs(target_edges)
        self.moving = tuple(edge for edge in (*reversed(source_edges), *reversed(target_edges))
                            if moves(edge))

    def steps(self) -> list[Step]:
        """Return all edges of a fixed path from the target to the source, including static."""
        if self._steps is None:
            source_edges, target_edges = self._edges
            self._steps = [Step(str(edge.parent), edge, upwards) for edges, upwards in (
                (target_edges, True), (reversed(source_edges), False)) for edge in edges]
        return self._steps

    def latest_common_time(self) -> int:
        """Return the newest time for which every edge has data; see ``latest_common``."""
        return latest_common(self.moving)

    def slowest_edges(self) -> list[MovingHistory]:
        """Return the edges whose newest sample limits the latest common time."""
        common = self.latest_common_time()
        return [edge for edge in self.moving
                if common in (edge.latest_stamp, edge.newest_stamp)]

    def span(self) -> tuple[int, int]:
        """Return the oldest and the latest stamp for which every moving edge has data."""
        oldest, latest = BEGINNING, FOREVER - 1
        for edge in self.moving:
            assert edge.oldest_stamp is not None and edge.latest_stamp is not None
            oldest, latest = max(oldest, edge.oldest_stamp), min(latest, edge.latest_stamp)
        return oldest, latest

    def tracks(self, first: int, last: int) -> tuple[list[EdgeTrack], list[EdgeTrack]]:
        """
        Return a copy of the data for lookups between two stamps in the span.

        :return: those from the meeting point down to the source, and those to the target.
        """
        return ([part.track(first, last) for part in self.source_parts],
                [part.track(first, last) for part in self.target_parts])

    def without_data(self, stamp: int) -> list[MovingHistory]:
        """Return the edges without data for a stamp."""
        return [edge for edge in self.moving if edge.parent_at(stamp) is None]

    def failure(self, stamp: int, error: ExtrapolationException) -> ExtrapolationException:
        """
        Return why a fixed path has no answer at a stamp, and which data may change that.

        :param error: the error of one of its edges; returned if that edge is the worst.
        """
        stuck = self.without_data(stamp)
        worst = edge_to_blame(stuck, stamp)
        if worst.child != error.child:
            error = worst.extrapolation(stamp)
        if not any(edge.is_too_old(stamp) for edge in stuck):
            error.blocked_on = tuple(
                [(edge.child, edge.next_turn(stamp)) for edge in self.moving])
        return error

    def pose_at(self, stamp: int) -> PoseTuple:
        """
        Return ``target_T_source``: inverse(top_T_target) top_T_source.

        :raises ExtrapolationException: an edge has no data for the stamp.
        """
        pose = pose_in_c and pose_in_c(self.source_parts, self.target_parts, stamp)
        return pose or join_branches([part.sample(stamp) for part in self.source_parts],
                                     [part.sample(stamp) for part in self.target_parts])


def across(a_T_b: PoseTuple, edge: History, upwards: bool, stamp: int) -> PoseTuple:
    """
    Return ``a_T_c``, where an edge joins b and c.

    :param upwards: whether c is the parent, which is so for few of a tree's edges.
    """
    if upwards:
        return compose(a_T_b, inverse(edge.sample(stamp)))
    pose = pose_in_c and pose_in_c((a_T_b, edge), (), stamp)
    return pose or compose(a_T_b, edge.sample(stamp))


def sample_of(edge: History, stamp: int) -> PoseTuple:
    """Return ``edge.sample(stamp)``, in C where that is possible."""
    return (pose_in_c and pose_in_c((edge,), (), stamp)) or edge.sample(stamp)


def latest_common(edges: Sequence[MovingHistory]) -> int:
    """
    Return the newest stamp for which every edge has data, at most that of the newest sample.

    So an edge that holds its newest sample does not make others older, and nothing is answered
    for a time of which no edge knows anything yet.

    :param edges: that move; those without samples are left out.
    :return: nanoseconds; ``LATEST`` if there is none.
    """
    common, slowest = FOREVER, None
    for edge in edges:
        stamp = edge.latest_stamp
        if stamp is not None and stamp < common:
            common, slowest = stamp, edge
    if slowest is None:
        return LATEST
    if slowest.newest_stamp != common:
        common = min(common, max(edge.newest_stamp for edge in edges
                                 if edge.newest_stamp is not None))
    return common


def edge_to_blame(edges: Iterable[MovingHistory], stamp: int) -> MovingHistory:
    """
    Return the worst of some edges without data for a stamp.

    The worst is an edge whose data for the stamp is lost permanently; then one without data so
    old; then the one with the oldest newest sample.
    """
    def order(edge: MovingHistory) -> tuple[int, int]:
        oldest, latest = edge.oldest_stamp, edge.latest_stamp
        if oldest is not None and stamp < oldest:
            return not edge.is_too_old(stamp), -oldest
        return 2, BEGINNING if latest is None else latest

    return min(edges, key=order)


def _merge_static_runs(edges: Sequence[History]) -> tuple[History, ...]:
    """Return the edges from the top down, with successive static edges composed."""
    parts: list[History] = []
    for edge in reversed(edges):
        if parts and parts[-1].is_static and edge.is_static:
            above = parts[-1]
            parts[-1] = StaticHistory(edge.child, str(above.parent), compose(
                above.sample(LATEST), edge.sample(LATEST)))
        else:
            parts.append(edge)
    return tuple(parts)


# --- in C

_REVISION = 1  # of path_in_c.c

_Parts = tuple[History | PoseTuple, ...]
_PoseInC = Callable[[_Parts, _Parts, int], PoseTuple | None]


def load_pose_in_c() -> _PoseInC | None:
    """Return the C function; None where it was not built, does not fit, or is not wanted."""
    if os.environ.get('TF_TREE_PY_PURE', '0') not in ('', '0'):
        return None
    try:
        from . import path_in_c
        path_in_c.use(StaticHistory, Samples, _REVISION)
        _compare(path_in_c.pose_at)
    except (AttributeError, ImportError, TypeError, ValueError) as error:
        if getattr(error, 'name', None) != __package__:  # otherwise it was not built
            warn(f'lookups run in Python, because the compiled formulas do not fit ({error}): '
                 'install tf_tree_py again, or set TF_TREE_PY_PURE=1', RuntimeWarning)
        return None
    return path_in_c.pose_at


def _compare(in_c: _PoseInC) -> None:
    """
    Compare poses at, and between, samples that are turned by 0.4, 3.1 and 5.0 rad.

    :raises ValueError: C returns other numbers, maybe because its sine is not Python's.
    """
    still = StaticHistory('b', 'a', (1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8))
    moving = Samples('c', 100)
    for stamp, cos, sin in (0, 1.0, 0.0), (7, 0.98, 0.199), (14, 0.0, 1.0), (21, -0.8, 0.6):
        moving.insert(stamp, 'b', (0.1 * stamp, cos, 3.0, sin, 0.0, -0.0, cos))
    for stamp in range(22):
        in_python = join_branches([moving.sample(stamp)], [still.sample(stamp)])
        if in_c((moving,), (still,), stamp) != in_python:
            raise ValueError('they return other numbers than Python')


pose_in_c = load_pose_in_c()
COMPILED = pose_in_c is not None
"""Whether lookups use the compiled formulas; see ``docs/installing.md``."""
