# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_monitor``: a live table of every edge, those with trouble first."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
import sys
import time
from typing import Any, NamedTuple, TYPE_CHECKING

from tf_tree_py.beyond.uncertainty.noise import EdgeNoise
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.command.arguments import (
    add_number,
    console,
    Parser,
    print_json_line,
    shown,
    styled,
    table,
)
from tf_tree_py.command.endings import Cannot, entry_point, FINE, FOUND, needs
from tf_tree_py.core.text import listed
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor, Monitor, Watched
from tf_tree_py.reports.explanation import explain, Explanation, known_noise
from tf_tree_py.reports.explanation_text import noise_of
from tf_tree_py.shared.status import Status

from .inputs import nothing_arrived, TreeInput
from .missing import Hint, hint_of, hints_of_graph
from .tree_input import add_input, frame, open_input

if TYPE_CHECKING:
    from rich.text import Text

NAME = 'tf_monitor'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

_DESCRIPTION = """\
Shows every edge of a tree, or those between two frames: its rate, delay, longest gap,
refused transforms and publisher; those with trouble first. On a terminal the table refreshes
in place; in a pipe it is printed once in each period.

Delays and gaps are measured since the start; rates over the last seconds. The exit status is
0 if all is well, 1 if there is an error at the end, 2 if there were no transforms to watch.
Ctrl-C ends it."""

_EXAMPLES = (
    ('tf_monitor', 'every edge of the running robot'),
    ('tf_monitor map base_link', 'the edges between two frames'),
    ('tf_monitor --noise', 'how much each edge trembles'),
    ('tf_monitor --period 10 --json >> night.jsonl', 'one line every ten seconds'),
    ('tf_monitor --bag run.mcap', 'one table of a whole recording'),
)
_MARKS = {Severity.ERROR: '!!', Severity.WARNING: '!'}
_REFUSED, _NOISE = 'refused', 'noise'
_HEADINGS = ('', 'parent -> child', 'rate', 'p50 ms', 'p95 ms', 'gap ms', _NOISE, _REFUSED, 'from')
_NUMBERS = _HEADINGS[2:-1]
# The lines of a terminal that are not rows, and the maximum number of findings below the table.
_FRAME_LINES, _MOST_FINDINGS = 6, 8


