# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""PyBullet, one simulator for each object, without a window."""

from functools import partial
from typing import Any

import pybullet
import pybullet_data


class Simulator:
    """All functions of ``pybullet``, on a separate simulator; it finds PyBullet's models."""

    def __init__(self) -> None:
        self._id = pybullet.connect(pybullet.DIRECT)
        self.setAdditionalSearchPath(pybullet_data.getDataPath())

    def __getattr__(self, name: str) -> Any:
        return partial(getattr(pybullet, name), physicsClientId=self._id)

    def close(self) -> None:
        """End the simulator."""
        self.disconnect()

    def load_arm(self) -> int:
        """Load Franka Emika's Panda: seven joints and a gripper. Its base is the world frame."""
        return int(self.loadURDF('franka_panda/panda.urdf', useFixedBase=True))
