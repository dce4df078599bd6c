# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The poses of all frames in one of them, computed in one pass over the tree."""

from .path_finder import PathFinder
from ..edges.protocol import History
from ..errors import ExtrapolationException
from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..stamp import LATEST

# An edge, the known end, the end to be computed, and whether the latter is the parent.
_Step = tuple[History, str, str, bool]


class Spanning:
    """The order in which all frames are reached from one; cached while no parent changes."""

    def __init__(self, histories: dict[str, History], ways: PathFinder) -> None:
        """
        Begin without orders.

        :param histories: the tree's own mapping of each child frame's samples.
        """
        self._histories = histories
        self._ways = ways
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
        self._ways.check_frame('target_frame', target)
        poses = {target: se3.IDENTITY}
        for history, known, frame, upwards in self._steps_from(target, stamp):
            if known not in poses:
                continue
            try:
                pose = history.sample(stamp)
            except ExtrapolationException:
                continue
            poses[frame] = se3.compose_chain(
                (poses[known], se3.inverse(pose) if upwards else pose))
        return poses

    def newest_of_all(self, target: str) -> int:
        """Return the newest time for which all moving edges of a frame's tree have data, or 0."""
        self._ways.check_frame('target_frame', target)
        stamps = [history.latest_stamp for history, *_ in self._steps_from(target, None)
                  if not history.is_static and history.latest_stamp is not None]
        return min(stamps, default=LATEST)

    def _steps_from(self, target: str, stamp: int | None) -> list[_Step]:
        """Return the edges in an order in which one end of each edge is already known."""
        if target in self._steps:
            return self._steps[target]
        fixed = not self._ways.was_rehung
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
