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

"""The command ``tf_echo``: what a lookup answers, again and again, and why."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
import sys
import time
from typing import Any

from tf_tree_py.core.buffer.buffer_core import DEFAULT_CACHE_TIME
from tf_tree_py.core.buffer.deadline import WallDeadline
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST, UNLIMITED
from tf_tree_py.core.telling import words
from tf_tree_py.core.telling.certainty import Certainty
from tf_tree_py.core.telling.explanation import explain, ExplainedEdge, Explanation
from tf_tree_py.core.telling.poses import FORMS
from tf_tree_py.core.text import listed

from .arguments import add_number, frame, Parser, stamp
from .endings import entry_point, FINE, FOUND
from .output import console, fits, print_json_line, shown, table
from .source import nothing_arrived, open_source, TreeSource

NAME = 'tf_echo'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

_DESCRIPTION = """\
Prints what lookup_transform(TARGET, SOURCE) answers: where SOURCE is in TARGET, with
the stamp of the answer and its age. Before there is an answer it says what is missing.

The exit status is 0 if there was an answer, 1 if there was none, 2 if nothing could be
heard. Ctrl-C ends."""

_EXAMPLES = (
    ('tf_echo map base_link', 'once a second, until Ctrl-C'),
    ('tf_echo map base_link --once --explain', 'the path, and how old each edge is'),
    ('tf_echo map base_link --bag run.mcap', 'each second of a recording'),
    ('tf_echo map camera --bag run.mcap --at 1700000000.25 --as all', 'at a stamp'),
)
_PATIENCE_S = 10.0


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('target', metavar='TARGET', type=frame, help='in whose coordinates')
    parser.add_argument('source', metavar='SOURCE', type=frame, help='whose place is asked for')
    add_number(parser, '--rate', 1.0, 'how often to ask, Hz; of a recording, by its own time')
    parser.add_argument('--once', action='store_true',
                        help='end with the first answer; of a recording, the last')
    parser.add_argument('--at', metavar='STAMP', type=stamp, default=LATEST,
                        help='ask once, for this stamp, seconds; else for the latest')
    parser.add_argument('--as', dest='form', choices=FORMS, default='rpy',
                        help='how to write the pose (rpy unless given)')
    parser.add_argument('--explain', action='store_true',
                        help='tell the path and each edge of it, too')
    add_number(parser, '--seconds', None, 'when to give up and end; '
               f'{_PATIENCE_S:g} with --once or --at, and never without, unless given')
    parser.add_json()
    parser.add_source()
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.explain and not arguments.json:
        console()  # what it needs should be missed before, and not in the middle
    window = UNLIMITED if arguments.at != LATEST else DEFAULT_CACHE_TIME
    teller = _Teller(arguments)
    with open_source(arguments, NAME, cache_time=window) as source:
        with suppress(KeyboardInterrupt):
            for explanation in _asked(source, arguments):
                teller.tell(explanation)
        if not teller.answered and not source.buffer.frames():
            raise nothing_arrived(source)
    return FINE if teller.answered else FOUND


def _asked(source: TreeSource, arguments: Namespace) -> Iterator[Explanation]:
    """Yield what each lookup answers."""
    def ask() -> Explanation:
        return explain(source.buffer, arguments.target, arguments.source, arguments.at,
                       source.now())

    if arguments.once or arguments.at != LATEST:
        yield from _one(source, arguments, ask)
        return
    period, begin = 1.0 / arguments.rate, time.monotonic()
    while True:
        more = source.watch(period)
        yield ask()
        over = arguments.seconds and time.monotonic() - begin >= arguments.seconds
        if not more or (over and not arguments.bag):
            return


def _one(source: TreeSource, arguments: Namespace, ask: Any) -> Iterator[Explanation]:
    """Yield one answer, after what is missing as long as there is none."""
    if arguments.bag:
        source.watch(arguments.seconds)
        yield ask()
        return
    patience = arguments.seconds or _PATIENCE_S
    # Nodes need a moment to find each other: what is missing until then is no news.
    for seconds in (min(1.0, patience), max(0.0, patience - 1.0)):
        with suppress(TransformException):
            source.buffer.wait_for(
                lambda: source.buffer.lookup_stamped(
                    arguments.target, arguments.source, arguments.at), WallDeadline(seconds))
            if arguments.explain or arguments.json:
                source.await_covariances()
        explanation = ask()
        yield explanation
        if explanation.pose is not None:
            return


class _Teller:
    """
    Prints answers, and what is missing when that changes.

    :ivar answered: whether there was an answer.
    """

    def __init__(self, arguments: Namespace) -> None:
        self.answered = False
        self._arguments = arguments
        self._missing = ''
        self._last = LATEST

    def tell(self, explanation: Explanation) -> None:
        """Print one."""
        self.answered = self.answered or explanation.pose is not None
        if self._arguments.json:
            print_json_line({'version': VERSION, **explanation.as_dict()})
        elif explanation.pose is None:
            self._tell_missing(explanation)
        else:
            self._missing = ''
            self._tell_answer(explanation)
            self._last = explanation.stamp

    def _tell_missing(self, explanation: Explanation) -> None:
        text = '\n'.join(_missing(explanation))
        if text != self._missing:
            self._missing = text
            print(text, flush=True)
            self._tell_edges(explanation)

    def _tell_answer(self, explanation: Explanation) -> None:
        assert explanation.pose is not None
        pose = FORMS[self._arguments.form](explanation.pose)
        stamped, remark = _stamp_and_age(explanation), self._remark(explanation)
        line = f'{stamped}  {pose}'
        if '\n' not in pose and fits(line):
            print(f'{line}{remark}', flush=True)
        else:
            print(f'{stamped}{remark}\n{pose}\n', flush=True)
        self._tell_edges(explanation)

    def _remark(self, explanation: Explanation) -> str:
        slowest = explanation.slowest
        if slowest is None or explanation.stamp != self._last:
            return ''
        return f'  no new data of {_edge(slowest)}'

    def _tell_edges(self, explanation: Explanation) -> None:
        if not self._arguments.explain or not explanation.edges:
            return
        out = console()
        out.print(shown(' <- '.join(reversed(explanation.frames)), 500), markup=False)
        out.print(table(_HEADINGS, [_cells(edge, explanation.stamp)
                                    for edge in explanation.edges], _NUMBERS))
        if explanation.certainty is not None:
            out.print(shown(_sigma(explanation.certainty), 500), markup=False)


def _missing(explanation: Explanation) -> Iterator[str]:
    """Yield lines: what is missing, which frames there are, and which may be meant."""
    what = f'{explanation.target} <- {explanation.source}'
    if not explanation.unknown:
        yield shown(f'no answer for {what}: {explanation.problem}', 1000)
        return
    for name, meant in explanation.unknown:
        hint = f': did you mean {meant!r}?' if meant else ''
        yield shown(f'no answer for {what}: nobody has published {name!r}{hint}', 1000)
    yield f'  there is: {shown(listed(explanation.known, 40), 2000) or "no frame yet"}'


def _stamp_and_age(explanation: Explanation) -> str:
    if explanation.stamp == LATEST:
        return f'{"static":20}'
    age = '' if explanation.age is None else f'  age {explanation.age / 1e6:8.1f} ms'
    return f'{format_stamp(explanation.stamp):>20}{age}'


def _edge(edge: ExplainedEdge) -> str:
    return shown(f'{edge.info.parent} -> {edge.info.child}')


def _sigma(certainty: Certainty) -> str:
    parts = '; '.join(f'{edge} {part}' for edge, part in words.shares(certainty))
    return f'sigma {words.sigma(certainty)}: {parts}'


_HEADINGS = ('parent -> child', 'kind', 'age', 'around', 'apart', 'from')
_NUMBERS = ('kind', 'age', 'around', 'apart')


def _cells(edge: ExplainedEdge, stamp: int) -> tuple[str, ...]:
    sender = edge.info.authority or '-'
    if edge.info.static:
        return (_edge(edge), 'static', '', '', '', sender)
    return (_edge(edge), words.kind_of(edge), _age(edge), words.around(edge, stamp),
            words.apart(edge), sender)


def _age(edge: ExplainedEdge) -> str:
    return '' if edge.age is None else _milliseconds(edge.age)


def _milliseconds(span: int) -> str:
    return f'{span / 1e6:.1f} ms' if abs(span) < 10_000_000_000 else format_span(span)


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
