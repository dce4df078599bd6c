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

"""The links of a robot, as its description says that they look."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from ..shown.moment import Moment
from ..shown.shapes import LinkShape


class Links:
    """Draws the shapes of a robot's links on one page; a node for each link."""

    def __init__(self, scene: Any, shapes: Sequence[LinkShape]) -> None:
        """
        Begin with none to be seen.

        :param shapes: of all links.
        """
        self._scene = scene
        self._nodes: dict[str, Any] = {}
        for number, shape in enumerate(shapes):
            if shape.link not in self._nodes:
                self._nodes[shape.link] = scene.add_frame(
                    f'/links/{len(self._nodes)}', show_axes=False, visible=False)
            scene.add_mesh_simple(
                f'{self._nodes[shape.link].name}/{number}', shape.vertices, shape.faces,
                color=shape.color[:3], opacity=shape.color[3] if shape.color[3] < 1.0 else None,
                flat_shading=True)

    def draw(self, moment: Moment, positions: Array, shown: npt.NDArray[np.bool_]) -> None:
        """
        Put the links where their frames are.

        :param positions: (N, 3) of the moment's frames, metres.
        :param shown: (N,) which of the frames to show.
        """
        places = {frame: place for place, frame in enumerate(moment.frames)}
        for link, node in self._nodes.items():
            place = places.get(link)
            node.visible = place is not None and bool(shown[place])
            if node.visible:
                x, y, z, w = moment.poses[place, 3:].tolist()
                node.position = tuple(positions[place].tolist())
                node.wxyz = (w, x, y, z)
