# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Extrapolations of an edge, and the errors of those that could have been made earlier.

An extrapolation follows the edge's last twist and its gyroscope. The errors are those of
samples spread evenly over the last 10 s, for a ladder of times ahead. They are cached, so that
a prediction costs little while there are only a few new samples.
"""

from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import ExtrapolationException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import BEGINNING, from_seconds
from tf_tree_py.screws import Twist

from ..curves.aided import gyro_until, turn_of
from ..curves.gaps import BRIDGED
from ..uncertainty.covariances import pack, PACKED_FLOATS

TWIST_OVER = from_seconds(0.1)
"""A prediction uses the mean twist over this time before its first sample."""


class Start(NamedTuple):
    """
    The initial state of a prediction.

    :ivar pose: ``parent_T_child`` at the stamp.
    :ivar twist: just before the stamp, per nanosecond, in the child's axes.
    """

    stamp: int
    pose: PoseTuple
    twist: Twist


def start_at(history: MovingHistory, stamp: int) -> Start:
    """
    Return the initial state of a prediction from a stamp.

    :raises ExtrapolationException: there is only one sample.
    """
    assert history.oldest_stamp is not None
    length = min(TWIST_OVER, stamp - history.oldest_stamp)
    if length <= 0 or history.parent_at(stamp - length) != history.parent:
        raise ExtrapolationException(
            f'A prediction requires two samples, and the edge {history.parent} -> {history.child} '
            'has one under this parent')
    before, now = history.sample(stamp - length), history.sample(stamp)
    moved = se3.compose(se3.inverse(before), now)
    return Start(stamp, now, screws.times(1.0 / length, screws.log(moved)))


def forecast(history: MovingHistory, start: Start, end: int, until: int) -> PoseTuple:
    """
    Return the predicted pose at a stamp, from the state at an earlier one.

    :param until: the stamp up to which the edge's gyroscope is followed.
    """
    return se3.compose(start.pose, motion(history, start, end, until))


def motion(history: MovingHistory, start: Start, end: int, until: int) -> PoseTuple:
    """Return the motion of an edge until a stamp if it keeps its velocity; see ``forecast``."""
    begin = start.stamp
    if until > begin:
        turn, half = (turn_of(history, begin, stamp) for stamp in (until, (begin + until) // 2))
        if turn is not None and half is not None:
            return _turned_motion(start.twist, until - begin, end - until, half, turn)
    return screws.exp(screws.times(end - begin, start.twist))


def measured_until(history: MovingHistory, begin: int, end: int) -> int:
    """Return the stamp up to which an edge's gyroscope measured the rotation from another on."""
    known = gyro_until(history)
    until = begin if known is None else max(begin, min(end, known))
    return until if until == begin or turn_of(history, begin, until) is not None else begin


def _turned_motion(twist: Twist, measured: int, rest: int, half: so3.Quaternion,
                   turn: so3.Quaternion) -> PoseTuple:
    """
    Return the motion of a twist whose rotation a gyroscope measured at first.

    The velocity is constant in the child's axes, which rotate; it is integrated by Simpson's
    rule.

    :param measured: how long the gyroscope measured, nanoseconds; ``rest``: how long the twist
        continues after that.
    :param half: the rotation after half of the measured time; ``turn``: after all of it.
    """
    way = screws.times(measured, twist)[:3]
    first, middle, last = way, so3.rotate(half, way), so3.rotate(turn, way)
    x, y, z = ((a + 4.0 * b + c) / 6.0 for a, b, c in zip(first, middle, last, strict=True))
    return se3.compose((x, y, z, *turn), screws.exp(screws.times(rest, twist)))


def unchanged_until(history: MovingHistory, late: int) -> int:
    """Return a stamp up to which a sample with a given stamp did not change the edge's poses."""
    before = _sample_before(history, late)
    if gyro_until(history) is None:
        return before
    # A gap that contains the pose after a stamp is bridged from the pose before to that after it.
    return _sample_before(history, before - BRIDGED)


def _unexpired_since(history: MovingHistory, newest: int, oldest: int) -> int:
    """
    Return a stamp from which on an edge's poses do not change when older samples expire.

    :param newest: the stamp of the newest pose or sample of the gyroscope.
    :param oldest: this is returned if nothing has expired.
    """
    # Two samples before a gap around the pose before another gap have an effect.
    horizon = newest - history.cache_time + 2 * BRIDGED
    if horizon < oldest:
        return oldest
    return history.next_stamp(history.next_stamp(horizon) + BRIDGED)


def _sample_before(history: MovingHistory, stamp: int) -> int:
    """Return the stamp of the last older sample; ``BEGINNING`` if there is none."""
    oldest = history.oldest_stamp
    if oldest is None or stamp <= oldest:
        return BEGINNING
    return int(history.track(stamp - 1, stamp - 1).knots[0])


# --- earlier predictions

_Error = tuple[float, float, float, float, float, float]

Packed = list[float]
"""A covariance as the 21 numbers of ``covariances.pack``; for so few, numpy takes longer."""

