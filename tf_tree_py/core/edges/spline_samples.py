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

"""What a spline is fitted to: a caller's poses, and knots to begin with."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from .track import InterpolatedTrack
from ..errors import InvalidArgumentException
from ..geometry.poses import checked_poses
from ..geometry.so3 import Array
from ..geometry.spline import difference, Group, moved
from ..geometry.spline_fit import ORDER
from ..stamp import format_stamp, NANOSECONDS_PER_SECOND
from ..times import checked_stamps, Stamps

# Nanoseconds: differences of stamps are taken in 64 bits.
_LONGEST = 2**62


def checked_samples(stamps: npt.ArrayLike, poses: Any) -> tuple[Stamps, Array]:
    """
    Return a caller's samples, sorted by stamp, with unit quaternions.

    :return: (N,) and (N, 7), N > 0.
    :raises InvalidArgumentException: none, not as many, not finite, or no rotation.
    """
    times = checked_stamps(stamps)
    array = checked_poses(poses) if len(times) or np.size(poses) else np.empty((0, 7))
    if len(array) != len(times) or not len(times):
        raise InvalidArgumentException(
            f'stamps (N,) and poses (N, 7) are one for each, and there is at least one: not '
            f'{len(times)} and {len(array)}')
    sizes = np.linalg.norm(array[:, 3:], axis=1)
    good = np.isfinite(array).all(axis=1) & (sizes > 0.0) & np.isfinite(sizes)
    if not good.all():
        first = int(np.argmin(good))
        raise InvalidArgumentException(
            f'poses[{first}] is no pose: {array[first].tolist()} is not finite, or no rotation')
    if int(times.max()) - int(times.min()) > _LONGEST:
        raise InvalidArgumentException(
            f'the stamps go from {format_stamp(int(times.min()))} to '
            f'{format_stamp(int(times.max()))}, too far for one spline')
    order = np.argsort(times, kind='stable')
    array = np.concatenate([array[:, :3], array[:, 3:] / sizes[:, None]], axis=1)
    return times[order], array[order]


def checked_rate(knot_rate_hz: float) -> float:
    """
    Return a rate of knots.

    :raises InvalidArgumentException: it is none.
    """
    try:
        rate = float(knot_rate_hz)
    except (TypeError, ValueError):
        rate = math.nan
    if not 0.0 < rate <= NANOSECONDS_PER_SECOND:
        raise InvalidArgumentException(
            f'Invalid argument knot_rate_hz {knot_rate_hz!r}: it is a number of knots a second, '
            'more than 0 and at most one a nanosecond')
    return rate


def places(stamps: Stamps, begin: int, period: int, pieces: int) -> tuple[Stamps, Array]:
    """Return the pieces on which stamps lie, and where on these pieces (u); each (...)."""
    since = stamps - begin
    numbers = np.minimum(since // period, pieces - 1)
    return numbers, (since - numbers * period) / period


def first_guess(group: Group, begin: int, period: int, pieces: int, stamps: Stamps,
                poses: Array, before: Array | None = None) -> Array:
    """
    Return knots (n, 7) for a fit to begin with.

    Each is the pose in the middle of the time that it influences: interpolated between the
    poses, and beyond the last of them extrapolated at the same velocity.

    :param stamps: (N,) sorted, and the poses (N, 7).
    :param before: (m, 7) the first knots, where they are known.
    """
    count = pieces + ORDER - 1
    times = begin + period * (np.arange(count) - 1)
    inside = np.clip(times, stamps[0], stamps[-1])
    knots = InterpolatedTrack(stamps, poses).at(inside).T
    if before is not None:
        knots[:len(before)] = before[:count]
    for number in range(1 if before is None else len(before), count):
        if times[number] > stamps[-1] and number > 1:
            step = difference(group, knots[number - 2], knots[number - 1])
            knots[number] = moved(group, knots[number - 1], step)
    if before is None:
        knots[0] = moved(group, knots[1], -difference(group, knots[1], knots[2]))
    return knots
