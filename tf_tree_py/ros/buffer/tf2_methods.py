# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The methods of ``tf2_py.BufferCore`` under their own names, in messages and ROS times."""

from collections.abc import Callable
from typing import Any, cast, SupportsIndex

from geometry_msgs.msg import (
    TransformStamped,
    Twist,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    VelocityStamped,
)
import numpy.typing as npt
from rclpy.clock_type import ClockType
from rclpy.time import Time
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.twist import lookup_twist, lookup_twist_many, ORIGIN, Velocity
from tf_tree_py.beyond.motion.uncertain_twist import lookup_twist_uncertain
from tf_tree_py.buffer_core import BufferCore, Snapshot
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.times import checked_stamp, Stamp
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.reports import plain_text

from .answers import answered
from ..messages.convert import (
    as_nanoseconds,
    as_span,
    as_stamp,
    DurationLike,
    SpanLike,
    time_message,
    TimeLike,
    transform_stamped,
)


def _checked_ros_stamp(stamp: Stamp | TimeLike, is_simulated: Callable[[], bool]) -> int:
    """
    Return a caller's stamp: one that the core accepts, or a ``Time`` of rclpy or of a message.

    :param is_simulated: returns whether ROS time differs from the system's.
    :raises InvalidArgumentException: none of these, or a time of another clock.
    """
    if isinstance(stamp, Time) or hasattr(stamp, 'nanosec'):
        return as_stamp(stamp, is_simulated)
    return checked_stamp(stamp)


def _as_limit(max_age: SupportsIndex | SpanLike) -> SupportsIndex | None:
    """Return a caller's limit, which may be a duration, as the core accepts it."""
    if hasattr(max_age, 'nanoseconds') or hasattr(max_age, 'nanosec'):
        return as_span(max_age, 'max_age')
    return cast('SupportsIndex | None', max_age)


class RosSnapshot(Snapshot):
    """A buffer's contents at one moment, with lookups by ROS times."""

    def __init__(self, tree: Tree, simulated: bool) -> None:
        """
        Take a tree that does not change any more.

        :param simulated: whether time was simulated then.
        """
        super().__init__(tree)
        self._simulated = simulated

    def _stamp_of(self, stamp: Stamp | TimeLike) -> int:
        return _checked_ros_stamp(stamp, lambda: self._simulated)

    def checked_limit(self, max_age: SupportsIndex | SpanLike, *,
                      is_used: bool = True) -> int | None:
        """Return a limit as a plain int; it may also be a ``Duration``."""
        return super().checked_limit(_as_limit(max_age), is_used=is_used)


# --- velocities

def velocity_stamped(velocity: Velocity, tracking_frame: str, observation_frame: str,
                     reference_frame: str | None = None) -> VelocityStamped:
    """
    Return a velocity as a message.

    Its ``body_frame_id`` is the moving frame, ``reference_frame_id`` the frame it moves relative
    to (tf2 leaves it empty), and ``header.frame_id`` the frame of the axes.

    :param reference_frame: the argument of ``lookup_twist``.
    """
    header = Header(stamp=time_message(velocity.stamp),
                    frame_id=reference_frame or observation_frame)
    linear, angular = (Vector3(x=x, y=y, z=z) for x, y, z in (velocity.linear, velocity.angular))
    return VelocityStamped(header=header, body_frame_id=tracking_frame,
                           reference_frame_id=observation_frame,
                           velocity=Twist(linear=linear, angular=angular))


# --- tf2's methods

