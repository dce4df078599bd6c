# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The uncertainty of the chosen frame's position, drawn as an ellipsoid around it."""

from typing import Any, Final

from tf_tree_py.core.geometry.so3 import Array

from ..model import colours
from ..model.ellipsoid import Ellipsoid

_OPACITY: Final = 0.3


class UncertaintyEllipsoid:
    """Draws one ellipsoid on one page."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._node: Any = None

    def draw(self, ellipsoid: Ellipsoid | None, positions: Array) -> None:
        """
        Show an ellipsoid; None: hide it.

        :param positions: (N, 3) of the moment's frames, metres.
        """
        if ellipsoid is None:
            if self._node is not None:
                self._node.visible = False
            return
        if self._node is None:
            self._node = self._scene.add_icosphere(
                '/doubt', color=colours.CHOSEN, opacity=_OPACITY, cast_shadow=False,
                receive_shadow=False)
        x, y, z, w = ellipsoid.rotation
        self._node.scale = tuple(ellipsoid.semi_axes.tolist())
        self._node.wxyz = (w, x, y, z)
        self._node.position = tuple(positions[ellipsoid.place].tolist())
        self._node.visible = True
