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

"""
How fast a frame moves, from the poses in a buffer.

The answers are right where frames turn, too. Velocities as tf2 computes them, its
faults included, are in the drop-in.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
)
from .geometry import se3
from .geometry.screws import carry, carry_many, Screw
from .geometry.so3 import Array, Vector3
from .stamp import format_stamp, LATEST, NANOSECONDS_PER_SECOND
from .times import checked_stamp
from .tree.outline import EdgeInfo
from .tree.queries import Queries

ORIGIN: Vector3 = (0.0, 0.0, 0.0)
_AT_REST: Screw = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Velocity(NamedTuple):
    """
    How fast a frame moves.

    :ivar stamp: when, nanoseconds.
    :ivar linear: metres a second.
    :ivar angular: radians a second, in the same axes.
    """

    stamp: int
    linear: Vector3
    angular: Vector3


# --- the twist


def lookup_twist(tree: Queries, tracking_frame: str, observation_frame: str, stamp: int,
                 averaging_interval: int, *, reference_frame: str | None = None,
                 reference_point: Vector3 = ORIGIN,
                 reference_point_frame: str | None = None) -> Velocity:
    """
    Return how fast one frame moves as another sees it, at a stamp.

    The twist of an edge on a spline is known, and the interval does not matter. Every other
    edge between the two is taken to move along one screw during the interval: the one from
    its pose at the beginning to that at the end (``se3.log``). These twists are carried down
    to the tracking frame by the edges' poses at the stamp. If every edge turns and goes at
    constant speed in its own axes, the answer is exact for any interval. Otherwise its error
    is quadratic in the interval, or linear if the data ends too soon to have the stamp in the
    middle. An edge must turn by less than half a turn in the interval.

    :param tree: a buffer or a snapshot.
    :param stamp: nanoseconds; ``LATEST`` for the newest possible.
    :param averaging_interval: nanoseconds, with the stamp in the middle; moved to lie
        inside the data, and cut where there is less.
    :param reference_frame: whose axes the answer is in; None: the observation frame's.
    :param reference_point: metres; the linear velocity is that of the point of the
        moving body which is there at the stamp.
    :param reference_point_frame: the frame of that point; None: the tracking frame, so
        that with neither given it is the velocity of the tracking frame's origin.
    :raises InvalidArgumentException: an interval that is no positive integer.
    :raises TransformException: as ``lookup``, or where there is but one sample.
    """
    interval = _checked_interval(averaging_interval)
    stamp, _ = tree.lookup_stamped(observation_frame, tracking_frame, stamp)
    twist = _twist_at(tree, tracking_frame, observation_frame, stamp, interval,
                      reference_frame or observation_frame, reference_point,
                      reference_point_frame)
    return Velocity(stamp, twist[:3], twist[3:])


def _twist_at(tree: Queries, tracking_frame: str, observation_frame: str, stamp: int,
              interval: int, reference_frame: str, reference_point: Vector3,
              reference_point_frame: str | None) -> Screw:
    """Return it at a stamp, where 0 is a time."""
    frames, moving = _chain(tree, observation_frame, tracking_frame, stamp)
    twist = _AT_REST
    if moving:
        oldest, newest, length = _window(moving, interval)
        begin = min(max(stamp - length // 2, oldest), newest)
        for near, far in pairwise(frames):
            before, now, after = (tree.lookup_at(near, far, time)
                                  for time in (begin, stamp, begin + length))
            known = tree._twists_between(near, far, np.array([stamp]))
            if known is None:
                own = se3.log(se3.compose(se3.inverse(before), after))
                factor = NANOSECONDS_PER_SECOND / length
            else:
                own, factor = tuple(known[0].tolist()), 1.0
            twist = _plus(carry(se3.inverse(now), twist), own, factor)

    # If nothing moves between the two, LATEST comes to no time.
    look = tree.lookup_at if moving or stamp != LATEST else tree.lookup
    x, y, z, qx, qy, qz, qw = look(reference_frame, tracking_frame, stamp)
    px, py, pz = se3.apply(
        look(reference_frame, reference_point_frame or tracking_frame, stamp), reference_point)
    return carry((x - px, y - py, z - pz, qx, qy, qz, qw), twist)


def lookup_twist_many(tree: Queries, tracking_frame: str, observation_frame: str,
                      stamps: npt.ArrayLike, averaging_interval: int, *,
                      reference_frame: str | None = None, reference_point: Vector3 = ORIGIN,
                      reference_point_frame: str | None = None) -> Array:
    """
    Return the twists at many stamps, as ``lookup_twist`` would one by one.

    :param stamps: (N,) integer nanoseconds, in any order. 0 is a time here.
    :return: (N, 6): linear velocity, metres a second, and angular, radians a second.
    :raises TransformException: as ``lookup_many`` and ``lookup_twist`` do.
    """
    interval = _checked_interval(averaging_interval)
    frozen = tree.snapshot()
    axes = reference_frame or observation_frame
    frozen.lookup_many(observation_frame, tracking_frame, stamps)
    poses = frozen.lookup_many(axes, tracking_frame, stamps)
    points = frozen.lookup_many(axes, reference_point_frame or tracking_frame, stamps)
    times = frozen._stamps_of(stamps)
    twists = np.zeros((len(times), 6))
    if not len(times):
        return twists
    if frozen._tree.ways.was_rehung:
        return np.array([
            _twist_at(frozen, tracking_frame, observation_frame, time, interval, axes,
                      reference_point, reference_point_frame) for time in times.tolist()])
    frames, moving = _chain(frozen, observation_frame, tracking_frame, int(times[0]))
    if moving:
        oldest, newest, length = _window(moving, interval)
        begins = np.clip(times - length // 2, oldest, newest)
        for near, far in pairwise(frames):
            before, now, after = (frozen.lookup_many(near, far, when)
                                  for when in (begins, times, begins + length))
            own = frozen._twists_between(near, far, times)
            if own is None:
                own = se3.log_many(se3.compose_many(se3.inverse_many(before), after)) * (
                    NANOSECONDS_PER_SECOND / length)
            twists = carry_many(se3.inverse_many(now), twists) + own

    poses[:, :3] -= se3.apply_many(points, np.asarray(reference_point, dtype=float))
    return carry_many(poses, twists)


def _checked_interval(averaging_interval: int) -> int:
    interval = checked_stamp(averaging_interval)
    if interval <= 0:
        raise InvalidArgumentException(
            f'Invalid argument averaging_interval {interval}: it is a positive number of '
            'nanoseconds')
    return interval


def _chain(tree: Queries, first: str, last: str,
           stamp: int) -> tuple[list[str], list[EdgeInfo]]:
    """
    Return the frames from one to another, and those edges between them that move.

    The edges are today's if all of them have data for the stamp. Even if the frames hung
    elsewhere then, the poses between neighbours still multiply to the pose of the ends.
    Otherwise the edges are those of that time.
    """
    try:
        edges = tree._edges_between(last, first, None)
        known = all(edge.static or edge.oldest <= stamp <= edge.latest for edge in edges)
    except ConnectivityException:
        known = False
    if not known:
        edges = tree._edges_between(last, first, stamp)
    frames = [first]
    for edge in edges:
        frames.append(edge.parent if edge.child == frames[-1] else edge.child)
    return frames, [edge for edge in edges if not edge.static]


def _window(moving: list[EdgeInfo], interval: int) -> tuple[int, int, int]:
    """
    Return the oldest and newest beginning that an interval may have, and its length.

    :raises ExtrapolationException: the edges have no two times in common.
    """
    last = min(moving, key=lambda edge: edge.latest)
    oldest = max(edge.oldest for edge in moving)
    if last.latest <= oldest:
        raise ExtrapolationException(
            f'A velocity takes two samples, and the edge {last.parent} -> {last.child} has none '
            f'after {format_stamp(oldest)}',
            blocked_on=tuple((edge.child, oldest + 1) for edge in moving
                             if edge.latest <= oldest))
    length = min(interval, last.latest - oldest)
    return oldest, last.latest - length, length


def _plus(a: Screw, b: Screw, factor: float) -> Screw:
    """Return a + factor b."""
    ax, ay, az, au, av, aw = a
    bx, by, bz, bu, bv, bw = b
    return (ax + factor * bx, ay + factor * by, az + factor * bz,
            au + factor * bu, av + factor * bv, aw + factor * bw)
