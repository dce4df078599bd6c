# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Extrapolation of one edge beyond its newest sample, from its last twist and gyroscope."""

from typing import NamedTuple

from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import ExtrapolationException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple, Twist
from tf_tree_py.core.stamp import from_seconds

from ..curves.aided import gyro_until, turn_of

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
    return Start(stamp, now, _times(se3.log(se3.compose(se3.inverse(before), now)), 1.0 / length))


def forecast(history: MovingHistory, start: Start, end: int) -> PoseTuple:
    """Return the predicted pose at a stamp, from the state at an earlier one."""
    return se3.compose(start.pose, motion(history, start, end))


def motion(history: MovingHistory, start: Start, end: int) -> PoseTuple:
    """Return the motion of an edge until a stamp if it keeps its velocity."""
    begin, known = start.stamp, gyro_until(history)
    until = begin if known is None else max(begin, min(end, known))
    if until > begin:
        turn, half = (turn_of(history, begin, stamp) for stamp in (until, (begin + until) // 2))
        if turn is not None and half is not None:
            return _turned_motion(start.twist, until - begin, end - until, half, turn)
    return se3.exp(_times(start.twist, end - begin))


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
    way = _times(twist, measured)[:3]
    first, middle, last = way, so3.rotate(half, way), so3.rotate(turn, way)
    x, y, z = ((a + 4.0 * b + c) / 6.0 for a, b, c in zip(first, middle, last, strict=True))
    return se3.compose((x, y, z, *turn), se3.exp(_times(twist, rest)))


def _times(twist: Twist, factor: float) -> Twist:
    vx, vy, vz, wx, wy, wz = twist
    return (factor * vx, factor * vy, factor * vz, factor * wx, factor * wy, factor * wz)
