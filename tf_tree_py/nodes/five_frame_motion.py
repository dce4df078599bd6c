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
How the robot of five frames moves: world -> odom -> base_link -> {camera, gripper}.

This is the truth that the publisher sends. It needs no ROS. Every pose is a pure
function of the stamp, so anybody can check the answer of a lookup.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin, tau
from typing import NamedTuple

from tf_tree_py.core import Pose
from tf_tree_py.core.stamp import from_seconds

DRIFT_PERIOD = from_seconds(120.0)
ARM_PERIOD = from_seconds(4.0)


class Frames(NamedTuple):
    """What the five frames are called."""

    world: str = 'world'
    odom: str = 'odom'
    base_link: str = 'base_link'
    camera: str = 'camera'
    gripper: str = 'gripper'


@dataclass(frozen=True)
class FiveFrameMotion:
    """
    Where each frame is in its parent, at a stamp in nanoseconds.

    x points forward, y left and z up, in the camera too (it is no optical frame).

    :param radius: of the circle that the robot drives, metres.
    :param lap_time: how long it takes once round, nanoseconds.
    """

    radius: float = 2.0
    lap_time: int = from_seconds(20.0)

    base_link_T_camera = Pose.from_xyz_rpy(x=0.25, z=0.5, pitch=radians(15.0))
    """The camera sits at the front and looks forward and a little down. It never moves."""

    def world_T_odom(self, stamp: int) -> Pose:
        """Return the drift that a localiser corrects: slow, half a metre and three degrees."""
        phase = _phase(stamp, DRIFT_PERIOD)
        return Pose.from_xyz_rpy(
            x=0.5 * sin(phase), y=0.3 * cos(phase), yaw=radians(3.0) * sin(phase))

    def odom_T_base_link(self, stamp: int) -> Pose:
        """Return where the robot is on its circle round odom; it looks along the tangent."""
        phase = _phase(stamp, self.lap_time)
        return Pose.from_xyz_rpy(
            x=self.radius * cos(phase), y=self.radius * sin(phase), yaw=phase + pi / 2)

    def base_link_T_gripper(self, stamp: int) -> Pose:
        """Return where the arm holds the gripper: it reaches out and down, and swings."""
        phase = _phase(stamp, ARM_PERIOD)
        return Pose.from_xyz_rpy(
            x=0.55 - 0.2 * cos(phase), y=0.2 * sin(phase), z=0.6 + 0.15 * cos(phase),
            pitch=0.6 - 0.4 * cos(phase), yaw=0.3 * sin(phase))

    def world_T_gripper(self, stamp: int) -> Pose:
        """Return the whole chain at one stamp."""
        return (self.world_T_odom(stamp) @ self.odom_T_base_link(stamp)
                @ self.base_link_T_gripper(stamp))


def _phase(stamp: int, period: int) -> float:
    """Return the angle of a periodic motion. The remainder of integers is exact."""
    return tau * (stamp % period) / period
