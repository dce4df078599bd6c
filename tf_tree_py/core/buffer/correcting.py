"""
Corrections of a live buffer's edges, without a jump.

The formulas stand in ``geometry.blend``; whose samples are moved, ``edges.corrected`` says.
"""

import math
import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from ..edges.correction import ORIGIN
from ..errors import InvalidArgumentException
from ..geometry.blend import Limits
from ..geometry.poses import checked_pose
from ..geometry.so3 import Vector3
from ..stamp import from_seconds
from ..tree.corrections import absorb, smoothed, Transition
from ..tree.queries import Queries, Snapshot

DEFAULT_OVER = from_seconds(0.5)


class Correcting(Queries):
    """A buffer whose edges absorb corrections."""

    def correct(self, child: str, correction: Any, over: int = DEFAULT_OVER, *,
                max_speed: float = math.inf, max_turn_rate: float = math.inf,
                stamp: int | None = None, about: npt.ArrayLike = ORIGIN,
                reach: float = 0.0) -> Transition:
        """
        Let an edge absorb a correction, without a jump.

        In the end ``parent_T_child`` is the correction times what is inserted; it takes the
        place of the one before, so giving it twice does no harm. It begins at the edge's
        newest sample, so no answer that was given changes, and is blended over stamps: a
        quintic that begins with the present value and rate.

        :param correction: of any kind that ``insert`` takes as a pose.
        :param over: how long the blend takes at least, nanoseconds.
        :param max_speed: metres a second that the blend adds at most to the speed of the
            edge's child; the blend takes as long as that takes.
        :param max_turn_rate: radians a second, likewise.
        :param stamp: when it was seen to be true: the stamp of an image, for instance. For
            ``smoothed()`` only. None: at the newest sample.
        :param about: the point of the child, in its coordinates, that ``max_speed`` holds
            for; it turns about it. What lies r metres from there may gain r times the turn
            rate besides.
        :param reach: ``max_speed`` holds as far from there, metres.
        :return: when it begins and ends, and its number.
        :raises InvalidArgumentException: an edge without samples or that is static or a
            spline; what is no pose, no stamp or no limit.
        """
        limits = checked_limits(over, max_speed, max_turn_rate, reach)
        motion = checked_pose(correction)
        if not np.isfinite(motion).all():
            raise InvalidArgumentException('Invalid argument correction: it is not finite')
        seen_at = None if stamp is None else self._stamp_of(stamp)
        place = _point(about)
        with self._lock:
            return absorb(self._tree, checked_frame(child), motion, seen_at, place, limits)

    def smoothed(self) -> Snapshot:
        """
        Return everything as all corrections together have it: a snapshot, of another past.

        What is blended for those who must not see jumps is wrong while it lasts, and what
        was answered before is never corrected. Here every sample has the correction of its
        own stamp, between two the one in between. For maps and for post-processing.
        """
        with self._lock:
            return Snapshot(smoothed(self._tree))


def checked_limits(over: int, max_speed: float, max_turn_rate: float, reach: float) -> Limits:
    """
    Return how fast a caller lets a blend be.

    :raises InvalidArgumentException: negative, not a number, or nothing that ever ends.
    """
    try:
        span = operator.index(over)
        fast, turn, near = float(max_speed), float(max_turn_rate), float(reach)
    except (TypeError, ValueError):
        raise InvalidArgumentException(
            f'over={over!r} is integer nanoseconds, and max_speed={max_speed!r}, '
            f'max_turn_rate={max_turn_rate!r} and reach={reach!r} are numbers') from None
    if not (span >= 0 and fast > 0.0 and turn > 0.0 and 0.0 <= near < math.inf):
        raise InvalidArgumentException(
            f'over={over!r} ns must not be negative, max_speed={max_speed!r} and '
            f'max_turn_rate={max_turn_rate!r} have to be positive, and reach={reach!r} metres '
            'not negative and finite')
    return Limits(span, fast, turn, near)


def checked_frame(child: Any) -> str:
    """
    Return the name of a caller's child frame, without a leading slash.

    :raises InvalidArgumentException: it is none.
    """
    if not isinstance(child, str) or not child.removeprefix('/'):
        raise InvalidArgumentException(f'child is the name of a frame, not {child!r}')
    return child.removeprefix('/')


def _point(given: npt.ArrayLike) -> Vector3:
    try:
        x, y, z = np.asarray(given, dtype=float).tolist()
    except (TypeError, ValueError):
        raise InvalidArgumentException(f'about is a point (3,), not {given!r}') from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InvalidArgumentException(f'about is a point (3,), and finite, not {given!r}')
    return (x, y, z)
