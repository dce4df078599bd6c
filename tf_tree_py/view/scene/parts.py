# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a scene shows besides frames: their names, a robot's links, and the points of sensors."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.text import shorten

from ..framing.camera import Camera, layout
from ..model.moment import Moment
from ..robot.shapes import LinkShape

if TYPE_CHECKING:
    from viser import SceneApi

# Each name that moves costs a message. A picture moves at most so many; the others follow in turn.
_AT_ONCE: Final = 40
_LONGEST_NAME: Final = 60
_ALL: Final = 400
# The setting "few" shows one name for so many square pixels.
_AREA_OF_A_NAME: Final = 32_000.0


class _Name:
    """One name on the page, and its state in the browser."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.position: tuple[float, ...] = ()
        self.side = ''
        self.visible = True

    def put(self, position: tuple[float, ...], side: str) -> bool:
        """Show the name at a position; return whether anything had to be sent."""
        changed = not self.visible or self.side != side or self.position != position
        if not self.visible:
            self.node.visible = self.visible = True
        if self.side != side:
            self.node.anchor = self.side = side
        if self.position != position:
            self.node.position = self.position = position
        return changed

    def hide(self) -> None:
        """Hide the name."""
        if self.visible:
            self.node.visible = self.visible = False


class Labels:
    """
    The names on one page.

    Each name is a node of viser, which has no node for many names. A picture moves at most 40
    of them. Up to 40 names therefore follow their frames at once, and more with a small delay.
    """

    def __init__(self, scene: 'SceneApi') -> None:
        self._scene = scene
        self._root = scene.add_frame('/names', show_axes=False)
        self._names: dict[str, _Name] = {}
        self._numbers = 0
        self._next = 0

    def draw(self, frames: Sequence[str], positions: Array, shown: npt.NDArray[np.bool_],
             camera: Camera | None, first: Sequence[str], amount: str) -> None:
        """
        Show the names of some frames.

        :param positions: (N, 3) of all of them, metres.
        :param shown: (N,) which of them may be shown.
        :param camera: of the page; None: not known yet, so no name is shown.
        :param first: the frames whose names are placed before all others.
        :param amount: 'none', 'few', or 'all' for all names that fit.
        """
        for frame in [frame for frame in self._names if frame not in frames]:
            self._names.pop(frame).node.remove()
        wanted = [] if camera is None else [
            frame for frame, show in zip(frames, shown.tolist(), strict=True) if show]
        sides = self._sides(wanted, positions[shown], camera, first, amount)
        for frame, name in self._names.items():
            if frame not in sides:
                name.hide()
        places = dict(zip(frames, positions.tolist(), strict=True))
        seen = list(sides)
        moved = 0
        for turn in range(len(seen)):
            frame = seen[(self._next + turn) % len(seen)]
            moved += self._name(frame).put(tuple(places[frame]), sides[frame])
            if moved >= _AT_ONCE:
                self._next = (self._next + turn + 1) % len(seen)
                return

    def _sides(self, names: Sequence[str], positions: Array, camera: Camera | None,
               first: Sequence[str], amount: str) -> dict[str, str]:
        """Return the side of its frame for each name to show, by frame."""
        if camera is None or not names or amount == 'none':
            return {}
        most = _ALL if amount == 'all' else int(camera.width * camera.height / _AREA_OF_A_NAME)
        order = {name: place for place, name in enumerate(names)}
        before = {order[frame]: name.side for frame, name in self._names.items()
                  if name.visible and frame in order}
        texts = [shorten(name, _LONGEST_NAME) for name in names]
        found = layout(camera, texts, positions, [order[name] for name in first if name in order],
                       before, most)
        return {names[place]: side for place, side in found.items()}

    def _name(self, frame: str) -> _Name:
        if frame not in self._names:
            # Names of frames may contain slashes, so nodes have numbers.
            self._numbers += 1
            self._names[frame] = _Name(self._scene.add_label(
                f'/names/{self._numbers}', shorten(frame, _LONGEST_NAME)))
        return self._names[frame]


# --- links

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
