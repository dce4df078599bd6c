# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The path between two frames, by the newest samples or at a stamp; and the poses of all frames.

``tree`` stores the parents of frames. A path that does not depend on the stamp is cached here
until the structure of the tree changes. The poses of all frames in one of them are computed in
one pass over the tree.

Everything here is called with the buffer's lock. A cached path holds histories: one that the tree
replaces without ``forget`` would go on to answer, with the samples of before.
"""

from collections.abc import Callable

from .climb import blockers, Branches, climb, climb_both
from .path import across, edge_to_blame, latest_common, Path
from ..edges.protocol import History, moves, MovingHistory
from ..errors import (
    ANY_STRUCTURE,
    ArgumentTypeException,
    Blocker,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from ..geometry.se3 import IDENTITY, PoseTuple
from ..hints import nothing_yet, unconnected, unknown_frame

MAX_PATHS = 20_000
"""The maximum number of cached paths; all are removed when it is reached."""


class PathFinder:
    """
    Finds paths in a tree, and caches those on which no edge ever changed its parent.

    :ivar when_empty: returns the hint of an error in a live buffer while there is no frame.
    """

    def __init__(self, histories: dict[str, History], frames: dict[str, None]) -> None:
        """
        Begin without paths.

        :param histories: the tree's own mapping of each child frame's samples.
        :param frames: the tree's own mapping of every frame name.
        """
        self.when_empty: Callable[[], str] = nothing_yet
        self._histories = histories
        self._frames = frames
        self._changes_parent: bool | None = None
        # None: the path changes with the stamp, or there is none.
        self._paths: dict[tuple[str, str], Path | None] = {}

    def forget(self) -> None:
        """Remove all cached paths, because the structure has changed."""
        self._changes_parent = None
        self._paths.clear()

    def newest_path(self, target: str, source: str) -> Path:
        """
        Return the path between two frames by every edge's newest sample.

        This is the textbook's algorithm: climb from the source and from the target to the
        lowest common ancestor.

        :raises InvalidArgumentException: an invalid frame name.
        :raises LookupException: an unknown frame.
        :raises ConnectivityException: the two frames are not connected.
        """
        return self.fixed_path(target, source) or self._path(target, source, None)

    def pose_at(self, target: str, source: str, stamp: int,
                path: Path | None = None) -> PoseTuple:
        """
        Return ``target_T_source`` at a stamp, by the path at that stamp.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :param path: the fixed path, if the caller has it.
        :raises ExtrapolationException: they are not connected, and an edge has no data then.

        The other errors are those of ``newest_path``.
        """
        path = path or self.fixed_path(target, source)
        if path is not None:
            try:
                return path.pose_at(stamp)
            except ExtrapolationException as error:
                if path.for_good:
                    raise path.failure(stamp, error) from None
                # A frame above had another parent once, so there may be another path.
        return self._path(target, source, stamp).pose_at(stamp)

    def newest_pose(self, target: str, source: str) -> tuple[int, PoseTuple]:
        """
        Return the newest time for which all edges between two frames have data, and the pose.

        The errors are those of ``newest_path`` and ``pose_at``.
        """
        path = self.newest_path(target, source)
        stamp = path.latest_common_time()
        try:
            return stamp, self.pose_at(target, source, stamp, path if path.fixed else None)
        except TransformException as error:
            # Late samples may help, and so may a newer time for which all edges have data.
            error.blocked_on = (*(error.blocked_on or ()), *(
                (edge.child, stamp + 1) for edge in path.slowest_edges()))
            raise

    def fixed_path(self, target: str, source: str) -> Path | None:
        """Return the present path if it does not depend on the stamp, else None; cache it."""
        try:
            return self._paths[target, source]
        except KeyError:
            pass
        except TypeError:  # not hashable, such as a list: check_frame raises an error for it
            return None
        return self._find_fixed_path(target, source)

    def _find_fixed_path(self, target: str, source: str) -> Path | None:
        self._check_frames(target, source)
        now = climb_both(self._histories, target, source, None)
        path = Path(*now.edges(), self._above(now.target.top)) if now.meet else None
        if len(self._paths) >= MAX_PATHS:
            self._paths.clear()
        self._paths[target, source] = path = path if path and path.fixed else None
        return path

    def _above(self, frame: str) -> list[History]:
        """Return the edges above a frame by the newest samples; the last may have ended."""
        above = climb(self._histories, frame, None)
        last = self._histories.get(above.top)
        return above.edges if last is None else [*above.edges, last]

    def _path(self, target: str, source: str, stamp: int | None) -> Path:
        """Return the path at a stamp; None: by the newest samples."""
        return Path(*self.branches(target, source, stamp).edges())

    def blockers(self, target: str, source: str, stamp: int) -> tuple[Blocker, ...]:
        """Return the edges that may change the result at a stamp; empty if none can."""
        return blockers(self._histories, target, source, stamp) or ()

    @property
    def has_changed_parent(self) -> bool:
        """Return whether the parent of any frame changes within the stored time."""
        if self._changes_parent is None:
            self._changes_parent = not all(
                history.fixed_parent for history in self._histories.values())
        return self._changes_parent

    def check_frame(self, argument: str, frame: str,
                    query: str = 'lookupTransform') -> None:
        """
        Raise an error if a query cannot use a frame name.

        :param query: the name of the query in tf2.
        :raises InvalidArgumentException: it is empty or has a leading slash; or it is not a
            string, in which case the error is also a TypeError.
        :raises LookupException: the frame is unknown.
        """
        if not isinstance(frame, str) or not frame or frame.startswith('/'):
            cls = InvalidArgumentException if isinstance(frame, str) else ArgumentTypeException
            raise cls(
                f'Invalid argument {argument} {frame!r}: a frame name in a query must be a '
                'string that is not empty and has no leading slash')
        if frame not in self._frames:
            raise LookupException(
                f'"{frame}" passed to {query} argument {argument} does not exist',
                hint=unknown_frame(
                    frame, self._frames, '' if self._frames else self.when_empty()),
                blocked_on=ANY_STRUCTURE)

    def _check_frames(self, target: str, source: str) -> None:
        self.check_frame('target_frame', target)
        self.check_frame('source_frame', source)

    def branches(self, target: str, source: str, stamp: int | None) -> Branches:
        """
        Return the climbs from two frames to their meeting point.

        :param stamp: nanoseconds; None: use the newest samples.

        The errors are those of ``newest_path`` and ``pose_at``.
        """
        self._check_frames(target, source)
        branches = climb_both(self._histories, target, source, stamp)
        if not branches.meet:
            raise self._not_joined(branches, target, source, stamp)
        return branches

    def _not_joined(self, branches: Branches, target: str, source: str,
                    stamp: int | None) -> TransformException:
        """Return tf2's error for two climbs that do not meet."""
        error: TransformException | None = None
        if stamp is not None:
            error = self._why_stuck(branches, target, source, stamp)
        if error is None:
            error = ConnectivityException(
                f'Could not find a connection between {target!r} and {source!r} because they '
                f'are not part of the same tree: the root of {target!r} is '
                f'{branches.target.top!r}, that of {source!r} is {branches.source.top!r}',
                hint=unconnected)
        error.blocked_on = ANY_STRUCTURE if stamp is None else blockers(
            self._histories, target, source, stamp)
        return error

    def _why_stuck(self, branches: Branches, target: str, source: str,
                   stamp: int) -> ExtrapolationException | None:
        """Return the error of an edge without data; None if both climbs reached a root."""
        stuck = [history for climb in branches
                 if moves(history := self._histories.get(climb.top))]
        if not stuck:
            return None
        # If the frames are connected now, name an edge between them, not above them.
        now = climb_both(self._histories, target, source, None)
        between = Path(*now.edges()).without_data(stamp) if now.meet else []
        return edge_to_blame(between or stuck, stamp).extrapolation(stamp)


