# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command ``tf_frames``: the whole tree, on the terminal or as a drawing.

graphviz draws it if it is installed, otherwise matplotlib.
"""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from io import BytesIO
import json
from pathlib import Path
import shutil
import subprocess
import sys
from typing import Any, NamedTuple

from tf_tree_py.command.arguments import add_number, console, Parser, print_json, shown, styled
from tf_tree_py.command.endings import Cannot, entry_point, FINE, FOUND, needs
from tf_tree_py.files.whole_files import write_whole
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.checks.graph import GRAPH_CODES
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.outline import branches
from tf_tree_py.reports.frame_graph import (
    as_dot,
    as_mermaid,
    frame_graph,
    FrameGraph,
    GraphEdge,
    label_of,
    label_of_root,
    REFUSED,
    RefusedEdge,
    ROOT,
    ROOT_ALONE,
    style_of,
    STYLES,
)

from .inputs import nothing_arrived, TreeInput
from .missing import hint_of
from .tree_input import add_input, open_input

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
    order = list(branches(edge.info for edge in graph.edges))
    edges = {edge.info.child: edge for edge in graph.edges}
    children: dict[str, list[str]] = {}
    for edge in graph.edges:
        children.setdefault(edge.info.parent, []).append(edge.info.child)
    leaves = [branch.frame for branch in order if branch.frame not in children]
    rows = {frame: float(row) for row, frame in enumerate(leaves)}
    boxes: dict[str, DrawnBox] = {}
    for lead, frame, _ in reversed(order):
        if frame in children:
            below = [rows[child] for child in children[frame]]
            rows[frame] = (min(below) + max(below)) / 2.0
        own = edges.get(frame)
        lines = label_of_root(graph, frame) if own is None else label_of(own)
        boxes[frame] = DrawnBox(len(lead) // len(_STEP), rows[frame], lines, own)
    return boxes


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


# --- the command

NAME = 'tf_frames'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

_DESCRIPTION = """\
Shows all frames: the parent of each, the rate and the publisher of each edge; trees that
are not connected, edges that would close a loop, and edges that have stopped.

