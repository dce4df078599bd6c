# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Checks of what callers give: a correction, and how fast an edge may go over to it."""

import math
import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import InvalidArgumentException
from ..geometry.blend import Limits
from ..geometry.poses import checked_pose
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Vector3
from ..stamp import from_seconds

DEFAULT_OVER = from_seconds(0.5)


def checked_motion(correction: Any) -> PoseTuple:
    """
    Return a caller's correction.

    :raises InvalidArgumentException: no pose, or one that is not finite.
    """
    motion = checked_pose(correction)
    if not np.isfinite(motion).all():
        raise InvalidArgumentException('Invalid argument correction: it is not finite')
    return motion


def checked_limits(over: int, max_speed: float, max_turn_rate: float, reach: float) -> Limits:
    """
    Return how fast a caller lets a blend be.

    :raises InvalidArgumentException: negative, not a number, or a blend that would never end.
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


def checked_point(given: npt.ArrayLike) -> Vector3:
    """
    Return the point of the child that a caller limits the speed of.

    :raises InvalidArgumentException: it is none, or not finite.
    """
    try:
        x, y, z = np.asarray(given, dtype=float).tolist()
    except (TypeError, ValueError):
        raise InvalidArgumentException(f'about is a point (3,), not {given!r}') from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InvalidArgumentException(f'about is a point (3,), and finite, not {given!r}')
    return (x, y, z)
