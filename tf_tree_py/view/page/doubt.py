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

"""How far the chosen frame may be off, as an ellipsoid around it."""

from typing import Any, Final

from tf_tree_py.core.geometry.so3 import Array

from ..shown import colours
from ..shown.ellipsoid import Ellipsoid

_OPACITY: Final = 0.3


class Doubt:
    """Draws one ellipsoid on one page, where there is one."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._node: Any = None

    def draw(self, ellipsoid: Ellipsoid | None, positions: Array) -> None:
        """
        Show an ellipsoid; None: there is none to be shown.

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
