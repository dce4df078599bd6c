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
The way between two frames: by the newest samples, or as it was at a stamp.

``tree`` knows which frame hangs on which. A way that does not change with the stamp is kept
here until the structure of the tree changes.
"""

from functools import partial

from .climb import blockers, Branches, climb, climb_both
from .path import furthest_from_cure, Path
from ..edges.protocol import History, moves
from ..errors import (
    ANY_STRUCTURE,
    Blocker,
    ConnectivityException,
    ExtrapolationException,
    Hint,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from ..geometry.se3 import PoseTuple
from ..suggest import known_names

# Paths kept to save time: all are forgotten at this number.
_MAX_PATHS = 20_000


class Ways:
    """
    Finds ways in a tree, and keeps those on which no edge ever changed its parent.

    :ivar when_empty: the hint of an error while there is no frame.
    """

    def __init__(self, histories: dict[str, History], frames: dict[str, None]) -> None:
        """
        Begin without any.

        :param histories: each child frame's samples, as the tree has them at any time.
        :param frames: likewise every frame name.
        """
        self.when_empty = 'Nothing has been received yet'
        self._histories = histories
        self._frames = frames
        self._was_rehung: bool | None = None
        # None: the way changes with the stamp, or there is none.
        self._paths: dict[tuple[str, str], Path | None] = {}

    def forget(self) -> None:
        """Find every way anew: the structure has changed."""
        self._was_rehung = None
        self._paths.clear()

    def newest_path(self, target: str, source: str) -> Path:
        """
        Return the way between two frames by every edge's newest sample.

        The textbook's walk: climb from the source, climb from the target, meet at
        the lowest common ancestor.

        :raises InvalidArgumentException: a name that cannot be a frame.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        """
        return self._fixed_path(target, source) or self._path(target, source, None)

    def pose_at(self, target: str, source: str, stamp: int) -> PoseTuple:
        """
        Return ``target_T_source`` at a stamp, by the way that there was then.

        :param stamp: nanoseconds; 0 is a time here.
        :raises ExtrapolationException: nothing joins them, and an edge has no data then.

        The other errors are those of ``newest_path``.
        """
        path = self._fixed_path(target, source)
        if path is not None:
            try:
                return path.pose_at(stamp)
            except ExtrapolationException as error:
                if path.for_good:
                    raise path.failure(stamp, error) from None
                # A frame above once hung elsewhere, so there may be another way.
        return self._path(target, source, stamp).pose_at(stamp)

    def newest_pose(self, target: str, source: str) -> tuple[int, PoseTuple]:
        """
        Return the newest time that every edge between two frames has data for, and the pose.

        Errors are those of ``newest_path`` and ``pose_at``.
        """
        path = self.newest_path(target, source)
        stamp = path.latest_common_time()
        if path.fixed:
            try:
                return stamp, path.pose_at(stamp)
            except ExtrapolationException:
                pass  # Below it is asked again, for another way or for the reason.
        try:
            return stamp, self.pose_at(target, source, stamp)
        except TransformException as error:
            # Late samples may cure it, and so may a newer time that all edges have data for.
            error.blocked_on = (*(error.blocked_on or ()), *(
                (edge.child, stamp + 1) for edge in path.slowest_edges()))
            raise

    def _fixed_path(self, target: str, source: str) -> Path | None:
        """Return the present way if it never changes with the stamp, else None; it is kept."""
        try:
            path = self._paths.get((target, source))
            known = path is not None or (target, source) in self._paths
        except TypeError:  # not hashable, such as a list: check_frame raises an error for it
            return None
        return path if known else self._find_fixed_path(target, source)

    def _find_fixed_path(self, target: str, source: str) -> Path | None:
        self._check_frames(target, source)
        now = climb_both(self._histories, target, source, None)
        path = Path(*now.edges(), self._above(now.target.top)) if now.meet else None
        if path is not None and not path.fixed:
            path = None
        if len(self._paths) >= _MAX_PATHS:
            self._paths.clear()
        self._paths[target, source] = path
        return path

    def _above(self, frame: str) -> list[History]:
        """Return the edges above a frame by the newest samples; the last may have ended."""
        above = climb(self._histories, frame, None)
        last = self._histories.get(above.top)
        return above.edges if last is None else [*above.edges, last]

    def _path(self, target: str, source: str, stamp: int | None) -> Path:
        """Return the way at a stamp (None: by the newest samples)."""
        return Path(*self.branches(target, source, stamp).edges())

    def blockers(self, target: str, source: str, stamp: int) -> tuple[Blocker, ...]:
        """Return what may change the answer at a stamp; empty if nothing ever can."""
        return blockers(self._histories, target, source, stamp) or ()

    @property
    def was_rehung(self) -> bool:
        """Return whether a frame hangs elsewhere than before, at a time that can be asked for."""
        if self._was_rehung is None:
            self._was_rehung = not all(
                history.fixed_parent for history in self._histories.values())
        return self._was_rehung

    def check_frame(self, argument: str, frame: str) -> None:
        """
        Raise an error if a query cannot use a frame name.

        :raises InvalidArgumentException: empty, or with a leading slash.
        :raises LookupException: not known.
        """
        if not isinstance(frame, str) or not frame or frame.startswith('/'):
            raise InvalidArgumentException(
                f'Invalid argument {argument} {frame!r}: a frame in a query is a string, '
                'not empty and without a leading slash')
        if frame not in self._frames:
            raise LookupException(
                f'"{frame}" passed to lookupTransform argument {argument} does not exist',
                hint=self._known_frames(frame), blocked_on=ANY_STRUCTURE)

    def _check_frames(self, target: str, source: str) -> None:
        self.check_frame('target_frame', target)
        self.check_frame('source_frame', source)

    def _known_frames(self, frame: str) -> Hint:
        if not self._frames:
            return self.when_empty
        return partial(known_names, frame, tuple(self._frames))

    def branches(self, target: str, source: str, stamp: int | None) -> Branches:
        """
        Return the climbs from two frames to where they meet.

        :param stamp: nanoseconds; None goes by the newest samples.

        Errors are those of ``newest_path`` and ``pose_at``.
        """
        self._check_frames(target, source)
        branches = climb_both(self._histories, target, source, stamp)
        if not branches.meet:
            raise self._not_joined(branches, target, source, stamp)
        return branches

    def _not_joined(self, branches: Branches, target: str, source: str,
                    stamp: int | None) -> TransformException:
        """Return what tf2 says of two climbs that do not meet."""
        error: TransformException | None = None
        if stamp is not None:
            error = self._why_stuck(branches, target, source, stamp)
        if error is None:
            error = ConnectivityException(
                f'Could not find a connection between {target!r} and {source!r} because they '
                f'are not part of the same tree: {target!r} hangs on {branches.target.top!r}, '
                f'{source!r} on {branches.source.top!r}',
                hint='Tf has two or more unconnected trees: who should publish the edge between '
                'them? tf_doctor tells which there are, and names that are only spelled in two '
                'ways')
        error.blocked_on = ANY_STRUCTURE if stamp is None else blockers(
            self._histories, target, source, stamp)
        return error

    def _why_stuck(self, branches: Branches, target: str, source: str,
                   stamp: int) -> ExtrapolationException | None:
        """Return which edge has no data for a stamp; None if both climbs got to a root."""
        stuck = [history for climb in branches
                 if moves(history := self._histories.get(climb.top))]
        if not stuck:
            return None
        # If the frames are joined now, the edge to name lies between them, not above.
        now = climb_both(self._histories, target, source, None)
        between = Path(*now.edges()).without_data(stamp) if now.meet else []
        return furthest_from_cure(between or stuck, stamp).extrapolation(stamp)
