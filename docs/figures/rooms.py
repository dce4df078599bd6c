"""
Draw docs/images/rooms.svg: the layers, their rooms, and which room imports which.

python docs/figures/rooms.py (needs matplotlib; no ROS)

The arrows are read from the imports. An import that a chain of other arrows implies is
left out.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
import tf_tree_py

matplotlib.rcParams.update({'svg.hashsalt': 'tf_tree_py', 'font.size': 11})

PACKAGE = Path(tf_tree_py.__file__).parent
IMAGES = Path(__file__).parents[1] / 'images'

# Each layer: where its lower edge is, how high it is, and its rooms: the middle of each, and
# what lives there. Files that stand in no room go by the name of their box.
LAYERS: dict[str, tuple[float, float, dict[str, tuple[float, float, str]]]] = {
    'core': (0.0, 7.1, {
        'buffer': (2.2, 6.25, 'the lock, the way in, who waits'),
        'telling': (5.5, 6.25, 'reports, diagnosis, audit'),
        'deskew, twist, anchor': (8.8, 6.25, 'points over time, velocities'),
        'tree': (5.5, 5.05, 'who hangs on whom, queries'),
        'arrivals': (5.5, 3.95, 'bytes, samples, refusals'),
        'edges': (5.5, 2.85, "one edge's samples over time"),
        'geometry': (5.5, 1.75, 'formulas of rotations, poses'),
        'errors, stamp': (5.5, 0.65, 'and times, text, suggestions'),
    }),
    'ros': (7.7, 6.0, {
        'filtering': (2.2, 12.85, 'messages held back'),
        'remote': (5.5, 12.85, 'buffer server and client'),
        'diagnostics': (8.8, 12.85, 'the health of every edge'),
        'topics': (2.2, 11.75, '/tf and /tf_static, who sends'),
        'buffer': (5.5, 10.65, "tf2's buffer, with messages"),
        'waiting': (5.5, 9.55, 'clocks, timeouts, futures'),
        'threads': (2.9, 8.45, 'our own threads and nodes'),
        'messages': (8.1, 8.45, 'messages and plain numbers'),
    }),
}
TOP, TOP_HEIGHT = 14.3, 0.9
ABOVE = (('nodes', 2.2, 'executables'), ('labs', 5.5, 'the labs of the course'),
         ('dropin', 8.8, 'runs code that imports tf2_ros'))
WIDTH, HEIGHT = 3.1, 0.74
# Which box the files outside of rooms belong to.
LOOSE = {'core': dict.fromkeys(('deskew', 'twist', 'anchor'), 'deskew, twist, anchor'),
         'ros': {'diagnostics': 'diagnostics'}}


def imported(path: Path) -> Iterator[tuple[str, ...]]:
    """Yield what a file imports of the package, as parts of a path inside the package."""
    here = path.relative_to(PACKAGE).parts
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        module = tuple((node.module or '').split('.')) if node.module else ()
        if node.level:
            module = here[:len(here) - node.level] + module
        elif module[:1] == ('tf_tree_py',):
            module = module[1:]
        else:
            continue
        yield from (module + (alias.name,) for alias in node.names)


def room_of(parts: tuple[str, ...], layer: str) -> str | None:
    """Return the box that a file of a layer belongs to; None if it is another layer's."""
    if parts[0] != layer or len(parts) < 2:
        return None
    rooms = LAYERS[layer][2]
    name = parts[1].removesuffix('.py')
    if (PACKAGE / layer / name).is_dir():
        assert name in rooms, f'{layer}/{name} has no place in the picture'
        return name
    return LOOSE[layer].get(name, 'errors, stamp' if layer == 'core' else None)


def arrows(layer: str) -> set[tuple[str, str]]:
    """Return which rooms of a layer import which, without what others imply."""
    direct: dict[str, set[str]] = {room: set() for room in LAYERS[layer][2]}
    for path in (PACKAGE / layer).rglob('*.py'):
        room = room_of(path.relative_to(PACKAGE).parts, layer)
        if room is None or path.parent == PACKAGE / layer and path.name == '__init__.py':
            continue
        for target in imported(path):
            other = room_of(target, layer)
            if other not in (None, room):
                direct[room].add(other)

    def reachable(room: str) -> set[str]:
        return {far for near in direct[room] for far in {near} | reachable(near)}

    return {(room, near) for room in direct for near in direct[room]
            if not any(near in reachable(other) for other in direct[room] - {near})}


def draw_box(axes: Axes, x: float, y: float, name: str, text: str) -> None:
    """Draw a room: its name, and below it what lives there."""
    axes.add_patch(FancyBboxPatch(
        (x - WIDTH / 2, y - HEIGHT / 2), WIDTH, HEIGHT, boxstyle='round,pad=0,rounding_size=0.1',
        facecolor='white', edgecolor='black', lw=1.2))
    axes.text(x, y + 0.14, name, ha='center', va='center', fontweight='bold', fontsize=12)
    axes.text(x, y - 0.17, text, ha='center', va='center', fontsize=10.5)


def draw_panel(axes: Axes, name: str, bottom: float, height: float, shade: str) -> None:
    """Draw the ground of a layer, its name in the upper left corner."""
    axes.add_patch(FancyBboxPatch(
        (0.1, bottom), 10.8, height, boxstyle='round,pad=0,rounding_size=0.15',
        facecolor=shade, edgecolor='none'))
    axes.text(0.3, bottom + height - 0.12, name, ha='left', va='top', fontsize=12,
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
    figure = Figure(figsize=(9.0, 12.2))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, 11.0)
    axes.set_ylim(-0.1, TOP + TOP_HEIGHT + 0.1)
    axes.axis('off')
    draw_panel(axes, '', TOP, TOP_HEIGHT, '0.94')
    for name, x, text in ABOVE:
        draw_box(axes, x, TOP + TOP_HEIGHT / 2, name, text)
    draw_layer(axes, 'ros', '0.9')
    draw_layer(axes, 'core', '0.86')
    for above, below in ((TOP, sum(LAYERS['ros'][:2])), (LAYERS['ros'][0], LAYERS['core'][1])):
        draw_arrow(axes, (5.5, above), (5.5, below), 'layers', width=3.0)
    figure.savefig(IMAGES / 'rooms.svg', metadata={'Date': None})


if __name__ == '__main__':
    main()
