# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Velocities of ``core.twist`` as messages."""

from geometry_msgs.msg import Twist, Vector3, VelocityStamped
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.twist import Velocity

from ..messages.convert import time_message


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
