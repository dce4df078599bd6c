# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The ground: a pale grid below the robot."""

from typing import Any, Final

from tf_tree_py.core.geometry.so3 import Array

Colour = tuple[int, int, int]

_LIGHT: Final[tuple[Colour, Colour]] = (238, 238, 238), (214, 214, 214)
_DARK: Final[tuple[Colour, Colour]] = (44, 44, 46), (62, 62, 66)
# The grid fades out at this distance. Every tenth line is darker.
_CELLS_SEEN: Final = 60.0
_CELLS_A_SECTION: Final = 10.0


class Ground:
    """The ground of one page, at the height of the fixed frame."""

    def __init__(self, scene: Any) -> None:
        self._node = scene.add_grid('/ground', infinite_grid=True, cell_thickness=0.6,
                                    section_thickness=0.8, shadow_opacity=0.0)

    def draw(self, origin: Array, cell: float, visible: bool, dark: bool) -> None:
        """
        Show or hide the grid.

        :param origin: (3,) the offset that is subtracted from every position, metres.
        :param cell: the length of a cell, metres.
        """
        node = self._node
        node.visible = visible
        node.position = tuple((-origin).tolist())
        node.cell_size, node.section_size = cell, _CELLS_A_SECTION * cell
        node.fade_distance = _CELLS_SEEN * cell
        node.cell_color, node.section_color = _DARK if dark else _LIGHT
