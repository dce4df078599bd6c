# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Extrapolations of an edge: it keeps its last twist, and follows its gyroscope."""

from collections.abc import Sequence
from typing import NamedTuple

from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import ExtrapolationException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, BEGINNING, from_seconds
from tf_tree_py.screws import Twist

from ..curves.aided import gyro_until, turn_of
from ..curves.gaps import BRIDGED
from ..uncertainty.learning import Span

TWIST_OVER = from_seconds(0.1)
"""A prediction uses the mean twist over this time before its first sample."""


AT_REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Start(NamedTuple):
    """
    The initial state of a prediction.

    :ivar pose: ``parent_T_child`` at the stamp.
    :ivar twist: just before the stamp, per nanosecond, in the child's axes.
    """

    stamp: int
    pose: PoseTuple
    twist: Twist


class Asked(NamedTuple):
    """
    A prediction of an edge.

    :ivar span: the time of which something is learnt.
    :ivar start: at the newest sample.
    :ivar stop: the accelerations with which the edge stops in time, as ``past.Limits``.
    :ivar ahead: nanoseconds.
    :ivar until: the stamp up to which the edge's gyroscope is followed.
    :ivar noise: of a sample (6, 6); None if unknown.
    :ivar own: 1, or 0 if the noise of the newest sample itself is not included.
    """

    span: Span
    start: Start
    stop: Sequence[float]
    ahead: int
    until: int
    noise: Array | None
    own: float


def start_at(history: MovingHistory, stamp: int, oldest: int) -> Start:
    """
    Return the initial state of a prediction from a stamp.

    :param oldest: the stamp of the first sample that counts.
    :raises ExtrapolationException: there is no other sample.
    """
    length = min(TWIST_OVER, stamp - oldest)
    if length <= 0:
        raise ExtrapolationException(
            f'A prediction requires two samples, and the edge {history.parent} -> {history.child} '
            'has one with this parent', blocked_on=((history.child, stamp + 1),))
    before, now = history.sample(stamp - length), history.sample(stamp)
    moved = se3.compose(se3.inverse(before), now)
    return Start(stamp, now, screws.times(1.0 / length, screws.log(moved)))


def start_with(history: MovingHistory, stamp: int, twist: Twist) -> Start:
    """Return the initial state of a prediction with a known twist, per second."""
    return Start(stamp, history.sample(stamp), screws.times(as_seconds(1), twist))


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


def unexpired_since(history: MovingHistory, newest: int, oldest: int) -> int:
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
