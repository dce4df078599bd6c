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

"""The command ``tf_monitor``: a live table of every edge, trouble first."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
import sys
import time
from typing import Any, NamedTuple

from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.monitor import Monitor, Watched
from tf_tree_py.core.telling.explanation import explain, Explanation
from tf_tree_py.core.text import listed

from .arguments import add_number, frame, Parser
from .endings import Cannot, entry_point, FINE, FOUND, needs
from .output import console, print_json_line, shown, styled, table
from .source import nothing_arrived, open_source, TreeSource

NAME = 'tf_monitor'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

_DESCRIPTION = """\
Shows every edge of a tree, or those between two frames: how often it comes, how late, its
longest gap, who sends it and what was refused; those with trouble first. On a terminal the
table refreshes in place; in a pipe it is printed once in each period.

Delays and gaps are those since it began to watch; rates are those of the last seconds. The
exit status is 0 if all is well, 1 if there is an error at the end, 2 if nothing could be
watched. Ctrl-C ends."""

_EXAMPLES = (
    ('tf_monitor', 'every edge of the running robot'),
    ('tf_monitor map base_link', 'those between two frames'),
    ('tf_monitor --period 10 --json >> night.jsonl', 'one line every ten seconds'),
    ('tf_monitor --bag run.mcap', 'one table of a whole recording'),
)
_MARKS = {Severity.ERROR: '!!', Severity.WARNING: '!'}
_REFUSED = 'refused'
_HEADINGS = ('', 'parent -> child', 'rate', 'p50 ms', 'p95 ms', 'gap ms', _REFUSED, 'from')
_NUMBERS = _HEADINGS[2:-1]
# Lines of a terminal that are not rows of the table; and so many findings below it at most.
_FRAME_LINES, _MOST_FINDINGS = 6, 8


class Look(NamedTuple):
    """
    What there is to show at a moment.

    :ivar findings: errors and warnings, the worst first.
    :ivar chain: the lookup between the two frames that were asked for, if they were.
    """

    source: str
    transforms: int
    watched_s: float
    rows: list[Watched]
    findings: list[Finding]
    chain: Explanation | None


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('target', metavar='TARGET', type=frame, nargs='?',
                        help='show the edges from here')
    parser.add_argument('source', metavar='SOURCE', type=frame, nargs='?', help='to there')
    add_number(parser, '--period', 1.0, 'seconds from one look to the next')
    add_number(parser, '--seconds', None, 'end after so long')
    parser.add_json()
    parser.add_source()
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.target and not arguments.source:
        raise Cannot('a chain has two ends: TARGET and SOURCE')
    doctor = Doctor()
    shown_on, look = (_Pipe() if arguments.json else _Screen()), None
    with open_source(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as source:
        with shown_on, suppress(KeyboardInterrupt):
            for look in _looks(source, doctor, arguments):
                shown_on.tell(look)
        if look is None or not look.transforms:
            raise nothing_arrived(source)
    return FOUND if any(one.severity is Severity.ERROR for one in look.findings) else FINE


def _looks(source: TreeSource, doctor: Doctor, arguments: Namespace) -> Iterator[Look]:
    """Yield what there is to show, once in each period; of a recording once."""
    monitor, begin = Monitor(doctor), time.monotonic()
    live = arguments.bag is None
    while True:
        source.watch(arguments.period if live else arguments.seconds)
        now = time.monotonic()
        doctor.endpoints = source.endpoints()
        yield _look(source, doctor, monitor, arguments, now)
        if not live or (arguments.seconds and now - begin >= arguments.seconds):
            return


def _look(source: TreeSource, doctor: Doctor, monitor: Monitor, arguments: Namespace,
          now: float) -> Look:
    findings = [one for one in doctor.findings() if one.severity is not Severity.NOTE]
    rows, chain = _named(monitor.look(now, findings), source), None
    if arguments.target:
        chain = explain(source.buffer, arguments.target, arguments.source, now=source.now())
        wanted = {(edge.info.parent, edge.info.child) for edge in chain.edges}
        rows = [row for row in rows if (row.signs.parent, row.signs.child) in wanted]
        findings = [one for one in findings if any(one in row.findings for row in rows)]
    return Look(source.name, doctor.transforms, doctor.watched / 1e9, rows, findings, chain)


def _named(rows: Sequence[Watched], source: TreeSource) -> list[Watched]:
    """Name who sent what came before its sender was known; by now the buffer knows it."""
    known = {(edge.parent, edge.child): edge.authority for edge in source.buffer.edges()}

    def named(row: Watched) -> Watched:
        sender = known.get((row.signs.parent, row.signs.child))
        if row.signs.publishers or not sender:
            return row
        return replace(row, signs=replace(row.signs, publishers=(sender,)))

    return list(map(named, rows))


class _Pipe(nullcontext[None]):
    """Prints one look after the other for programs."""

    def tell(self, look: Look) -> None:
        """Print one."""
        print_json_line({
            'version': VERSION, 'source': look.source, 'transforms': look.transforms,
            'watched_s': look.watched_s, 'edges': [row.as_dict() for row in look.rows],
            'findings': [finding.as_dict() for finding in look.findings],
            'problem': look.chain.problem if look.chain else ''})


# --- for people

class _Screen(AbstractContextManager[None]):
    """Shows one look after the other: in place on a terminal, below each other in a pipe."""

    def __init__(self) -> None:
        self._out = console()
        self._group = needs('rich.console', 'rich', 'tools').Group
        self._live = needs('rich.live', 'rich', 'tools').Live(
            console=self._out, auto_refresh=False) if self._out.is_terminal else None

    def __enter__(self) -> None:
        if self._live is not None:
            self._live.start()

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def tell(self, look: Look) -> None:
        """Show one."""
        if self._live is not None:
            rows = self._out.height - _FRAME_LINES
            self._live.update(self._group(*_drawn(look, rows)), refresh=True)
        else:
            self._out.print(*_drawn(look, None), sep='\n')
            sys.stdout.flush()


def _drawn(look: Look, most: int | None) -> Iterator[Any]:
    """Yield what rich draws of a look, in so many lines at most."""
    text = needs('rich.text', 'rich', 'tools').Text
    yield text(f'{shown(look.source)}: {look.transforms} transforms, {len(look.rows)} edges, '
               f'{look.watched_s:.0f} s')
    if look.chain is not None and look.chain.problem:
        yield styled(look.chain.problem, 'warning')
    findings = look.findings[:_MOST_FINDINGS]
    room = len(look.rows) if most is None else max(3, most - len(findings))
    yield table(*_without_empty(_HEADINGS, [_cells(row) for row in look.rows[:room]]), _NUMBERS)
    if len(look.rows) > room:
        yield text(f'and {len(look.rows) - room} more edges')
    for finding in findings:
        line = styled(f'{finding.severity.value} {finding.code}', finding.severity.value)
        line.append(f'  {shown(listed(finding.frames, longest=60))}', style='none')
        line.truncate(200)
        yield line
    if len(look.findings) > len(findings):
        yield text(f'and {len(look.findings) - len(findings)} more findings: tf_doctor')


def _without_empty(headings: Sequence[str], rows: list[list[Any]]
                   ) -> tuple[list[str], list[list[Any]]]:
    """Return a table without the columns that say nothing: most trees are well."""
    kept = [place for place, heading in enumerate(headings)
            if heading not in ('', _REFUSED) or any(row[place] for row in rows)]
    return [headings[place] for place in kept], [[row[place] for place in kept] for row in rows]


def _cells(row: Watched) -> list[Any]:
    signs = row.signs
    kind = 'static' if signs.static else f'{row.rate_hz:.1f} Hz'
    gap = max(signs.longest_gap or 0, signs.silence or 0)
    cells = [_MARKS.get(row.severity, '') if row.severity else '',
             f'{signs.parent} -> {signs.child}', kind, _ms(signs.delay_p50), _ms(signs.delay_p95),
             '' if signs.static else _ms(gap), str(signs.refused or ''),
             listed(signs.publishers, most=2) or '-']
    severity = row.severity
    return cells if severity is None else [styled(cell, severity.value) for cell in cells]


def _ms(span: int | None) -> str:
    return '' if span is None else f'{span / 1e6:.1f}'


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
