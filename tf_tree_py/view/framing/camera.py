# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A pinhole camera, the sizes of what it shows, and the places of names.

The camera has a projection, and a position from which it sees some points. The sizes are those of
a robot, of its axes, and of the cells of the ground.

Names are placed one by one, the most important first. Each gets the first side of its frame on
which no other name is, or is not shown.
"""

from collections.abc import Iterable, Sequence
import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array

from ..model.moment import Moment

UP: Final = np.array((0.0, 0.0, 1.0))
# From the robot to the camera: to the right, behind and above the robot.
DIRECTION: Final = np.array((0.58, -0.66, 0.48))
# The share of the picture that points may fill. The rest is for their names.
_FILLED: Final = 0.8
_FIT_ROUNDS: Final = 4


class Camera(NamedTuple):
    """
    A pinhole camera.

    :ivar position: (3,) metres, in the page's axes.
    :ivar look_at: (3,) the point in the middle of the picture, metres.
    :ivar field_of_view: vertical, radians.
    :ivar width: of the picture, CSS pixels.
    :ivar height: of the picture, CSS pixels.
    """

    position: Array
    look_at: Array
    field_of_view: float
    width: float
    height: float

    def axes(self) -> Array:
        """Return the directions right, up and forward of the camera, the rows of (3, 3)."""
        forward = _unit(self.look_at - self.position, -DIRECTION)
        right = _unit(np.cross(forward, UP), np.array((1.0, 0.0, 0.0)))
        return np.array((right, np.cross(right, forward), forward))

    def project(self, points: Array) -> tuple[Array, Array]:
        """
        Return the pixels of some points, and their depths.

        :param points: (N, 3) metres.
        :return: (N, 2) CSS pixels from the upper left corner, meaningless where the depth is
            not positive; (N,) depths along the direction of view, metres.
        """
        right, up, depth = self.axes() @ (points - self.position).T
        with np.errstate(divide='ignore', invalid='ignore'):
            pixels = np.stack([right, -up]) * self._pixels_at(1.0) / depth
        return pixels.T + (self.width / 2.0, self.height / 2.0), depth

    def metres_per_pixel(self, depth: npt.ArrayLike) -> Array:
        """Return the size of a CSS pixel at a depth, metres."""
        return np.asarray(depth, float) / self._pixels_at(1.0)

    def _pixels_at(self, depth: float) -> float:
        return self.height / (2.0 * math.tan(self.field_of_view / 2.0) * depth)

    def fitted(self, points: Array, least: float, toward: Array | None = None) -> 'Camera':
        """
        Return the camera nearest to some points that sees all of them.

        :param points: (N, 3) metres; at least one.
        :param least: the radius that must be visible around each point, metres.
        :param toward: (3,) the direction from the points to the camera; None: as it is now.
        """
        away = _unit(self.position - self.look_at if toward is None else toward, DIRECTION)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        camera = self._replace(position=middle + away, look_at=middle)
        axes = camera.axes()
        tangent = np.tan(self.field_of_view / 2.0) * _FILLED
        half = np.array((tangent * self.width / max(self.height, 1.0), tangent))
        for _ in range(_FIT_ROUNDS):
            across, forward = _seen(axes, points - middle)
            distance = _distance(across, forward, half, least)
            # Centre the points in the picture, where near points move more than far ones.
            seen = across / (distance + forward)
            shift = (seen.min(axis=1) + seen.max(axis=1)) / 2.0 * distance
            middle = middle + shift @ axes[:2]
        distance = _distance(*_seen(axes, points - middle), half, least)
        return self._replace(position=middle + away * distance, look_at=middle)


def _unit(vector: Array, otherwise: Array) -> Array:
    length = float(np.linalg.norm(vector))
    unit: Array = vector / length if length > 1e-9 else otherwise / np.linalg.norm(otherwise)
    return unit


def _seen(axes: Array, points: Array) -> tuple[Array, Array]:
    """Return the coordinates of points along right and up, (2, N), and forward, (N,)."""
    right, up, forward = axes @ points.T
    return np.stack([right, up]), forward


def _distance(across: Array, forward: Array, half: Array, least: float) -> float:
    """Return the distance from which all points are visible and in front of the camera."""
    needed = np.maximum((np.abs(across) / half[:, None]).max(axis=0), least)
    return float(max((needed - forward).max(), least / half.min()))


# --- sizes

# Shorter edges do not count, metres.
_TOGETHER: Final = 1e-3
_LEAST: Final = 0.1
# Frames beyond a gap of so many times the robot's size are not part of the robot.
_GAP: Final = 3.0
# The shortest and the longest axes on the screen, CSS pixels.
_SHORTEST, _LONGEST = 14.0, 42.0
_CELLS_ACROSS: Final = 12.0


def axes_length(moment: Moment) -> float:
    """Return half of the median length of the edges, metres, which a far map does not affect."""
    places = np.flatnonzero(moment.parents >= 0)
    lengths = np.linalg.norm(
        moment.poses[places, :3] - moment.poses[moment.parents[places], :3], axis=1)
    lengths = lengths[lengths > _TOGETHER]
    return float(f'{np.median(lengths) / 2.0:.1g}') if len(lengths) else _LEAST


def lengths_on_screen(camera: Camera | None, positions: Array, length: float) -> Array:
    """
    Return the length of each frame's axes, (N,) metres, limited on the screen.

    :param camera: None: not known yet, so all axes get the same length.
    :param positions: (N, 3) in the page's axes, metres.
    :param length: the length where the limits allow it, metres.
    """
    lengths = np.full(len(positions), length)
    if camera is None:
        return lengths
    pixel = camera.metres_per_pixel(np.maximum(camera.project(positions)[1], 1e-6))
    clipped: Array = np.clip(lengths, _SHORTEST * pixel, _LONGEST * pixel)
    return clipped


def of_the_robot(positions: Array) -> npt.NDArray[np.bool_]:
    """
    Return which frames belong to the robot and are not far from it, as a map's origin is, (N,).

    :param positions: (N, 3) metres.
    """
    distances = np.linalg.norm(positions - np.median(positions, axis=0), axis=1)
    order = np.sort(distances)
    core = max(float(order[len(order) // 2]), _LEAST)
    beyond = order[order > core]
    gaps = np.concatenate([[core], beyond])
    wide = np.flatnonzero(gaps[1:] > _GAP * gaps[:-1])
    return distances <= (gaps[wide[0]] if len(wide) else np.inf)


def cell_of(reach: float) -> float:
    """Return the length of a cell of the ground: 1, 2 or 5 times a power of ten, metres."""
    wanted = max(reach, 1e-3) * 2.0 / _CELLS_ACROSS
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * next(step for step in (1.0, 2.0, 5.0, 10.0) if step * power >= wanted))


# --- names

# The widths of letters, in parts of the font size, of DejaVu Sans, the widest common font.
_EM: Final = 12.0
_WIDTHS: Final = {**dict.fromkeys("ijl|.,:;'`! ", 0.35), **dict.fromkeys('ftr()[]{}/-_"', 0.53),
                  **dict.fromkeys('mwMW@%', 1.0)}
_UPPER, _OTHER = 0.8, 0.66
# The height of a line with its white border, CSS pixels.
_HEIGHT: Final = 1.42 * _EM
_BORDER: Final = 0.3 * _EM
# The free space around a name, CSS pixels.
_MARGIN: Final = 1.0

_SIDES: Final = ('center-left', 'center-right', 'bottom-center', 'top-center', 'bottom-left',
                 'top-left', 'bottom-right', 'top-right')
"""The point of a name that is at its frame, in viser's terms; the preferred ones first."""


