# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One run, and its evaluation: whether the block is in the gripper, and then in the tray."""

from collections.abc import Callable
from contextlib import closing
from math import dist, hypot

import numpy as np
from tf_tree_py.core import Pose

from .cell import Cell
from .kinematics import Kinematics, OutOfReach
from .mistakes import RIGHT, Way
from .pick_and_place import look, LOOKOUT, NothingFound, pick, place
from .report import PLACED_WITHIN, Trial
from .scene import BLOCK_SIZE, random_scene, Scene, TRAY
from .tree import ArmTree

_LIFTED = 0.05


def scene_of(seed: int, number: int) -> Scene:
    """Return the poses of the blocks in one run."""
    return random_scene(np.random.default_rng((seed, number)))


def run(number: int, seed: int, way: Way = RIGHT,
        watch: Callable[[Cell], None] = lambda cell: None) -> Trial:
    """
    Look, pick and place once.

    :param watch: called with the cell before the run.
    """
    with closing(Cell(scene_of(seed, number), LOOKOUT)) as cell:
        watch(cell)
        tree = ArmTree(cell)
        way.prepare(tree)
        try:
            image, camera_T_block = look(cell)
        except NothingFound as error:
            return Trial(number, remark=str(error))
        world_T_block = way.locate(tree, image, camera_T_block)
        return judged(cell, world_T_block, Trial(number, sight=(image, camera_T_block)))


def judged(cell: Cell, world_T_block: Pose, trial: Trial) -> Trial:
    """Pick and place the block at its estimated pose; return the result."""
    trial = trial._replace(
        error=dist(world_T_block.translation, cell.world_T_top().translation))
    try:
        with closing(Kinematics()) as kinematics:
            pick(cell, kinematics, world_T_block)
            if cell.world_T_top().z < BLOCK_SIZE[2] + _LIFTED:
                return trial._replace(remark='the gripper came up without the block')
            place(cell, kinematics)
    except OutOfReach as error:
        return trial._replace(remark=str(error))
    world_T_top = cell.world_T_top()
    off = hypot(world_T_top.x - TRAY.x, world_T_top.y - TRAY.y)
    return trial._replace(picked=True, placed=off < PLACED_WITHIN, off=off)
