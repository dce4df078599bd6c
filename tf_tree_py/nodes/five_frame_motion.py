# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The motion of the robot of five frames: world -> odom -> base_link -> {camera, gripper}.

This is the true motion, which the publisher sends. It does not need ROS. Every pose is a pure
function of the stamp, so the answers of lookups can be checked.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin, tau
from typing import NamedTuple

from tf_tree_py.core import Pose
from tf_tree_py.core.stamp import from_seconds

DRIFT_PERIOD = from_seconds(120.0)
ARM_PERIOD = from_seconds(4.0)


class Frames(NamedTuple):
    """The names of the five frames."""

    world: str = 'world'
    odom: str = 'odom'
    base_link: str = 'base_link'
    camera: str = 'camera'
    gripper: str = 'gripper'


@dataclass(frozen=True)
class FiveFrameMotion:
    """
    The pose of each frame in its parent, at a stamp in nanoseconds.

    x points forward, y left and z up, in the camera too (it is not an optical frame).

    :param radius: of the circle that the robot drives, metres.
    :param lap_time: the duration of one lap, nanoseconds.
    """

    radius: float = 2.0
    lap_time: int = from_seconds(20.0)

    base_link_T_camera = Pose.from_xyz_rpy(x=0.25, z=0.5, pitch=radians(15.0))
    """The camera is fixed at the front, and points forward and slightly down."""

    def world_T_odom(self, stamp: int) -> Pose:
        """Return the drift that a localiser corrects: slow, half a metre and three degrees."""
        phase = _phase(stamp, DRIFT_PERIOD)
        return Pose.from_xyz_rpy(
            x=0.5 * sin(phase), y=0.3 * cos(phase), yaw=radians(3.0) * sin(phase))

    def odom_T_base_link(self, stamp: int) -> Pose:
        """Return the pose of the robot on its circle around odom, facing along the tangent."""
        phase = _phase(stamp, self.lap_time)
        return Pose.from_xyz_rpy(
            x=self.radius * cos(phase), y=self.radius * sin(phase), yaw=phase + pi / 2)

    def base_link_T_gripper(self, stamp: int) -> Pose:
        """Return the pose of the gripper on an arm that reaches out and down, and swings."""
        phase = _phase(stamp, ARM_PERIOD)
        return Pose.from_xyz_rpy(
            x=0.55 - 0.2 * cos(phase), y=0.2 * sin(phase), z=0.6 + 0.15 * cos(phase),
            pitch=0.6 - 0.4 * cos(phase), yaw=0.3 * sin(phase))

    def world_T_gripper(self, stamp: int) -> Pose:
        """Return the product of the whole chain at one stamp."""
        return (self.world_T_odom(stamp) @ self.odom_T_base_link(stamp)
                @ self.base_link_T_gripper(stamp))


def _phase(stamp: int, period: int) -> float:
    """Return the angle of a periodic motion. The remainder of integers is exact."""
    return tau * (stamp % period) / period
