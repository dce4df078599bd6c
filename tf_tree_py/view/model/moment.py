# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
All frames at one stamp, as a page draws them.

All poses are those of ``lookup_tree`` at this stamp. A frame whose publisher has stopped has
no data for it. Its pose is that of ``lookup_at`` at its last stamp, and its age is given. Which
edges still receive data also decides which times a page can show. A frame can have a trail, the
path that it has taken, and an ellipsoid, the uncertainty of its position.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
import math
import threading
import time
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import EdgeInfo, Pose, TransformException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array, Quaternion
from tf_tree_py.core.stamp import is_silent, LATEST

Edge = tuple[str, str]

# An edge is silent after a second at the soonest.
_EVERY_S = 0.5

LeftBehind = Callable[[int], Collection[Edge]]
"""Returns the edges that answer no lookup for a time, nanoseconds; 0: that of the last arrival."""


class Remembered:
    """Caches which edges are left behind for half a second, as pages are drawn more often."""

    def __init__(self, judge: LeftBehind) -> None:
        self._judge = judge
        self._lock = threading.Lock()
        # By whether it was for the last arrival: when, and what was found.
        self._known: dict[bool, tuple[float, Collection[Edge]]] = {}

    def __call__(self, now: int) -> Collection[Edge]:
        """Return a recent judgement; see ``LeftBehind``."""
        with self._lock:
            present = time.monotonic()
            judged, found = self._known.get(now == LATEST, (-math.inf, ()))
            if present - judged >= _EVERY_S:
                found = self._judge(now)
                self._known[now == LATEST] = present, found
            return found


def left_behind_by_stamps(edges: Sequence[EdgeInfo]) -> LeftBehind:
    """Return what judges edges by their stamps, which cannot show whether one is only late."""
    moving = [edge for edge in edges if not edge.static]
    newest = max((edge.latest for edge in moving), default=LATEST)
    return lambda now: {(edge.parent, edge.child) for edge in moving
                        if is_silent((now or newest) - edge.latest, edge.interval)}


def without(edges: Sequence[EdgeInfo], left: Collection[Edge]) -> list[EdgeInfo]:
    """Return the edges that are not among those that are left behind."""
    return [edge for edge in edges if (edge.parent, edge.child) not in left]


def window(edges: Sequence[EdgeInfo], cache_time: int) -> tuple[int, int]:
    """
    Return the oldest and the newest stamp that a page can show, nanoseconds.

    Samples of an edge that stopped long ago do not extend the window.
    """
    moving = [edge for edge in edges if not edge.static]
    newest = max((edge.latest for edge in moving), default=LATEST)
    oldest = min((edge.oldest for edge in moving), default=LATEST)
    return max(oldest, newest - cache_time), newest


def reached(frame: str, links: Mapping[str, Collection[str]]) -> set[str]:
    """Return a frame and all frames that are linked to it, directly or indirectly."""
    known = {frame}
    waiting = [frame]
    while waiting:
        for other in links.get(waiting.pop(), ()):
            if other not in known:
                known.add(other)
                waiting.append(other)
    return known


def links_of(edges: Sequence[EdgeInfo]) -> dict[str, list[str]]:
    """Return the neighbours of each frame."""
    links: dict[str, list[str]] = {}
    for edge in edges:
        links.setdefault(edge.parent, []).append(edge.child)
        links.setdefault(edge.child, []).append(edge.parent)
    return links


# --- the moment

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


# --- uncertainty

# The true position is inside in 74 % of all cases, and along each single axis in 95 %.
_SIGMAS: Final = 2.0
# The least thickness, as a share of the longest axis, so that a flat ellipsoid stays visible.
_THINNEST: Final = 1e-3


class Ellipsoid(NamedTuple):
    """
    Two standard deviations of a position, in the fixed frame.

    :ivar place: the index of its frame in the moment.
    :ivar rotation: of the ellipsoid's axes, x y z w.
    :ivar semi_axes: (3,) their lengths, metres.
    """

    place: int
    rotation: Quaternion
    semi_axes: Array


def ellipsoid(tree: AllQueries, moment: Moment, frame: str) -> Ellipsoid | None:
    """Return the ellipsoid of a frame; None if its uncertainty is unknown."""
    place = moment.place(frame)
    if place is None or not tree.has_covariances:
        return None
    try:
        _, covariance = AllQueries.lookup_uncertain(
            tree, moment.fixed_frame, frame, int(moment.stamps[place]))
    except TransformException:  # the samples have expired in the meantime
        return None
    variances, axes = np.linalg.eigh(covariance[:3, :3])
    if variances[-1] <= 0.0:
        return None
    semi_axes = _SIGMAS * np.sqrt(np.maximum(variances, 0.0))
    # The sign of an eigenvector is free: choose a rotation and not a reflection.
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return Ellipsoid(place, so3.from_matrix(axes),
                     np.maximum(semi_axes, _THINNEST * semi_axes[-1]))


# --- the trail

# The number of points, which is enough for a smooth line on a screen.
_MOST = 400


def trail(tree: AllQueries, fixed_frame: str, frame: str, begin: int, end: int) -> Array:
    """
    Return the path of a frame in the fixed frame between two stamps.

    :return: (N, 2, 3) line segments, metres, with gaps where there are no data.
    """
    stamps = np.linspace(begin, end, _MOST).round().astype(np.int64)
    try:
        poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    except TransformException:
        return np.empty((0, 2, 3))
    pieces = np.stack([poses[:-1, :3], poses[1:, :3]], axis=1)
    return pieces[valid[:-1] & valid[1:]]
