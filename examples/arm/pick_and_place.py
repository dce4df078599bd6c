# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Pick a red block and place it in a tray, step by step as in a textbook.

The camera detects the block in its own frame, at the time of its image. The arm is
commanded in the frame `world`, some time later. The transform tree connects the two.
"""

from math import atan2, pi

import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core import from_seconds, Pose

from .cell import Cell, CLOSED, OPEN
from .image import Image
from .kinematics import Kinematics, REST
from .perception import find_block
from .scene import BLOCK_SIZE, TRAY

LOOKOUT, LOOKED = REST + np.outer((-1.3, 1.2), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
"""Looking for the block the arm turns from the one to the other, about its base."""
LOOKING_SPEED, SPEED, SLOW = 0.8, 1.2, 0.4
"""Of the fastest joint, radians a second."""

LATENCY = from_seconds(0.1)
"""How long perception takes; the arm moves on meanwhile."""

_ABOVE = 0.12
_GRASP = -BLOCK_SIZE[2] / 2
_TRAY_T_TOP = Pose(z=0.0125 + BLOCK_SIZE[2])
_GRIP_S, _SETTLE_S = 0.5, 0.5


class NothingFound(Exception):
    """The block was not detected in any image."""


def look(cell: Cell) -> tuple[Image, Pose]:
    """
    Turn until the block is detected; return an image, and camera_T_block at the image's stamp.

    When the result is available, the camera has moved on.
    """
    image = cell.take_image()
    for _ in cell.moving_to(LOOKED, LOOKING_SPEED):
        if cell.stamp == image.stamp + LATENCY:
            camera_T_block = find_block(image)
            if camera_T_block is not None:
                return image, camera_T_block
            image = cell.take_image()
    raise NothingFound('no image shows the block')


def locate(tree: BufferCore, image: Image, camera_T_block: Pose) -> Pose:
    """Return world_T_block, using the pose of the camera at the image's stamp."""
    world_T_camera = tree.lookup('world', 'camera', image.stamp)
    return world_T_camera @ camera_T_block


def pick(cell: Cell, kinematics: Kinematics, world_T_block: Pose) -> None:
    """Grasp the block across its width, and lift it."""
    go(cell, kinematics, gripper_at(world_T_block, _ABOVE), SPEED)
    go(cell, kinematics, gripper_at(world_T_block, _GRASP), SLOW)
    cell.grip(CLOSED)
    cell.wait(_GRIP_S)
    go(cell, kinematics, gripper_at(world_T_block, _ABOVE), SLOW)


def place(cell: Cell, kinematics: Kinematics) -> None:
    """Put the block in the gripper into the middle of the tray."""
    outwards = Pose.from_xyz_rpy(yaw=atan2(TRAY.y, TRAY.x))
    world_T_top = TRAY @ outwards @ _TRAY_T_TOP
    go(cell, kinematics, gripper_at(world_T_top, _ABOVE), SPEED)
    go(cell, kinematics, gripper_at(world_T_top, _GRASP), SLOW)
    cell.grip(OPEN)
    cell.wait(_GRIP_S)
    go(cell, kinematics, gripper_at(world_T_top, _ABOVE), SLOW)
    cell.wait(_SETTLE_S)


def gripper_at(world_T_top: Pose, height: float) -> Pose:
    """Return world_T_grasp at a height above a block's top: fingers down, wrist not twisted."""
    ahead = world_T_top @ (1.0, 0.0, 0.0) - world_T_top.translation
    # A block that is rotated by 180 degrees is the same block.
    turn = 0.0 if ahead @ world_T_top.translation > 0.0 else pi
    return world_T_top @ Pose.from_xyz_rpy(z=height, roll=pi, yaw=turn)


def go(cell: Cell, kinematics: Kinematics, world_T_grasp: Pose, speed: float) -> None:
    """Move the gripper to a pose."""
    for _ in cell.moving_to(kinematics.joints_for(world_T_grasp), speed):
        pass
