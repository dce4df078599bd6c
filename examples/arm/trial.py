"""One run, and its judge: whether the gripper has the block, and then the tray."""

from collections.abc import Callable
from contextlib import closing
from math import dist, hypot
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core import Pose

from .cell import Cell
from .image import Image
from .kinematics import Kinematics, OutOfReach
from .mistakes import RIGHT, Way
from .pick_and_place import look, LOOKOUT, NothingFound, pick, place
from .scene import BLOCK_SIZE, random_scene, TRAY
from .tree import ArmTree

PLACED_WITHIN = 0.02

_LIFTED = 0.05


class Trial(NamedTuple):
    """
    What came of one run; metres.

    :ivar error: between where the block's top was and where it was taken to be.
    :ivar off: how far the block came to lie from the tray's middle.
    :ivar remark: why it ended early.
    :ivar sight: the image, and camera_T_block.
    """

    number: int
    error: float | None = None
    picked: bool = False
    placed: bool = False
    off: float | None = None
    remark: str = ''
    sight: tuple[Image, Pose] | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {'run': self.number, 'detection_error_m': self.error, 'picked': self.picked,
                'placed': self.placed, 'placed_off_m': self.off, 'remark': self.remark}


def run(number: int, seed: int, way: Way = RIGHT,
        watch: Callable[[Cell], None] = lambda cell: None) -> Trial:
    """
    Look, pick and place once.

    :param number: with the seed it says where the blocks stand.
    :param watch: is given the cell before anything happens.
    """
    scene = random_scene(np.random.default_rng((seed, number)))
    with closing(Cell(scene, LOOKOUT)) as cell, closing(Kinematics()) as kinematics:
        watch(cell)
        tree = ArmTree(cell)
        way.prepare(tree)
        return _judged(cell, tree, kinematics, way, Trial(number))


def _judged(cell: Cell, tree: ArmTree, kinematics: Kinematics, way: Way, trial: Trial) -> Trial:
    try:
        image, camera_T_block = look(cell)
        world_T_block = way.locate(tree, image, camera_T_block)
        trial = trial._replace(
            sight=(image, camera_T_block),
            error=dist(world_T_block.translation, cell.world_T_top().translation))
        pick(cell, kinematics, world_T_block)
        if cell.world_T_top().z < BLOCK_SIZE[2] + _LIFTED:
            return trial._replace(remark='the gripper came up without the block')
        place(cell, kinematics)
    except (NothingFound, OutOfReach) as error:
        return trial._replace(remark=str(error))
    world_T_top = cell.world_T_top()
    off = hypot(world_T_top.x - TRAY.x, world_T_top.y - TRAY.y)
    return trial._replace(picked=True, placed=off < PLACED_WITHIN, off=off)
