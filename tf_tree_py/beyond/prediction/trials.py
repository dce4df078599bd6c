# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How the errors of predictions grow, learnt from those that could have been made earlier.

They start from up to 512 samples of the last 10 s, and are compared with the poses that
followed, for a ladder of times ahead. Each error has two parts: the noise of the samples that it
is computed from, and the change of the motion. The noise is known (``uncertainty.noise``); what
the squares of the errors contain beyond it is the square of the change. Within about a period of
the samples there is no pose to compare with. There the change is that of a constant acceleration,
whose size follows from the errors after one and a half periods.
"""

from bisect import bisect_right
from functools import lru_cache
import math
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array, Number
from tf_tree_py.core.times import Stamps

from .forecast import Asked, forecast, start_at, TWIST_OVER, unchanged_until, unexpired_since
from ..curves.aided import gyro_until, LATEST_RATES
from ..curves.gaps import BRIDGED
from ..uncertainty.covariances import (
    DIAGONAL,
    errors_of,
    pack,
    PACKED_FLOATS,
    packed_squares,
    unpack,
    with_less_correlation,
)
from ..uncertainty.learning import (
    Cells,
    check_size,
    chosen,
    Span,
    stamps_in,
    Sums,
    sums_by_cell,
)
from ..uncertainty.noise import between, PRIOR

_Ahead = tuple[int, int]
"""A time ahead, nanoseconds, and how many eighths of it a gyroscope measured."""

# Errors in fewer cells say nothing.
LEAST_CELLS = 3
# Squares of errors are interpolated between two rungs of the ladder, 2^(1/4) apart: if an error
# grows with the square of the time, the resulting variance is up to 3 % too large.
_RUNGS_PER_OCTAVE = 4
_LOWEST_RUNG = 1000
_MOST_RUNGS = 32
# Errors are compared after at least so many periods: nearly always there is another sample then.
_PERIODS = 1.5
# Trials are made as if a gyroscope had measured an eighth of the time ahead, or two, and so on.
_MEASURED_PARTS = 8
# Smaller ones are rounding errors: m^2 and rad^2; and relative to the square of a mean.
_LEAST_VARIANCE, _LEAST_SPREAD = 1e-30, 1e-12
# From n independent errors, a variance is enlarged by 2 / n: see ``noise``.
_FEW = 2.0
# Correlations change with the motion: at most this part of them counts.
_MOST_CORRELATION = 0.7
# The part of all cells over which the errors may be correlated.
_CORRELATED = 0.25


_NONE = np.zeros((6, 6))


class _Rung(NamedTuple):
    """
    The errors of predictions for one time ahead.

    :ivar cells: the length of a cell, and the first and the last one.
    :ivar sums: their sums.
    :ivar change: the packed covariance of the motion's change; None if there are too few cells.
    :ivar noise: the variance of the noise in an error, relative to that of a sample.
    """

    cells: tuple[int, int, int] | None
    sums: Cells
    change: Array | None
    noise: float = 1.0


class Trials:
    """The errors of earlier predictions of one edge; a learner of ``uncertainty.learning``."""

    __slots__ = ('_rungs', '_noise', '_packed')

    def __init__(self, history: MovingHistory) -> None:
        self._rungs: dict[_Ahead, _Rung] = {}
        # The noise that the rungs are computed with, also packed. It is constant, so another
        # object is another noise.
        self._noise: Array | None = None
        self._packed = pack(_NONE)

    def forget(self, history: MovingHistory, late: int) -> None:
        """Forget all errors that a sample may have changed, which arrived late."""
        for ahead, rung in self._rungs.items():
            rung.sums.forget(unchanged_until(history, late) + 1)
            self._rungs[ahead] = _Rung(None, rung.sums, None)

    def errors(self, history: MovingHistory, asked: Asked) -> list[float] | None:
        """
        Return the covariance of a prediction's errors, packed; None if there are too few trials.

        If the noise is unknown, all errors may be noise, or changes of the motion, and both are
        added.
        """
        span, start, _, ahead, until, noise, own = asked
        if noise is not self._noise:
            self._noise, self._packed = noise, pack(_NONE if noise is None else noise)
            self._rungs = {ahead: _Rung(None, rung.sums, None)
                           for ahead, rung in self._rungs.items()}
        tried = max(ahead, math.ceil(_PERIODS * span.period))
        changes = []
        for ahead_by, weight in _rungs_around(tried, (until - start.stamp) / ahead):
            rung = self._known(history, span, ahead_by)
            if rung.change is None:
                return None
            changes.append((weight * rung.change, rung.noise))
        is_aided = gyro_until(history) is not None
        if not is_aided:
            own += _noise_at(history, span, start.stamp, ahead) - 1.0
        part = ahead / tried if is_aided else _part(ahead, tried, max(span.period, TWIST_OVER))
        total = own * self._packed
        for change, in_errors in changes:
            total += (part + (own / in_errors if noise is None else 0.0)) * change
        packed: list[float] = total.tolist()
        return packed

    def _known(self, history: MovingHistory, span: Span, ahead: _Ahead) -> _Rung:
        """Return what is known of predictions for a time ahead."""
        oldest, cell = span.oldest, span.cell
        gyro = gyro_until(history)
        if gyro is not None:
            oldest = unexpired_since(history, max(gyro, history.newest_stamp or gyro), oldest)
        first, last = -((-oldest - TWIST_OVER) // cell), (span.newest - ahead[0]) // cell - 1
        while gyro is not None and last >= first and not _is_final(
                history, (last + 1) * cell + ahead[0], gyro):
            last -= 1
        rung = self._rungs.get(ahead)
        if rung is None:
            if len(self._rungs) >= _MOST_RUNGS:
                self._rungs.clear()
            rung = _Rung(None, Cells(), None)
        if rung.cells != (cell, first, last):
            rows = rung.sums.rows(cell, first, last, lambda begin, end: _errors(
                history, span, begin, end, ahead))
            rung = _Rung((cell, first, last), rung.sums, None)
            if len(rows) >= LEAST_CELLS:
                count, noise = rows[:, :2].sum(axis=0).tolist()
                rung = rung._replace(noise=noise / count, change=change_in(
                    history, rows, ahead[0], cell, noise / count * unpack(self._packed)))
            self._rungs[ahead] = rung
        return rung


def _part(ahead: float, tried: float, lag: float) -> float:
    """
    Return the part of a variance of a time ahead that belongs to a shorter time.

    An acceleration shows in the square of h (h + l): see ``past.deviations``.
    """
    return (ahead * (ahead + lag) / (tried * (tried + lag)))**2


def _noise_at(history: MovingHistory, span: Span, stamp: int, ahead: int) -> float:
    """Return the variance of the noise in a prediction, relative to that of a sample."""
    if not history.takes_samples:
        return 1.0
    stamps = history.columns().stamps
    before = max(stamp - TWIST_OVER, span.oldest)
    place = bisect_right(stamps, before, 0, len(stamps) - 1)
    first, second = stamps[place - 1], stamps[place]
    return _of_noise(ahead / (stamp - before), (before - first) / max(second - first, 1),
                     float(second >= stamp))


def _of_noise(times: float, ratio: Number, is_last: Number) -> Number:
    """
    Return the variance of the noise in predictions, relative to that of a sample.

    A prediction by u times the time of which the twist is the mean is (1 + u) x - u x', with the
    newest sample x and an earlier pose x', which is interpolated between two samples.

    :param ratio: where it is between the two, 0 to 1.
    :param is_last: 1 if the second one is x, otherwise 0.
    """
    once = times * (1.0 - ratio)
    return (is_last * ((1.0 + once)**2 + once**2)
            + (1.0 - is_last) * ((1.0 + times)**2 + times**2 * between(ratio)))


def change_in(history: MovingHistory, rows: Array, ahead: float, cell: int,
              noise: Array) -> Array:
    """
    Return the covariance of the motion's change that errors show.

    :param rows: the sums of cells: the count, the variance of the noise relative to that of a
        sample, and the squares of the errors.
    :param ahead: the time ahead, nanoseconds; ``cell``: the length of a cell.
    :param noise: in the errors, (6, 6).
    """
    count, _, *squares = rows.sum(axis=0).tolist()
    moment = unpack(np.array(squares) / count)
    check_size(history, math.sqrt(moment.max()))
    units = np.sqrt(np.maximum((moment + noise).diagonal(), _LEAST_VARIANCE))
    scale = np.outer(units, units)
    values, vectors = np.linalg.eigh((moment - noise) / scale)
    change = (vectors * np.maximum(values, 0.0)) @ vectors.T
    number = _independent(rows[:, 2:][:, DIAGONAL] / rows[:, :1],
                          (ahead + TWIST_OVER) / cell)
    mean = float(np.exp(np.log(number).mean()))
    change = with_less_correlation(change, _MOST_CORRELATION * mean / (mean + PRIOR))
    factor = np.sqrt(1.0 + _FEW / number)
    return pack(change * scale * np.outer(factor, factor))


def _independent(squares: Array, overlap: float) -> Array:
    """
    Return how many independent normal errors would show their variance as well, (6,).

    The variance of a mean of correlated numbers is a sum of their autocovariances, here with
    the weights of Newey and West ("A Simple, Positive Semi-Definite, Heteroskedasticity and
    Autocorrelation Consistent Covariance Matrix", Econometrica 55(3), 1987).

    :param squares: the mean squares of errors in n successive cells, (n, 6).
    :param overlap: how many cells an error spans.
    """
    count = len(squares)
    mean = squares.mean(axis=0)
    off = squares - mean
    lags = max(min(int(overlap) + 2, count // 3), int(_CORRELATED * count))
    # The weights are those of the squares of all sums of lags + 1 successive numbers.
    sums = np.zeros((count + 2 * lags + 2, 6))
    sums[lags + 1:-lags - 1] = np.cumsum(off, axis=0)
    sums[-lags - 1:] = sums[-lags - 2]
    moving = sums[lags + 1:] - sums[:-lags - 1]
    variance = (moving * moving).sum(axis=0) / (lags + 1)
    variance = np.maximum(
        variance / (count * (count - 1)), _LEAST_SPREAD * mean * mean + np.finfo(float).tiny)
    return np.asarray(np.maximum(2.0 * mean * mean / variance, 1.0))


# --- the errors

def _errors(history: MovingHistory, span: Span, first: int, last: int, ahead: _Ahead) -> Sums:
    """Return the sums of cells; see ``change_in``."""
    time, measured = ahead
    is_aided = gyro_until(history) is not None
    starts = chosen(history, span.cell, first, last, *([1] if is_aided else []))
    noise, used = np.zeros(len(starts)), starts + time
    if history.takes_samples and len(starts):
        starts, noise, used = _compared(history, span, starts, time, is_aided)
    if not len(starts):
        return sums_by_cell(
            span.cell, first, last, starts, np.zeros((0, 1 + PACKED_FLOATS)), used)
    ends = starts + time
    track = history.track(int(starts[0]) - TWIST_OVER, int(ends[-1]))
    if is_aided:
        predicted = np.array([forecast(history, start_at(history, start, span.oldest),
                                       start + time, start + measured * time // _MEASURED_PARTS)
                              for start in starts.tolist()])
    else:
        before, now = (track.at(stamps).T for stamps in (starts - TWIST_OVER, starts))
        twists = screws.log_many(se3.compose_many(se3.inverse_many(before), now))
        predicted = se3.compose_many(now, screws.exp_many(time / TWIST_OVER * twists))
    # In the axes of the predicted poses.
    errors = errors_of(se3.compose_many(se3.inverse_many(predicted), track.at(ends).T))
    check_size(history, float(np.abs(errors).max()))
    return sums_by_cell(span.cell, first, last, starts, np.concatenate(
        [noise[:, None], packed_squares(errors)], axis=1), used)


def _compared(history: MovingHistory, span: Span, starts: Stamps, time: int,
              is_aided: bool) -> tuple[Stamps, Array, Stamps]:
    """
    Return the starts whose predictions are compared with a pose after another sample.

    :return: the starts (N,); the variance of the noise in an error, relative to that of a sample,
        (N,), without that of the twist if the edge is aided; and the stamps of the samples at the
        end or after it, (N,).
    """
    stamps = stamps_in(history, _stamp_before(history, int(starts[0]) - TWIST_OVER),
                       span.newest + 1)
    after = stamps[np.minimum(stamps.searchsorted(starts, side='right'), len(stamps) - 1)]
    starts = starts[(after > starts) & (after <= starts + time)]
    _, second, ratio = stamps_around(stamps, starts + time)
    noise = between(ratio)
    if is_aided:
        return starts, noise + 1.0, second
    _, later, part = stamps_around(stamps, starts - TWIST_OVER)
    is_last = np.asarray(later >= starts, dtype=float)
    return starts, noise + _of_noise(time / TWIST_OVER, part, is_last), second


def _stamp_before(history: MovingHistory, time: int) -> int:
    """Return the stamp of the last sample up to a time, at which the edge has a pose."""
    stamps = history.columns().stamps
    return stamps[max(bisect_right(stamps, time) - 1, 0)]


def stamps_around(stamps: Stamps, times: Stamps) -> tuple[Stamps, Stamps, Array]:
    """Return the stamps before times and at them or after, (N,), and where between these."""
    places = stamps.searchsorted(times)
    first, second = stamps[np.maximum(places - 1, 0)], stamps[places]
    return first, second, np.asarray((times - first) / np.maximum(second - first, 1))


def _is_final(history: MovingHistory, stamp: int, gyro: int) -> bool:
    """Return whether no next pose or angular velocity changes the poses up to a stamp."""
    # The pose after a gap that contains the next one. Until then there may be another gap, which
    # is bridged with the rates that are measured after it.
    after = history.next_stamp(history.next_stamp(stamp - 1) + BRIDGED)
    newest = history.newest_stamp
    assert newest is not None
    return after < newest and (gyro < newest - LATEST_RATES or after + 2 * BRIDGED <= gyro)


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
