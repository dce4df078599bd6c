# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The picture of a page: axes, lines, names, marks, a trail, links, points and the ground.

Stale frames have grey axes. The uncertainty of the chosen frame's position is an ellipsoid
around it.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from .parts import Labels, Links, Seen, SensorPoints
from ..framing.camera import Camera, lengths_on_screen
from ..model import colours
from ..model.moment import Ellipsoid, Moment

if TYPE_CHECKING:
    from viser import ClientHandle

_Colour = tuple[int, int, int]

_LIGHT: Final[tuple[_Colour, _Colour]] = (238, 238, 238), (214, 214, 214)
_DARK: Final[tuple[_Colour, _Colour]] = (44, 44, 46), (62, 62, 66)
# The grid fades out at this distance. Every tenth line is darker.
_CELLS_SEEN: Final = 60.0
_CELLS_A_SECTION: Final = 10.0
_RADIUS: Final = 0.035

# A grey axis, a box from 0 to 1 along x: eight corners, and twelve triangles.
_CORNERS = np.array([(x, y, z) for x in (0.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_CORNERS[:, 1:] *= _RADIUS
_SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                   (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])
# Along x, y and z. A cyclic permutation of the coordinates keeps the orientation of triangles.
_VERTICES = np.concatenate([np.roll(_CORNERS, axis, axis=1) for axis in range(3)])
_FACES = np.concatenate([_SIDES + 8 * axis for axis in range(3)])

_OPACITY: Final = 0.3
_THICKNESS: Final = 2.5
# The size of a sensor's points, as a share of the length of the axes.
_POINT: Final = 0.15
_TRAIL: Final = (0, 160, 130)
_FINDING: Final = (225, 20, 20)


@dataclass
class Appearance:
    """
    What a page draws, and how.

    :ivar axes_length: metres; limited to a range on the screen.
    :ivar cell: the length of a cell of the ground, metres.
    :ivar names: 'none', 'few', or 'all' for all names that fit.
    :ivar opacity: of the links, 0 to 1.
    :ivar hidden: the frames that are switched off.
    :ivar chosen: the chosen frame; None: no frame is chosen.
    :ivar found: the frames of the selected finding.
    :ivar origin: (3,) the offset that is subtracted from every position, metres. It keeps
        numbers small, because the browser uses single precision. To follow a frame, the page
        moves the origin and not the camera.
    """

    axes_length: float = 0.3
    cell: float = 1.0
    axes: bool = True
    names: str = 'few'
    lines: bool = True
    links: bool = True
    opacity: float = 0.7
    ground: bool = True
    dark: bool = False
    hidden: set[str] = field(default_factory=set)
    chosen: str | None = None
    found: Collection[str] = ()
    origin: Array = field(default_factory=lambda: np.zeros(3))

    def shows(self, moment: Moment) -> npt.NDArray[np.bool_]:
        """Return whether to show each frame of a moment, (N,)."""
        return np.array([frame not in self.hidden for frame in moment.frames], np.bool_)


class Scene:
    """
    Draws moments on one page.

    All axes share one node and all lines another, so that many frames cost little.

    :ivar links: the links of the robot.
    """

    def __init__(self, client: 'ClientHandle', on_click: Callable[[str], None]) -> None:
        """
        Begin without any node.

        :param client: viser's handle of the page.
        :param on_click: is called with a frame when its axes are clicked.
        """
        self._client = client
        self._scene = client.scene
        self._on_click = on_click
        self._frames: tuple[str, ...] = ()
        self._nodes: dict[str, Any] = {}
        # Those with grey axes.
        self._stale: tuple[str, ...] = ()
        self._labels = Labels(self._scene)
        self.links = Links(self._scene)
        self._sensors = SensorPoints(self._scene)

    def draw(self, moment: Moment, look: Appearance, ellipsoid: Ellipsoid | None,
             camera: Camera | None, seen: Mapping[str, Seen]) -> None:
        """
        Show a moment, with all its parts at once.

        :param ellipsoid: the uncertainty of the chosen frame; None: it is unknown.
        :param camera: of the page; None: not known yet.
        :param seen: the points of sensors, by topic.
        """
        shown = look.shows(moment)
        positions = moment.poses[:, :3] - look.origin
        lengths = lengths_on_screen(camera, positions, look.axes_length)
        with self._client.atomic():
            self._draw_ground(look)
            self._draw_axes(moment, look, shown, positions, lengths)
            self._draw_lines(moment, look, shown, positions)
            self._draw_marks(moment, look, positions, lengths)
            self.links.draw(moment, positions, shown & look.links, look.opacity)
            first = [*([look.chosen] if look.chosen else []), *look.found]
            self._labels.draw(moment.frames, positions, shown, camera, first, look.names)
            self._draw_ellipsoid(ellipsoid, positions)
            self._sensors.draw(seen, look.origin, look.axes_length * _POINT)

    # --- parts

    def _draw_ground(self, look: Appearance) -> None:
        """Draw a grid at the height of the fixed frame."""
        cell_color, section_color = _DARK if look.dark else _LIGHT
        self._update('ground', lambda **props: self._scene.add_grid(
            '/ground', infinite_grid=True, cell_thickness=0.6, section_thickness=0.8,
            shadow_opacity=0.0, **props),
            visible=look.ground, position=tuple((-look.origin).tolist()),
            cell_size=look.cell, section_size=_CELLS_A_SECTION * look.cell,
            fade_distance=_CELLS_SEEN * look.cell, cell_color=cell_color,
            section_color=section_color)

    def _draw_axes(self, moment: Moment, look: Appearance, shown: npt.NDArray[np.bool_],
                   positions: Array, lengths: Array) -> None:
        rotations = moment.poses[:, [6, 3, 4, 5]]
        fresh = shown & ~moment.stale & look.axes
        if moment.frames != self._frames:
            self._frames = moment.frames
            self._remove('axes')
        self._update('axes', self._new_axes, batched_positions=positions,
                     batched_wxyzs=rotations, batched_scales=lengths * fresh)
        stale = np.flatnonzero(shown & moment.stale & look.axes)
        if len(stale) != len(self._stale):
            self._remove('stale')
        self._stale = tuple(moment.frames[place] for place in stale)
        if self._stale:
            self._update('stale', self._new_stale_axes, batched_positions=positions[stale],
                         batched_wxyzs=rotations[stale], batched_scales=lengths[stale],
                         batched_colors=colours.greys(moment.ages[stale]))

    def _new_axes(self, **props: Any) -> Any:
        axes = self._scene.add_batched_axes('/axes', axes_length=1.0, axes_radius=_RADIUS, **props)
        axes.on_click(lambda event: self._clicked(event.instance_index, self._frames))
        return axes

    def _new_stale_axes(self, **props: Any) -> Any:
        axes = self._scene.add_batched_meshes_simple(
            '/stale', _VERTICES, _FACES, lod='off', cast_shadow=False, receive_shadow=False,
            scale=1.0, **props)
        axes.on_click(lambda event: self._clicked(event.instance_index, self._stale))
        return axes

    def _draw_lines(self, moment: Moment, look: Appearance, shown: npt.NDArray[np.bool_],
                    positions: Array) -> None:
        parents = moment.parents
        drawn = np.flatnonzero((parents >= 0) & shown & shown[parents] & look.lines)
        points = np.stack([positions[parents[drawn]], positions[drawn]], axis=1)
        line_colours = np.repeat(colours.of_edges(moment)[drawn][:, None], 2, axis=1)
        self._draw_segments('lines', points, line_colours)

    def draw_trail(self, points: Array, look: Appearance) -> None:
        """Show the path of a frame, (N, 2, 3) line segments."""
        shifted = points - look.origin
        self._draw_segments('trail', shifted, np.full(shifted.shape, _TRAIL, np.uint8))

    def _draw_segments(self, name: str, points: Array, segment_colours: colours.Colours) -> None:
        if name in self._nodes and len(self._nodes[name].points) != len(points):
            self._remove(name)
        if len(points):
            self._update(name, lambda **props: self._scene.add_line_segments(
                f'/{name}', thickness=_THICKNESS, thickness_units='screen', **props),
                points=points, colors=_as_light(segment_colours))

    def _draw_marks(self, moment: Moment, look: Appearance, positions: Array,
                    lengths: Array) -> None:
        """Mark the chosen frame and the frames of the selected finding."""
        marked = dict.fromkeys(look.found, _FINDING) | (
            {look.chosen: colours.CHOSEN} if look.chosen else {})
        places = [place for place, frame in enumerate(moment.frames) if frame in marked]
        if 'marks' in self._nodes and len(self._nodes['marks'].points) != len(places):
            self._remove('marks')
        if places:
            colour = np.array([marked[moment.frames[place]] for place in places], np.uint8)
            self._update('marks', lambda **props: self._scene.add_point_cloud(
                '/marks', point_shape='circle', precision='float32', **props),
                points=positions[places], colors=colour,
                point_size=float(lengths[places].min()) / 3.0)

    def _draw_ellipsoid(self, ellipsoid: Ellipsoid | None, positions: Array) -> None:
        if ellipsoid is None:
            self._remove('doubt')
            return
        x, y, z, w = ellipsoid.rotation
        self._update('doubt', lambda **props: self._scene.add_icosphere(
            '/doubt', color=colours.CHOSEN, opacity=_OPACITY, cast_shadow=False,
            receive_shadow=False, **props),
            scale=tuple(ellipsoid.semi_axes.tolist()), wxyz=(w, x, y, z),
            position=tuple(positions[ellipsoid.place].tolist()))

    # --- nodes

    def _update(self, name: str, make: Callable[..., Any], **props: Any) -> None:
        """Set properties of a node; make the node if it does not exist."""
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

    def _clicked(self, index: int | None, frames: Sequence[str]) -> None:
        if index is not None and index < len(frames):
            self._on_click(frames[index])


def _as_light(seen: colours.Colours) -> colours.Colours:
    """Return colours in linear light, as viser's lines take them, from sRGB."""
    return (255.0 * (seen / 255.0) ** 2.2).round().astype(np.uint8)
