# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
All frames at one stamp, as a page draws them.

All poses are those of ``lookup_tree`` at this stamp. A frame whose publisher has stopped has
no data for it. Its pose is that of ``lookup_at`` at its last stamp, and its age is given.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import EdgeInfo, Pose, TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST

from .liveness import Edge, left_behind_by_stamps, LeftBehind, links_of, reached, without


class Moment(NamedTuple):
    """
    The frames that a page draws, and their poses.

    :ivar stamp: nanoseconds.
    :ivar fixed_frame: the frame in which all poses are expressed.
    :ivar frames: the N frames that can be drawn.
    :ivar poses: (N, 7) ``fixed_T_frame``.
    :ivar parents: (N,) the index of each frame's parent; -1: it has none.
    :ivar static: (N,) whether the edge to the parent is static.
    :ivar stamps: (N,) the stamp of each pose, nanoseconds: that of the moment, or an earlier
        one if there are no data for it.
    :ivar ages: (N,) the age of each pose by the page's clock, nanoseconds; 0 if only static
        edges connect the frame to the fixed one.
    :ivar stale: (N,) whether an edge between the frame and the fixed one is left behind.
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
        """Return the index of a frame; None if it is not drawn."""
        return self.frames.index(frame) if frame in self.frames else None


def nothing(fixed_frame: str) -> Moment:
    """Return a moment without frames."""
    none = np.empty(0, np.int64)
    no = np.empty(0, np.bool_)
    return Moment(LATEST, fixed_frame, (), np.empty((0, 7)), none, no, none, none, no)


def live_moment(tree: AllQueries, fixed_frame: str, now: int,
                left_behind: LeftBehind | None = None) -> Moment:
    """
    Return the newest moment for which all edges that still receive data have some.

    :param now: the time from which ages are counted, nanoseconds.
    :param left_behind: the judgement of a doctor that sees all messages; None: by the stamps.
    """
    edges = AllQueries.edges(tree)
    left_behind = left_behind or left_behind_by_stamps(edges)
    around = reached(fixed_frame, links_of(edges))
    moving = [edge for edge in edges if edge.child in around and not edge.static]
    gone = left_behind(now)
    # Where nothing comes any more, the moment is that before all ended.
    going_on = without(moving, gone) or without(moving, left_behind(LATEST))
    stamp = min((edge.latest for edge in going_on), default=LATEST)
    return _moment(tree, edges, fixed_frame, stamp, max(now, stamp), gone)


def moment_at(tree: AllQueries, fixed_frame: str, stamp: int) -> Moment:
    """Return all frames at a stamp, from which their ages are also counted."""
    edges = AllQueries.edges(tree)
    return _moment(tree, edges, fixed_frame, stamp, stamp, left_behind_by_stamps(edges)(stamp))


def _moment(tree: AllQueries, edges: Sequence[EdgeInfo], fixed_frame: str, stamp: int, now: int,
            gone: Collection[Edge]) -> Moment:
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
    fresh = reached(fixed_frame, links_of(without(edges, gone)))
    return Moment(
        stamp, fixed_frame, frames, np.array(list(poses.values()), float).reshape(-1, 7),
        _parents(tree, edges, frames, stamp), _static(edges, frames), of_pose, ages,
        np.array([frame not in fresh for frame in frames], np.bool_))


def _left_behind(tree: AllQueries, edges: Sequence[EdgeInfo], fixed_frame: str, stamp: int,
                 poses: Mapping[str, Pose]) -> dict[str, tuple[int, Pose]]:
    """Return the last stamp and pose of each frame without data for a stamp."""
    last = {}
    for frame in dict.fromkeys(name for edge in edges for name in (edge.parent, edge.child)):
        if frame in poses:
            continue
        try:
            newest = tree.latest_common_time(fixed_frame, frame)
            if newest <= stamp:
                last[frame] = newest, tree.lookup_at(fixed_frame, frame, newest)
        except TransformException:
            continue  # it is below another root, or its edges have no stamp in common
    return last


def _parents(tree: AllQueries, edges: Sequence[EdgeInfo], frames: Sequence[str],
             stamp: int) -> npt.NDArray[np.int64]:
    """Return the index of each frame's parent at the stamp, or else of its last parent."""
    parents = {edge.child: edge.parent for edge in edges} | tree.parents_at(stamp)
    places = {frame: place for place, frame in enumerate(frames)}
    return np.array([places.get(parents.get(frame, ''), -1) for frame in frames], np.int64)


def _static(edges: Sequence[EdgeInfo], frames: Sequence[str]) -> npt.NDArray[np.bool_]:
    fixed = {edge.child for edge in edges if edge.static}
    return np.array([frame in fixed for frame in frames], np.bool_)
