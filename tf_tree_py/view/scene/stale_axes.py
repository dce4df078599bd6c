# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Grey axes for stale frames."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from ..model.colours import Colours

_RADIUS: Final = 0.035

# A box from 0 to 1 along x: eight corners, and twelve triangles.
_CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_CORNERS[:, 1:] *= _RADIUS
_SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                   (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])
# Along x, y and z. A cyclic permutation of the coordinates keeps the orientation of triangles.
_VERTICES = np.concatenate([np.roll(_CORNERS, axis, axis=1) for axis in range(3)])
_FACES = np.concatenate([_SIDES + 8 * axis for axis in range(3)])


class StaleAxes:
    """The grey axes of one page: one node, which exists only while a frame is stale."""

    def __init__(self, scene: Any, on_click: Callable[[int], None]) -> None:
        """
        Begin without axes.

        :param on_click: is called with the index of a frame when its axes are clicked.
        """
        self._scene = scene
        self._on_click = on_click
        self._places = np.empty(0, np.int64)
        self._node: Any = None

    def draw(self, places: npt.NDArray[np.int64], positions: Array, rotations: Array,
             greys: Colours, lengths: Array) -> None:
        """
        Show the axes of some frames.

        :param places: (N,) indices of the frames in the moment.
        :param rotations: (N, 4) quaternions w x y z.
        :param lengths: (N,) of the axes, metres.
        """
        if len(places) != len(self._places) and self._node is not None:
            self._node.remove()
            self._node = None
        self._places = places
        if not len(places):
            return
        if self._node is None:
            self._node = self._scene.add_batched_meshes_simple(
                '/stale', _VERTICES, _FACES, rotations, positions, batched_colors=greys,
                lod='off', cast_shadow=False, receive_shadow=False, scale=1.0,
                batched_scales=lengths)
            self._node.on_click(self._clicked)
            return
        self._node.batched_positions, self._node.batched_wxyzs = positions, rotations
        self._node.batched_scales = lengths
        self._node.batched_colors = greys

    def _clicked(self, event: Any) -> None:
        index = event.instance_index
        if index is not None and index < len(self._places):
            self._on_click(int(self._places[index]))
