# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The covariances of edges over time, separate from their poses.

They have their own stamps: the poses may arrive on /tf, and the covariances in odometry
messages. ``covariances`` defines the convention.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping, Sequence
import struct
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core.edges.protocol import History, moves
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array, Four
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.sample import bad_name
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Arrays, Bytes, Facts, Saved
from tf_tree_py.files.stamped_rows import StampedRows

from .covariance_rows import Rows
from .covariances import (
    between_rows,
    ends_turned_once,
    one_term,
    pack,
    PACKED_FLOATS,
    rows_of,
    Terms,
)

# Fewer expired covariances than this are not removed yet.
_MIN_BLOCK = 64
_TURNS_AS_BYTES = struct.Struct('18d').pack


class Around(NamedTuple):
    """
    The covariances of an edge around N stamps: arguments of ``covariances.between_rows``.

    Before the first covariance, and after the last, both are the same, with the ratio 0.

    :ivar before: (N, 21) packed; ``after`` likewise.
    :ivar turn: (N, 3)
    :ivar back: (N, 3, 3); None if the edge has no gyroscope.
    """

    before: Array
    after: Array
    ratio: Array
    turn: Array
    back: Array | None


Closing = Callable[[History, int, int, Stamps], tuple[Array, Array] | None]
"""
Returns the arguments of ``covariances.between_rows`` for a stretch between two poses.

It takes the history, both stamps, and the stamps (N,) of a lookup. The arguments are the remaining
error at the next pose, in the parent's axes, (3,), and the measured rotations back from there,
(N, 3, 3); None if not the whole stretch was measured.
"""


def closing_of(history: History) -> Closing | None:
    """Return what a gyroscope measured between the poses of a history; None if it has none."""
    closing: Closing | None = getattr(getattr(history, 'interpolation', None), 'closing', None)
    return closing


def pending(history: History, stamps: Stamps, poses: Array) -> Array | None:
    """
    Return the known errors of poses, such as those of a correction that has just begun.

    :param poses: (N, 7), or (1, 7) for all stamps (N,).
    :return: (N, 6) in the convention of ``covariances``; None if there are none.
    """
    known = getattr(history, 'pending', None)
    errors: Array | None = None if known is None else known(stamps, poses)
    return errors


def interpolated(each: Sequence[Around], independent: bool) -> Rows:
    """
    Return the covariances of E edges at N stamps, 21 rows (E, N).

    All edges are processed at once, because numpy takes as long for one.
    """
    before, after, ratio, turn = (
        np.stack(part) for part in zip(*(one[:4] for one in each), strict=True))
    return between_rows(rows_of(before), rows_of(after), ratio, rows_of(turn), independent,
                        _back_of([one.back for one in each], ratio.shape[1]))


def _back_of(backs: Sequence[Array | None], count: int) -> Rows | None:
    """Return the rotations by gyroscopes, nine rows (E, N); None if no edge has one."""
    if all(back is None for back in backs):
        return None
    still = np.broadcast_to(np.eye(3), (count, 3, 3))
    return rows_of(np.stack([still if back is None else back for back in backs]).reshape(
        len(backs), count, 9))


