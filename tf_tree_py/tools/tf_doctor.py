# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_doctor``: reports what is wrong with a tree, the worst first."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
import sys
from typing import Any

from tf_tree_py.command.arguments import (
    add_number,
    console,
    fields,
    Parser,
    print_json,
    shown,
    styled,
)
from tf_tree_py.command.endings import entry_point, FINE, FOUND
from tf_tree_py.core.text import listed
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor

from .doctor_report import add_limits, judged, limits_of
from .tree_input import add_input, open_input

NAME = 'tf_doctor'
_DESCRIPTION = """\
Watches a tree, live or recorded, and reports what is wrong with it, the worst first,
each with its evidence, the likely cause and what to do.

The exit status is 0 if all is well, 1 with an error (with --strict: or a warning),
2 if there were no transforms to watch. Ctrl-C ends the watch and prints the findings."""

_EXAMPLES = (
    ('tf_doctor', 'watch the running robot for ten seconds'),
    ('tf_doctor --bag run.mcap --strict', 'check a recording; exit status 1 also with a warning'),
    ('tf_doctor --seconds 60 --json', 'for a nightly job'),
    ('tf_doctor --list', 'explain every code'),
)
_LIVE_S = 10.0


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    add_number(parser, '--seconds', None, f'how long to watch; {_LIVE_S:g} live, and all of a '
               'recording, unless given')
    parser.add_argument('--strict', action='store_true',
                        help='exit with 1 also for a warning or a damaged bag')
    parser.add_argument('--notes', action='store_true',
                        help='also print notes, which need no action')
    parser.add_argument('--list', action='store_true', help='explain every code, and exit')
    parser.add_json()
    add_input(parser)
    add_limits(parser)
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.list:
        _list(arguments.json)
        return FINE
    doctor = Doctor(limits_of(arguments), recorded=arguments.bag is not None)
    with open_input(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as tree_input:
        interrupted = True
        with suppress(KeyboardInterrupt):
            tree_input.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
            interrupted = False
        report, findings = judged(tree_input, doctor, interrupted)
    if arguments.json:
        print_json(report)
    else:
        _print(report, findings, arguments.notes)
    strictly = arguments.strict and (report['warnings'] or report['damage'])
    return FOUND if report['errors'] or strictly else FINE


# --- for people

def _print(report: dict[str, Any], findings: Sequence[Finding], with_notes: bool) -> None:
    out = console()
    for sentence in report['damage']:
        out.print(styled(sentence, 'warning'))
    shown_findings = [finding for finding in findings
                      if with_notes or finding.severity is not Severity.NOTE]
    for finding in _first_of_each(shown_findings):
        out.print(_heading(finding))
        out.print(fields({'': finding.summary, 'from': finding.senders,
                          'cause': finding.cause, 'fix': finding.fix}))
        alike = [f'({listed(other.frames, longest=60)})' for other in shown_findings
                 if other.code == finding.code and other is not finding and other.frames]
        if alike:
            out.print(fields({'also': listed(alike, longest=150)}))
        out.print()
    out.print(f'{shown(report["source"])}: {report["transforms"]} transforms of '
              f'{report["frames"]} frames in {report["watched_s"]:.1f} s', markup=False)
    if report['interrupted']:
        out.print(styled('interrupted: the report is incomplete', 'warning'))
    out.print(_verdict(report, with_notes))


def _first_of_each(findings: Sequence[Finding]) -> Iterable[Finding]:
    """Return the first finding of each code; the others are listed with it."""
    first: dict[str, Finding] = {}
    for finding in findings:
        first.setdefault(finding.code, finding)
    return first.values()


def _heading(finding: Finding) -> object:
    heading = styled(f'{finding.severity.value} {finding.code}', finding.severity.value)
    return heading.append(f'  {shown(listed(finding.frames, longest=60))}', style='bold')


def _verdict(report: dict[str, Any], with_notes: bool) -> object:
    counts = {name: report[f'{name}s'] for name in ('error', 'warning', 'note')}
    summary = ', '.join(f'{count} {name}{"s" * (count != 1)}' for name, count in counts.items()
                        if count)
    worst = 'error' if counts['error'] else (
        'warning' if counts['warning'] or report['damage'] else 'fine')
    hint = ' (--notes prints them)' if counts['note'] and not with_notes else ''
    return styled(f'{summary or "no findings"}{hint}', worst)


def _list(as_json: bool) -> None:
    if as_json:
        print_json([{'code': code.name, 'severity': code.severity.value, 'textbook': code.textbook,
                     'catches': code.catches, 'cause': code.cause, 'fix': code.fix,
                     'recorded_fix': code.recorded_fix or code.fix}
                    for code in CODES.values()])
        return
    out = console()
    for code in CODES.values():
        out.print(styled(f'{code.name} ({code.severity.value})', code.severity.value))
        out.print(fields({'': code.catches, 'cause': code.cause, 'fix': code.fix,
                          'in a bag': code.recorded_fix}))
        out.print()


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