class Rectangle(NamedTuple):
    """A rectangle of the picture, CSS pixels."""

    left: float
    top: float
    right: float
    bottom: float

    def meets(self, other: 'Rectangle') -> bool:
        """Return whether two rectangles overlap."""
        return (self.left < other.right and other.left < self.right
                and self.top < other.bottom and other.top < self.bottom)


def size_of(text: str) -> tuple[float, float]:
    """Return the greatest width and height of a name, CSS pixels."""
    width = sum(_WIDTHS.get(letter, _OTHER if ord(letter) < 0x250 and not letter.isupper()
                            else _UPPER if ord(letter) < 0x1100 else 1.1) for letter in text)
    return width * _EM + _BORDER + 2.0 * _MARGIN, _HEIGHT + 2.0 * _MARGIN


def rectangle(pixel: Sequence[float], size: tuple[float, float], side: str) -> Rectangle:
    """Return the rectangle of a name whose side is at a pixel."""
    vertical, _, horizontal = side.partition('-')
    left = pixel[0] - size[0] * {'left': 0.0, 'center': 0.5, 'right': 1.0}[horizontal]
    top = pixel[1] - size[1] * {'top': 0.0, 'center': 0.5, 'bottom': 1.0}[vertical]
    return Rectangle(left, top, left + size[0], top + size[1])


class Placer:
    """
    Places names in one picture.

    It keeps the rectangles in a grid of cells, so it compares a name only with those near it.
    """

    def __init__(self, width: float, height: float) -> None:
        """Begin with an empty picture."""
        self._picture = Rectangle(0.0, 0.0, width, height)
        self._cells: dict[tuple[int, int], list[Rectangle]] = {}

    def place(self, pixel: Sequence[float], text: str, before: str | None) -> str | None:
        """
        Place a name; return its side, or None if there is no room for it.

        :param before: the side on which it is now, which is tried first; None: not shown.
        """
        size = size_of(text)
        for side in ((before,) if before else ()) + _SIDES:
            taken = rectangle(pixel, size, side)
            if self._is_inside(taken) and not any(
                    taken.meets(other) for cell in _cells(taken)
                    for other in self._cells.get(cell, ())):
                for cell in _cells(taken):
                    self._cells.setdefault(cell, []).append(taken)
                return side
        return None

    def _is_inside(self, taken: Rectangle) -> bool:
        return (taken.left >= 0.0 and taken.top >= 0.0 and taken.right <= self._picture.right
                and taken.bottom <= self._picture.bottom)


def _cells(taken: Rectangle) -> Iterable[tuple[int, int]]:
    return ((column, row)
            for column in range(int(taken.left // 64.0), int(taken.right // 64.0) + 1)
            for row in range(int(taken.top // 24.0), int(taken.bottom // 24.0) + 1))


def layout(camera: Camera, names: Sequence[str], positions: Array, first: Sequence[int],
           before: dict[int, str], most: int) -> dict[int, str]:
    """
    Return the side of each name that is shown, by the index of the name.

    :param names: of the N frames.
    :param positions: (N, 3) of the frames, in the page's axes, metres.
    :param first: indices of the names to place before all others.
    :param before: the result for the last picture. Names that are shown are preferred to others
        at nearly the same distance, so that they do not flicker.
    :param most: the greatest number of names to show.
    """
    pixels, depths = camera.project(positions)
    # A name that is shown counts as a little nearer.
    nearness = depths * np.array([0.8 if place in before else 1.0 for place in range(len(names))])
    order = [*first, *(place for place in np.argsort(nearness, kind='stable').tolist()
                       if place not in first)]
    placer = Placer(camera.width, camera.height)
    result: dict[int, str] = {}
    for place in order:
        if depths[place] <= 0.0 or len(result) >= most:
            continue
        side = placer.place(pixels[place].tolist(), names[place], before.get(place))
        if side is not None:
            result[place] = side
    return result
