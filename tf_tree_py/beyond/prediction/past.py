# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the samples of an edge show about the errors of its predictions, which is cached.

It has two parts: the errors of earlier predictions, and the largest accelerations. A prediction
keeps the twist, so it is wrong as soon as the edge accelerates, which it may do at any time.
Without a given limit, the largest acceleration so far is assumed to be possible, and that the edge
may stop within half a second.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
import math

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.packed import POSE_FLOATS
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import (
    BEGINNING,
    FOREVER,
    from_seconds,
    mean_interval,
    NANOSECONDS_PER_SECOND,
)
from tf_tree_py.core.times import Indices, Stamps
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.screws import Twist

from .trials import check_size, LATELY, Packed, Start, Trials, TWIST_OVER, unchanged_until
from ..uncertainty.covariances import DIAGONAL

Limits = Sequence[float]
"""The largest acceleration along x, y, z (m/s^2) and about them (rad/s^2), in the child's axes."""

# An edge may stop within half a second.
_TO_STOP = 1.0 / 0.5
# The deviation of a uniform distribution, relative to its limit.
_UNIFORM = 1.0 / math.sqrt(3.0)


def checked_limits(given: Mapping[str, Limits] | None) -> dict[str, Limits]:
    """
    Return a caller's limits by child frame.

    :param given: a mapping from frames to six numbers each; None: no limits.
    :raises InvalidArgumentException: something else.
    """
    limits: dict[str, Limits] = {}
    try:
        for child, each in ({} if given is None else given).items():
            x, y, z, rx, ry, rz = limits[child.removeprefix('/')] = [*map(float, each)]
            if not all(0.0 <= limit < math.inf for limit in (x, y, z, rx, ry, rz)):
                raise ValueError
    except (AttributeError, TypeError, ValueError):
        raise InvalidArgumentException(
            f'Invalid argument acceleration {given!r:.80}: it maps child frames to six limits '
            'each, along x, y, z (m/s^2) and about x, y, z (rad/s^2), such as '
            "{'base_link': (3.0, 0.0, 0.0, 0.0, 0.0, 4.0)}; none may be negative") from None
    return limits


# --- the errors

def deviations(twist: Twist, limits: Limits, may_stop: bool, lag: float, ahead: float,
               measured: float) -> Limits:
    """
    Return the standard deviations of a prediction whose edge may accelerate up to limits.

    A prediction by the time h is off by a (h^2 + l h) / 2 for a constant acceleration a, because a
    mean twist is that of half the lag l ago. A rotation that is off turns the velocity, so the
    position is off by the integral of that. Any acceleration up to the limit is as likely as
    any other, so the deviation is the largest error divided by the square root of three: JCGM
    100:2008, "Guide to the Expression of Uncertainty in Measurement", 4.3.7.

    :param twist: per second, in the child's axes; ``limits`` likewise.
    :param may_stop: whether each limit is at least the acceleration that stops the edge soon.
    :param lag: the time of which the twist is the mean, seconds.
    :param ahead: the time of the prediction, seconds; ``measured``: how much of it a gyroscope
        measured.
    :return: metres and radians, in the axes of the predicted pose.
    """
    vx, vy, vz, wx, wy, wz = map(abs, twist)
    ax, ay, az, bx, by, bz = limits
    if may_stop:
        ax, ay, az = max(ax, _TO_STOP * vx), max(ay, _TO_STOP * vy), max(az, _TO_STOP * vz)
        bx, by, bz = max(bx, _TO_STOP * wx), max(by, _TO_STOP * wy), max(bz, _TO_STOP * wz)
    once, twice = _integrals(ahead, lag)
    turned, turned_twice = once, twice
    if measured:
        known, known_twice = _integrals(measured, lag)
        turned -= known
        turned_twice -= known_twice + known * (ahead - measured)
    return (
        once * ax + twice * (wy * az + wz * ay) + turned_twice * (vy * bz + vz * by),
        once * ay + twice * (wz * ax + wx * az) + turned_twice * (vz * bx + vx * bz),
        once * az + twice * (wx * ay + wy * ax) + turned_twice * (vx * by + vy * bx),
        turned * bx + turned_twice * (wy * bz + wz * by),
        turned * by + turned_twice * (wz * bx + wx * bz),
        turned * bz + turned_twice * (wx * by + wy * bx))


