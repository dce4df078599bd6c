# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The error of detections by the arm's speed, with the right and with the wrong stamp."""

from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from math import dist, hypot
from typing import NamedTuple

from tf_tree_py.core import as_seconds, Pose

from .cell import Cell
from .mistakes import locate_at_latest
from .perception import find_block
from .pick_and_place import LATENCY, locate, LOOKED, LOOKOUT
from .scene import BLOCK_SIZE, Scene
from .tree import ArmTree

SPEEDS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
"""Of the joint that turns the arm, radians a second."""

_DETECTIONS = 6
_BLOCK = Pose.from_xyz_rpy(0.50, 0.05, BLOCK_SIZE[2] / 2, yaw=0.4)
RADIUS = hypot(_BLOCK.x, _BLOCK.y)
"""How far the block is from the axis about which the arm turns, metres."""


class Errors(NamedTuple):
    """The errors of one detection, metres, by the stamp of the lookup."""

    stamped: float
    latest: float


def law(speed: float) -> float:
    """
    Return the error with the latest transform, metres: speed at the block times latency.

    :param speed: metres a second.
    """
    return speed * as_seconds(LATENCY)


def errors_at(speed: float) -> list[Errors]:
    """Turn over a block, and locate it in the first images in which it is visible."""
    with closing(Cell(Scene(_BLOCK, []), LOOKOUT)) as cell:
        return list(islice(_errors(cell, ArmTree(cell), speed), _DETECTIONS))


def _errors(cell: Cell, tree: ArmTree, speed: float) -> Iterator[Errors]:
    image = cell.take_image()
    for _ in cell.moving_to(LOOKED, speed):
        if cell.stamp == image.stamp + LATENCY:
            camera_T_block = find_block(image)
            if camera_T_block is not None:
                top = cell.world_T_top().translation
                seen = [way(tree, image, camera_T_block) for way in (locate, locate_at_latest)]
                yield Errors(*(dist(top, world_T_block.translation) for world_T_block in seen))
            image = cell.take_image()
