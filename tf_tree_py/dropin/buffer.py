# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The differences of tf2's buffers from this package's.

There are two classes, the setters return nothing, and there are the methods with a leading
underscore, which tf2's tools and some programs call. The reasons of ``can_transform`` are in
tf2's exact words, because some programs parse them. Velocities are as tf2's ``lookupVelocity``
computes them, its errors included, for code that was tuned to them;
``tf_tree_py.lookup_twist`` returns the correct ones.
"""

from collections.abc import Callable
from functools import partial
import math
import os
import threading
from typing import Any, TypeVar
import weakref

from geometry_msgs.msg import TransformStamped
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from rclpy.time import Time
from tf_tree_py.beyond.freshness.queries import NewestPose
from tf_tree_py.beyond.motion.twist import ORIGIN, Velocity
from tf_tree_py.core.errors import (
    ConnectivityException,
    FutureExtrapolationException,
    LookupException,
    PastExtrapolationException,
    TransformException,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Quaternion, Vector3
from tf_tree_py.core.hints import nothing_yet
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.many_stamps import ManyStampQueries
from tf_tree_py.reports import plain_text
from tf_tree_py.ros.buffer.answers import answered
from tf_tree_py.ros.buffer.interface import NO_TIME
from tf_tree_py.ros.messages.convert import as_nanoseconds, DurationLike, SpanLike, TimeLike
from tf_tree_py.ros.topics.joining_buffer import Buffer as OurBuffer
from tf_tree_py.ros.waiting.futures import TransformFuture
from tf_tree_py.screws import carry

from .spinning_thread import SpinningThread

Answer = TypeVar('Answer')
_CatchUp = weakref.WeakMethod[Callable[[float], None]]

VARIABLE = 'TF_TREE_MAX_AGE'
"""The environment variable with the default ``max_age`` of buffers, seconds."""

_LONGEST_AGE_S = 1e9

# How long a lookup waits for the listener's thread, which needs far less unless the processor is
# busy.
LONGEST_S = 0.05


def _tf2_text(error: TransformException) -> str:
    """Return the text of tf2's ``can_transform`` for an error; this package's if tf2 has none."""
    if isinstance(error, LookupException):
        return (f'Invalid frame ID {error.describe()}'
                .replace('lookupTransform', 'canTransform')
                .replace(' does not exist', ' - frame does not exist'))
    if isinstance(error, ConnectivityException):
        return (f"Could not find a connection between '{error.target_frame}' and "
                f"'{error.source_frame}' because they are not part of the same tree."
                'Tf has two or more unconnected trees.')
    if isinstance(error, FutureExtrapolationException) and error.latest is not None:
        return _extrapolation(error, 'the future', 'latest', error.latest)
    if isinstance(error, PastExtrapolationException) and error.oldest is not None:
        return _extrapolation(error, 'the past', 'earliest', error.oldest)
    return error.describe()


def _extrapolation(error: FutureExtrapolationException | PastExtrapolationException,
                   where: str, which: str, stamp: int) -> str:
    assert error.requested is not None
    return (f'Lookup would require extrapolation into {where}.  Requested time '
            f'{_seconds(error.requested)} but the {which} data is at time {_seconds(stamp)}, when '
            f'looking up transform from frame [{error.source_frame}] to frame '
            f'[{error.target_frame}]')


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.6f}'


# --- velocities

def lookup_velocity(tree: ManyStampQueries, tracking_frame: str, observation_frame: str,
                    stamp: int, averaging_interval: int, *, reference_frame: str | None = None,
                    reference_point: Vector3 = ORIGIN,
                    reference_point_frame: str | None = None) -> Velocity:
    """
    Return the result of tf2's ``lookupVelocity``; the parameters are those of ``lookup_twist``.

    It is wrong where frames rotate: the displacement, which is already in the observation frame's
    axes, is rotated by reference_R_tracking once more; the velocity is that of the body's point at
    the reference frame's origin, so that a frame that spins in place three metres away has one;
    and the lever to the reference point is multiplied element by element, instead of by a cross
    product. Times are converted to float seconds, rounded as in Jazzy, which may put the newest
    stamp of today's clocks some 100 ns beyond the data. ``LATEST`` gives the velocity at the time
    0.

    It equals Jazzy's to 1e-9 if a frame rotates by more than 1e-6 rad in the interval. For smaller
    rotations the arc cosine returns rounding errors in both, which differ.

    :param stamp: nanoseconds, the middle of the interval unless the data ends before.
    :param averaging_interval: nanoseconds.
    :raises TransformException: as ``lookup`` does.
    """
    reference_frame = reference_frame or observation_frame
    reference_point_frame = reference_point_frame or tracking_frame
    try:
        latest_s = _as_float_seconds(tree.latest_common_time(observation_frame, tracking_frame))
    except TransformException:
        latest_s = 0.0  # the lookups raise the reason
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
    """Return seconds, rounded as in tf2's ``timeToSec``: the two parts separately."""
    whole, rest = divmod(stamp, NANOSECONDS_PER_SECOND)
    return whole + 1e-9 * rest


