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

"""The command ``tf_doctor``: what is wrong with a tree, the worst first."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
import sys
from typing import Any

from tf_tree_py.core.checks.catalogue import CODES
from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.text import listed

from .arguments import add_number, Parser
from .doctor_report import add_limits, judged, limits_of
from .endings import entry_point, FINE, FOUND
from .output import console, fields, print_json, shown, styled
from .source import open_source

NAME = 'tf_doctor'
_DESCRIPTION = """\
Watches a tree, live or recorded, and says what is wrong with it: the worst first,
each with its evidence, the likely cause and what to do.

The exit status is 0 if all is well, 1 with an error (with --strict: or a warning),
2 if nothing could be watched. Ctrl-C ends the watch, and what was found is told."""

_EXAMPLES = (
    ('tf_doctor', 'watch the running robot for ten seconds'),
    ('tf_doctor --bag run.mcap --strict', 'judge a recording; 1 with a warning too'),
    ('tf_doctor --seconds 60 --json', 'for a nightly job'),
    ('tf_doctor --list', 'explain every code'),
)
_LIVE_S = 10.0


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    add_number(parser, '--seconds', None, f'how long to watch; {_LIVE_S:g} live, and all of a '
               'recording, unless given')
    parser.add_argument('--strict', action='store_true',
                        help='exit with 1 for a warning too, and for a damaged bag')
    parser.add_argument('--notes', action='store_true',
                        help='tell notes too: worth knowing, and nothing to do')
    parser.add_argument('--list', action='store_true', help='explain every code, and end')
    parser.add_json()
    parser.add_source()
    add_limits(parser)
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.list:
        _list(arguments.json)
        return FINE
    doctor = Doctor(limits_of(arguments))
    with open_source(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as source:
        with suppress(KeyboardInterrupt):
            source.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
        report, findings = judged(source, doctor)
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
    told = [finding for finding in findings
            if with_notes or finding.severity is not Severity.NOTE]
    for finding in _first_of_each(told):
        out.print(_heading(finding))
        out.print(fields({'': finding.summary, 'from': ', '.join(finding.publishers),
                          'cause': finding.cause, 'fix': finding.fix}))
        alike = [f'({listed(other.frames, longest=60)})' for other in told
                 if other.code == finding.code and other is not finding and other.frames]
        if alike:
            out.print(fields({'also': listed(alike, longest=150)}))
        out.print()
    out.print(f'{shown(report["source"])}: {report["transforms"]} transforms of '
              f'{report["frames"]} frames in {report["watched_s"]:.1f} s', markup=False)
    out.print(_verdict(report, with_notes))


def _first_of_each(findings: Sequence[Finding]) -> Iterable[Finding]:
    """Return the first finding of each code: the others are told beside it."""
    first: dict[str, Finding] = {}
    for finding in findings:
        first.setdefault(finding.code, finding)
    return first.values()


def _heading(finding: Finding) -> Any:
    heading = styled(f'{finding.severity.value} {finding.code}', finding.severity.value)
    return heading.append(f'  {shown(listed(finding.frames, longest=60))}', style='bold')


def _verdict(report: dict[str, Any], with_notes: bool) -> Any:
    counts = {name: report[f'{name}s'] for name in ('error', 'warning', 'note')}
    told = ', '.join(f'{count} {name}{"s" * (count != 1)}' for name, count in counts.items()
                     if count)
    worst = 'error' if counts['error'] else (
        'warning' if counts['warning'] or report['damage'] else 'fine')
    hint = ' (--notes tells them)' if counts['note'] and not with_notes else ''
    return styled(f'{told or "nothing to complain of"}{hint}', worst)


def _list(as_json: bool) -> None:
    if as_json:
        print_json([{'code': code.name, 'severity': code.severity.value, 'textbook': code.textbook,
                     'catches': code.catches, 'cause': code.cause, 'fix': code.fix}
                    for code in CODES.values()])
        return
    out = console()
    for code in CODES.values():
        out.print(styled(f'{code.name} ({code.severity.value})', code.severity.value))
        out.print(fields({'': code.catches, 'cause': code.cause, 'fix': code.fix}))
        out.print()


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
