# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Selects the names to show and the sides of their frames, so that no name covers another.

Names are placed one by one, the most important first. Each gets the first side on which there
is room for it, or is not shown.
"""

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
from tf_tree_py.core.geometry.so3 import Array

from .camera import Camera

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

SIDES: Final = ('center-left', 'center-right', 'bottom-center', 'top-center', 'bottom-left',
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
        for side in ((before,) if before else ()) + SIDES:
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