class CoreApi(BufferCore):
    """The methods of tf2_py, and twists: lookups that never wait, and listings."""

    def _is_simulated(self) -> bool:
        """Return whether stamps follow another clock than the system's."""
        return False

    def _as_stamp(self, time: TimeLike) -> int:
        return as_stamp(time, self._is_simulated)

    def _stamp_of(self, stamp: Stamp | TimeLike) -> int:
        return _checked_ros_stamp(stamp, self._is_simulated)

    def checked_limit(self, max_age: SupportsIndex | SpanLike, *,
                      is_used: bool = True) -> int | None:
        """Return a limit as a plain int; it may also be a ``Duration``."""
        return super().checked_limit(_as_limit(max_age), is_used=is_used)

    def snapshot(self) -> RosSnapshot:
        """
        Return a copy of the present contents, for several lookups that must agree.

        Ages in it are those at the present time.
        """
        return cast(RosSnapshot, super().snapshot())

    def _snapshot_of(self, tree: Tree) -> RosSnapshot:
        return RosSnapshot(tree, self._is_simulated())

    def lookup_transform_core(self, target_frame: str, source_frame: str,
                              time: TimeLike) -> TransformStamped:
        """Return the transform from source to target, or raise at once."""
        stamp, pose = self.lookup_stamped(target_frame, source_frame, self._as_stamp(time))
        return transform_stamped(target_frame, source_frame, stamp, pose)

    def lookup_transform_full_core(self, target_frame: str, target_time: TimeLike,
                                   source_frame: str, source_time: TimeLike,
                                   fixed_frame: str) -> TransformStamped:
        """Return the transform between two times, or raise at once."""
        stamp, pose = self.lookup_full_stamped(
            target_frame, self._as_stamp(target_time), source_frame,
            self._as_stamp(source_time), fixed_frame)
        return transform_stamped(target_frame, source_frame, stamp, pose)

    def can_transform_core(self, target_frame: str, source_frame: str,
                           time: TimeLike) -> tuple[bool, str]:
        """Return whether the lookup would succeed, and the reason if not."""
        return answered(
            lambda: self.lookup_stamped(target_frame, source_frame, self._as_stamp(time)))

    def can_transform_full_core(self, target_frame: str, target_time: TimeLike, source_frame: str,
                                source_time: TimeLike, fixed_frame: str) -> tuple[bool, str]:
        """Return whether the lookup between two times would succeed, and the reason if not."""
        return answered(lambda: self.lookup_transform_full_core(
            target_frame, target_time, source_frame, source_time, fixed_frame))

    def lookup_twist(self, tracking_frame: str, observation_frame: str, time: TimeLike,
                     averaging_interval: DurationLike, *, reference_frame: str | None = None,
                     reference_point: so3.Vector3 = ORIGIN,
                     reference_point_frame: str | None = None) -> VelocityStamped:
        """
        Return the velocity of one frame relative to another.

        See ``beyond.motion.twist.lookup_twist``.

        :param time: an rclpy ``Time``, or a message's; zero is the latest.
        :param averaging_interval: an rclpy ``Duration``.
        """
        velocity = lookup_twist(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), reference_frame=reference_frame,
            reference_point=reference_point, reference_point_frame=reference_point_frame)
        return velocity_stamped(velocity, tracking_frame, observation_frame, reference_frame)

    def lookup_twist_uncertain(self, tracking_frame: str, observation_frame: str, time: TimeLike,
                               averaging_interval: DurationLike,
                               **reference: Any) -> TwistWithCovarianceStamped:
        """
        Return a velocity with the covariance that follows from the noise of the samples.

        See ``beyond.motion.uncertain_twist.lookup_twist_uncertain``.

        :param time: an rclpy ``Time``, or a message's; zero is the latest.
        :param averaging_interval: an rclpy ``Duration``.
        :param reference: the keyword arguments of ``lookup_twist``.
        :return: a message; its ``header.frame_id`` is the frame of the axes.
        """
        velocity, covariance = lookup_twist_uncertain(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), **reference)
        message = velocity_stamped(velocity, tracking_frame, observation_frame,
                                   reference.get('reference_frame'))
        return TwistWithCovarianceStamped(header=message.header, twist=TwistWithCovariance(
            twist=message.velocity, covariance=covariance.ravel()))

    def lookup_twist_many(self, tracking_frame: str, observation_frame: str, stamps: npt.ArrayLike,
                          averaging_interval: DurationLike, **reference: Any) -> Array:
        """
        Return the twists at many stamps; see ``beyond.motion.twist.lookup_twist_many``.

        :param stamps: (N,) integer nanoseconds.
        :param averaging_interval: an rclpy ``Duration``.
        :param reference: the keyword arguments of ``lookup_twist``.
        :return: (N, 6): linear velocity, metres a second, and angular, radians a second.
        """
        return lookup_twist_many(self, tracking_frame, observation_frame, stamps,
                                 as_nanoseconds(averaging_interval), **reference)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """
        Return the newest time for which all edges between two frames have data.

        :raises InvalidArgumentException: it is before 1970, and rclpy has no such ``Time``;
            ``latest_common_time`` returns it.
        """
        # In simulated time a clock type that lookups accept; otherwise tf2's, for comparisons.
        clock_type = ClockType.ROS_TIME if self._is_simulated() else ClockType.SYSTEM_TIME
        stamp = self.latest_common_time(target_frame, source_frame)
        if stamp < 0:
            raise InvalidArgumentException(
                f'The latest common time of {target_frame!r} and {source_frame!r} is '
                f'{format_stamp(stamp)} s, and a Time of rclpy cannot be negative',
                hint='latest_common_time() returns it in nanoseconds. Most likely a publisher has '
                     'a broken clock')
        return Time(nanoseconds=stamp, clock_type=clock_type)

    def all_frames_as_yaml(self) -> str:
        """Return the stored data of every edge, in tf2's format."""
        return plain_text.as_yaml(self.edges(), self.frames())

    def all_frames_as_string(self) -> str:
        """Return every frame that was ever a child, and its parent, one a line, as tf2 does."""
        with self._lock:
            children = [frame for frame in self._tree.frames if frame in self._tree.histories]
            return plain_text.as_string(children, super().edges())