class TableContent(NamedTuple):
    """
    The content of the table at a moment.

    :ivar findings: errors and warnings, the worst first.
    :ivar chain: the lookup between the two requested frames, if any.
    :ivar hints: what the ROS graph shows, if nothing has arrived or that lookup has no answer.
    :ivar shared: the tree that ``tf_share`` shares for the same topics, if it does.
    :ivar noise: that of each edge, by parent and child, if it was asked for and is known.
    """

    source: str
    transforms: int
    watched_s: float
    rows: list[Watched]
    findings: list[Finding]
    chain: Explanation | None
    hints: list[Hint]
    shared: Status | None
    noise: dict[tuple[str, str], EdgeNoise]


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('target', metavar='TARGET', type=frame, nargs='?',
                        help='show the edges from here')
    parser.add_argument('source', metavar='SOURCE', type=frame, nargs='?', help='to there')
    add_number(parser, '--period', 1.0, 'seconds between two updates')
    add_number(parser, '--seconds', None, 'stop after this many seconds')
    parser.add_argument('--noise', action='store_true',
                        help="also show the noise of each moving edge's samples, which is learnt")
    parser.add_json()
    add_input(parser)
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.target and not arguments.source:
        raise Cannot('give both frames of a chain: TARGET and SOURCE')
    doctor = Doctor()
    showing, look = nullcontext(_print_json) if arguments.json else _on_screen(console()), None
    with open_input(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as tree_input:
        with showing as show, suppress(KeyboardInterrupt):
            for look in _looks(tree_input, doctor, arguments):
                show(look)
        if look is None or not look.transforms:
            raise nothing_arrived(tree_input)
    return FOUND if any(one.severity is Severity.ERROR for one in look.findings) else FINE


def _looks(tree_input: TreeInput, doctor: Doctor, arguments: Namespace) -> Iterator[TableContent]:
    """Yield the content, once in each period; of a recording once."""
    monitor, begin = Monitor(doctor), time.monotonic()
    live = arguments.bag is None
    while True:
        tree_input.watch(arguments.period if live else arguments.seconds)
        now = time.monotonic()
        yield _look(tree_input, doctor, monitor, arguments, now)
        if not live or (arguments.seconds and now - begin >= arguments.seconds):
            return


def _look(tree_input: TreeInput, doctor: Doctor, monitor: Monitor, arguments: Namespace,
          now: float) -> TableContent:
    at = tree_input.now()
    findings = [one for one in tree_input.findings(doctor, at)
                if one.severity is not Severity.NOTE]
    rows, chain = _named(monitor.look(now, findings, at), tree_input), None
    if arguments.target:
        chain = explain(tree_input.buffer, arguments.target, arguments.source, now=at)
        wanted = {(edge.info.parent, edge.info.child) for edge in chain.edges}
        rows = [row for row in rows if (row.signs.parent, row.signs.child) in wanted]
        findings = [one for one in findings if any(one in row.findings for row in rows)]
    lacks = not doctor.transforms or (chain is not None and bool(chain.problem))
    hints = hints_of_graph(doctor.graph, chain) if lacks else []
    return TableContent(tree_input.name, doctor.transforms, doctor.watched / 1e9, rows, findings,
                        chain, hints, tree_input.shared(),
                        _noise_of(tree_input.buffer) if arguments.noise else {})


def _noise_of(buffer: BufferCore) -> dict[tuple[str, str], EdgeNoise]:
    """Return the noise of each edge for which it is known."""
    return {(edge.parent, edge.child): noise for edge in buffer.edges()
            if (noise := known_noise(buffer, edge)) is not None}


def _named(rows: Sequence[Watched], tree_input: TreeInput) -> list[Watched]:
    """Add the publishers of edges that arrived before their names were known to the buffer."""
    known = {(edge.parent, edge.child): edge.authority for edge in tree_input.buffer.edges()}

    def named(row: Watched) -> Watched:
        sender = known.get((row.signs.parent, row.signs.child))
        if row.signs.publishers or not sender:
            return row
        return replace(row, signs=replace(row.signs, publishers=(sender,)))

    return list(map(named, rows))


def _print_json(look: TableContent) -> None:
    print_json_line({
        'version': VERSION, 'source': look.source, 'transforms': look.transforms,
        'watched_s': look.watched_s, 'edges': [_plain(row, look) for row in look.rows],
        'findings': [finding.as_dict() for finding in look.findings],
        'problem': look.chain.problem if look.chain else '',
        'hints': [hint.text for hint in look.hints],
        'shared': look.shared and look.shared.as_dict()})


def _plain(row: Watched, look: TableContent) -> dict[str, object]:
    noise = look.noise.get((row.signs.parent, row.signs.child))
    return {**row.as_dict(), 'noise': None if noise is None else noise.as_dict()}


# --- for people

@contextmanager
def _on_screen(out: Any) -> Iterator[Callable[[TableContent], None]]:
    """
    Yield a function that shows a content: in place on a terminal, below the last one in a pipe.

    :param out: rich's console.
    """
    def print_below(look: TableContent) -> None:
        out.print(*_drawn(look, None), sep='\n')
        sys.stdout.flush()

    if not out.is_terminal:
        yield print_below
        return
    group = needs('rich.console', 'rich').Group
    with needs('rich.live', 'rich').Live(console=out, auto_refresh=False) as live:
        yield lambda look: live.update(
            group(*_drawn(look, out.height - _FRAME_LINES)), refresh=True)


def _drawn(look: TableContent, most: int | None) -> Iterator[object]:
    """Yield rich's drawing of a content, in at most so many lines."""
    text = needs('rich.text', 'rich').Text
    yield text(f'{shown(look.source)}: {look.transforms} transforms, {len(look.rows)} edges, '
               f'{look.watched_s:.0f} s')
    if look.shared is not None:
        yield (styled(f'not shared: {look.shared.problem}', 'warning') if look.shared.problem
               else text(f'shared by {look.shared.sentence}'))
    if look.chain is not None and look.chain.problem:
        for line in look.chain.problem.split('\n'):  # the hint of an error is a line of its own
            yield styled(line, 'warning')
    for hint in look.hints:
        yield styled('', 'warning').append(shown(hint.text, 1000))
    hinted = {hint.text for hint in look.hints}
    findings = [one for one in look.findings[:_MOST_FINDINGS] if hint_of(one) not in hinted]
    room = len(look.rows) if most is None else max(3, most - len(findings))
    yield table(*_without_empty(_HEADINGS, [
        _cells(row, look) for row in look.rows[:room]]), _NUMBERS)
    if len(look.rows) > room:
        yield text(f'and {len(look.rows) - room} more edges')
    for finding in findings:
        begun = styled(f'{finding.severity.value} {finding.code}', finding.severity.value)
        what = listed(finding.frames, longest=60) or finding.summary
        begun.append(f'  {shown(what)}', style='none')
        begun.truncate(200)
        yield begun
    if len(look.findings) > _MOST_FINDINGS:
        yield text(f'and {len(look.findings) - _MOST_FINDINGS} more findings: tf_doctor')


def _without_empty(headings: Sequence[str], rows: Sequence[Sequence['str | Text']]
                   ) -> tuple[list[str], list[list['str | Text']]]:
    """Return a table without the optional columns that are empty."""
    kept = [place for place, heading in enumerate(headings)
            if heading not in ('', _NOISE, _REFUSED) or any(row[place] for row in rows)]
    return [headings[place] for place in kept], [[row[place] for place in kept] for row in rows]


def _cells(row: Watched, look: TableContent) -> Sequence['str | Text']:
    signs = row.signs
    rate = 'static' if signs.static else f'{row.rate_hz:.1f} Hz'
    gap = max(signs.longest_gap or 0, signs.silence or 0)
    cells = [_MARKS.get(row.severity, '') if row.severity else '',
             f'{signs.parent} -> {signs.child}', rate, _ms(signs.delay_p50), _ms(signs.delay_p95),
             '' if signs.static else _ms(gap),
             noise_of(look.noise.get((signs.parent, signs.child))), str(signs.refused or ''),
             listed(signs.publishers, most=2) or '-']
    severity = row.severity
    return cells if severity is None else [styled(cell, severity.value) for cell in cells]


def _ms(span: int | None) -> str:
    return '' if span is None else f'{span / 1e6:.1f}'


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
