# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The velocity of a frame, from the poses in a buffer.

The results are also correct for rotating frames. The drop-in package computes velocities as
tf2 does, including its faults.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.core.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
)
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import format_stamp, LATEST, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, Stamp, Stamps, StampsLike
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.many_stamps import ends_of, ManyStampQueries
from tf_tree_py.screws import carry, carry_many, Screw

ORIGIN: Vector3 = (0.0, 0.0, 0.0)
_AT_REST: Screw = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Velocity(NamedTuple):
    """
    The velocity of a frame.

    :ivar stamp: nanoseconds.
    :ivar linear: metres per second.
    :ivar angular: radians per second, in the same axes.
    """

    stamp: int
    linear: Vector3
    angular: Vector3


# --- the twist


def lookup_twist(tree: ManyStampQueries, tracking_frame: str, observation_frame: str, stamp: Stamp,
                 averaging_interval: int, *, reference_frame: str | None = None,
                 reference_point: Vector3 = ORIGIN,
                 reference_point_frame: str | None = None) -> Velocity:
    """
    Return the velocity of one frame relative to another, at a stamp.

    If an edge is a curve that provides its twist, such as a spline, that twist is used, and the
    interval does not matter. Every other edge between the two is assumed to move along one
    screw during the interval: from its pose at the beginning to that at the end (``screws.log``).
    These twists are transformed to the tracking frame by the edges' poses at the stamp. If the
    twist of every edge is constant in its own axes, the result is exact for any interval.
    Otherwise its error is quadratic in the interval, or linear if the data ends too early for
    the stamp to be in the middle. An edge must rotate by less than half a turn in the interval.

    :param tree: a buffer or a snapshot.
    :param stamp: nanoseconds; ``LATEST`` for the newest possible.
    :param averaging_interval: nanoseconds, with the stamp in the middle; it is moved to lie
        inside the data, and shortened if there is less data.
    :param reference_frame: the frame whose axes the result is in; None: the observation frame.
    :param reference_point: metres; the linear velocity is that of the point of the
        moving body that is there at the stamp.
    :param reference_point_frame: the frame of that point; None: the tracking frame. Without
        both arguments it is the velocity of the tracking frame's origin.
    :raises InvalidArgumentException: an interval that is not a positive integer.
    :raises TransformException: as in ``lookup``, or if an edge has only one sample.
    """
    interval = _checked_interval(averaging_interval)
    stamp, _ = tree.lookup_stamped(observation_frame, tracking_frame, stamp)
    twist = _twist_at(tree, tracking_frame, observation_frame, stamp, interval,
                      reference_frame or observation_frame, reference_point,
                      reference_point_frame)
    return Velocity(stamp, twist[:3], twist[3:])


def _twist_at(tree: ManyStampQueries, tracking_frame: str, observation_frame: str, stamp: int,
              interval: int, reference_frame: str, reference_point: Vector3,
              reference_point_frame: str | None) -> Screw:
    """Return the velocity at a stamp; 0 is a stamp like any other."""
    frames, moving = _chain(tree, observation_frame, tracking_frame, stamp)
    twist = _AT_REST
    if moving:
        begin, end = _interval(moving, stamp, interval)
        for near, far in pairwise(frames):
            before, now, after = (tree.lookup_at(near, far, time)
                                  for time in (begin, stamp, end))
            known = twists_between(tree, near, far, np.array([stamp]))
            if known is None:
                own = screws.log(se3.compose(se3.inverse(before), after))
                factor = NANOSECONDS_PER_SECOND / (end - begin)
            else:
                own, factor = tuple(known[0].tolist()), 1.0
            twist = screws.plus(carry(se3.inverse(now), twist), factor, own)

    # If all edges between the two are static, LATEST has no stamp.
    look = tree.lookup_at if moving or stamp != LATEST else tree.lookup
    x, y, z, qx, qy, qz, qw = look(reference_frame, tracking_frame, stamp)
    px, py, pz = se3.apply(
        look(reference_frame, reference_point_frame or tracking_frame, stamp), reference_point)
    return carry((x - px, y - py, z - pz, qx, qy, qz, qw), twist)


