# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The covariance of a prediction's errors.

It is that of earlier predictions (``trials``). But these show only what the edge has done
lately, and it may stop at any time. So the deviation along and about each axis is at least that of
an edge that stops within half a second, or accelerates up to a given limit.
"""

from collections.abc import Mapping, Sequence
import math

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.screws import Twist

from .forecast import motion, Start, start_at, TWIST_OVER
from .trials import Trials
from ..uncertainty.covariances import DIAGONAL, pack
from ..uncertainty.learning import check_size, Span

Limits = Sequence[float]
"""The largest acceleration along x, y, z (m/s^2) and about them (rad/s^2), in the child's axes."""

# An edge may stop within half a second.
_STOPS_S = 0.5
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


# --- the errors of an edge that accelerates

def deviations(twist: Twist, limits: Limits, lasts: float, lag: float, ahead: float,
               measured: float) -> Limits:
    """
    Return the standard deviations of a prediction whose edge may accelerate up to limits.

    A prediction by the time h is off by a (h^2 + l h) / 2 for a constant acceleration a, because a
    mean twist is that of half the lag l ago. A rotation that is off turns the velocity, so the
    position is off by the integral of that. Any acceleration up to the limit is as likely as
    any other, so the deviation is the largest error divided by the square root of three: JCGM
    100:2008, "Guide to the Expression of Uncertainty in Measurement", 4.3.7.

    :param twist: per second, in the child's axes; ``limits`` likewise.
    :param lasts: after this time it accelerates no more, seconds.
    :param lag: the time of which the twist is the mean, seconds.
    :param ahead: the time of the prediction, seconds; ``measured``: how much of it a gyroscope
        measured.
    :return: metres and radians, in the axes of the predicted pose.
    """
    vx, vy, vz, wx, wy, wz = map(abs, twist)
    ax, ay, az, bx, by, bz = limits
    once, twice = _integrals(ahead, lag, lasts)
    turned, turned_twice = once, twice
    if measured:
        known, known_twice = _integrals(measured, lag, lasts)
        turned -= known
        turned_twice -= known_twice + known * (ahead - measured)
    return (
        once * ax + twice * (wy * az + wz * ay) + turned_twice * (vy * bz + vz * by),
        once * ay + twice * (wz * ax + wx * az) + turned_twice * (vz * bx + vx * bz),
        once * az + twice * (wx * ay + wy * ax) + turned_twice * (vx * by + vy * bx),
        turned * bx + turned_twice * (wy * bz + wz * by),
        turned * by + turned_twice * (wz * bx + wx * bz),
        turned * bz + turned_twice * (wx * by + wy * bx))


def _integrals(time: float, lag: float, lasts: float) -> tuple[float, float]:
    """
    Return the factors of the deviations: the integral of t + lag / 2, and the integral of that.

    :param lasts: the last t; it remains the same then.
    """
    end, rest = min(time, lasts), max(time - lasts, 0.0)
    once, speed = end * (end + lag) / 2.0, end + lag / 2.0
    twice = end * end * (2.0 * end + 3.0 * lag) / 12.0
    return (_UNIFORM * (once + speed * rest),
            _UNIFORM * (twice + once * rest + speed * rest * rest / 2.0))


# --- the errors

def errors(trials: Trials, history: MovingHistory, span: Span, start: Start, ahead: int,
           until: int, given: Limits | None, noise: Array | None, own: float) -> list[float]:
    """
    Return the covariance of a prediction's errors, packed, in the axes of the predicted pose.

    If there are too few earlier predictions, the error is assumed to be as large as the
    predicted motion, because the edge may have stopped.

    :param trials: the earlier predictions of the edge.
    :param span: the time that counts.
    :param start: at the newest sample.
    :param ahead: nanoseconds.
    :param until: the stamp up to which the edge's gyroscope is followed.
    :param given: the largest accelerations; None: it may stop.
    :param noise: of a sample (6, 6); None if unknown.
    :param own: 1, or 0 if the noise of the newest sample itself is not included.
    """
    found = trials.errors(history, span, start, ahead, until, noise, own)
    if found is None:
        found = _as_large_as_the_motion(history, span, start, ahead, until, noise, own)
    lag, lasts = as_seconds(round(max(span.period, TWIST_OVER))), math.inf
    if given is None:
        given, lag = _to_stop(history, span, start), min(lag, 2.0 * _STOPS_S)
        lasts = _STOPS_S - lag / 2.0
    least = deviations(screws.times(NANOSECONDS_PER_SECOND, start.twist), given, lasts, lag,
                       as_seconds(ahead), as_seconds(until - start.stamp))
    check_size(history, max(least))
    for place, deviation in zip(_DIAGONAL, least, strict=True):
        found[place] = max(found[place], deviation * deviation)
    return found


def _as_large_as_the_motion(history: MovingHistory, span: Span, start: Start, ahead: int,
                            until: int, noise: Array | None, own: float) -> list[float]:
    """Return the square of the predicted motion; unknown noise is as large as that of a period."""
    moved = np.array(screws.log(motion(history, start, start.stamp + ahead, until)))
    in_period = max(span.period, TWIST_OVER) * np.array(start.twist)
    check_size(history, float(np.abs((moved, in_period)).max()))
    if noise is None:
        noise = np.outer(in_period, in_period)
    packed: list[float] = pack(np.outer(moved, moved) + own * noise).tolist()
    return packed


_DIAGONAL: tuple[int, ...] = tuple(DIAGONAL.tolist())


def _to_stop(history: MovingHistory, span: Span, start: Start) -> Limits:
    """Return the accelerations with which an edge stops in time, or has begun to do so."""
    speeds = [abs(each) for each in start.twist]
    before = start.stamp - from_seconds(_STOPS_S)
    if before > span.oldest:
        speeds = [max(now, abs(then)) for now, then in zip(
            speeds, start_at(history, before, span.oldest).twist, strict=True)]
    return screws.times(NANOSECONDS_PER_SECOND / _STOPS_S, speeds)