# --- all frames

# An edge, the known end, the end to be computed, and whether the latter is the parent.
_Step = tuple[History, str, str, bool]


class Spanning:
    """The order in which all frames are reached from one; cached while no parent changes."""

    def __init__(self, histories: dict[str, History], paths: PathFinder) -> None:
        """
        Begin without orders.

        :param histories: the tree's own mapping of each child frame's samples.
        """
        self._histories = histories
        self._paths = paths
        self._steps: dict[str, list[_Step]] = {}

    def forget(self) -> None:
        """Remove all cached orders, because the structure has changed."""
        self._steps.clear()

    def poses_from(self, target: str, stamp: int) -> dict[str, PoseTuple]:
        """
        Return ``target_T_frame`` for every frame that has one at a stamp.

        :param stamp: nanoseconds; 0 is an ordinary stamp.
        :raises LookupException: the target is unknown.
        :raises InvalidArgumentException: an invalid frame name.
        """
        self._paths.check_frame('target_frame', target)
        poses = {target: IDENTITY}
        for history, known, frame, upwards in self._steps_from(target, stamp):
            if known not in poses:
                continue
            try:
                poses[frame] = across(poses[known], history, upwards, stamp)
            except ExtrapolationException:
                continue
        return poses

    def latest_of_all(self, target: str) -> int:
        """Return the newest time for which all moving edges of a frame's tree have data, or 0."""
        return latest_common(self.moving(target))

    def moving(self, target: str) -> list[MovingHistory]:
        """Return all moving edges of a frame's tree, by the newest samples."""
        self._paths.check_frame('target_frame', target)
        return [edge for edge, *_ in self._steps_from(target, None) if moves(edge)]

    def _steps_from(self, target: str, stamp: int | None) -> list[_Step]:
        """Return the edges in an order in which one end of each edge is already known."""
        if target in self._steps:
            return self._steps[target]
        fixed = not self._paths.has_changed_parent
        neighbours: dict[str, list[_Step]] = {}
        for child, history in self._histories.items():
            parent = history.parent if fixed or stamp is None else history.parent_at(stamp)
            if parent is not None:
                neighbours.setdefault(parent, []).append((history, parent, child, False))
                neighbours.setdefault(child, []).append((history, child, parent, True))
        steps: list[_Step] = []
        reached = {target}
        frames = [target]
        for frame in frames:
            for step in neighbours.get(frame, ()):
                if step[2] not in reached:
                    reached.add(step[2])
                    frames.append(step[2])
                    steps.append(step)
        if fixed:
            self._steps[target] = steps
        return steps
