# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Predictions of edges whose velocity the caller knows, such as a commanded one.

Predictions with a command are kept. Later, the poses that followed show how far off they were, and
so how well the edge follows its commands.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import History, MovingHistory
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.screws import Twist

from .forecast import Asked, forecast, Start
from .trials import change_in, LEAST_CELLS, stamps_around
from ..uncertainty.covariances import at_least, errors_of, pack, packed_squares
from ..uncertainty.learning import check_size, LATELY, Span, stamps_in, sums_by_cell
from ..uncertainty.noise import between

# So many predictions are kept of an edge, evenly distributed, for each octave of the time ahead.
_MOST = 256
# All shorter times ahead, nanoseconds, are one of these octaves: its number of bits.
_SHORTEST = 26
# The largest error of this time counts for itself, because an edge may have ceased to follow; but
# not what is below so many variances of the noise.
_RECENT, _MOST_NOISE = from_seconds(0.25), 6.0


class _Trial(NamedTuple):
    """
    One prediction with a command.

    :ivar start: the stamp of the newest sample then; ``end``: that of the prediction.
    :ivar twist: the command, per nanosecond; ``before``: the edge's own at the start.
    :ivar until: the stamp up to which the edge's gyroscope was followed.
    """

    start: int
    end: int
    twist: Twist
    until: int
    before: Twist


class Commands(Companion):
    """The predictions with commands of a tree's edges, sorted by their starts."""

    def __init__(self) -> None:
        # By child frame, and by the octave of the time ahead.
        self._by_child: dict[str, dict[int, list[_Trial]]] = {}

    def copy(self) -> 'Commands':
        """Return an independent copy."""
        twin = Commands()
        twin._by_child = {
            child: {octave: list(trials) for octave, trials in octaves.items()}
            for child, octaves in self._by_child.items()}
        return twin

    def clear(self, histories: Mapping[str, History]) -> None:
        """Remove all: only edges that move are predicted."""
        self._by_child.clear()

    def remove(self, frame: str) -> None:
        """Remove the predictions of a frame's edge."""
        self._by_child.pop(frame, None)

    def note(self, child: str, asked: Asked, before: Twist) -> None:
        """
        Keep a prediction, unless one from a little earlier is kept.

        Of several from one sample, the last counts.

        :param before: the edge's own twist at the start, per nanosecond.
        """
        start, end = asked.start, asked.start.stamp + asked.ahead
        octaves = self._by_child.setdefault(child, {})
        trials = octaves.setdefault(_octave(asked.ahead), [])
        while trials and trials[-1].start >= start.stamp:
            trials.pop()  # it is from the same sample, or the clock went back
        if not trials or trials[-1].start + LATELY // _MOST <= start.stamp:
            trials.append(_Trial(start.stamp, end, start.twist, asked.until, before))
            del trials[:-_MOST]

    def errors(self, history: MovingHistory, asked: Asked, change: Array) -> list[float] | None:
        """
        Return the covariance of a prediction's errors, packed; None if too few have ended.

        An edge that does not follow its command is off by a twist, whose covariance is learnt.

        :param change: the difference that the command makes to the predicted pose, (6,).
        """
        span, _, _, ahead, _, noise, own = asked
        octaves = self._by_child.get(history.child, {})
        trials = [each for each in octaves.get(_octave(ahead), ())
                  if each.start >= span.oldest and each.end <= span.newest]
        if not trials:
            return None
        starts, ends, gyro_ends = (np.array([each[place] for each in trials], dtype=np.int64)
                                   for place in (0, 1, 3))
        seconds = (ends - starts) * as_seconds(1)
        offs = _errors(history, starts, ends, gyro_ends, [each.twist for each in trials])
        check_size(history, float(np.abs(offs).max()))
        first, last = int(starts[0]) // span.cell, int(starts[-1]) // span.cell
        share = _noise_in(history, span, starts, ends) / seconds**2
        rows = sums_by_cell(span.cell, first, last, starts, np.concatenate(
            [share[:, None], packed_squares(offs / seconds[:, None])], axis=1), ends).rows
        rows = rows[rows[:, 0] > 0.0]
        if len(rows) < LEAST_CELLS:
            return None
        known = np.zeros((6, 6)) if noise is None else noise
        mean = float(share.mean())
        twist = change_in(history, rows, float((ends - starts).mean()), span.cell, mean * known)
        also_noise = own / mean if noise is None else 0.0
        found: list[float] = ((as_seconds(ahead)**2 + also_noise) * twist
                              + own * pack(known)).tolist()
        changes = (ends - starts)[:, None] * np.array(
            [np.subtract(each.twist, each.before) for each in trials])
        above = (offs / seconds[:, None])**2 - _MOST_NOISE * share[:, None] * known.diagonal()
        recent = above[ends > span.newest - _RECENT].max(axis=0, initial=0.0)
        return at_least(found, np.maximum(
            _missed(offs, changes, change), as_seconds(ahead) * np.sqrt(recent)).tolist())


def _octave(ahead: int) -> int:
    """Return the octave of a time ahead: what an edge misses depends on the time that it has."""
    return max(ahead.bit_length(), _SHORTEST)


def _missed(offs: Array, changes: Array, change: Array) -> Array:
    """
    Return the part of a command's change that an edge may not follow, (6,).

    A change that is not larger than earlier ones is in the errors of these. Of a larger one, an
    edge misses as large a part as of all earlier ones; or all of it, if they were too small.

    :param offs: their errors, (n, 6); ``changes``: what the commands changed, likewise.
    """
    known = (changes * changes).sum(axis=0)
    part = np.minimum((offs * offs).sum(axis=0) / np.maximum(known, np.finfo(float).tiny), 1.0)
    part[known < change * change] = 1.0
    part[np.abs(change) <= np.abs(changes).max(axis=0)] = 0.0
    return np.asarray(np.sqrt(part) * np.abs(change))


def _noise_in(history: MovingHistory, span: Span, starts: Stamps, ends: Stamps) -> Array:
    """Return the variance of the noise in errors, (n,), relative to that of a sample."""
    if not history.takes_samples:
        return np.ones(len(starts))
    before, _, ratio = stamps_around(stamps_in(history, int(starts.min()), span.newest + 1), ends)
    # Before the next sample, the pose that an error is compared with is that of the start, too.
    return np.where(before == starts, 2.0 * ratio**2, 1.0 + between(ratio))


def _errors(history: MovingHistory, starts: Stamps, ends: Stamps, gyro_ends: Stamps,
            twists: list[Twist]) -> Array:
    """Return the errors of predictions (n, 6), in the axes of the predicted poses."""
    track = history.track(int(starts.min()), int(ends.max()))
    begins = track.at(starts).T
    if (gyro_ends > starts).any():
        predicted = np.array([
            forecast(history, Start(start, history.sample(start), twist), end, until)
            for start, end, until, twist in zip(
                starts.tolist(), ends.tolist(), gyro_ends.tolist(), twists, strict=True)])
    else:
        moved = screws.exp_many((ends - starts)[:, None] * np.array(twists))
        predicted = se3.compose_many(begins, moved)
    return errors_of(se3.compose_many(se3.inverse_many(predicted), track.at(ends).T))