With -o it writes a file; the suffix selects the format: .dot, .mmd (Mermaid), .json, .svg,
.png, .pdf. The exit status is 0 if all is well, 1 with an error, as that of tf_doctor, 2 if
there were no transforms to watch."""

_EXAMPLES = (
    ('tf_frames', 'the tree of the running robot'),
    ('tf_frames -o frames.pdf', 'a drawing'),
    ('tf_frames --bag run.mcap', 'the tree at the end of a recording'),
)
_LIVE_S = 5.0
_PICTURES = ('.svg', '.png', '.pdf')
# The indentation of each level of the tree.
_STEP = '└─ '
# The doctor's findings that the graph itself shows.
_DRAWN = ('loop', 'unconnected', 'stale')
_COLOURS = {'stale': 'warning', 'static': 'note', 'moving': 'fine'}


def _parser(output: str) -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('-o', '--output', metavar='FILE', type=Path,
                        default=Path(output) if output else None,
                        help='write a file instead; its suffix selects the format')
    add_number(parser, '--seconds', None, f'how long to watch; {_LIVE_S:g} live, and all of a '
               'recording, unless given')
    parser.add_json()
    add_input(parser)
    return parser


def _work(argv: Sequence[str], output: str = '') -> int:
    arguments = _parser(output).parse(argv)
    if arguments.output is not None:
        _check(arguments.output)
    doctor = Doctor()
    with open_input(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as tree_input:
        with suppress(KeyboardInterrupt):
            tree_input.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
        findings = tree_input.findings(doctor)
        if not doctor.transforms:
            raise nothing_arrived(tree_input)
        silent = {(one.parent, one.child): one.silence or 0
                  for one in doctor.signs(tree_input.now()) if one.stale}
        graph = frame_graph(tree_input.buffer, tree_input.now(), list(_refused(findings)), silent)
    errors = [one for one in findings if one.severity is Severity.ERROR]
    _show(graph, tree_input, arguments, [
        one for one in findings if one.code in GRAPH_CODES or (
            one.severity is Severity.ERROR and one.code not in _DRAWN)])
    return FOUND if errors else FINE


def _refused(findings: Sequence[Finding]) -> Iterator[RefusedEdge]:
    for finding in findings:
        if finding.code == 'loop':
            parent, child = finding.frames
            yield RefusedEdge(parent, child, finding.publishers, int(finding.evidence['count']))


def _plain(graph: FrameGraph, tree_input: TreeInput) -> dict[str, object]:
    return {'version': VERSION, 'source': tree_input.name, **graph.as_dict()}


def _show(graph: FrameGraph, tree_input: TreeInput, arguments: Namespace,
          findings: Sequence[Finding]) -> None:
    if arguments.output is not None:
        _write(graph, tree_input, arguments.output)
        print(f'{len(graph.frames)} frames: {arguments.output}')
    elif arguments.json:
        print_json(_plain(graph, tree_input))
    else:
        _print(graph, tree_input, findings)


def _check(path: Path) -> None:
    """Refuse a file that cannot be written, before the long watch."""
    suffixes = ('.dot', '.mmd', '.json', *_PICTURES)
    if path.suffix not in suffixes:
        raise Cannot(f'{path} has none of the supported suffixes: {", ".join(suffixes)}')
    if not path.parent.is_dir():
        raise Cannot(f'{path}: there is no folder {path.parent}')


def _write(graph: FrameGraph, tree_input: TreeInput, path: Path) -> None:
    if path.suffix in _PICTURES:
        draw(graph, path)
        return
    write_whole(path, [{
        '.dot': lambda: as_dot(graph), '.mmd': lambda: as_mermaid(graph),
        '.json': lambda: json.dumps(_plain(graph, tree_input), indent=2, allow_nan=False) + '\n',
    }[path.suffix]().encode()])


# --- for people

def _print(graph: FrameGraph, tree_input: TreeInput, findings: Sequence[Finding]) -> None:
    out = console()
    text = needs('rich.text', 'rich').Text
    edges = {edge.info.child: edge for edge in graph.edges}
    drawn = [branch._replace(lead=_lead(branch.lead, out.width // 2))
             for branch in branches(edge.info for edge in graph.edges)]
    width = max((len(branch.lead) + len(shown(branch.frame, 60)) for branch in drawn), default=0)
    for branch in drawn:
        line = text(branch.lead, style='dim').append(shown(branch.frame, 60), style='bold')
        if branch.edge is None:
            if len(graph.roots) > 1:
                line.append('  a separate tree', style='yellow')
        else:
            line.append(' ' * max(2, min(width, out.width * 2 // 3) - len(line) + 2))
            line.append_text(_remark(edges[branch.edge.child]))
        out.print(line, no_wrap=True, overflow='ellipsis')
    out.print()
    out.print(text(f'{shown(tree_input.name)}: {len(graph.frames)} frames, '
                   f'{len(graph.edges)} edges'))
    for remark in graph.remarks:
        out.print(styled(remark, 'error' if 'loop' in remark else 'warning'))
    for one in findings:
        words = hint_of(one) if one.code in GRAPH_CODES else one.summary
        out.print(styled(f'{one.code}: ', one.severity.value).append(shown(words, 1000)))


def _lead(lead: str, most: int) -> str:
    """Return the lines in front of a frame; if they are too long, its depth and their end."""
    if len(lead) <= most:
        return lead
    depth = f'{len(lead) // len(_STEP)} deep '
    return depth + lead[len(depth) - most:]


def _remark(edge: GraphEdge) -> object:
    return styled(f'{edge.remark:<10}', _COLOURS[style_of(edge)]).append(
        f'  {shown(edge.info.authority or "")}', style='dim')


def _draw_by_default(argv: Sequence[str]) -> int:
    return _work(argv, f'frames_{datetime.now():%Y-%m-%d_%H.%M.%S}.pdf')


main = entry_point(NAME, _work)
view_frames = entry_point('view_frames', _draw_by_default)
"""The same tool under the name that draws a PDF by default."""

if __name__ == '__main__':
    sys.exit(main())
