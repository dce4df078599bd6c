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

"""All frames at once: the pose of each as one of them sees it, in one pass over the tree."""

from .ways import Ways
from ..edges.protocol import History
from ..errors import ExtrapolationException
from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..stamp import LATEST

# An edge, the end that is reached, the end to reach, and whether that is the parent.
_Step = tuple[History, str, str, bool]


class Spanning:
    """The order in which all frames are reached from one; kept while no frame was re-hung."""

    def __init__(self, histories: dict[str, History], ways: Ways) -> None:
        """
        Begin without any.

        :param histories: each child frame's samples, as the tree has them at any time.
        """
        self._histories = histories
        self._ways = ways
        self._steps: dict[str, list[_Step]] = {}

    def forget(self) -> None:
        """Find every order anew: the structure has changed."""
        self._steps.clear()

    def poses_from(self, target: str, stamp: int) -> dict[str, PoseTuple]:
        """
        Return ``target_T_frame`` for every frame that has one at a stamp.

        :param stamp: nanoseconds; 0 is a time here.
        :raises LookupException: nobody published the target.
        :raises InvalidArgumentException: a name that cannot be a frame.
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
        """Return the newest time that all moving edges of a frame's tree have data for, or 0."""
        self._ways.check_frame('target_frame', target)
        stamps = [history.latest_stamp for history, *_ in self._steps_from(target, None)
                  if not history.is_static and history.latest_stamp is not None]
        return min(stamps, default=LATEST)

    def _steps_from(self, target: str, stamp: int | None) -> list[_Step]:
        """Return the edges in an order in which one end of each is reached before its turn."""
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
