# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The input of a spline fit: a caller's poses, and the initial knots."""

import math
from typing import Any

import numpy as np
from tf_tree_py.core.edges.track import InterpolatedTrack
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.poses import checked_poses, with_unit_quaternions
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamps, Stamps, StampsLike

from .spline_fit import ORDER
from .spline_segment import difference, Group, moved

# Nanoseconds: differences of stamps must fit into 64 bits.
_LONGEST = 2**62


def checked_samples(stamps: StampsLike, poses: Any) -> tuple[Stamps, Array]:
    """
    Return a caller's samples, sorted by stamp, with unit quaternions.

    :return: (N,) and (N, 7), N > 0.
    :raises InvalidArgumentException: no samples, different numbers of stamps and poses, or a
        pose that is not finite or not a rotation.
    """
    times = checked_stamps(stamps)
    array = checked_poses(poses) if len(times) or np.size(poses) else np.empty((0, 7))
    if len(array) != len(times) or not len(times):
        raise InvalidArgumentException(
            f'there must be one pose (N, 7) for each stamp (N,), and at least one: not '
            f'{len(times)} stamps and {len(array)} poses')
    unit, good = with_unit_quaternions(array)
    if not good.all():
        first = int(np.argmin(good))
        raise InvalidArgumentException(
            f'poses[{first}] is not a pose: {array[first].tolist()} is not finite, or not a '
            'rotation')
    if int(times.max()) - int(times.min()) > _LONGEST:
        raise InvalidArgumentException(
            f'the stamps range from {format_stamp(int(times.min()))} to '
            f'{format_stamp(int(times.max()))}, which is too long for one spline')
    order = np.argsort(times, kind='stable')
    return times[order], unit[order]


def checked_rate(knot_rate_hz: float) -> float:
    """
    Return a caller's knot rate as a float.

    :raises InvalidArgumentException: it is not a valid rate.
    """
    try:
        rate = float(knot_rate_hz)
    except (TypeError, ValueError):
        rate = math.nan
    if not 0.0 < rate <= NANOSECONDS_PER_SECOND:
        raise InvalidArgumentException(
            f'Invalid argument knot_rate_hz {knot_rate_hz!r}: it must be a number of knots per '
            'second, greater than 0 and at most one per nanosecond')
    return rate


def places(stamps: Stamps, begin: int, period: int, pieces: int) -> tuple[Stamps, Array]:
    """Return the pieces that contain stamps, and the places on these pieces (u); each (...)."""
    since = stamps - begin
    numbers = np.minimum(since // period, pieces - 1)
    return numbers, (since - numbers * period) / period


def first_guess(group: Group, begin: int, period: int, pieces: int, stamps: Stamps,
                poses: Array, before: Array | None = None) -> Array:
    """
    Return initial knots (n, 7) for a fit.

    Each is the pose in the middle of the time that it influences: interpolated between the
    poses, and extrapolated beyond the last pose at the same velocity.

    :param stamps: (N,) sorted; ``poses``: (N, 7).
    :param before: (m, 7) the first knots, if they are known.
    """
    count = pieces + ORDER - 1
    if before is not None and len(before) >= count:
        return before[:count].copy()
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
