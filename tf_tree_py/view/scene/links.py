# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The shapes of a robot's links, on their frames, and the points of sensors."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, TYPE_CHECKING

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


# --- the points of sensors

_COLOURS: Final = ((214, 51, 108), (12, 133, 153), (95, 61, 196), (47, 158, 68), (232, 89, 12))
_THICKNESS: Final = 3.0


class Seen(NamedTuple):
    """
    The points of one topic.

    :ivar points: (N, 3) in the fixed frame, metres.
    :ivar is_line: whether to connect them by a line.
    """

    points: Array
    is_line: bool


class SensorPoints:
    """Draws the points of topics, with a node for each topic."""

    def __init__(self, scene: 'SceneApi') -> None:
        self._scene = scene
        self._nodes: dict[str, Any] = {}
        self._numbers: dict[str, int] = {}

    def draw(self, seen: Mapping[str, Seen], origin: Array, size: float) -> None:
        """
        Show the points of some topics, and remove those of all others.

        :param origin: (3,) the offset that is subtracted from every position, metres.
        :param size: of a point, metres.
        """
        for topic in [topic for topic in self._nodes if topic not in seen]:
            self._nodes.pop(topic).remove()
        for topic, (points, is_line) in seen.items():
            number = self._numbers.setdefault(topic, len(self._numbers))
            colour = _COLOURS[number % len(_COLOURS)]
            shifted = points - origin
            if is_line:
                self._draw_line(topic, number, shifted, colour)
            else:
                self._draw_cloud(topic, number, shifted, colour, size)

    def _draw_cloud(self, topic: str, number: int, points: Array, colour: tuple[int, int, int],
                    size: float) -> None:
        node = self._nodes.get(topic)
        if node is None:
            self._nodes[topic] = self._scene.add_point_cloud(
                f'/sensors/{number}', points, colour, point_size=size, point_shape='circle',
                precision='float32')
            return
        node.points, node.colors, node.point_size = points, np.array(colour, np.uint8), size

    def _draw_line(self, topic: str, number: int, points: Array,
                   colour: tuple[int, int, int]) -> None:
        node = self._nodes.pop(topic, None)
        if node is not None:
            node.remove()
        if len(points) > 1:
            self._nodes[topic] = self._scene.add_line_segments(
                f'/sensors/{number}', np.stack([points[:-1], points[1:]], axis=1),
                np.array(colour, np.uint8), thickness=_THICKNESS, thickness_units='screen')
