"""Velocities of ``core.twist`` in messages and ROS times."""

from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Twist, Vector3, VelocityStamped
import numpy.typing as npt
from std_msgs.msg import Header
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.twist import lookup_twist, lookup_twist_many, ORIGIN, Velocity

from ..messages.convert import as_nanoseconds, time_message


class TwistLookups(BufferCore):
    """The part of ``Buffer`` that tells how fast frames move."""

    _as_stamp: Callable[[Any], int]

    def lookup_twist(self, tracking_frame: str, observation_frame: str, time: Any,
                     averaging_interval: Any, *, reference_frame: str | None = None,
                     reference_point: so3.Vector3 = ORIGIN,
                     reference_point_frame: str | None = None) -> VelocityStamped:
        """
        Return how fast one frame moves as another sees it; see ``core.twist.lookup_twist``.

        :param time: an rclpy ``Time``, or a message's; zero is the latest.
        :param averaging_interval: an rclpy ``Duration``.
        """
        velocity = lookup_twist(
            self, tracking_frame, observation_frame, self._as_stamp(time),
            as_nanoseconds(averaging_interval), reference_frame=reference_frame,
            reference_point=reference_point, reference_point_frame=reference_point_frame)
        return velocity_stamped(velocity, tracking_frame, observation_frame, reference_frame)

    def lookup_twist_many(self, tracking_frame: str, observation_frame: str,
                          stamps: npt.ArrayLike, averaging_interval: Any,
                          **reference: Any) -> so3.Array:
        """
        Return the twists at many stamps; see ``core.twist.lookup_twist_many``.

        :param stamps: (N,) integer nanoseconds.
        :param averaging_interval: an rclpy ``Duration``.
        :param reference: as ``lookup_twist`` has it.
        :return: (N, 6): linear velocity, metres a second, and angular, radians a second.
        """
        return lookup_twist_many(self, tracking_frame, observation_frame, stamps,
                                 as_nanoseconds(averaging_interval), **reference)


def velocity_stamped(velocity: Velocity, tracking_frame: str, observation_frame: str,
                     reference_frame: str | None = None) -> VelocityStamped:
    """
    Return a velocity as a message.

    Its ``body_frame_id`` is the frame that moves, ``reference_frame_id`` the one that
    it moves relative to (tf2 leaves it empty), and ``header.frame_id`` the one whose
    axes the numbers are in.

    :param reference_frame: as it was given to ``lookup_twist``.
    """
    header = Header(stamp=time_message(velocity.stamp),
                    frame_id=reference_frame or observation_frame)
    linear, angular = (Vector3(x=x, y=y, z=z) for x, y, z in (velocity.linear, velocity.angular))
    return VelocityStamped(header=header, body_frame_id=tracking_frame,
                           reference_frame_id=observation_frame,
                           velocity=Twist(linear=linear, angular=angular))
