# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The objects around the arm: a table, a tray, and blocks."""

from collections.abc import Sequence

import pybullet
from tf_tree_py.core import Pose

from .scene import BLOCK_SIZE, DISTRACTOR_COLORS, RED, Scene, TRAY, TRAY_SCALE
from .simulator import Simulator

_TABLE = (0.4, 0.0, -0.625)
_BLOCK_MASS = 0.1


def furnish(bullet: Simulator, scene: Scene) -> int:
    """Place all objects of a scene; return the id of the red block."""
    bullet.loadURDF('table/table.urdf', _TABLE, useFixedBase=True)
    bullet.loadURDF('tray/traybox.urdf', TRAY.translation, useFixedBase=True,
                    globalScaling=TRAY_SCALE)
    for pose, color in zip(scene.distractors, DISTRACTOR_COLORS, strict=False):
        add_block(bullet, pose, color)
    return add_block(bullet, scene.block, RED)


def add_block(bullet: Simulator, pose: Pose, color: Sequence[float]) -> int:
    """Add a block that can be grasped; return its id."""
    half = [size / 2 for size in BLOCK_SIZE]
    shape = bullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
    looks = bullet.createVisualShape(
        pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(*color, 1.0), specularColor=(0, 0, 0))
    block = int(bullet.createMultiBody(
        _BLOCK_MASS, shape, looks, pose.translation, pose.rotation))
    bullet.changeDynamics(block, -1, lateralFriction=1.0, spinningFriction=0.01)
    return block