def _integrals(time: float, lag: float) -> tuple[float, float]:
    """Return the deviation's factors: the integral of t + lag / 2, and the integral of that."""
    scaled = _UNIFORM * time
    return scaled * (time + lag) / 2.0, scaled * time * (2.0 * time + 3.0 * lag) / 12.0


# --- learning

# The twist is measured from the first sample in a cell to the first in the next. Whole blocks of
# cells are learnt at once, because numpy takes as long for one cell.
_CELL = from_seconds(0.1)
_BLOCK = 10 * _CELL
# An acceleration lasts if it is seen in two successive differences of twists. Four samples show
# that, the last of them in one of the next blocks.
_SAMPLES = 4
# Two successive twists that are closer in time only show the noise.
_SHORTEST_S = 0.05


class LearntLimits:
    """
    The largest accelerations that lasted, by block of time, which may be cached.

    They depend only on the samples, not on the times of the calls.
    """

    __slots__ = ('_blocks', '_next', '_used', '_span', '_largest')

    def __init__(self) -> None:
        self._blocks: dict[int, Array] = {}
        # The first block that is not known yet, the end of the samples that those before it
        # depend on, and the last span of stamps.
        self._next: int | None = None
        self._used = BEGINNING
        self._span: tuple[int, int] | None = None
        # None: unknown.
        self._largest: Limits | None = None

    def largest(self, history: MovingHistory, oldest: int, newest: int) -> Limits:
        """
        Return the largest accelerations in all whole blocks.

        :param oldest: the oldest sample with the present parent; ``newest``: the newest.
        """
        if (oldest, newest) != self._span:
            self._span = oldest, newest
            self._renew(history, oldest, newest)
        if self._largest is None:
            self._largest = np.max([*self._blocks.values(), np.zeros(6)], axis=0).tolist()
        return self._largest

    def _renew(self, history: MovingHistory, oldest: int, newest: int) -> None:
        """Remove the blocks that have expired, and learn those that are new."""
        first = -(-oldest // _BLOCK)
        while self._blocks and (expired := next(iter(self._blocks))) < first:
            del self._blocks[expired]
            self._largest = None
        begin = first if self._next is None else max(self._next, first)
        if newest >= (begin + 1) * _BLOCK + _SAMPLES * _CELL:
            self._learn(history, begin, newest)

    def forget(self, late: int) -> None:
        """Forget all blocks that depend on a sample, which was inserted before the newest one."""
        self._span = None
        if late >= self._used:
            return
        known = [*self._blocks]
        # A block contains the first of four cells with samples.
        first = max(bisect_left(known, late // _BLOCK) - (_SAMPLES - 1), 0)
        for block in known[first:]:
            del self._blocks[block]
        self._next = None if first == 0 else known[first]
        self._used, self._largest = late, None

    def _learn(self, history: MovingHistory, first: int, newest: int) -> None:
        """Add all blocks that no later sample changes."""
        times, poses = _one_in_each_cell(history, first * _BLOCK, newest)
        if len(times) < _SAMPLES:
            return
        rows = _lasting_limits(times, poses)
        blocks = times // _BLOCK
        end = int(min(blocks[len(rows)], (newest - _SAMPLES * _CELL) // _BLOCK))
        blocks = blocks[:len(rows)]
        known = blocks.searchsorted(end)
        if known:
            starts = _changes(blocks[:known])
            self._blocks.update(zip(blocks[starts].tolist(), np.maximum.reduceat(
                rows[:known], starts), strict=True))
            self._largest = None
            self._used = int(times[known + _SAMPLES - 2]) + 1
        self._next = max(first, end)
        self._used = max(self._used, self._next * _BLOCK)


def _one_in_each_cell(history: MovingHistory, begin: int, end: int) -> tuple[Stamps, Array]:
    """Return the first stamp in each cell with samples, and the poses (n, 7)."""
    if not history.takes_samples:
        # Curves have no samples, but have a pose at every stamp.
        times = np.arange(begin, end, _CELL)
        return times, np.moveaxis(history.track(begin, end).at(times), 0, -1)
    # Without a copy of all samples, which takes much longer than the rest if these are many.
    columns = history.columns()
    first, last = (bisect_left(columns.stamps, stamp) for stamp in (begin, end))
    stamps = np.asarray(columns.stamps[first:last])
    times = stamps[_changes(stamps // _CELL)]
    # Of several samples with one stamp, the last counts.
    newest = first + stamps.searchsorted(times, side='right') - 1
    return times, np.asarray(columns.poses).reshape(-1, POSE_FLOATS)[newest]


def _changes(values: Stamps) -> Indices:
    """Return the indices of the first value, and of those that differ from the one before."""
    return np.flatnonzero(np.append(True, values[1:] != values[:-1])[:len(values)])


def _lasting_limits(times: Stamps, poses: Array) -> Array:
    """
    Return the limits that each four successive poses show, (n - 3, 6).

    Noise and jumps show no lasting acceleration: the next one has the opposite sign.

    :param times: (n,), n > 3; ``poses``: (n, 7).
    """
    seconds = np.diff(times) / NANOSECONDS_PER_SECOND
    twists = screws.log_many(se3.compose_many(
        se3.inverse_many(poses[:-1]), poses[1:])) / seconds[:, None]
    apart = np.maximum(0.5 * (seconds[1:] + seconds[:-1]), _SHORTEST_S)
    accelerations = np.diff(twists, axis=0) / apart[:, None]
    return np.maximum(_lasting(accelerations), _TO_STOP * _lasting(twists)[:-1])


def _lasting(values: Array) -> Array:
    """Return the size of the smaller of two successive values, zero if their signs differ."""
    first, second = values[:-1], values[1:]
    return np.where((first > 0.0) == (second > 0.0),
                    np.minimum(np.abs(first), np.abs(second)), 0.0)


# --- the past of an edge

_DIAGONAL: tuple[int, ...] = tuple(DIAGONAL.tolist())


class PastCache(Companion):
    """
    The cached past of edges.

    :ivar by_child: that of each edge that was predicted, by its child frame.
    """

    def __init__(self) -> None:
        self.by_child: dict[str, Past] = {}

    def structure_changed(self) -> None:
        """
        Remove all: a prediction is made from samples with the newest parent.

        A late sample of an edge that has had other parents changes the structure, too.
        """
        self.by_child.clear()

    def of(self, history: MovingHistory) -> 'Past':
        """Return the past of an edge; that of a curve, which may be replaced, is new."""
        if not history.takes_samples:
            return Past(history)
        known = self.by_child.get(history.child)
        if known is None:
            known = self.by_child[history.child] = Past(history)
        elif history.late != FOREVER:
            known.forget(history, history.late)
        history.late = FOREVER
        return known


class Past:
    """
    The earlier predictions of one edge, and its accelerations.

    It depends only on the samples, not on the times of the calls.
    """

    __slots__ = ('_since', '_trials', '_limits')

    def __init__(self, history: MovingHistory) -> None:
        self._since = _begin(history)
        self._trials = Trials()
        self._limits = LearntLimits()

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all that a sample that was inserted before the newest one may have changed."""
        self._limits.forget(late)
        self._trials.forget(unchanged_until(history, late))

    def covariance(self, history: MovingHistory, start: Start, ahead: int, until: int,
                   given: Limits | None) -> Packed:
        """
        Return the covariance of a prediction's errors, in the axes of the predicted pose.

        The variances of both parts are added: noise does not prevent an edge from accelerating.

        :param start: at the newest sample.
        :param ahead: nanoseconds.
        :param until: the stamp up to which the edge's gyroscope is followed.
        :param given: the largest accelerations; None: learnt.
        """
        oldest, period = history.oldest_stamp, 0.0
        assert oldest is not None
        if history.takes_samples:
            period = mean_interval(start.stamp - oldest, len(history))
        second = float(NANOSECONDS_PER_SECOND)
        limits = self._limits.largest(
            history, max(oldest, self._since), start.stamp) if given is None else given
        errors = deviations(
            screws.times(second, start.twist), limits, given is None,
            max(period, TWIST_OVER) / second, ahead / second, (until - start.stamp) / second)
        check_size(history, max(errors))
        covariance = self._trials.moment(history, start, ahead, until, period)
        for index, error in zip(_DIAGONAL, errors, strict=True):
            covariance[index] += error * error
        return covariance


def _begin(history: MovingHistory) -> int:
    """Return the stamp since which an edge has its parent; a curve is only learnt from lately."""
    if history.newest_stamp is None or not history.takes_samples:
        return (history.newest_stamp or 0) - LATELY
    if history.fixed_parent:
        return BEGINNING
    *_, (_, begin, _) = history.parents_between(BEGINNING, history.newest_stamp + 1)
    return begin
