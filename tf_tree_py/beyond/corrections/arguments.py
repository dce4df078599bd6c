# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of callers' arguments: a correction, and the limits of the speed of its blend."""

import math
import operator

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.poses import checked_pose, PoseLike
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Vector3
from tf_tree_py.core.stamp import from_seconds

from .blend import BlendLimits
from .stage import ORIGIN

DEFAULT_OVER = from_seconds(0.5)


def checked_motion(correction: PoseLike) -> PoseTuple:
    """
    Return a caller's correction as a pose.

    :raises InvalidArgumentException: not a pose, or not finite.
    """
    motion = checked_pose(correction)
    if not all(map(math.isfinite, motion)):
        raise InvalidArgumentException('Invalid argument correction: it is not finite')
    return motion


def checked_limits(over: int, max_speed: float, max_turn_rate: float, reach: float) -> BlendLimits:
    """
    Return a caller's limits of a blend.

    :raises InvalidArgumentException: negative, not a number, or a blend that would never end.
    """
    try:
        span = operator.index(over)
        fast, turn, near = float(max_speed), float(max_turn_rate), float(reach)
    except (TypeError, ValueError):
        raise InvalidArgumentException(
            f'over={over!r} must be integer nanoseconds, and max_speed={max_speed!r}, '
            f'max_turn_rate={max_turn_rate!r} and reach={reach!r} numbers') from None
    if not (span >= 0 and fast > 0.0 and turn > 0.0 and 0.0 <= near < math.inf):
        raise InvalidArgumentException(
            f'over={over!r} ns must not be negative, max_speed={max_speed!r} and '
            f'max_turn_rate={max_turn_rate!r} must be positive, and reach={reach!r} metres '
            'must be finite and not negative')
    return BlendLimits(span, fast, turn, near)


def checked_point(given: npt.ArrayLike) -> Vector3:
    """
    Return the point of the child whose speed a caller limits.

    :raises InvalidArgumentException: it is not a point, or not finite.
    """
    if given is ORIGIN:
        return ORIGIN  # the usual case
    try:
        x, y, z = np.asarray(given, dtype=float).tolist()
    except (TypeError, ValueError):
        raise InvalidArgumentException(f'about must be a point (3,), not {given!r}') from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InvalidArgumentException(f'about must be a finite point (3,), not {given!r}')
    return (x, y, z)
