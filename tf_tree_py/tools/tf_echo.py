# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_echo``: the result of a lookup, repeatedly, and the reasons for it."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
import sys
import time

from tf_tree_py.command.arguments import (
    add_number,
    console,
    fits,
    Parser,
    positive_number,
    print_json_line,
    shown,
    table,
)
from tf_tree_py.command.endings import Cannot, entry_point, FINE, FOUND
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_CACHE_TIME
from tf_tree_py.core.buffer.waiting import WallDeadline
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import format_span, format_stamp, from_seconds, LATEST, UNLIMITED
from tf_tree_py.core.text import listed
from tf_tree_py.reports import explanation_text
from tf_tree_py.reports.explanation import Certainty, explain, ExplainedEdge, Explanation
from tf_tree_py.reports.plain_text import FORMS

from .inputs import nothing_arrived, TreeInput
from .missing import Hint, hints_of_graph, Refusals
from .tree_input import add_input, frame, open_input, stamp

NAME = 'tf_echo'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

_DESCRIPTION = """\
Prints the result of lookup_transform(TARGET, SOURCE): the pose of SOURCE in TARGET, with
its stamp and age. Until a lookup succeeds, it reports what is missing.

The exit status is 0 if a lookup succeeded, 1 if none did, 2 if no transforms could be
received. Press Ctrl-C to stop."""

_EXAMPLES = (
    ('tf_echo map base_link', 'once a second, until Ctrl-C'),
    ('tf_echo map base_link 10', 'ten times a second'),
    ('tf_echo map base_link --once --explain', 'the path, and the age of each edge'),
    ('tf_echo map base_link --bag run.mcap', 'every second of a recording'),
    ('tf_echo map base_link --once --max-age 0.5', 'does every edge still arrive?'),
    ('tf_echo map camera --bag run.mcap --at 1700000000.25 --as all', 'at a stamp'),
)
_PATIENCE_S = 10.0
_RATE = 1.0


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('target', metavar='TARGET', type=frame,
                        help='the frame to express the pose in')
    parser.add_argument('source', metavar='SOURCE', type=frame,
                        help='the frame whose pose is printed')
    parser.add_argument('rate_of_tf2', metavar='RATE', nargs='?', type=positive_number,
                        help='the same as --rate, as in tf2_echo')
    add_number(parser, '--rate', None,
               f'lookups per second, in a recording of its own time (default {_RATE:g})')
    parser.add_argument('--once', action='store_true',
                        help='stop after the first answer; in a recording, print only the last')
    parser.add_argument('--at', metavar='STAMP', type=stamp, default=LATEST,
                        help='look up once, at this stamp in seconds (default: the latest)')
    add_number(parser, '--max-age', None,
               'accept no latest transform that is older than this, in seconds')
    parser.add_argument('--as', dest='form', choices=FORMS, default='rpy',
                        help='how to write the pose (default rpy)')
    parser.add_argument('--explain', action='store_true',
                        help='also print the path and each of its edges')
    add_number(parser, '--seconds', None, 'when to give up, in seconds '
               f'(default: {_PATIENCE_S:g} with --once or --at, otherwise never)')
    parser.add_json()
    add_input(parser)
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    _check(arguments)
    if arguments.explain and not arguments.json:
        console()  # a missing package has to be reported first, and not in the middle
    window = UNLIMITED if arguments.at != LATEST else DEFAULT_CACHE_TIME
    refusals = Refusals(recorded=arguments.bag is not None)
    with open_input(arguments, NAME, [refusals], cache_time=window) as tree_input:
        printer = _Printer(arguments, tree_input, refusals)
        with suppress(KeyboardInterrupt):
            for explanation in _asked(tree_input, arguments):
                printer.show(explanation)
        if not printer.answered and not tree_input.buffer.frames():
            raise nothing_arrived(tree_input)
    return FINE if printer.answered else FOUND