def _from_float_seconds(seconds: float) -> int:
    """Return nanoseconds, rounded as in tf2's ``timeFromSec``."""
    whole = math.floor(seconds)
    return whole * NANOSECONDS_PER_SECOND + math.floor((seconds - whole) * 1e9 + 0.5)


def _tf2_rotation_vector(q: Quaternion) -> Vector3:
    """
    Return tf2's axis times tf2's angle, of the quaternion that tf2 makes from the matrix.

    Beyond 120 degrees w may be negative there; the angle is then more than half a turn.
    """
    x, y, z, w = so3.with_tf2_sign(q)
    square = 1.0 - w * w
    if square < 10.0 * np.finfo(float).eps:
        return (2.0 * math.acos(min(w, 1.0)), 0.0, 0.0)
    scale = 2.0 * math.acos(w) / math.sqrt(square)
    return (scale * x, scale * y, scale * z)


# --- the buffers

class BufferCore(OurBuffer):
    """``tf2_py.BufferCore``; the log and ``statistics()`` show the refused transforms."""

    def __init__(self, cache_time: Duration | None = None, node: Node | None = None,
                 **options: Any) -> None:
        """
        Make an empty buffer.

        :param cache_time: the length of the history of each edge; 10 s unless given.
        :param options: those of ``tf_tree_py.Buffer``; ``max_age`` is that of the environment
            variable ``TF_TREE_MAX_AGE``, in seconds, unless it is given.
        :raises ValueError: the variable is not a number of seconds.
        """
        if 'max_age' not in options:
            options['max_age'] = _max_age()
        super().__init__(cache_time, node, **options)
        self._spinning_threads: dict[SpinningThread, _CatchUp] = {}
        self.timeouts.call_back = self._call_back
        # tf2's timeouts end also where no node publishes /clock.
        self.timeouts.by_wall = True

    def _nothing_yet(self) -> str:
        # tf2's own kind of listener does not register with the buffer.
        return nothing_yet()

    def set_transform(self, transform: TransformStamped,  # type: ignore[override]
                      authority: str) -> None:
        """Insert a moving transform."""
        super().set_transform(transform, authority)

    def set_transform_static(self, transform: TransformStamped,  # type: ignore[override]
                             authority: str) -> None:
        """Insert a transform that is valid at all times."""
        super().set_transform_static(transform, authority)

    def insert_batch(self, *batch: Any, **options: Any) -> list[Incident]:
        """Insert a batch that a listener received, and let ``rclpy.spin_once`` return."""
        try:
            return super().insert_batch(*batch, **options)
        finally:
            for thread in list(self._spinning_threads):
                thread.message_arrived()

    def _is_simulated(self) -> bool:
        # tf2 only reads the nanoseconds of a Time, so its programs use any clock type.
        return False

    # --- as if the program's thread read the transforms

    def lookup_stamped(self, *question: object) -> tuple[int, PoseTuple]:
        """Return the stamp and the pose; see ``Queries``."""
        return self._caught_up(super().lookup_stamped, *question)

    def lookup_full_stamped(self, *question: object) -> tuple[int, PoseTuple]:
        """Return the stamp and the pose between two times; see ``Queries``."""
        return self._caught_up(super().lookup_full_stamped, *question)

    def _lookup_no_older(self, *question: object) -> tuple[int, PoseTuple]:
        return self._caught_up(super()._lookup_no_older, *question)

    def _lookup_newest(self, *question: object) -> NewestPose:
        return self._caught_up(super()._lookup_newest, *question)

    def _caught_up(self, lookup: Callable[..., Answer], *question: object) -> Answer:
        """
        Look up again if what is missing may have arrived.

        In tf2 the thread that calls a program's callbacks has read the transforms that were sent
        before. Here another thread reads them, and may be a moment behind.
        """
        try:
            return lookup(*question)
        except TransformException as error:
            # A thread that holds the lock waits for data, and others could not insert any. What
            # observers see is looked up once.
            is_held = self.waiting.lock._is_owned()  # type: ignore[attr-defined]
            if error.blocked_on is None or is_held or self.observers.watches_lookups():
                raise
        for reference in list(self._spinning_threads.values()):
            catch_up = reference()
            if catch_up is not None:
                catch_up(LONGEST_S)
        return lookup(*question)

    def _wait(self, duration: int, query: Callable[[], Answer]) -> Answer:
        try:
            return query()  # without the lock, so that it catches up
        except TransformException as error:
            if error.blocked_on is None:
                raise
        return super()._wait(duration, query)

    def join_spinning_thread(self, node: Node, catch_up: _CatchUp, *,
                             wake_always: bool) -> Callable[[], None]:
        """
        Make calls in the thread that spins a listener's node, as tf2 does.

        :param catch_up: a method of the listener, which the buffer must not keep alive: it waits
            until what has arrived is inserted, for some seconds at most.
        :param wake_always: see ``SpinningThread``: some programs wait for a transform in a loop of
            ``rclpy.spin_once(node)``.
        :return: a function that stops this.
        """
        thread = SpinningThread(node, wake_always=wake_always,
                                is_notified=not self.is_shared)
        self._spinning_threads[thread] = catch_up

        def leave() -> None:
            self._spinning_threads.pop(thread, None)
            thread.end()

        return leave

    def _call_back(self, future: TransformFuture, callback: Callable[[Future], object]) -> None:
        """
        Call a callback of a future, in the thread in which tf2 would call it.

        The thread that inserted a transform itself makes its calls itself. tf2's futures do not
        end when ROS shuts down, so their callbacks are not called then.
        """
        if not self._is_ours(threading.current_thread()):
            callback(future)
            return
        if future.released:
            return
        call = partial(callback, future)
        if not any(thread.call(call) for thread in list(self._spinning_threads)):
            call()

    def _is_ours(self, thread: threading.Thread) -> bool:
        return self.feeds.deliver_in(thread) or self.timeouts.alarms.run_in(thread)

    # --- results as in tf2

    def can_transform_core(  # type: ignore[override]  # 1 or 0, as in tf2
            self, target_frame: str, source_frame: str, time: TimeLike) -> tuple[int, str]:
        """Return whether the lookup would succeed, as 1 or 0, and the reason if not."""
        return _answered(lambda: self.lookup_transform_core(target_frame, source_frame, time))

    def can_transform_full_core(  # type: ignore[override]  # likewise
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str) -> tuple[int, str]:
        """Return whether the lookup between two times would succeed, 1 or 0, and the reason."""
        return _answered(lambda: self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame))

    def can_transform(  # type: ignore[override]  # likewise
            self, target_frame: str, source_frame: str, time: TimeLike,
            timeout: DurationLike = NO_TIME, return_debug_tuple: bool = False, *,
            max_age: SpanLike = None) -> bool | tuple[int, str]:
        """Return whether a lookup would succeed, or the result of ``can_transform_core``."""
        can = super().can_transform(target_frame, source_frame, time, timeout, max_age=max_age)
        if not return_debug_tuple:
            return bool(can)
        return (1, '') if can else _answered(lambda: self.lookup_transform(
            target_frame, source_frame, time, max_age=max_age))

    def can_transform_full(  # type: ignore[override]  # likewise
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str, timeout: DurationLike = NO_TIME,
            return_debug_tuple: bool = False) -> bool | tuple[int, str]:
        """Return whether a lookup between two times would succeed, likewise."""
        times = (target_frame, target_time, source_frame, source_time, fixed_frame)
        can = super().can_transform_full(*times, timeout)
        if not return_debug_tuple:
            return bool(can)
        return (1, '') if can else self.can_transform_full_core(*times)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """
        Return the newest time for which all edges between two frames have data.

        :raises TransformException: the frames are not connected; the base class, as in tf2.
        """
        try:
            return super().get_latest_common_time(target_frame, source_frame)
        except ConnectivityException as error:
            raise TransformException(error.describe(), hint=error.hint) from None

    # --- methods of tf2 only

    def lookupVelocityCore(self, tracking_frame: str, observation_frame: str, time: TimeLike,
                           averaging_interval: DurationLike) -> tuple[Vector3, Vector3]:
        """
        Return linear and angular velocity as tf2 computes them, its errors included.

        ``lookup_twist`` is correct also where frames rotate.
        """
        velocity = lookup_velocity(self, tracking_frame, observation_frame,
                                   self._as_stamp(time), as_nanoseconds(averaging_interval))
        return velocity.linear, velocity.angular

    def lookupVelocityFullCore(self, tracking_frame: str, observation_frame: str,
                               reference_frame: str, reference_point: Vector3,
                               reference_point_frame: str, time: TimeLike,
                               averaging_interval: DurationLike) -> tuple[Vector3, Vector3]:
        """Return the velocity of a point, in the axes of a reference frame, likewise."""
        velocity = lookup_velocity(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), reference_frame=reference_frame,
            reference_point=reference_point, reference_point_frame=reference_point_frame)
        return velocity.linear, velocity.angular

    def _allFramesAsDot(self, time: TimeLike | None = None) -> str:
        return plain_text.as_dot(self.edges())

    def _frameExists(self, frame_id: str) -> bool:
        return frame_id in self.frames()

    def _getFrameStrings(self) -> list[str]:
        return self.frames()

    def _chain(self, target_frame: str, target_time: TimeLike, source_frame: str,
               source_time: TimeLike, fixed_frame: str) -> list[str]:
        """Return the frames from the source through the fixed one to the target."""
        to_fixed = self.frames_between(fixed_frame, source_frame, self._as_stamp(source_time))
        return to_fixed[:-1] + self.frames_between(
            target_frame, fixed_frame, self._as_stamp(target_time))


class Buffer(BufferCore):
    """``tf2_ros.Buffer``."""


def _max_age() -> Duration | None:
    """Return the limit that the environment sets; None: there is none."""
    given = os.environ.get(VARIABLE)
    if not given:
        return None
    try:
        seconds = float(given)
    except ValueError:
        seconds = math.nan
    if not 1e-9 <= seconds < _LONGEST_AGE_S:
        raise ValueError(f'{VARIABLE} has to be a number of seconds, such as 0.5, and not '
                         f'{given!r}')
    return Duration(seconds=seconds)


def _answered(lookup: Callable[[], object]) -> tuple[int, str]:
    found, reason = answered(lookup, _tf2_text)
    return int(found), reason
