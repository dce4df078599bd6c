# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A graph of frames as a picture: by graphviz if it is installed, otherwise by matplotlib."""

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
import shutil
import subprocess
from typing import Any, NamedTuple

from tf_tree_py.command.endings import Cannot, needs
from tf_tree_py.core.whole_files import write_whole
from tf_tree_py.reports.drawings import (
    as_dot,
    label_of,
    label_of_root,
    REFUSED,
    ROOT,
    ROOT_ALONE,
    style_of,
    STYLES,
)
from tf_tree_py.reports.frame_graph import FrameGraph, GraphEdge

_PATIENCE_S = 60.0
# Inches: a character of a name and of a remark, a row, a box, and the gap between two columns.
_CHARACTER, _SMALL_CHARACTER, _ROW, _BOX, _GAP = 0.08, 0.064, 0.44, 0.34, 0.45
_FONT_SIZE = 9
_DOTS_PER_INCH = 110
# The largest picture of matplotlib, in inches.
_LARGEST = 400.0


def draw(graph: FrameGraph, path: Path) -> None:
    """
    Write a picture of a graph; the file's suffix determines its format.

    :raises Cannot: graphviz failed, or neither it nor matplotlib is installed.
    """
    if shutil.which('dot') is not None:
        _draw_with_graphviz(graph, path)
    else:
        _draw_with_matplotlib(graph, path)


def _draw_with_graphviz(graph: FrameGraph, path: Path) -> None:
    done = subprocess.run(['dot', f'-T{path.suffix[1:]}'], input=as_dot(graph).encode(),
                          capture_output=True, timeout=_PATIENCE_S, check=False)
    if done.returncode:
        raise Cannot(f'graphviz could not draw it: {done.stderr.decode(errors="replace")[:300]}')
    write_whole(path, [done.stdout])


class DrawnBox(NamedTuple):
    """
    The place of a frame in the picture.

    :ivar column: its depth below its root.
    :ivar row: 0 is on top; a parent in the middle of its children may be between two rows.
    :ivar edge: to its parent; None for a root.
    """

    column: int
    row: float
    lines: list[str]
    edge: GraphEdge | None


def places(graph: FrameGraph) -> dict[str, DrawnBox]:
    """Return the place of each frame: leaves have a row each, a parent is amid its children."""
    children: dict[str, list[GraphEdge]] = {}
    for one in graph.edges:
        children.setdefault(one.info.parent, []).append(one)
    boxes: dict[str, DrawnBox] = {}
    rows = 0
    for root in graph.roots:
        for column, frame, edge in _depth_first(root, children):
            below = [boxes[one.info.child].row for one in children.get(frame, ())]
            row = (min(below) + max(below)) / 2.0 if below else float(rows)
            rows += not below
            lines = label_of_root(graph, frame) if edge is None else label_of(edge)
            boxes[frame] = DrawnBox(column, row, lines, edge)
    return boxes


def _depth_first(root: str, children: dict[str, list[GraphEdge]]
                 ) -> Iterable[tuple[int, str, GraphEdge | None]]:
    """Return the frames below a root with their depth and edge, children before parents."""
    order: list[tuple[int, str, GraphEdge | None]] = []
    waiting: list[tuple[int, str, GraphEdge | None]] = [(0, root, None)]
    while waiting:
        column, frame, edge = waiting.pop()
        order.append((column, frame, edge))
        waiting += [(column + 1, one.info.child, one) for one in children.get(frame, ())]
    return reversed(order)