class Uncertainty(StampedRows):
    """
    The covariances of one edge's poses over time.

    A covariance takes 176 bytes. Between two stamps with covariances it is interpolated; the
    first also applies before its stamp, the last until the next arrives. It is not
    thread-safe; the buffer's lock protects it. A frame that changes its parent has one object
    for each parent.
    """

    __slots__ = ()

    width, name, least = PACKED_FLOATS, 'count', 1

    def insert(self, stamp: int, covariance: Array, cache_time: int) -> None:
        """
        Add a covariance; it replaces one with the same stamp.

        :param covariance: (6, 6), checked.
        :param cache_time: how far behind the newest one they are kept, nanoseconds.
        """
        index = bisect_left(self.stamps, stamp)
        if stamp in self.stamps[index:index + 1]:
            self.drop(index, index + 1)
        self.add(index, stamp, pack(covariance).tolist())
        self._tidy(self.stamps[-1] - cache_time)

    def _tidy(self, horizon: int) -> None:
        """Remove expired ones in blocks; the last one before the horizon still applies at it."""
        expired = bisect_right(self.stamps, horizon) - 1
        if expired >= max(_MIN_BLOCK, len(self) // 8):
            self.drop(0, expired)

    def around_poses(self, stamps: Stamps, history: History) -> Around:
        """
        Return the covariances around stamps (N,), for interpolation.

        :param history: the edge's poses.
        """
        if history.is_static or len(self) == 1:
            last = np.tile(np.array(self.numbers[-PACKED_FLOATS:]), (len(stamps), 1))
            return Around(last, last, np.zeros(len(stamps)), np.zeros((len(stamps), 3)), None)
        begins, ends, before, after, ratio = self.around(stamps)
        return Around(before, after, ratio, *_turns(history, begins, ends, stamps))

    def terms_at(self, stamp: int, history: History, independent: bool) -> Terms:
        """
        Return the covariance at one stamp as one term, or as two terms of an interpolation.

        See ``covariances.between_rows``. For an edge with a gyroscope it is one term.
        """
        stamps = self.stamps
        after = len(stamps) if history.is_static else bisect_right(stamps, stamp)
        if not 0 < after < len(stamps):
            return one_term(self._rows(max(after - 1, 0)))
        if closing_of(history) is not None:
            rows = interpolated([self.around_poses(np.array([stamp]), history)], independent)
            return one_term(np.array(rows).tobytes())
        begin, end = stamps[after - 1], stamps[after]
        if stamp == begin:
            return one_term(self._rows(after - 1))
        ratio = (stamp - begin) / (end - begin)
        rest = 1.0 - ratio
        weights = (rest * rest, ratio * ratio) if independent else (rest, ratio)
        turns = ends_turned_once(ratio, _turn(history, begin, end))
        return weights, _TURNS_AS_BYTES(*turns), self._rows(after - 1, 2)

    def _rows(self, number: int, count: int = 1) -> Bytes:
        first = number * PACKED_FLOATS
        rows: Any = self.numbers[first:first + count * PACKED_FLOATS]
        packed: Bytes = rows  # usable like bytes
        return packed

    def knots_around(self, stamp: int, history: History) -> tuple[int, int]:
        """Return the stamps of the covariances before and after a stamp, as ``around`` does."""
        stamps = self.stamps
        after = len(stamps) if history.is_static else bisect_right(stamps, stamp)
        return stamps[max(after - 1, 0)], stamps[min(after, len(stamps) - 1)]


def _turns(history: History, begins: Stamps, ends: Stamps,
           stamps: Stamps) -> tuple[Array, Array | None]:
    """Return the fields ``turn`` and ``back`` of ``Around``."""
    closing = closing_of(history)
    if closing is None:
        return _turns_at_constant_rates(history, begins, ends), None
    turns, back = np.zeros((len(stamps), 3)), np.tile(np.eye(3), (len(stamps), 1, 1))
    for begin in np.unique(begins):
        here = begins == begin
        turns[here], back[here] = _turn_by_gyroscope(
            closing, history, int(begin), int(ends[here][0]), stamps[here])
    return turns, back


def _turns_at_constant_rates(history: History, begins: Stamps, ends: Stamps) -> Array:
    """Return ``_turn`` (N, 3) between many stamps."""
    oldest, newest = history.oldest_stamp, history.newest_stamp
    if (not history.fixed_parent or not history.takes_samples or oldest is None
            or newest is None):
        pairs, place = np.unique(begins, return_index=True, return_inverse=True)[1:]
        return np.array([so3.log(_turn(history, int(begins[pair]), int(ends[pair])))
                         for pair in pairs])[place]
    turns = np.zeros((len(begins), 3))
    known = np.flatnonzero((begins < ends) & (begins >= oldest) & (ends <= newest))
    if not len(known):
        return turns
    begins, ends = begins[known], ends[known]
    track = history.track(int(begins.min()), int(ends.max()))
    after = track.knots.take(track.knots.searchsorted(begins, side='right'), mode='clip')
    _, first = _rotations(track.at(begins))
    second, _ = _rotations(track.at(ends))
    turned = so3.log_many(np.stack(so3.multiply(second, first), axis=-1))
    turns[known] = np.where((after >= ends)[:, None], turned, 0.0)
    return turns


def _rotations(poses: Array) -> tuple[Four[Array], Four[Array]]:
    """Return rotations and their inverses, row by row, of poses (7, N)."""
    x, y, z, w = poses[3:]
    return (x, y, z, w), (-x, -y, -z, w)


def _turn(history: History, first: int, last: int) -> so3.Quaternion:
    """
    Return the rotation of an edge between two stamps, if its rate is constant.

    It is the identity if there are poses between the two stamps, or no poses: then the
    covariances are blended without a rotation.
    """
    if first == last:
        return so3.IDENTITY
    ends = history.neighbours(first, last)
    if ends is None:
        return so3.IDENTITY
    _, _, _, ax, ay, az, aw, _, _, _, bx, by, bz, bw = ends
    return so3.multiply((bx, by, bz, bw), (-ax, -ay, -az, aw))


def _turn_by_gyroscope(closing: Closing, history: History, first: int, last: int,
                       stamps: Stamps) -> tuple[Array, Array]:
    """Return a gyroscope's remaining error, (3,), and its rotations back, (N, 3, 3)."""
    known = first < last and history.neighbours(first, last) is not None
    measured = closing(history, first, last, stamps) if known else None
    return measured or (np.array(so3.log(_turn(history, first, last))), np.eye(3))


# --- the edges of a tree

class EdgeCovariances(Companion):
    """
    The covariances of a tree's edges.

    :ivar by_edge: the covariances of each edge that has any, by (parent, child).
    """

    key = 'uncertainty'

    def __init__(self) -> None:
        self.by_edge: dict[tuple[str, str], Uncertainty] = {}

    def copy(self) -> 'EdgeCovariances':
        """Return an independent copy."""
        twin = EdgeCovariances()
        twin.by_edge = {edge: one.copy() for edge, one in self.by_edge.items()}
        return twin

    def clear(self, histories: Mapping[str, History]) -> None:
        """Remove the covariances of edges that move; see ``Tree.clear``."""
        self.by_edge = {edge: one for edge, one in self.by_edge.items()
                        if not moves(histories.get(edge[1]))}

    def remove(self, frame: str) -> None:
        """Remove the covariances of a frame's edges to all its parents."""
        self.by_edge = {edge: one for edge, one in self.by_edge.items() if edge[1] != frame}

    def save(self, arrays: Arrays) -> list[Facts]:
        """Return the facts for ``load``, and add the covariances to arrays."""
        return [{'parent': parent, 'child': child} | one.save(arrays)
                for (parent, child), one in self.by_edge.items()]

    @classmethod
    def load(cls, saved: Saved) -> 'EdgeCovariances':
        """Return the saved covariances; they use the memory in place."""
        twin = cls()
        twin.by_edge = {(part.one('parent', str), part.one('child', str)): Uncertainty.load(part)
                        for part in saved.parts(cls.key)}
        return twin


def set_covariance(tree: Tree, parent: str, child: str, stamp: int, covariance: Array,
                   authority: str) -> list[Incident]:
    """
    Insert the covariance (6, 6) of an edge at a stamp; the edge need not have poses yet.

    :return: refusals, because the names come from messages; nearly always empty.
    """
    by_edge = tree.companion_or_new(EdgeCovariances).by_edge
    known = by_edge.get((parent, child))
    if known is None:
        bad = bad_name(parent, child, stamp, authority, tree.max_name_bytes)
        if bad:
            return [bad]
        if len(by_edge) >= tree.max_frames:
            return [Incident(
                Kind.TOO_MANY_FRAMES, parent, child, stamp, authority, 'the buffer already has '
                f'covariances of {len(by_edge)} edges, its limit (max_frames)')]
        known = by_edge[parent, child] = Uncertainty()
    known.insert(stamp, covariance, tree.cache_time)
    return []


def known_covariances(tree: Tree, parent: str, child: str) -> Uncertainty | None:
    """Return the covariances of an edge; None if it has none."""
    return covariances_by_edge(tree).get((parent, child))


def covariances_by_edge(tree: Tree) -> Mapping[tuple[str, str], Uncertainty]:
    """Return the covariances of each edge that has any, by (parent, child)."""
    known = tree.companion(EdgeCovariances)
    return {} if known is None else known.by_edge
