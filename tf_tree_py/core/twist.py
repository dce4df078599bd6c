"""
How fast a frame moves, out of the poses in a buffer.

``lookup_twist`` is right for frames that turn; ``lookup_velocity`` repeats what
tf2's ``lookupVelocity`` computes, for code that was tuned to it.
"""

from itertools import pairwise
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    TransformException,
)
from .geometry import se3, so3
from .geometry.screws import carry, carry_many, Screw
from .geometry.so3 import Array, Quaternion, Vector3
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

    Each edge between the two is taken to move along one screw during the interval,
    the one from its pose at the beginning to that at the end (``se3.log``), and these
    twists are carried down to the tracking frame by the edges' poses at the stamp.
    So the answer is exact, not only in the limit, where every edge turns and goes at
    constant speed in its own axes, however fast the others turn; elsewhere its error
    is quadratic in the interval, and linear where the data ends too soon to have the
    stamp in the middle. An edge must turn by less than half a turn in it.

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
    frames, moving = _chain(tree, observation_frame, tracking_frame, stamp)
    twist = _AT_REST
    if moving:
        oldest, newest, length = _window(moving, interval)
        begin = min(max(stamp - length // 2, oldest), newest)
        for near, far in pairwise(frames):
            before, now, after = (tree.lookup_at(near, far, time)
                                  for time in (begin, stamp, begin + length))
            own = se3.log(se3.compose(se3.inverse(before), after))
            twist = _plus(carry(se3.inverse(now), twist), own, NANOSECONDS_PER_SECOND / length)

    # The stamp may have come to 0, a time here; or to none, where nothing moves.
    look = tree.lookup_at if moving or stamp != LATEST else tree.lookup
    axes = reference_frame or observation_frame
    x, y, z, qx, qy, qz, qw = look(axes, tracking_frame, stamp)
    px, py, pz = se3.apply(
        look(axes, reference_point_frame or tracking_frame, stamp), reference_point)
    twist = carry((x - px, y - py, z - pz, qx, qy, qz, qw), twist)
    return Velocity(stamp, twist[:3], twist[3:])


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
    frames, moving = _chain(frozen, observation_frame, tracking_frame, int(times[0]))
    if moving:
        oldest, newest, length = _window(moving, interval)
        begins = np.clip(times - length // 2, oldest, newest)
        for near, far in pairwise(frames):
            before, now, after = (frozen.lookup_many(near, far, when)
                                  for when in (begins, times, begins + length))
            own = se3.log_many(se3.compose_many(se3.inverse_many(before), after))
            twists = (carry_many(se3.inverse_many(now), twists)
                      + own * (NANOSECONDS_PER_SECOND / length))

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

    As they hang on each other now, and if nothing joins them now, as they hung at a stamp.
    Where they hung otherwise at the time of a lookup, the poses between neighbours in this
    list still multiply to the one of its ends.
    """
    try:
        edges = tree._edges_between(last, first, None)
    except ConnectivityException:
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


# --- as tf2 has it


def lookup_velocity(tree: Queries, tracking_frame: str, observation_frame: str, stamp: int,
                    averaging_interval: int, *, reference_frame: str | None = None,
                    reference_point: Vector3 = ORIGIN,
                    reference_point_frame: str | None = None) -> Velocity:
    """
    Return what tf2's ``lookupVelocity`` does, its errors included; see ``lookup_twist``.

    It differs from the truth where frames turn: the displacement, which is already in
    the observation frame's axes, is turned by reference_R_tracking once more; the
    velocity is that of the body's point at the reference frame's origin, so that a
    frame that spins in place three metres away has one; and the lever to the reference
    point is multiplied element by element, where it takes a cross product. Times go
    through float seconds, rounded as in Jazzy, which may put the newest stamp of today's
    clocks some 100 ns beyond the data. ``LATEST`` gives the velocity at the time 0.

    Equal to Jazzy's to 1e-9 while a frame turns by more than 1e-6 rad in the interval:
    of what turns less the arc cosine returns rounding, in both, and not the same.

    :param stamp: nanoseconds, the middle of the interval unless the data ends before.
    :param averaging_interval: nanoseconds.
    :raises TransformException: as ``lookup`` does.
    """
    reference_frame = reference_frame or observation_frame
    reference_point_frame = reference_point_frame or tracking_frame
    try:
        latest_s = _as_float_seconds(tree.latest_common_time(observation_frame, tracking_frame))
    except TransformException:
        latest_s = 0.0  # The lookups say why.
    stamp_s, interval_s = _as_float_seconds(stamp), averaging_interval / 1e9
    end_s = min(stamp_s + interval_s * 0.5, latest_s)
    start_s = max(0.00001 + interval_s, end_s) - interval_s
    start = tree.lookup(observation_frame, tracking_frame, _from_float_seconds(start_s))
    end = tree.lookup(observation_frame, tracking_frame, _from_float_seconds(end_s))
    rate = 1.0 / (end_s - start_s) if end_s != start_s else math.nan
    turn = _tf2_rotation_vector(so3.multiply(so3.conjugate(start.rotation), end.rotation))
    wx, wy, wz = so3.rotate(start.rotation, turn)
    twist = ((end.x - start.x) * rate, (end.y - start.y) * rate, (end.z - start.z) * rate,
             wx * rate, wy * rate, wz * rate)

    time = _from_float_seconds(stamp_s)
    pose = tree.lookup(reference_frame, tracking_frame, time)
    vx, vy, vz, wx, wy, wz = carry(pose, twist)
    px, py, pz = se3.apply(
        tree.lookup(reference_frame, reference_point_frame, time), reference_point)
    linear = (vx + wx * (px - pose.x), vy + wy * (py - pose.y), vz + wz * (pz - pose.z))
    return Velocity(_from_float_seconds(start_s + interval_s * 0.5), linear, (wx, wy, wz))


def _as_float_seconds(stamp: int) -> float:
    """Return seconds, rounded as tf2's ``timeToSec`` does it: the two parts by themselves."""
    whole, rest = divmod(stamp, NANOSECONDS_PER_SECOND)
    return whole + 1e-9 * rest


def _from_float_seconds(seconds: float) -> int:
    """Return nanoseconds, rounded as tf2's ``timeFromSec`` does it."""
    whole = math.floor(seconds)
    return whole * NANOSECONDS_PER_SECOND + math.floor((seconds - whole) * 1e9 + 0.5)


def _tf2_rotation_vector(q: Quaternion) -> Vector3:
    """
    Return tf2's axis times tf2's angle, of the quaternion that tf2 makes of the matrix.

    Beyond 120 degrees w may be negative there, and then the angle is more than half a
    turn, the long way round.
    """
    x, y, z, w = so3.with_tf2_sign(q)
    square = 1.0 - w * w
    if square < 10.0 * np.finfo(float).eps:
        return (2.0 * math.acos(min(w, 1.0)), 0.0, 0.0)
    scale = 2.0 * math.acos(w) / math.sqrt(square)
    return (scale * x, scale * y, scale * z)
