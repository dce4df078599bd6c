# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The covariance of a prediction's errors.

It is that of earlier predictions (``trials``). But these show only what the edge has done
lately, and it may stop at any time. So the deviation along and about each axis is at least that of
an edge that stops within half a second, or accelerates up to a given limit.
"""

from collections.abc import Iterable, Mapping, Sequence
import math

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.edges.protocol import MovingHistory
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.stamp import as_seconds, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.screws import Twist

from .commanded import Commands
from .forecast import Asked, motion, Start, start_at, TWIST_OVER
from .trials import Trials
from ..uncertainty.covariances import at_least, pack
from ..uncertainty.learning import check_size, Span

Limits = Sequence[float]
"""The largest acceleration along x, y, z (m/s^2) and about them (rad/s^2), in the child's axes."""

ByChild = Mapping[str, Sequence[float]]
"""Six numbers along and about x, y, z in the child's axes, by child frame."""

# Faster than light is no velocity.
_FASTEST = 3e8
# An edge may stop within half a second.
_STOPS_S = 0.5
# The deviation of a uniform distribution, relative to its limit.
_UNIFORM = 1.0 / math.sqrt(3.0)


def checked_limits(given: ByChild | None) -> dict[str, Limits]:
    """
    Return a caller's limits by child frame.

    :raises InvalidArgumentException: something else.
    """
    limits = _six_by_child(given)
    if limits is None or any(limit < 0.0 for each in limits.values() for limit in each):
        raise InvalidArgumentException(
            f'Invalid argument acceleration {given!r:.80}: it maps child frames to six limits '
            'each, along x, y, z (m/s^2) and about x, y, z (rad/s^2), such as '
            "{'base_link': (3.0, 0.0, 0.0, 0.0, 0.0, 4.0)}; none may be negative")
    return limits


def checked_twists(given: ByChild | None, limited: Iterable[str]) -> dict[str, Twist]:
    """
    Return a caller's velocities by child frame.

    :param limited: the frames whose acceleration is limited, which may have no velocity.
    :raises InvalidArgumentException: something else.
    """
    twists = _six_by_child(given)
    if twists is None or any(abs(each) > _FASTEST for six in twists.values() for each in six):
        raise InvalidArgumentException(
            f'Invalid argument twist {given!r:.80}: it maps child frames to six finite numbers '
            'each, the velocity along x, y, z (m/s) and about x, y, z (rad/s), such as '
            "{'base_link': (0.5, 0.0, 0.0, 0.0, 0.0, 0.2)}")
    both = sorted(twists.keys() & set(limited))
    if both:
        raise InvalidArgumentException(
            f'Invalid arguments twist and acceleration: both are given for "{both[0]}"; a '
            'velocity is kept, so no acceleration is possible')
    return {child: screws.times(1.0, each) for child, each in twists.items()}


def _six_by_child(given: ByChild | None) -> dict[str, Sequence[float]] | None:
    """Return six finite numbers of each frame; None for something else."""
    numbers: dict[str, Sequence[float]] = {}
    try:
        for child, each in ({} if given is None else given).items():
            numbers[child.removeprefix('/')] = found = [*map(float, each)]
            if isinstance(each, str) or len(found) != 6 or not all(map(math.isfinite, found)):
                return None
    except (AttributeError, OverflowError, TypeError, ValueError):
        return None
    return numbers


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

def errors(trials: Trials, history: MovingHistory, asked: Asked,
           given: Limits | None) -> list[float]:
    """
    Return the covariance of a prediction's errors, packed, in the axes of the predicted pose.

    If there are too few earlier predictions, the error is assumed to be as large as the
    predicted motion, because the edge may have stopped.

    :param trials: the earlier predictions of the edge.
    :param given: the largest accelerations; None: it may stop.
    """
    found = trials.errors(history, asked)
    if found is None:
        found = _as_large_as_the_motion(history, asked)
    span, start = asked.span, asked.start
    lag, lasts = as_seconds(round(max(span.period, TWIST_OVER))), math.inf
    if given is None:
        given, lag = asked.stop, min(lag, 2.0 * _STOPS_S)
        lasts = _STOPS_S - lag / 2.0
    least = deviations(screws.times(NANOSECONDS_PER_SECOND, start.twist), given, lasts, lag,
                       as_seconds(asked.ahead), as_seconds(asked.until - start.stamp))
    check_size(history, max(least))
    return at_least(found, least)


def _as_large_as_the_motion(history: MovingHistory, asked: Asked) -> list[float]:
    """Return the square of the predicted motion; unknown noise is as large as that of a period."""
    span, start, _, ahead, until, noise, own = asked
    moved = np.array(screws.log(motion(history, start, start.stamp + ahead, until)))
    in_period = max(span.period, TWIST_OVER) * np.array(start.twist)
    check_size(history, float(np.abs((moved, in_period)).max()))
    if noise is None:
        noise = np.outer(in_period, in_period)
    packed: list[float] = pack(np.outer(moved, moved) + own * noise).tolist()
    return packed


def errors_with_command(commands: Commands, trials: Trials, history: MovingHistory,
                        asked: Asked, free: Start) -> list[float]:
    """
    Return the covariance of a prediction with a command, packed.

    Before there are enough earlier ones, the edge may also do what it did before: the covariance
    is that without a command, plus the square of the difference that the command makes.

    :param asked: with the command at the start.
    :param free: the start without a command.
    """
    end = asked.start.stamp + asked.ahead
    off = np.array(screws.log(se3.compose(
        se3.inverse(motion(history, asked.start, end, asked.until)),
        motion(history, free, end, asked.until))))
    check_size(history, float(np.abs(off).max()))
    found = commands.errors(history, asked, off)
    if found is None:
        found = errors(trials, history, asked._replace(start=free), None)
        found = (np.array(found) + pack(np.outer(off, off))).tolist()
    return found


def to_stop(history: MovingHistory, span: Span, start: Start) -> Limits:
    """Return the accelerations with which an edge stops in time, or has begun to do so."""
    speeds = [abs(each) for each in start.twist]
    before = start.stamp - from_seconds(_STOPS_S)
    if before > span.oldest:
        speeds = [max(now, abs(then)) for now, then in zip(
            speeds, start_at(history, before, span.oldest).twist, strict=True)]
    return screws.times(NANOSECONDS_PER_SECOND / _STOPS_S, speeds)