_Ahead = tuple[int, int]
"""A time ahead, nanoseconds, and how many eighths of it a gyroscope measured."""

# Predictions are made from one sample in each cell of time. There are at most this many cells;
# fewer than the minimum are not sufficient.
LATELY = from_seconds(10.0)
_MOST_TRIALS, _LEAST_TRIALS = 32, 3
# Squares of errors are interpolated between two rungs of the ladder, 2^(1/4) apart: if an error
# grows with the square of the time, the resulting variance is up to 3 % too large.
_RUNGS_PER_OCTAVE = 4
_LOWEST_RUNG = 1000
_MOST_RUNGS = 32
# Trials are made as if a gyroscope had measured an eighth of the time ahead, or two, and so on.
_MEASURED_PARTS = 8
# A gyroscope that lags behind the poses by more is not waited for.
_LATEST_GYRO = from_seconds(1.0)
# The covariance of larger errors does not fit into floats.
_LARGEST = 1e150


class _Rung(NamedTuple):
    """
    The errors of predictions for one time ahead.

    :ivar cells: the first cell and the last; None if the next samples may change an error.
    :ivar errors: those that they do not change, by cell; None if a cell has none.
    :ivar moment: the second moment of all, packed; None if there are too few.
    """

    cells: tuple[int, int] | None
    errors: dict[int, _Error | None]
    moment: Packed | None


_EMPTY = _Rung(None, {}, None)


