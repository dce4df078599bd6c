# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The arm's transform tree, built by hand."""

from tf_tree_py import BufferCore
from tf_tree_py.core import Pose

from .cell import BASE, Cell, HAND, HAND_T_CAMERA


class ArmTree(BufferCore):
    """
    The current and past poses of the arm's links, updated at every step of the cell.

    Static edges are inserted once. The camera is mounted on the hand, so it needs only one
    static edge: it moves because the hand moves.
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
        """Insert the current moving transforms, with the stamp of the simulation."""
        self._insert_links(static=False)

    def _insert_links(self, static: bool) -> None:
        world_T, stamp = self._cell.link_poses(), self._cell.stamp
        for link in self._cell.links:
            if link.moves != static:
                parent_T_child = world_T[link.parent].inverse() @ world_T[link.name]
                self.insert(link.parent, link.name, stamp, parent_T_child, static=static)