def lookup_twist_many(tree: ManyStampQueries, tracking_frame: str, observation_frame: str,
                      stamps: StampsLike, averaging_interval: int, *,
                      reference_frame: str | None = None, reference_point: Vector3 = ORIGIN,
                      reference_point_frame: str | None = None) -> Array:
    """
    Return the twists at many stamps, with the results of single calls of ``lookup_twist``.

    :param stamps: (N,) integer nanoseconds, in any order; 0 is a stamp like any other.
    :return: (N, 6): linear velocity, metres per second, and angular, radians per second.
    :raises TransformException: as in ``lookup_many`` and ``lookup_twist``.
    """
    interval = _checked_interval(averaging_interval)
    still = tree.snapshot()
    axes = reference_frame or observation_frame
    still.lookup_many(observation_frame, tracking_frame, stamps)
    poses = np.asarray(still.lookup_many(axes, tracking_frame, stamps))
    points = still.lookup_many(axes, reference_point_frame or tracking_frame, stamps)
    times = still._stamps_of(stamps)
    twists = np.zeros((len(times), 6))
    if not len(times):
        return twists
    if still._tree.paths.has_changed_parent:
        return np.array([
            _twist_at(still, tracking_frame, observation_frame, time, interval, axes,
                      reference_point, reference_point_frame) for time in times.tolist()])
    frames, moving = _chain(still, observation_frame, tracking_frame, int(times[0]))
    if moving:
        oldest, newest, length = _window(moving, interval)
        begins = np.clip(times - length // 2, oldest, newest)
        for near, far in pairwise(frames):
            before, now, after = (np.asarray(still.lookup_many(near, far, when))
                                  for when in (begins, times, begins + length))
            twists = after_edge(twists, before, now, after, length,
                                twists_between(still, near, far, times))

    poses[:, :3] -= points @ reference_point
    return carry_many(poses, twists)


def after_edge(twists: Array, before: Array, now: Array, after: Array, length: int,
               own: Array | None) -> Array:
    """
    Return the twists of frames in the axes of the next ones, with the motion of the edge.

    :param twists: (N, 6) of the frames before the edge.
    :param before: the edge's pose at the beginning of the interval, (N, 7); ``now``: at the
        stamp; ``after``: at the end.
    :param length: of the interval, nanoseconds.
    :param own: the twists of the edge, (N, 6), if it provides them.
    """
    if own is None:
        own = screws.log_many(se3.compose_many(se3.inverse_many(before), after)) * (
            NANOSECONDS_PER_SECOND / length)
    return carry_many(se3.inverse_many(now), twists) + own


def _checked_interval(averaging_interval: int) -> int:
    interval = checked_stamp(averaging_interval)
    if interval <= 0:
        raise InvalidArgumentException(
            f'Invalid argument averaging_interval {interval}: it must be a positive number of '
            'nanoseconds')
    return interval


def _chain(tree: ManyStampQueries, first: str, last: str,
           stamp: int) -> tuple[list[str], list[EdgeInfo]]:
    """
    Return the frames from one to another, and the moving edges between them.

    These are the current edges if all of them have data for the stamp. Even if the frames had
    other parents then, the product of the poses between neighbours is the pose of the ends.
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


def interval_at(tree: ManyStampQueries, tracking_frame: str, observation_frame: str, stamp: int,
                averaging_interval: int) -> tuple[int, int] | None:
    """Return the ends of the interval of a lookup that has an answer; None if nothing moves."""
    moving = _chain(tree, observation_frame, tracking_frame, stamp)[1]
    return _interval(moving, stamp, averaging_interval) if moving else None


def _interval(moving: list[EdgeInfo], stamp: int, length: int) -> tuple[int, int]:
    """Return the ends of the interval around a stamp."""
    oldest, newest, length = _window(moving, length)
    begin = min(max(stamp - length // 2, oldest), newest)
    return begin, begin + length


def _window(moving: list[EdgeInfo], interval: int) -> tuple[int, int, int]:
    """
    Return the oldest and newest possible beginning of an interval, and its length.

    :raises ExtrapolationException: the edges do not have two times in common.
    """
    last = min(moving, key=lambda edge: edge.latest)
    oldest = max(edge.oldest for edge in moving)
    if last.latest <= oldest:
        raise ExtrapolationException(
            f'A velocity requires two samples, and the edge {last.parent} -> {last.child} has '
            f'none after {format_stamp(oldest)}',
            blocked_on=tuple((edge.child, oldest + 1) for edge in moving
                             if edge.latest <= oldest))
    length = min(interval, last.latest - oldest)
    return oldest, last.latest - length, length


def twists_between(tree: ManyStampQueries, near: str, far: str, stamps: Stamps) -> Array | None:
    """
    Return the twist of a frame relative to its neighbour, (N, 6), in its own axes.

    :param stamps: (N,) for which there is data.
    :return: None if the edge between them has only poses.
    """
    with tree._lock:
        for child, parent in (far, near), (near, far):
            history = tree._tree.histories.get(child)
            if history is not None and history.fixed_parent and history.parent == parent:
                break
        else:
            return None
        twists = history.twists(stamps)
        if twists is None or child == far:
            return twists
        # The twist of the inverse is -Ad_A V: Lynch, Park, "Modern Robotics", section 3.3.
        return -carry_many(history.track(*ends_of(stamps)).at(stamps).T, twists)
