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

"""The command ``tf_frames``: the whole tree, on the terminal or as a drawing."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
import json
from pathlib import Path
import sys
from typing import Any

from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.telling.drawings import as_dot, as_mermaid, style_of
from tf_tree_py.core.telling.frame_graph import frame_graph, FrameGraph, GraphEdge, RefusedEdge
from tf_tree_py.core.tree.outline import branches

from .arguments import add_number, Parser
from .drawing import draw
from .endings import Cannot, entry_point, FINE, FOUND, needs
from .output import console, print_json, shown, styled
from .source import nothing_arrived, open_source, TreeSource

NAME = 'tf_frames'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

_DESCRIPTION = """\
Shows all frames: which hangs on which, how often each edge comes and who sends it; trees
that are not connected, edges that would close a loop, and edges that came no more.

With -o it writes a file of the kind that its suffix says: .dot, .mmd (Mermaid), .json,
.svg, .png, .pdf. The exit status is 0 if all is well, 1 if somebody should look, 2 if
nothing could be watched."""

_EXAMPLES = (
    ('tf_frames', 'the tree of the running robot'),
    ('tf_frames -o frames.pdf', 'a drawing'),
    ('tf_frames --bag run.mcap', 'the tree at the end of a recording'),
)
_LIVE_S = 5.0
_PICTURES = ('.svg', '.png', '.pdf')
# What each level of the tree stands further to the right.
_STEP = '└─ '
_COLOURS = {'stale': 'warning', 'static': 'note', 'moving': 'fine'}


def _parser(output: str) -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('-o', '--output', metavar='FILE', type=Path,
                        default=Path(output) if output else None,
                        help='write a file instead; its suffix says of which kind')
    add_number(parser, '--seconds', None, f'how long to watch; {_LIVE_S:g} live, and all of a '
               'recording, unless given')
    parser.add_json()
    parser.add_source()
    return parser


def _work(argv: Sequence[str], output: str = '') -> int:
    arguments = _parser(output).parse(argv)
    if arguments.output is not None:
        _check(arguments.output)
    doctor = Doctor()
    with open_source(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as source:
        with suppress(KeyboardInterrupt):
            source.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
        findings = doctor.findings()
        if not doctor.transforms:
            raise nothing_arrived(source)
        graph = frame_graph(source.buffer, source.now(), list(_refused(findings)))
    _show(graph, source, arguments)
    return FOUND if graph.refused or any(
        one.code == 'unconnected' and one.severity is not Severity.NOTE for one in findings
    ) or any(edge.stale for edge in graph.edges) else FINE


def _refused(findings: Sequence[Finding]) -> Iterator[RefusedEdge]:
    for finding in findings:
        if finding.code == 'loop':
            parent, child = finding.frames
            yield RefusedEdge(parent, child, finding.publishers, int(finding.evidence['count']))


def _plain(graph: FrameGraph, source: TreeSource) -> dict[str, Any]:
    return {'version': VERSION, 'source': source.name, **graph.as_dict()}


def _show(graph: FrameGraph, source: TreeSource, arguments: Namespace) -> None:
    if arguments.output is not None:
        _write(graph, source, arguments.output)
        print(f'{len(graph.frames)} frames: {arguments.output}')
    elif arguments.json:
        print_json(_plain(graph, source))
    else:
        _print(graph, source)


def _check(path: Path) -> None:
    """Refuse a file that cannot be written before watching for long."""
    kinds = ('.dot', '.mmd', '.json', *_PICTURES)
    if path.suffix not in kinds:
        raise Cannot(f'{path} has none of the suffixes that say what to draw: {", ".join(kinds)}')
    if not path.parent.is_dir():
        raise Cannot(f'{path}: there is no folder {path.parent}')


def _write(graph: FrameGraph, source: TreeSource, path: Path) -> None:
    if path.suffix in _PICTURES:
        draw(graph, path)
        return
    path.write_text({
        '.dot': lambda: as_dot(graph), '.mmd': lambda: as_mermaid(graph),
        '.json': lambda: json.dumps(_plain(graph, source), indent=2, allow_nan=False) + '\n',
    }[path.suffix]())


# --- for people

def _print(graph: FrameGraph, source: TreeSource) -> None:
    out = console()
    text = needs('rich.text', 'rich', 'tools').Text
    edges = {edge.info.child: edge for edge in graph.edges}
    drawn = [branch._replace(lead=_lead(branch.lead, out.width // 2))
             for branch in branches(edge.info for edge in graph.edges)]
    width = max((len(branch.lead) + len(shown(branch.frame, 60)) for branch in drawn), default=0)
    for branch in drawn:
        line = text(branch.lead, style='dim').append(shown(branch.frame, 60), style='bold')
        if branch.edge is None:
            if len(graph.roots) > 1:
                line.append('  a tree of its own', style='yellow')
        else:
            line.append(' ' * max(2, min(width, out.width * 2 // 3) - len(line) + 2))
            line.append_text(_remark(edges[branch.edge.child]))
        out.print(line, no_wrap=True, overflow='ellipsis')
    out.print()
    out.print(text(f'{shown(source.name)}: {len(graph.frames)} frames, {len(graph.edges)} edges'))
    for remark in graph.remarks:
        out.print(styled(remark, 'error' if 'loop' in remark else 'warning'))


def _lead(lead: str, most: int) -> str:
    """Return what stands in front of a frame, where it is too deep for the lines its depth."""
    if len(lead) <= most:
        return lead
    depth = f'{len(lead) // len(_STEP)} deep '
    return depth + lead[len(depth) - most:]


def _remark(edge: GraphEdge) -> Any:
    return styled(f'{edge.remark:<10}', _COLOURS[style_of(edge)]).append(
        f'  {shown(edge.info.authority or "")}', style='dim')


def _draw_unless_told(argv: Sequence[str]) -> int:
    return _work(argv, f'frames_{datetime.now():%Y-%m-%d_%H.%M.%S}.pdf')


main = entry_point(NAME, _work)
view_frames = entry_point('view_frames', _draw_unless_told)
"""The same under the name that draws a PDF unless told otherwise."""

if __name__ == '__main__':
    sys.exit(main())
