# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The objects on the table and their poses: metres, in the frame `world`, the table at z = 0."""

from typing import NamedTuple

import numpy as np
from tf_tree_py.core import Pose

BLOCK_SIZE = (0.06, 0.04, 0.04)
"""Length along x, width along y, height; the gripper opens to 0.08."""

RED = (0.85, 0.08, 0.08)
DISTRACTOR_COLORS = ((0.10, 0.55, 0.15), (0.10, 0.20, 0.75))

TRAY = Pose(x=0.10, y=-0.50)
TRAY_SCALE = 0.5
"""Of PyBullet's tray, which is 0.6 wide."""

_RADII = (0.42, 0.62)
_BEARINGS = (-0.45, 0.85)
_APART = 0.13


class Scene(NamedTuple):
    """The poses of the middles of the blocks."""

    block: Pose
    distractors: list[Pose]


def random_scene(rng: np.random.Generator) -> Scene:
    """Return a red block and two others, within the arm's reach and apart from each other."""
    placed: list[Pose] = []
    while len(placed) < 1 + len(DISTRACTOR_COLORS):
        radius, bearing = rng.uniform(*_RADII), rng.uniform(*_BEARINGS)
        pose = Pose.from_xyz_rpy(radius * np.cos(bearing), radius * np.sin(bearing),
                                 BLOCK_SIZE[2] / 2, yaw=rng.uniform(-np.pi, np.pi))
        if all(np.hypot(pose.x - other.x, pose.y - other.y) > _APART for other in placed):
            placed.append(pose)
    return Scene(placed[0], placed[1:])