class Trials:
    """
    The errors of earlier predictions of one edge, which may be cached.

    They depend only on the samples, not on the times of the calls.
    """

    __slots__ = ('_cell', '_starts', '_rungs')

    def __init__(self) -> None:
        self._cell = 0
        self._starts: dict[int, Start | None] = {}
        self._rungs: dict[_Ahead, _Rung] = {}

    def forget(self, since: int) -> None:
        """Forget all errors and starts that poses after a stamp may have changed."""
        self._starts = {cell: start for cell, start in self._starts.items()
                        if (cell + 1) * self._cell <= since}
        self._rungs = {ahead: _Rung(None, {
            cell: error for cell, error in rung.errors.items()
            if (cell + 1) * self._cell + ahead[0] <= since}, None)
            for ahead, rung in self._rungs.items()}

    def moment(self, history: MovingHistory, start: Start, ahead: int, until: int,
               period: float) -> Packed:
        """
        Return the second moment of the errors of such a prediction, in the child's axes.

        If there are too few, the error is assumed to be as large as the predicted motion,
        because the edge may have stopped.

        Within the first period of the samples, the second moment grows linearly. It cannot be
        measured there, because a pose interpolated between two samples has the error of the
        first, from which the prediction begins.

        :param start: at the newest sample.
        :param ahead: nanoseconds.
        :param until: the stamp up to which the edge's gyroscope is followed.
        :param period: of the samples, nanoseconds.
        """
        assert history.oldest_stamp is not None
        oldest = max(history.oldest_stamp, start.stamp - LATELY)
        self._choose_cell(max(start.stamp - oldest, 1))
        tried = max(ahead, math.ceil(period))
        # The errors at the newest sample may still change, or until a gap of the gyroscope is
        # bridged; see ``_changing``.
        latest = start.stamp - math.ceil(period)
        measured = gyro_until(history)
        if measured is not None:
            latest -= BRIDGED
            oldest = _unexpired_since(history, max(measured, start.stamp), oldest)
        total = [0.0] * PACKED_FLOATS
        for rung, weight in _rungs_around(tried, (until - start.stamp) / ahead):
            moment = self._moment(history, oldest, latest, rung)
            if moment is None:
                moved = screws.log(motion(history, start, start.stamp + ahead, until))
                return _second_moment(history, np.array([moved]))
            weight *= ahead / tried
            total = [one + weight * other for one, other in zip(total, moment, strict=True)]
        return total

    def _choose_cell(self, span: int) -> None:
        """Halve the cells while the history is short."""
        cell = max(LATELY // _MOST_TRIALS >> int(math.log2(LATELY / span)), 1)
        if cell != self._cell:
            self._cell = cell
            self._starts.clear()
            self._rungs.clear()

    def _moment(self, history: MovingHistory, oldest: int, latest: int,
                ahead: _Ahead) -> Packed | None:
        """Return the second moment of the errors for a time ahead; None if too few."""
        cells = self._cells(history, oldest, latest - ahead[0])
        rung = self._rungs.get(ahead, _EMPTY)
        if rung.cells != cells:
            rung = self._renewed(history, cells, rung.errors, ahead)
            if len(self._rungs) >= _MOST_RUNGS:
                self._rungs.clear()
            self._rungs[ahead] = rung
        return rung.moment

    def _cells(self, history: MovingHistory, oldest: int, newest: int) -> tuple[int, int]:
        """Return the first and the last cell with an initial sample, up to a stamp."""
        last = newest // self._cell
        start = self._start(history, last)
        if start is not None and start.stamp > newest:
            last -= 1
        return -((-oldest - TWIST_OVER) // self._cell), last

    def _renewed(self, history: MovingHistory, cells: tuple[int, int],
                 known: dict[int, _Error | None], ahead: _Ahead) -> _Rung:
        first, last = cells
        errors = {cell: error for cell, error in known.items() if cell >= first}
        new = {cell: self._error(history, cell, ahead)
               for cell in range(first, last + 1) if cell not in errors}
        if len(self._starts) > 2 * _MOST_TRIALS:
            self._starts = {cell: start for cell, start in self._starts.items() if cell >= first}
        rows = np.array([error for error in (*errors.values(), *new.values())
                         if error is not None])
        moment = None if len(rows) < _LEAST_TRIALS else _second_moment(history, rows)
        errors.update(new)
        changing = self._changing(history, list(new), ahead[0])
        for cell in changing:
            del errors[cell]
        return _Rung(None if changing else cells, errors, moment)

    def _changing(self, history: MovingHistory, cells: list[int], ahead: int) -> list[int]:
        """Return the cells for which the next samples may change the pose that was compared."""
        newest, until = history.newest_stamp, gyro_until(history)
        assert newest is not None
        if until is not None and until < newest - _LATEST_GYRO:
            until = None
        changing = []
        for cell in reversed(cells):
            start = self._starts.get(cell)
            if start is not None:
                # The newest sample may be replaced by another one with its stamp.
                after = history.next_stamp(start.stamp + ahead - 1)
                if until is not None:
                    # The pose after a gap that contains the next one. Until then there may be
                    # another gap, which is bridged with the rates that are measured after it.
                    after = history.next_stamp(after + BRIDGED)
                if after < newest and (until is None or after + 2 * BRIDGED <= until):
                    break
                changing.append(cell)
        return changing

    def _error(self, history: MovingHistory, cell: int, ahead: _Ahead) -> _Error | None:
        """Return the error of a prediction: metres and radians, in the axes of its pose."""
        start, (span, measured) = self._start(history, cell), ahead
        end = start.stamp + span if start is not None else 0
        if start is None or not _has_its_parent(history, end):
            return None
        predicted = forecast(history, start, end,
                             start.stamp + measured * span // _MEASURED_PARTS)
        x, y, z, qx, qy, qz, qw = se3.compose(se3.inverse(predicted), history.sample(end))
        return (x, y, z, *so3.log((qx, qy, qz, qw)))

    def _start(self, history: MovingHistory, cell: int) -> Start | None:
        """Return the first sample in a cell; None if there is none."""
        if cell not in self._starts:
            begin = cell * self._cell
            # Curves have no samples, but have a pose at every stamp.
            stamp = history.next_stamp(begin - 1) if history.takes_samples else begin
            is_there = (stamp < begin + self._cell and _has_its_parent(history, stamp)
                        and _has_its_parent(history, stamp - TWIST_OVER))
            start = start_at(history, stamp) if is_there else None
            if stamp == history.newest_stamp:
                return start  # another sample with this stamp would replace it
            self._starts[cell] = start
        return self._starts[cell]


def _second_moment(history: MovingHistory, errors: Array) -> Packed:
    """
    Return the second moment of errors (N, 6).

    :raises ExtrapolationException: a square does not fit into a float.
    """
    check_size(history, np.abs(errors).max())
    packed: Packed = pack(errors.T @ errors / len(errors)).tolist()
    return packed


def check_size(history: MovingHistory, largest: float) -> None:
    """Raise an exception if the square of an error does not fit into a float."""
    if not largest < _LARGEST:
        raise ExtrapolationException(
            f'A prediction of the edge {history.parent} -> {history.child} would be off by up to '
            f'{largest:g} m, whose square is too large for a covariance: find out which samples '
            'of the edge are that far apart')


def _has_its_parent(history: MovingHistory, stamp: int) -> bool:
    return history.parent_at(stamp) == history.parent


@lru_cache(maxsize=64)
def _rungs_around(ahead: int, measured: float) -> list[tuple[_Ahead, float]]:
    """
    Return the rungs around a time ahead, nanoseconds, and their weights.

    :param measured: the part of the time that a gyroscope measured. The squares of errors are
        convex over this part: a bias adds up while it measures, and an acceleration while it does
        not. So a value between those of two parts is not too small.
    """
    number = int(_RUNGS_PER_OCTAVE * math.log2(max(ahead / _LOWEST_RUNG, 1.0)))
    below, above = (round(_LOWEST_RUNG * 2.0**(rung / _RUNGS_PER_OCTAVE))
                    for rung in (number, number + 1))
    higher = max(ahead * ahead - below * below, 0) / (above * above - below * below)
    parts = int(_MEASURED_PARTS * measured)
    more = _MEASURED_PARTS * measured - parts
    weights = [((rung, each), share * weight)
               for rung, share in ((below, 1.0 - higher), (above, higher))
               for each, weight in ((parts, 1.0 - more), (parts + 1, more))]
    return [(rung, weight) for rung, weight in weights if weight > 0.0]
