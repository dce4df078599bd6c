# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The shapes of a robot's links, on their frames."""

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from ..model.moment import Moment
from ..robot.shapes import LinkShape

if TYPE_CHECKING:
    from viser import SceneApi


class Links:
    """Draws the links of a robot on one page, with a node for each link."""

    def __init__(self, scene: 'SceneApi') -> None:
        """Begin without a robot."""
        self._scene = scene
        self._shapes: Sequence[LinkShape] = ()
        self._nodes: dict[str, Any] = {}
        self._meshes: list[tuple[Any, float]] = []
        self._opacity = 1.0

    def show(self, shapes: Sequence[LinkShape]) -> None:
        """
        Replace the robot.

        :param shapes: of all its links. The same object as before changes nothing.
        """
        if shapes is self._shapes:
            return
        for node in self._nodes.values():
            node.remove()
        self._shapes, self._nodes, self._meshes, self._opacity = shapes, {}, [], 1.0
        for number, shape in enumerate(shapes):
            if shape.link not in self._nodes:
                self._nodes[shape.link] = self._scene.add_frame(
                    f'/links/{len(self._nodes)}', show_axes=False, visible=False)
            mesh = self._scene.add_mesh_simple(
                f'{self._nodes[shape.link].name}/{number}', shape.vertices, shape.faces,
                color=shape.color[:3], opacity=_opacity(shape.color[3]), flat_shading=True,
                side='double', cast_shadow=False, receive_shadow=False)
            self._meshes.append((mesh, shape.color[3]))

    def draw(self, moment: Moment, positions: Array, shown: npt.NDArray[np.bool_],
             opacity: float) -> None:
        """
        Move the links to their frames.

        :param positions: (N, 3) of the moment's frames, metres.
        :param shown: (N,) whether to show the link of each frame.
        :param opacity: a factor for all links, 0 to 1.
        """
        if opacity != self._opacity:
            self._opacity = opacity
            for mesh, own in self._meshes:
                mesh.opacity = _opacity(own * opacity)
        places = {frame: place for place, frame in enumerate(moment.frames)}
        for link, node in self._nodes.items():
            place = places.get(link)
            node.visible = place is not None and bool(shown[place])
            if node.visible:
                x, y, z, w = moment.poses[place, 3:].tolist()
                node.position = tuple(positions[place].tolist())
                node.wxyz = (w, x, y, z)


def _opacity(value: float) -> float | None:
    """Return an opacity in viser's terms, where None is solid."""
    return value if value < 1.0 else None
