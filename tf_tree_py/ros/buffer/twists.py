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

"""Velocities of ``core.twist`` as messages."""

from geometry_msgs.msg import Twist, Vector3, VelocityStamped
from std_msgs.msg import Header
from tf_tree_py.core.twist import Velocity

from ..messages.convert import time_message


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