def _check(arguments: Namespace) -> None:
    if arguments.rate_of_tf2 is not None and arguments.rate is not None:
        raise Cannot(f'{arguments.rate_of_tf2:g} and --rate {arguments.rate:g}: give one rate')
    for option, is_given in (('--at', arguments.at != LATEST), ('--bag', arguments.bag)):
        if is_given and arguments.max_age is not None:
            raise Cannot(f'--max-age concerns the present, and not {option}: omit one of them')


def _rate(arguments: Namespace) -> float:
    rate: float = arguments.rate_of_tf2 or arguments.rate or _RATE
    return rate


def _max_age(arguments: Namespace) -> int | None:
    return None if arguments.max_age is None else from_seconds(arguments.max_age)


def _asked(tree_input: TreeInput, arguments: Namespace) -> Iterator[Explanation]:
    """Yield the result of each lookup."""
    def ask() -> Explanation:
        return explain(tree_input.buffer, arguments.target, arguments.source, arguments.at,
                       tree_input.now(), _max_age(arguments), arguments.explain)

    if arguments.once or arguments.at != LATEST:
        yield from _one(tree_input, arguments, ask)
        return
    period, begin = 1.0 / _rate(arguments), time.monotonic()
    while True:
        more = tree_input.watch(period)
        yield ask()
        over = arguments.seconds and time.monotonic() - begin >= arguments.seconds
        if not more or (over and not arguments.bag):
            return


def _one(tree_input: TreeInput, arguments: Namespace,
         ask: Callable[[], Explanation]) -> Iterator[Explanation]:
    """Yield one result; before it, the missing data as long as there is none."""
    if arguments.bag:
        tree_input.watch(arguments.seconds)
        yield ask()
        return
    patience = arguments.seconds or _PATIENCE_S
    # Nodes need a moment to discover each other: data that is missing until then is not reported.
    for seconds in (min(1.0, patience), max(0.0, patience - 1.0)):
        with suppress(TransformException):
            tree_input.buffer.wait_for(
                lambda: tree_input.buffer.lookup_no_older(
                    arguments.target, arguments.source, arguments.at, _max_age(arguments)),
                WallDeadline(seconds))
            if arguments.explain or arguments.json:
                tree_input.await_covariances()
        explanation = ask()
        yield explanation
        if explanation.pose is not None:
            return


