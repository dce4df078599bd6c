# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The trajectory of one frame in another: poses, velocities, and the choice of stamps.

This file handles arrays; trajectories are written to files elsewhere.
"""

import importlib
from typing import Any, Literal, NamedTuple, overload

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import ExtrapolationException, InvalidArgumentException
from tf_tree_py.core.geometry.pose import Poses
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamp, Stamps, StampsLike
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.many_stamps import ManyStampQueries

from .twist import lookup_twist_many
from ..curves.spline_fit import checked_rate

_AVERAGING_INTERVAL = NANOSECONDS_PER_SECOND // 10
"""The interval over which velocities are averaged, nanoseconds; see ``lookup_twist``."""

_MOST_STAMPS = 100_000_000
"""A rate that gives more stamps than this is considered a mistake."""

POSE_COLUMNS = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
TWIST_COLUMNS = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')

Outside = Literal['skip', 'nan', 'fail']


class Trajectory(NamedTuple):
    """
    ``target_T_source`` over time.

    :ivar stamps: (N,) nanoseconds.
    :ivar poses: (N, 7) x y z qx qy qz qw; metres.
    :ivar twists: (N, 6) velocities of the source's origin relative to the target, in its
        axes: linear, metres per second, and angular, radians per second; or None.
    :ivar outside: how many of the requested stamps have no pose.
    """

    target_frame: str
    source_frame: str
    stamps: Stamps
    poses: Poses
    twists: Array | None
    outside: int

    def to_frame(self) -> Any:
        """
        Return a ``pandas.DataFrame`` with a row for each stamp; the index is the time (UTC).

        Its columns are x y z qx qy qz qw, and with twists vx vy vz wx wy wz. To insert it into a
        buffer: ``buffer.insert_track(target, source, frame.index, frame[list(POSE_COLUMNS)])``.

        :raises ImportError: pandas is not installed.
        """
        try:
            pandas = importlib.import_module('pandas')
        except ModuleNotFoundError:
            raise ImportError('to_frame() needs pandas, which is in the extra "notebook": pip '
                              'install "tf_tree_py[notebook]", or pip install pandas') from None
        numbers = self.poses if self.twists is None else np.hstack([self.poses, self.twists])
        columns = POSE_COLUMNS if self.twists is None else (*POSE_COLUMNS, *TWIST_COLUMNS)
        index = pandas.DatetimeIndex(self.stamps.astype('datetime64[ns]'), name='time')
        return pandas.DataFrame(np.asarray(numbers), index=index, columns=list(columns))


class MovingTrajectory(Trajectory):
    """A trajectory that has velocities, for type checkers: its ``twists`` are never None."""

    __slots__ = ()

    twists: Array


@overload
def trajectory(tree: ManyStampQueries, target_frame: str, source_frame: str, stamps: StampsLike, *,
               twist: Literal[True], outside: Outside = 'skip') -> MovingTrajectory: ...


@overload
def trajectory(tree: ManyStampQueries, target_frame: str, source_frame: str, stamps: StampsLike, *,
               twist: bool = False, outside: Outside = 'skip') -> Trajectory: ...


def trajectory(tree: ManyStampQueries, target_frame: str, source_frame: str, stamps: StampsLike, *,
               twist: bool = False, outside: Outside = 'skip') -> Trajectory:
    """
    Return the poses of a frame at many stamps.

    :param tree: a buffer, a snapshot or a recording.
    :param stamps: (N,) integer nanoseconds, in any order.
    :param twist: whether to return velocities, too, averaged over ``_AVERAGING_INTERVAL``.
    :param outside: how to treat stamps without an answer: omit them ('skip'), return NaN
        ('nan'), or raise an error ('fail').
    :raises InvalidArgumentException: invalid arguments, as in ``lookup_many``.
    :raises TransformException: as in ``lookup_many``.
    """
    if outside not in ('skip', 'nan', 'fail'):
        raise InvalidArgumentException(
            f"outside must be 'skip', 'nan' or 'fail', not {outside!r}")
    if outside == 'fail':
        tree.lookup_many(target_frame, source_frame, stamps)
    poses, valid = tree.lookup_many(target_frame, source_frame, stamps, outside='mask')
    array = tree._stamps_of(stamps)
    twists = _twists(tree, target_frame, source_frame, array, valid) if twist else None
    missing = len(array) - int(valid.sum())
    if outside == 'skip' and missing:
        array, poses = array[valid], poses[valid]
        twists = None if twists is None else twists[valid]
    cls = MovingTrajectory if twist else Trajectory
    return cls(target_frame, source_frame, array, poses, twists, missing)


def _twists(tree: ManyStampQueries, target_frame: str, source_frame: str, stamps: Stamps,
            valid: npt.NDArray[np.bool_]) -> Array:
    twists = np.full((len(stamps), 6), np.nan)
    if valid.any():
        twists[valid] = lookup_twist_many(
            tree, source_frame, target_frame, stamps[valid], _AVERAGING_INTERVAL)
    return twists


def stamps_of_slowest(tree: ManyStampQueries, target_frame: str, source_frame: str, *,
                      start: Stamp | None = None, stop: Stamp | None = None) -> Stamps:
    """
    Return the stamps of the edge with the lowest rate between two frames.

    These are the stamps for which all edges between the two have data, sorted, each once.

    :param start: leave out earlier stamps, nanoseconds.
    :param stop: leave out later stamps.
    :raises InvalidArgumentException: all edges between the two are static.
    :raises TransformException: as in ``lookup``.
    """
    moving, first, last = _common_span(tree, target_frame, source_frame, start, stop)
    slowest = min(moving, key=lambda edge: (edge.samples - 1) / max(edge.span, 1))
    with tree._lock:
        knots = tree._tree.histories[slowest.child].track(first, last).knots
    return np.unique(knots[(knots >= first) & (knots <= last)])


def stamps_at_rate(tree: ManyStampQueries, target_frame: str, source_frame: str, rate_hz: float, *,
                   start: Stamp | None = None, stop: Stamp | None = None) -> Stamps:
    """
    Return stamps at a constant rate, for which all edges between two frames have data.

    :param rate_hz: greater than zero.
    :param start: leave out earlier stamps, nanoseconds.
    :param stop: leave out later stamps.
    :raises InvalidArgumentException: not a rate, all edges between the two are static, or there
        would be more than ``_MOST_STAMPS`` stamps.
    :raises TransformException: as in ``lookup``.
    """
    rate_hz = checked_rate(rate_hz, 'rate_hz')
    moving, first, last = _common_span(tree, target_frame, source_frame, start, stop)
    count = int((last - first) * rate_hz / NANOSECONDS_PER_SECOND) + 1
    if count > _MOST_STAMPS:
        raise InvalidArgumentException(
            f'{rate_hz:g} Hz from {format_stamp(first)} to {format_stamp(last)} s are {count} '
            f'stamps, which is more than the limit of {_MOST_STAMPS}. The longest edge '
            f'is {_named(max(moving, key=lambda edge: edge.span))}')
    since = np.arange(count) * NANOSECONDS_PER_SECOND / rate_hz
    return np.minimum(first + np.rint(since).astype(np.int64), last)


def _common_span(tree: ManyStampQueries, target_frame: str, source_frame: str, start: Stamp | None,
                 stop: Stamp | None) -> tuple[list[EdgeInfo], int, int]:
    """
    Return the moving edges between two frames, and the span for which all have data.

    :param start: the span begins no earlier, nanoseconds.
    :param stop: the span ends no later.
    """
    moving = [edge for edge in tree.edges_between(target_frame, source_frame) if not edge.static]
    if not moving:
        raise InvalidArgumentException(
            f'all edges between {target_frame!r} and {source_frame!r} are static, so they have no '
            'stamps to use: pass stamps')
    youngest = max(moving, key=lambda edge: edge.oldest)
    first, last = youngest.oldest, min(edge.latest for edge in moving)
    if last < first:
        raise ExtrapolationException(
            f'the edges between {target_frame!r} and {source_frame!r} have no time in common: '
            f'{youngest.parent} -> {youngest.child} begins at {format_stamp(first)} s, and '
            f'another ends at {format_stamp(last)} s')
    begin = first if start is None else max(first, tree._stamp_of(start))
    end = last if stop is None else min(last, tree._stamp_of(stop))
    if end < begin:
        raise InvalidArgumentException(
            f'nothing is left between start and stop: the edges between {target_frame!r} and '
            f'{source_frame!r} have data from {format_stamp(first)} to {format_stamp(last)} s')
    return moving, begin, end


def _named(edge: EdgeInfo) -> str:
    return (f'{edge.parent} -> {edge.child}, from {format_stamp(edge.oldest)} to '
            f'{format_stamp(edge.latest)} s')
