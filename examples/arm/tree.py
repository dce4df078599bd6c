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

"""The arm's transform tree, built by hand."""

from tf_tree_py.core import BufferCore, Pose

from .cell import BASE, Cell, HAND, HAND_T_CAMERA


class ArmTree(BufferCore):
    """
    Where every link of the arm is, and was: the tree follows the cell step by step.

    What does not move is told once. The camera is screwed to the hand, so one static edge
    is all there is to tell of it: it moves because the hand does.
    """

    def __init__(self, cell: Cell) -> None:
        super().__init__()
        self._cell = cell
        self.insert('world', BASE, 0, Pose(), static=True)
        self._insert_links(static=True)
        self.insert(HAND, 'camera', 0, HAND_T_CAMERA, static=True)
        self.follow()
        cell.watchers.append(self.follow)

    def follow(self) -> None:
        """Tell where what moves is now, with the stamp of the simulation."""
        self._insert_links(static=False)

    def _insert_links(self, static: bool) -> None:
        world_T, stamp = self._cell.link_poses(), self._cell.stamp
        for link in self._cell.links:
            if link.moves != static:
                parent_T_child = world_T[link.parent].inverse() @ world_T[link.name]
                self.insert(link.parent, link.name, stamp, parent_T_child, static=static)
