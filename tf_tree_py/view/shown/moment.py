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
All frames at one stamp, as a page draws them.

Every pose is ``lookup_tree`` at the one stamp. A frame that has no data for it, because
its publisher stopped, stands where ``lookup_at`` has it at the last stamp that it has
data for. It is told apart by its age.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core import EdgeInfo, Pose, TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.tree.queries import Queries

from .living import interval, links_of, living, reached

# A pose that is older than this is stale; where edges come slowly, by so much more.
_STALE = 1_000_000_000


class Moment(NamedTuple):
    """
    What a page draws.

    :ivar stamp: nanoseconds.
    :ivar fixed_frame: where all poses are expressed.
    :ivar frames: the N that can be drawn.
    :ivar poses: (N, 7) ``fixed_T_frame``.
    :ivar parents: (N,) the place of each one's parent among the frames; -1 for none.
    :ivar static: (N,) whether its edge to the parent never moves.
    :ivar stamps: (N,) the stamp of each pose; that of the moment unless there was no data.
    :ivar ages: (N,) nanoseconds, by how much a pose is older than the page's clock; 0 where
        nothing moves between the frame and the fixed one.
    :ivar stale: (N,) whether the age is more than its edges' rates explain.
    """

    stamp: int
    fixed_frame: str
    frames: tuple[str, ...]
    poses: Array
    parents: npt.NDArray[np.int64]
    static: npt.NDArray[np.bool_]
    stamps: npt.NDArray[np.int64]
    ages: npt.NDArray[np.int64]
    stale: npt.NDArray[np.bool_]

    def place(self, frame: str) -> int | None:
        """Return where a frame stands among the others; None if it is not drawn."""
        return self.frames.index(frame) if frame in self.frames else None


def nothing(fixed_frame: str) -> Moment:
    """Return a moment without frames."""
    none = np.empty(0, np.int64)
    no = np.empty(0, np.bool_)
    return Moment(LATEST, fixed_frame, (), np.empty((0, 7)), none, no, none, none, no)


def live_moment(tree: Queries, fixed_frame: str, now: int) -> Moment:
    """
    Return the newest moment for which all edges have data that go on.

    :param now: what ages are counted from, nanoseconds.
    """
    edges = Queries.edges(tree)
    around = reached(fixed_frame, links_of(edges))
    going_on = living([edge for edge in edges if edge.child in around])
    stamp = min((edge.latest for edge in going_on), default=LATEST)
    slowest = max(map(interval, going_on), default=0.0)
    return _moment(tree, edges, fixed_frame, stamp, max(now, stamp), _STALE + int(slowest))


def moment_at(tree: Queries, fixed_frame: str, stamp: int) -> Moment:
    """Return all frames at a stamp, which ages are counted from, too."""
    return _moment(tree, Queries.edges(tree), fixed_frame, stamp, stamp, _STALE)


def _moment(tree: Queries, edges: Sequence[EdgeInfo], fixed_frame: str, stamp: int, now: int,
            stale_after: int) -> Moment:
    try:
        poses = tree.lookup_tree(fixed_frame, stamp)
    except TransformException:
        return nothing(fixed_frame)
    stamps = dict.fromkeys(poses, stamp)
    for frame, (own, pose) in _left_behind(tree, edges, fixed_frame, stamp, poses).items():
        stamps[frame], poses[frame] = own, pose
    frames = tuple(poses)
    of_pose = np.fromiter(stamps.values(), np.int64, len(frames))
    rigid = reached(fixed_frame, links_of([edge for edge in edges if edge.static]))
    moves = np.array([frame not in rigid for frame in frames], np.bool_)
    ages = np.where(moves, np.maximum(now - of_pose, 0), 0)
    return Moment(
        stamp, fixed_frame, frames, np.array(list(poses.values()), float).reshape(-1, 7),
        _parents(tree, edges, frames, stamp), _static(edges, frames), of_pose, ages,
        ages > stale_after)


def _left_behind(tree: Queries, edges: Sequence[EdgeInfo], fixed_frame: str, stamp: int,
                 poses: Mapping[str, Pose]) -> dict[str, tuple[int, Pose]]:
    """Return where the frames without data for a stamp were last, and when that was."""
    last = {}
    for frame in dict.fromkeys(name for edge in edges for name in (edge.parent, edge.child)):
        if frame in poses:
            continue
        try:
            newest = tree.latest_common_time(fixed_frame, frame)
            if newest <= stamp:
                last[frame] = newest, tree.lookup_at(fixed_frame, frame, newest)
        except TransformException:
            continue  # it hangs on another root, or its edges have no stamp in common
    return last


def _parents(tree: Queries, edges: Sequence[EdgeInfo], frames: Sequence[str],
             stamp: int) -> npt.NDArray[np.int64]:
    """Return the place of each frame's parent, as it was at the stamp, or else as it is last."""
    parents = {edge.child: edge.parent for edge in edges} | tree.parents_at(stamp)
    places = {frame: place for place, frame in enumerate(frames)}
    return np.array([places.get(parents.get(frame, ''), -1) for frame in frames], np.int64)


def _static(edges: Sequence[EdgeInfo], frames: Sequence[str]) -> npt.NDArray[np.bool_]:
    fixed = {edge.child for edge in edges if edge.static}
    return np.array([frame in fixed for frame in frames], np.bool_)
