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

"""What stands around the arm: a table, a tray, and blocks."""

from collections.abc import Sequence

import pybullet
from tf_tree_py.core import Pose

from .scene import BLOCK_SIZE, DISTRACTOR_COLORS, RED, Scene, TRAY, TRAY_SCALE
from .simulator import Simulator

_TABLE = (0.4, 0.0, -0.625)
_BLOCK_MASS = 0.1


def furnish(bullet: Simulator, scene: Scene) -> int:
    """Put everything where a scene has it; return the red block's number."""
    bullet.loadURDF('table/table.urdf', _TABLE, useFixedBase=True)
    bullet.loadURDF('tray/traybox.urdf', TRAY.translation, useFixedBase=True,
                    globalScaling=TRAY_SCALE)
    for pose, color in zip(scene.distractors, DISTRACTOR_COLORS, strict=False):
        add_block(bullet, pose, color)
    return add_block(bullet, scene.block, RED)


def add_block(bullet: Simulator, pose: Pose, color: Sequence[float]) -> int:
    """Add a block that can be grasped; return its number."""
    half = [size / 2 for size in BLOCK_SIZE]
    shape = bullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half)
    looks = bullet.createVisualShape(
        pybullet.GEOM_BOX, halfExtents=half, rgbaColor=(*color, 1.0), specularColor=(0, 0, 0))
    block = int(bullet.createMultiBody(
        _BLOCK_MASS, shape, looks, pose.translation, pose.rotation))
    bullet.changeDynamics(block, -1, lateralFriction=1.0, spinningFriction=0.01)
    return block
