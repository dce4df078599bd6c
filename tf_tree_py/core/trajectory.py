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
Where one frame was in another over time: poses, velocities, and which stamps to take.

Files are made of it elsewhere; here are arrays only.
"""

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import ExtrapolationException, InvalidArgumentException
from .geometry.so3 import Array
from .stamp import format_stamp, NANOSECONDS_PER_SECOND
from .times import Stamps
from .tree.outline import EdgeInfo
from .tree.queries import Queries
from .twist import lookup_twist_many

AVERAGING_INTERVAL = NANOSECONDS_PER_SECOND // 10
"""Over which velocities are taken, nanoseconds; see ``lookup_twist``."""

MOST_STAMPS = 100_000_000
"""A rate that makes more stamps than this is taken for a mistake."""

Outside = Literal['skip', 'nan', 'fail']


class Trajectory(NamedTuple):
    """
    ``target_T_source`` over time.

    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (N, 7) x y z qx qy qz qw; metres.
    :ivar twists: (N, 6) velocities of the source's origin, as seen from the target and in its
        axes: linear, metres a second, and angular, radians a second; or None.
    :ivar outside: how many of the stamps that were asked for have no pose.
    """

    target_frame: str
    source_frame: str
    stamps: Stamps
    poses: Array
    twists: Array | None
    outside: int


def trajectory(tree: Queries, target_frame: str, source_frame: str, stamps: npt.ArrayLike, *,
               twist: bool = False, outside: Outside = 'skip') -> Trajectory:
    """
    Return where a frame was at many stamps.

    :param tree: a buffer, a snapshot or a recording.
    :param stamps: (N,) integer nanoseconds, in any order.
    :param twist: velocities, too, averaged over ``AVERAGING_INTERVAL``.
    :param outside: what becomes of stamps without an answer: they are left out ('skip'), or
        have NaN ('nan'), or raise ('fail').
    :raises InvalidArgumentException: wrong arguments, as ``lookup_many``.
    :raises TransformException: as ``lookup_many`` does.
    """
    if outside not in ('skip', 'nan', 'fail'):
        raise InvalidArgumentException(
            f"outside is 'skip', 'nan' or 'fail', not {outside!r}")
    if outside == 'fail':
        tree.lookup_many(target_frame, source_frame, stamps)
    poses, valid = tree.lookup_many(target_frame, source_frame, stamps, outside='mask')
    array = tree._stamps_of(stamps)
    twists = _twists(tree, target_frame, source_frame, array, valid) if twist else None
    missing = len(array) - int(valid.sum())
    if outside == 'skip' and missing:
        array, poses = array[valid], poses[valid]
        twists = None if twists is None else twists[valid]
    return Trajectory(target_frame, source_frame, array, poses, twists, missing)


def _twists(tree: Queries, target_frame: str, source_frame: str, stamps: Stamps,
            valid: npt.NDArray[np.bool_]) -> Array:
    twists = np.full((len(stamps), 6), np.nan)
    if valid.any():
        twists[valid] = lookup_twist_many(
            tree, source_frame, target_frame, stamps[valid], AVERAGING_INTERVAL)
    return twists


def stamps_of_slowest(tree: Queries, target_frame: str, source_frame: str) -> Stamps:
    """
    Return the stamps of the edge between two frames that has the fewest a second.

    Those for which all edges between the two have data, sorted, each once.

    :raises InvalidArgumentException: nothing between the two moves.
    :raises TransformException: as ``lookup`` does.
    """
    moving, first, last = _common_span(tree, target_frame, source_frame)
    slowest = min(moving, key=lambda edge: (edge.samples - 1) / max(edge.span, 1))
    with tree._lock:
        knots = tree._tree.histories[slowest.child].track(first, last).knots
    return np.unique(knots[(knots >= first) & (knots <= last)])


def stamps_at_rate(tree: Queries, target_frame: str, source_frame: str,
                   rate_hz: float) -> Stamps:
    """
    Return stamps at a rate, for which all edges between two frames have data.

    :param rate_hz: greater than zero.
    :raises InvalidArgumentException: nothing between the two moves, or the stamps would be
        more than ``MOST_STAMPS``.
    :raises TransformException: as ``lookup`` does.
    """
    _, first, last = _common_span(tree, target_frame, source_frame)
    count = int((last - first) * rate_hz / NANOSECONDS_PER_SECOND) + 1
    if count > MOST_STAMPS:
        raise InvalidArgumentException(
            f'{rate_hz:g} Hz from {format_stamp(first)} to {format_stamp(last)} s are {count} '
            f'stamps, and more than {MOST_STAMPS} are not made')
    since = np.arange(count) * (NANOSECONDS_PER_SECOND / rate_hz)
    return np.minimum(first + np.rint(since).astype(np.int64), last)


def _common_span(tree: Queries, target_frame: str,
                 source_frame: str) -> tuple[list[EdgeInfo], int, int]:
    """Return the edges between two frames that move, and from when to when all have data."""
    moving = [edge for edge in tree.edges_between(target_frame, source_frame) if not edge.static]
    if not moving:
        raise InvalidArgumentException(
            f'nothing between {target_frame!r} and {source_frame!r} moves, so no edge says at '
            'which stamps to look: give stamps')
    youngest = max(moving, key=lambda edge: edge.oldest)
    first, last = youngest.oldest, min(edge.latest for edge in moving)
    if last < first:
        raise ExtrapolationException(
            f'the edges between {target_frame!r} and {source_frame!r} have no time in common: '
            f'{youngest.parent} -> {youngest.child} begins at {format_stamp(first)} s, and '
            f'another ends at {format_stamp(last)} s')
    return moving, first, last
