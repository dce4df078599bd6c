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

"""PyBullet, one simulator for each object, without a window."""

from functools import partial
from typing import Any

import pybullet
import pybullet_data


class Simulator:
    """All functions of ``pybullet``, on a simulator of its own; it finds PyBullet's models."""

    def __init__(self) -> None:
        self._id = pybullet.connect(pybullet.DIRECT)
        self.setAdditionalSearchPath(pybullet_data.getDataPath())

    def __getattr__(self, name: str) -> Any:
        return partial(getattr(pybullet, name), physicsClientId=self._id)

    def close(self) -> None:
        """End it."""
        self.disconnect()

    def load_arm(self) -> int:
        """Load Franka Emika's Panda: seven joints and a gripper. Its base is the world."""
        return int(self.loadURDF('franka_panda/panda.urdf', useFixedBase=True))