def _draw_with_matplotlib(graph: FrameGraph, path: Path) -> None:
    figures = needs('matplotlib.figure', 'matplotlib')
    boxes = places(graph)
    lefts, widths = _columns(boxes)
    rows = max((box.row for box in boxes.values()), default=0.0) + 1.0
    width, height = lefts[-1] + widths[-1] + _GAP, rows * _ROW + 0.3 + 0.25 * len(graph.remarks)
    if max(width, height) > _LARGEST:
        raise Cannot(f'a picture of {len(boxes)} frames would be too large; use .dot or .json')
    figure = figures.Figure(figsize=(width, height), dpi=_DOTS_PER_INCH)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    axes.axis('off')
    drawn = _Paper(axes, lefts, widths)
    for box in boxes.values():
        drawn.box(box, len(graph.roots))
        if box.edge is not None:
            drawn.edge(boxes[box.edge.info.parent], box)
    for bad in graph.refused:
        if bad.parent in boxes and bad.child in boxes:
            drawn.refused(boxes[bad.parent], boxes[bad.child])
    for number, remark in enumerate(reversed(graph.remarks)):
        axes.text(_GAP / 2.0, height - 0.15 - 0.25 * number, remark[:200], fontsize=_FONT_SIZE,
                  color=REFUSED, parse_math=False)
    drawn_bytes = BytesIO()
    figure.savefig(drawn_bytes, format=path.suffix[1:])
    write_whole(path, [drawn_bytes.getvalue()])


def _columns(boxes: dict[str, DrawnBox]) -> tuple[list[float], list[float]]:
    """Return the left side of each column, and the width of its boxes."""
    widths: list[float] = []
    for box in sorted(boxes.values(), key=lambda box: box.column):
        name, *remarks = box.lines
        longest = 0.16 + max([len(name) * _CHARACTER,
                              *(len(remark) * _SMALL_CHARACTER for remark in remarks)])
        if box.column == len(widths):
            widths.append(longest)
        widths[box.column] = max(widths[box.column], longest)
    lefts = [_GAP / 2.0]
    for width in widths[:-1]:
        lefts.append(lefts[-1] + width + _GAP)
    return lefts, widths or [2.0]


class _Paper:
    """Draws boxes and lines; inches from the left and from the top."""

    def __init__(self, axes: Any, lefts: list[float], widths: list[float]) -> None:
        self._axes = axes
        self._lefts, self._widths = lefts, widths
        self._patches = needs('matplotlib.patches', 'matplotlib')

    def box(self, box: DrawnBox, roots: int) -> None:
        """Draw a frame."""
        fill, line = (ROOT if roots <= 1 else ROOT_ALONE, '#222222') if box.edge is None else (
            STYLES[style_of(box.edge)])
        left, top = self._lefts[box.column], self._middle(box) - _BOX / 2.0
        self._axes.add_patch(self._patches.FancyBboxPatch(
            (left, top), self._widths[box.column], _BOX, boxstyle='round,pad=0,rounding_size=0.06',
            facecolor=fill, edgecolor=line, linewidth=1.6 if box.edge is None else 0.9))
        name, *remark = box.lines
        self._axes.text(left + 0.08, top + _BOX / 2.0 - (0.07 if remark else 0.0), name,
                        fontsize=_FONT_SIZE, va='center', parse_math=False)
        for text in remark:
            self._axes.text(left + 0.08, top + _BOX / 2.0 + 0.08, text, fontsize=_FONT_SIZE - 2,
                            va='center', color=line, parse_math=False)

    def edge(self, parent: DrawnBox, child: DrawnBox) -> None:
        """Draw a line from a parent's right to a child's left."""
        assert child.edge is not None
        begin = self._lefts[parent.column] + self._widths[parent.column]
        end = self._lefts[child.column]
        self._axes.plot(
            [begin, end - _GAP / 2.0, end - _GAP / 2.0, end],
            [self._middle(parent)] * 2 + [self._middle(child)] * 2, linewidth=0.9,
            color=STYLES[style_of(child.edge)].line,
            linestyle='--' if child.edge.info.static else '-')

    def refused(self, parent: DrawnBox, child: DrawnBox) -> None:
        """Draw an edge that would have closed a loop."""
        begin = self._lefts[parent.column], self._middle(parent)
        end = self._lefts[child.column] + self._widths[child.column], self._middle(child)
        self._axes.annotate('', end, begin, arrowprops={
            'arrowstyle': '->', 'color': REFUSED, 'linewidth': 1.8,
            'connectionstyle': 'arc3,rad=0.25'})

    def _middle(self, box: DrawnBox) -> float:
        return 0.15 + (box.row + 0.5) * _ROW