class _Printer:
    """
    A printer of results, and of the missing data when that changes.

    :ivar answered: whether a lookup succeeded.
    """

    def __init__(self, arguments: Namespace, tree_input: TreeInput, refusals: Refusals) -> None:
        self.answered = False
        self._arguments = arguments
        self._tree_input, self._refusals = tree_input, refusals
        self._missing = ''
        self._last = LATEST
        self._hinted: set[str] = set()

    def show(self, explanation: Explanation) -> None:
        """Print one result."""
        self.answered = self.answered or explanation.pose is not None
        hints = self._hints(explanation)
        if self._is_new(explanation):
            self._hinted.clear()
        if self._arguments.json:
            print_json_line({'version': VERSION, **explanation.as_dict(),
                             'hints': [hint.text for hint in hints]})
        elif explanation.pose is None:
            self._print_missing(explanation)
        else:
            self._missing = ''
            self._print_answer(explanation)
        self._print_new(hints)
        self._last = explanation.stamp

    def _hints(self, explanation: Explanation) -> list[Hint]:
        """Return what may explain that there is no answer, or none with new data."""
        refused = list(self._refusals.hints(explanation.edges, explanation.now))
        if self._is_new(explanation):
            return []
        return refused + hints_of_graph(self._tree_input.graph(), explanation)

    def _is_new(self, explanation: Explanation) -> bool:
        """Return whether there is an answer, from newer data than the last one or static."""
        return explanation.pose is not None and (
            explanation.slowest is None or explanation.stamp != self._last)

    def _print_new(self, hints: Sequence[Hint]) -> None:
        """Print the hints that were not printed since the last new data."""
        for hint in hints:
            if hint.about not in self._hinted and not self._arguments.json:
                print(f'  {shown(hint.text, 2000)}', flush=True)
        self._hinted.update(hint.about for hint in hints)

    def _print_missing(self, explanation: Explanation) -> None:
        text = '\n'.join(_missing(explanation))
        if text != self._missing:
            self._missing = text
            print(text, flush=True)
            self._print_edges(explanation)

    def _print_answer(self, explanation: Explanation) -> None:
        assert explanation.pose is not None
        pose = FORMS[self._arguments.form](explanation.pose)
        stamped, remark = _stamp_and_age(explanation), self._remark(explanation)
        line = f'{stamped}  {pose}'
        if '\n' not in pose and fits(line):
            print(f'{line}{remark}', flush=True)
        else:
            print(f'{stamped}{remark}\n{pose}\n', flush=True)
        self._print_edges(explanation)

    def _remark(self, explanation: Explanation) -> str:
        slowest = explanation.slowest
        if slowest is None or self._is_new(explanation):
            return ''
        return f'  no new data of {_edge(slowest)}'

    def _print_edges(self, explanation: Explanation) -> None:
        if not self._arguments.explain or not explanation.edges:
            return
        out = console()
        out.print(shown(' <- '.join(reversed(explanation.frames)), 500), markup=False)
        out.print(table(_HEADINGS, [_cells(edge, explanation.stamp)
                                    for edge in explanation.edges], _NUMBERS))
        noise = '; '.join(f'{_edge(edge)} {explanation_text.noise_of(edge.noise)}'
                          for edge in explanation.edges if edge.noise is not None)
        if noise:
            out.print(shown(f'noise of the samples: {noise}', 500), markup=False)
        if explanation.certainty is not None:
            out.print(shown(_sigma(explanation.certainty), 500), markup=False)


def _missing(explanation: Explanation) -> Iterator[str]:
    """Yield lines with the missing data, the known frames, and similar names."""
    what = f'{explanation.target} <- {explanation.source}'
    if not explanation.unknown:
        sentence, *hints = explanation.problem.split('\n')
        yield shown(f'no answer for {what}: {sentence}', 1000)
        for hint in hints:
            yield f'  {shown(hint, 1000)}'
        return
    for name, meant in explanation.unknown:
        hint = f': did you mean {meant!r}?' if meant else ''
        yield shown(f'no answer for {what}: unknown frame {name!r}{hint}', 1000)
    yield f'  known frames: {shown(listed(explanation.known, 40), 2000) or "none"}'


def _stamp_and_age(explanation: Explanation) -> str:
    if explanation.stamp == LATEST:
        return f'{"static":20}'
    age = '' if explanation.age is None else f'  age {explanation.age / 1e6:8.1f} ms'
    return f'{format_stamp(explanation.stamp):>20}{age}'


def _edge(edge: ExplainedEdge) -> str:
    return shown(f'{edge.info.parent} -> {edge.info.child}')


def _sigma(certainty: Certainty) -> str:
    parts = '; '.join(f'{edge} {part}' for edge, part in explanation_text.shares(certainty))
    return f'sigma {explanation_text.sigma(certainty)}: {parts}'


_HEADINGS = ('parent -> child', 'kind', 'age', 'around', 'apart', 'from')
_NUMBERS = ('kind', 'age', 'around', 'apart')


def _cells(edge: ExplainedEdge, stamp: int) -> tuple[str, ...]:
    sender = edge.info.authority or '-'
    if edge.info.static:
        return (_edge(edge), 'static', '', '', '', sender)
    return (_edge(edge), explanation_text.rate_of(edge), _age(edge),
            explanation_text.around(edge, stamp), explanation_text.apart(edge), sender)


def _age(edge: ExplainedEdge) -> str:
    return '' if edge.age is None else _milliseconds(edge.age)


def _milliseconds(span: int) -> str:
    return f'{span / 1e6:.1f} ms' if abs(span) < 10_000_000_000 else format_span(span)


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
