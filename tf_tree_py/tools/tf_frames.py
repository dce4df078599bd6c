# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_frames``: the whole tree, on the terminal or as a drawing."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
import json
from pathlib import Path
import sys
from typing import Any

from tf_tree_py.command.arguments import add_number, Parser
from tf_tree_py.command.endings import Cannot, entry_point, FINE, FOUND, needs
from tf_tree_py.command.output import console, print_json, shown, styled
from tf_tree_py.core.tree.outline import branches
from tf_tree_py.core.whole_files import write_whole
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.reports.drawings import as_dot, as_mermaid, style_of
from tf_tree_py.reports.frame_graph import frame_graph, FrameGraph, GraphEdge, RefusedEdge

from .drawing import draw
from .tree_arguments import add_source
from .tree_source import nothing_arrived, open_source, TreeSource

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
    add_source(parser)
    return parser


def _work(argv: Sequence[str], output: str = '') -> int:
    arguments = _parser(output).parse(argv)
    if arguments.output is not None:
        _check(arguments.output)
    doctor = Doctor()
    with open_source(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as source:
        with suppress(KeyboardInterrupt):
            source.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
        doctor.endpoints = source.endpoints()
        findings = doctor.findings(source.now())
        if not doctor.transforms:
            raise nothing_arrived(source)
        silent = {(one.parent, one.child): one.silence or 0 for one in doctor.signs(source.now())
                  if one.stale}
        graph = frame_graph(source.buffer, source.now(), list(_refused(findings)), silent)
    errors = [one for one in findings if one.severity is Severity.ERROR]
    _show(graph, source, arguments, [one for one in errors if one.code not in _DRAWN])
    return FOUND if errors else FINE


def _refused(findings: Sequence[Finding]) -> Iterator[RefusedEdge]:
    for finding in findings:
        if finding.code == 'loop':
            parent, child = finding.frames
            yield RefusedEdge(parent, child, finding.publishers, int(finding.evidence['count']))


def _plain(graph: FrameGraph, source: TreeSource) -> dict[str, Any]:
    return {'version': VERSION, 'source': source.name, **graph.as_dict()}


def _show(graph: FrameGraph, source: TreeSource, arguments: Namespace,
          errors: Sequence[Finding]) -> None:
    if arguments.output is not None:
        _write(graph, source, arguments.output)
        print(f'{len(graph.frames)} frames: {arguments.output}')
    elif arguments.json:
        print_json(_plain(graph, source))
    else:
        _print(graph, source, errors)


def _check(path: Path) -> None:
    """Refuse a file that cannot be written, before the long watch."""
    kinds = ('.dot', '.mmd', '.json', *_PICTURES)
    if path.suffix not in kinds:
        raise Cannot(f'{path} has none of the supported suffixes: {", ".join(kinds)}')
    if not path.parent.is_dir():
        raise Cannot(f'{path}: there is no folder {path.parent}')


def _write(graph: FrameGraph, source: TreeSource, path: Path) -> None:
    if path.suffix in _PICTURES:
        draw(graph, path)
        return
    write_whole(path, [{
        '.dot': lambda: as_dot(graph), '.mmd': lambda: as_mermaid(graph),
        '.json': lambda: json.dumps(_plain(graph, source), indent=2, allow_nan=False) + '\n',
    }[path.suffix]().encode()])


# --- for people

def _print(graph: FrameGraph, source: TreeSource, errors: Sequence[Finding]) -> None:
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
    out.print(text(f'{shown(source.name)}: {len(graph.frames)} frames, {len(graph.edges)} edges'))
    for remark in graph.remarks:
        out.print(styled(remark, 'error' if 'loop' in remark else 'warning'))
    for error in errors:
        out.print(styled(f'{error.code}: {error.summary}', 'error'))


def _lead(lead: str, most: int) -> str:
    """Return the lines in front of a frame; if they are too long, its depth and their end."""
    if len(lead) <= most:
        return lead
    depth = f'{len(lead) // len(_STEP)} deep '
    return depth + lead[len(depth) - most:]


def _remark(edge: GraphEdge) -> Any:
    return styled(f'{edge.remark:<10}', _COLOURS[style_of(edge)]).append(
        f'  {shown(edge.info.authority or "")}', style='dim')


def _draw_by_default(argv: Sequence[str]) -> int:
    return _work(argv, f'frames_{datetime.now():%Y-%m-%d_%H.%M.%S}.pdf')


main = entry_point(NAME, _work)
view_frames = entry_point('view_frames', _draw_by_default)
"""The same tool under the name that draws a PDF by default."""

if __name__ == '__main__':
    sys.exit(main())
