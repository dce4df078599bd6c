# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Draw docs/images/rooms.svg: the layers, their rooms, and which room imports which.

python docs/figures/rooms.py (needs matplotlib; no ROS)

The arrows are read from the imports. An import that a chain of other arrows implies is
left out.
"""

from pathlib import Path

import house
import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

matplotlib.rcParams.update({'svg.hashsalt': 'tf_tree_py', 'font.size': 11})

IMAGES = Path(__file__).parents[1] / 'images'

# Each layer: where its lower edge is, how high it is, and its rooms: the middle of each, and
# what lives there. Files that stand in no room go by the name of their box.
LAYERS: dict[str, tuple[float, float, dict[str, tuple[float, float, str]]]] = {
    'core': (0.0, 8.2, {
        'health': (12.35, 6.25, 'measures, checks, doctor'),
        'thinning': (2.0, 7.35, 'what is forwarded, and when'),
        'buffer': (2.0, 6.25, 'the lock, the way in, waiters'),
        'deskew, twist': (5.45, 6.25, 'and trajectory, anchor'),
        'reports': (8.9, 6.25, 'explanations, diagnosis'),
        'tree': (7.2, 5.05, 'frames, paths, queries'),
        'ingest': (7.2, 3.95, 'bytes, samples, refusals'),
        'edges': (7.2, 2.85, "one edge's samples over time"),
        'geometry': (7.2, 1.75, 'formulas of rotations, poses'),
        'errors, stamp': (7.2, 0.65, 'and times, text, suggestions'),
    }),
    'ros': (8.8, 8.5, {
        'filtering': (2.2, 16.3, 'messages held back'),
        'remote': (5.5, 16.3, 'buffer server and client'),
        'diagnostics': (8.8, 16.3, 'the health of every edge'),
        'topics': (2.2, 14.65, '/tf and /tf_static, who sends'),
        'buffer': (5.5, 13.0, "tf2's buffer, with messages"),
        'waiting': (5.5, 11.35, 'clocks, timeouts, futures'),
        'threads': (2.9, 9.7, 'internal threads, nodes'),
        'messages': (8.1, 9.7, 'messages and plain numbers'),
    }),
    'calibration': (16.0, 1.3, {
        'calibrate': (12.85, 16.5, 'mountings and time offsets'),
    }),
    'bag': (11.8, 4.0, {
        'open_bag, record': (12.85, 14.8, 'a bag as a buffer, and back'),
        'assembly': (12.85, 13.6, 'messages become a tree'),
        'files': (12.85, 12.4, 'messages out of files'),
    }),
    'fleet': (10.3, 1.3, {
        'FleetListener': (12.85, 10.8, 'many robots, over Zenoh'),
    }),
    'urdf': (8.8, 1.3, {
        'Robot': (12.85, 9.3, 'descriptions, joint states'),
    }),
}
# Where each panel begins, and how wide it is; what uses no ROS stands beside ros.
SIDES = {'core': (0.1, 14.5), 'ros': (0.1, 10.8), '': (0.1, 14.5),
         **dict.fromkeys(('calibration', 'bag', 'fleet', 'urdf'), (11.1, 3.5))}
TOP, TOP_HEIGHT = 17.9, 0.9
ABOVE = (('nodes', 1.6, 'executables that stay up'), ('tools', 4.45, 'to look at a tree with'),
         ('view', 7.3, 'a page in the browser'), ('labs', 10.15, 'the labs of the course'),
         ('dropin', 13.0, 'runs what imports tf2_ros'))
WIDTH, WIDTH_ABOVE, HEIGHT = 3.1, 2.65, 0.74
# Which box the files outside of rooms belong to.
LOOSE = {'core': dict.fromkeys(
             ('deskew', 'twist', 'trajectory', 'anchor'), 'deskew, twist'),
         'ros': {'diagnostics': 'diagnostics'},
         'bag': dict.fromkeys(('joints', 'opening', 'stamps', 'recorder'), 'open_bag, record')}


def box_of(layer: str, room: str) -> str | None:
    """Return the box that a room or a loose file belongs to; None for a file without one."""
    name = room.removeprefix(f'{layer}/')
    if name in house.LAYERS[layer].rooms.split():
        assert name in LAYERS[layer][2], f'{room} has no place in the picture'
        return name
    return LOOSE.get(layer, {}).get(name, 'errors, stamp' if layer == 'core' else None)


def arrows(layer: str) -> set[tuple[str, str]]:
    """Return which boxes of a layer import which, without what others imply."""
    direct: dict[str, set[str]] = {box: set() for box in LAYERS[layer][2]}
    for room, others in house.graph_of_rooms(layer).items():
        box = box_of(layer, room)
        if box is not None:
            direct[box] |= {near for other in others for near in [box_of(layer, other)]
                            if near not in (None, box)}

    def reachable(room: str) -> set[str]:
        return {far for near in direct[room] for far in {near} | reachable(near)}

    return {(room, near) for room in direct for near in direct[room]
            if not any(near in reachable(other) for other in direct[room] - {near})}


def draw_box(axes: Axes, x: float, y: float, name: str, text: str, width: float = WIDTH) -> None:
    """Draw a room: its name, and below it what lives there."""
    axes.add_patch(FancyBboxPatch(
        (x - width / 2, y - HEIGHT / 2), width, HEIGHT, boxstyle='round,pad=0,rounding_size=0.1',
        facecolor='white', edgecolor='black', lw=1.2))
    axes.text(x, y + 0.14, name, ha='center', va='center', fontweight='bold', fontsize=12)
    axes.text(x, y - 0.17, text, ha='center', va='center', fontsize=10.5)


def draw_panel(axes: Axes, name: str, bottom: float, height: float, shade: str) -> None:
    """Draw the ground of a layer, its name in the upper left corner."""
    left, width = SIDES[name]
    axes.add_patch(FancyBboxPatch(
        (left, bottom), width, height, boxstyle='round,pad=0,rounding_size=0.15',
        facecolor=shade, edgecolor='none'))
    axes.text(left + 0.2, bottom + height - 0.12, name, ha='left', va='top', fontsize=12,
              style='italic')


def draw_arrow(axes: Axes, tail: tuple[float, float], head: tuple[float, float],
               name: str, width: float = 1.2) -> None:
    """Draw an arrow from who imports to what is imported; its name is its id in the SVG."""
    axes.add_patch(FancyArrowPatch(
        tail, head, arrowstyle='-|>', color='black', lw=width, shrinkA=0, shrinkB=0,
        mutation_scale=10 + 4 * width, gid=name))


def name_of_arrow(layer: str, upper: str, lower: str) -> str:
    """Return what an arrow is called in the SVG."""
    return f'{layer}: {upper} to {lower}'


def draw_layer(axes: Axes, layer: str, shade: str) -> None:
    """Draw a layer with its rooms."""
    bottom, height, rooms = LAYERS[layer]
    draw_panel(axes, layer, bottom, height, shade)
    for name, (x, y, text) in rooms.items():
        draw_box(axes, x, y, name, text)
    for upper, lower in sorted(arrows(layer)):
        (x, y, _), (below_x, below_y, _) = rooms[upper], rooms[lower]
        assert below_y < y, f'{upper} imports {lower}, which stands above it'
        # Arrows that come from the side meet the box off its middle, so that they stay apart.
        drift = max(-1.2, min(1.2, (x - below_x) * 0.35))
        draw_arrow(axes, (x - drift * 0.4, y - HEIGHT / 2),
                   (below_x + drift, below_y + HEIGHT / 2), name_of_arrow(layer, upper, lower))


def main() -> None:
    """Write the picture, as SVG."""
    figure = Figure(figsize=(12.0, 15.1))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, 14.7)
    axes.set_ylim(-0.1, TOP + TOP_HEIGHT + 0.1)
    axes.axis('off')
    draw_panel(axes, '', TOP, TOP_HEIGHT, '0.94')
    for name, x, text in ABOVE:
        draw_box(axes, x, TOP + TOP_HEIGHT / 2, name, text, WIDTH_ABOVE)
    draw_layer(axes, 'ros', '0.9')
    for layer in ('calibration', 'bag', 'fleet', 'urdf'):
        draw_layer(axes, layer, '0.9')
    draw_layer(axes, 'core', '0.86')
    for above, below in ((TOP, sum(LAYERS['ros'][:2])), (LAYERS['ros'][0], LAYERS['core'][1])):
        for x in (5.5, 12.85):
            draw_arrow(axes, (x, above), (x, below), 'layers', width=3.0)
    calibration, bag = (LAYERS[layer][2][room] for layer, room in (
        ('calibration', 'calibrate'), ('bag', 'open_bag, record')))
    draw_arrow(axes, (calibration[0], calibration[1] - HEIGHT / 2),
               (bag[0], bag[1] + HEIGHT / 2), 'layers')
    figure.savefig(IMAGES / 'rooms.svg', metadata={'Date': None})


if __name__ == '__main__':
    main()
