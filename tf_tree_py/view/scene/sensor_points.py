# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The points of sensors on one page: a cloud or a line for each topic."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple, TYPE_CHECKING

import numpy as np
from tf_tree_py.core.geometry.so3 import Array

if TYPE_CHECKING:
    from viser import SceneApi

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
