# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Draw docs/images/rooms.svg, and write the table of docs/design.md: the layers and their rooms.

python docs/figures/rooms.py (needs matplotlib; no ROS)

What lives in each is the docstring of its ``__init__``.
"""

from collections.abc import Iterator
from pathlib import Path
import textwrap
from typing import NamedTuple

import house
import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

DESIGN = Path(__file__).parents[1] / 'design.md'
PICTURE = DESIGN.parent / 'images' / 'rooms.svg'
BEGIN, END = '<!-- rooms: written by docs/figures/rooms.py -->\n', '<!-- end of rooms -->\n'

# From the top. A layer imports layers in rows below its own, and to its left; so do rooms.
ROWS = ('view', 'command tools nodes labs dropin', 'ros',
        'frame_names urdf bag calibration shared fleet',
        'recording reports buffer_core limited_log thinning health', 'beyond',
        'files screws many_stamps outline interfaces', 'core')

# Inches; the whole picture is at most 1000 pixels wide, at 96 pixels an inch.
WIDTH, GAP, TITLE, LINE, MARGIN = 1.23, 0.05, 0.21, 0.14, 0.05
LETTERS = 20  # of a caption in a line; bold ones are wider


class Box(NamedTuple):
    """A layer or a room in the picture; its lower left corner and its size are in inches."""

    place: str
    x: float
    y: float
    width: float
    height: float


def rooms_of(layer: str) -> list[str]:
    """Return the rooms of a layer, in their order."""
    return [f'{layer}/{room}' for room in house.LAYERS[layer].rooms.split()]


def boxes() -> Iterator[Box]:
    """Yield each layer, followed by its rooms."""
    y = GAP
    for layers in reversed(ROWS):
        x, height = GAP, height_of(layers.split())
        for layer in layers.split():
            rooms = rooms_of(layer)
            width = max(1, len(rooms)) * (WIDTH + GAP) + GAP
            yield Box(layer, x, y, width, height)
            for number, room in enumerate(rooms):
                yield Box(room, x + GAP + number * (WIDTH + GAP), y + GAP, WIDTH,
                          height - TITLE - 2 * GAP)
            x += width + GAP
        y += height + GAP


def height_of(layers: list[str]) -> float:
    """Return the height of a row, in which every name and its caption has room."""
    heights = [0.0]
    for layer in layers:
        rooms = rooms_of(layer)
        above = TITLE + 2 * GAP if rooms else 0.0
        heights += [above + len(lines(place)) * LINE + 3 * MARGIN for place in rooms or [layer]]
    return max(heights)


def lines(place: str) -> list[str]:
    """Return the name of a room, or of a layer without rooms, and the lines of its caption."""
    *_, name = place.split('/')
    return [name, *textwrap.wrap(house.caption(place).summary.replace('``', ''), LETTERS)]


def lines_in(box: Box) -> list[str]:
    """Return the lines in a box."""
    if '/' in box.place or not rooms_of(box.place):
        return lines(box.place)
    title = f'{box.place}: {house.caption(box.place).summary.replace("``", "")}'
    return [title if len(title) < 0.85 * LETTERS * box.width / WIDTH else box.place]


def draw(axes: Axes, box: Box) -> None:
    """Draw a layer as a grey panel, a room as a white box."""
    is_room = '/' in box.place
    axes.add_patch(FancyBboxPatch(
        (box.x, box.y), box.width, box.height, boxstyle='round,pad=0,rounding_size=0.06',
        facecolor='white' if is_room else '0.9', edgecolor='0.3' if is_room else 'none'))
    top = box.y + box.height - MARGIN
    for number, line in enumerate(lines_in(box)):
        axes.text(box.x + 0.07, top - number * LINE - 0.02 * (number > 0), line, ha='left',
                  va='top', fontsize=7.4 if number else 8.4,
                  fontweight='normal' if number else 'bold')


def picture() -> Figure:
    """Return the picture of all layers and rooms; all its sizes are given."""
    everything = list(boxes())
    width = max(box.x + box.width for box in everything) + GAP
    height = max(box.y + box.height for box in everything) + GAP
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    axes.axis('off')
    for box in everything:
        draw(axes, box)
    return figure


def table() -> str:
    """Return the rows of the table: a layer, its rooms, and what lives in each."""
    lines = ['| layer or room | what lives there |', '| --- | --- |']
    for layers in reversed(ROWS):
        for layer in layers.split():
            for place in (layer, *rooms_of(layer)):
                name = f'**`{place}`**' if place == layer else f'`{place}`'
                text = ' '.join(house.caption(place)).strip().replace('``', '`')
                lines.append(f'| {name} | {text} |')
    return '\n'.join(lines) + '\n'


def main() -> None:
    """Write the picture and the table."""
    # With the salt, the same picture is the same file.
    with matplotlib.rc_context({'svg.hashsalt': 'tf_tree_py'}):
        picture().savefig(PICTURE, metadata={'Date': None})
    before, _, rest = DESIGN.read_text().partition(BEGIN)
    DESIGN.write_text(before + BEGIN + table() + END + rest.partition(END)[2])


if __name__ == '__main__':
    main()
