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

"""The three-dimensional part of a page: axes, lines, names, marks, a trail and the ground."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from .doubt import Doubt
from .labels import Labels
from .links import Links
from .stale_axes import StaleAxes
from ..shown import colours
from ..shown.ellipsoid import Ellipsoid
from ..shown.moment import Moment
from ..shown.shapes import LinkShape

_RADIUS: Final = 0.04
_THICKNESS: Final = 2.5
_CELLS: Final = (225, 225, 225)
_SECTIONS: Final = (180, 180, 180)
_DARK_CELLS: Final = (45, 45, 45)
_DARK_SECTIONS: Final = (80, 80, 80)
_TRAIL: Final = (0, 160, 130)
_FINDING: Final = (225, 20, 20)


@dataclass
class Look:
    """
    What somebody wants to see of the frames, and how.

    :ivar hidden: frames that are switched off.
    :ivar origin: (3,) what is subtracted from every position, metres. Numbers go to the browser
        with seven digits; and a camera that follows a frame is a scene that moves under it.
    """

    axes_length: float = 0.3
    axes: bool = True
    names: bool = True
    lines: bool = True
    links: bool = True
    dark: bool = False
    hidden: set[str] = field(default_factory=set)
    chosen: str | None = None
    found: Collection[str] = ()
    origin: Array = field(default_factory=lambda: np.zeros(3))

    def shows(self, moment: Moment) -> npt.NDArray[np.bool_]:
        """Return which frames of a moment are to be seen, (N,)."""
        return np.array([frame not in self.hidden for frame in moment.frames], np.bool_)


class Scene:
    """
    Draws moments on one page.

    All axes are one node, and all lines another, so that many frames cost little.
    """

    def __init__(self, client: Any, shapes: Sequence[LinkShape],
                 on_click: Callable[[str], None]) -> None:
        """
        Begin with the ground only.

        :param client: viser's handle of the page.
        :param shapes: of the links of a robot.
        :param on_click: is called with the frame that somebody clicked.
        """
        self._client = client
        self._scene = client.scene
        self._on_click = on_click
        self._frames: tuple[str, ...] = ()
        self._nodes: dict[str, Any] = {}
        self._ground = self._scene.add_grid(
            '/ground', infinite_grid=True, fade_distance=40.0, cell_size=1.0, section_size=10.0)
        self._stale = StaleAxes(self._scene, self._clicked)
        self._labels = Labels(self._scene)
        self._links = Links(self._scene, shapes)
        self._doubt = Doubt(self._scene)

    def draw(self, moment: Moment, look: Look, ellipsoid: Ellipsoid | None) -> None:
        """
        Show a moment, all at once.

        :param ellipsoid: of the chosen frame; None: there is none.
        """
        shown = look.shows(moment)
        positions = moment.poses[:, :3] - look.origin
        with self._client.atomic():
            self._draw_ground(look)
            self._draw_axes(moment, look, shown, positions)
            self._draw_lines(moment, look, shown, positions)
            self._draw_marks(moment, look, positions)
            self._links.draw(moment, positions, shown & look.links)
            self._labels.draw(moment.frames, positions, shown & look.names)
            self._doubt.draw(ellipsoid, positions)

    # --- parts

    def _draw_ground(self, look: Look) -> None:
        self._ground.position = tuple(-look.origin)
        self._ground.cell_color = _DARK_CELLS if look.dark else _CELLS
        self._ground.section_color = _DARK_SECTIONS if look.dark else _SECTIONS

    def _draw_axes(self, moment: Moment, look: Look, shown: npt.NDArray[np.bool_],
                   positions: Array) -> None:
        rotations = moment.poses[:, [6, 3, 4, 5]]
        fresh = shown & ~moment.stale & look.axes
        if moment.frames != self._frames:
            self._frames = moment.frames
            self._remove('axes')
        self._update('axes', self._new_axes, batched_positions=positions,
                     batched_wxyzs=rotations, batched_scales=look.axes_length * fresh)
        stale = np.flatnonzero(shown & moment.stale & look.axes)
        self._stale.draw(stale, positions[stale], rotations[stale],
                         colours.greys(moment.ages[stale]), look.axes_length)

    def _new_axes(self, **props: Any) -> Any:
        axes = self._scene.add_batched_axes(
            '/axes', axes_length=1.0, axes_radius=_RADIUS, **props)
        axes.on_click(lambda event: self._clicked(event.instance_index))
        return axes

    def _draw_lines(self, moment: Moment, look: Look, shown: npt.NDArray[np.bool_],
                    positions: Array) -> None:
        parents = moment.parents
        drawn = np.flatnonzero((parents >= 0) & shown & shown[parents] & look.lines)
        points = np.stack([positions[parents[drawn]], positions[drawn]], axis=1)
        line_colours = np.repeat(colours.of_edges(moment)[drawn][:, None], 2, axis=1)
        self._draw_segments('lines', points, line_colours)

    def draw_trail(self, points: Array, look: Look) -> None:
        """Show where a frame has been, (N, 2, 3)."""
        shifted = points - look.origin
        self._draw_segments('trail', shifted, np.full(shifted.shape, _TRAIL, np.uint8))

    def _draw_segments(self, name: str, points: Array, segment_colours: colours.Colours) -> None:
        if name in self._nodes and len(self._nodes[name].points) != len(points):
            self._remove(name)
        if len(points):
            self._update(name, lambda **props: self._scene.add_line_segments(
                f'/{name}', thickness=_THICKNESS, thickness_units='screen', **props),
                points=points, colors=_as_light(segment_colours))

    def _draw_marks(self, moment: Moment, look: Look, positions: Array) -> None:
        """Mark the chosen frame, and those that a finding is about."""
        marked: Mapping[str, Any] = dict.fromkeys(look.found, _FINDING) | (
            {look.chosen: colours.CHOSEN} if look.chosen else {})
        places = [place for place, frame in enumerate(moment.frames) if frame in marked]
        if 'marks' in self._nodes and len(self._nodes['marks'].points) != len(places):
            self._remove('marks')
        if places:
            colour = np.array([marked[moment.frames[place]] for place in places], np.uint8)
            self._update('marks', lambda **props: self._scene.add_point_cloud(
                '/marks', point_shape='circle', precision='float32', **props),
                points=positions[places], colors=colour, point_size=look.axes_length / 3.0)

    # --- nodes

    def _update(self, name: str, make: Callable[..., Any], **props: Any) -> None:
        """Give a node new properties; make it, if there is none."""
        node = self._nodes.get(name)
        if node is None:
            self._nodes[name] = make(**props)
            return
        for prop, value in props.items():
            setattr(node, prop, value)

    def _remove(self, name: str) -> None:
        node = self._nodes.pop(name, None)
        if node is not None:
            node.remove()

    def _clicked(self, index: int | None) -> None:
        if index is not None and index < len(self._frames):
            self._on_click(self._frames[index])


def _as_light(seen: colours.Colours) -> colours.Colours:
    """Return colours as lines take them: in amounts of light, and not as they are seen."""
    return (255.0 * (seen / 255.0) ** 2.2).round().astype(np.uint8)
