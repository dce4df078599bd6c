"""The command ``tf_doctor``: what is wrong with a tree, the worst first."""

from argparse import Namespace
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
import sys
from typing import Any

from tf_tree_py.core.checks.catalogue import CODES
from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.text import listed
from tf_tree_py.core.vitals.limits import Limits

from .arguments import add_number, Parser
from .endings import FINE, FOUND, run
from .output import console, fields, print_json, shown, styled
from .source import nothing_arrived, open_source, TreeSource

NAME = 'tf_doctor'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

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


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the command; return its exit status.

    :param argv: the whole command line; None: this process's.
    """
    return run(NAME, _work, argv)


def _parser() -> Parser:
    limits = Limits()
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
    group = parser.add_argument_group('what is still right')
    for name, value, text in (
            ('--max-speed', limits.max_speed, 'of a frame in its parent, m/s'),
            ('--max-turn-rate', limits.max_turn_rate, 'likewise, rad/s'),
            ('--max-delay', limits.max_delay / 1e9, 'from a stamp to its arrival, s'),
            ('--max-skew', limits.max_skew / 1e9, 'between the ages of edges on a path, s'),
            ('--cache-time', limits.cache_time / 1e9, 'what the buffers of the system keep, s')):
        add_number(group, name, value, text)
    return parser


def _limits(arguments: Namespace) -> Limits:
    return Limits(from_seconds(arguments.cache_time), arguments.max_speed,
                  arguments.max_turn_rate, from_seconds(arguments.max_delay),
                  from_seconds(arguments.max_skew))


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if arguments.list:
        _list(arguments.json)
        return FINE
    doctor = Doctor(_limits(arguments))
    with open_source(arguments, NAME, [doctor], cache_time=doctor.limits.cache_time) as source:
        with suppress(KeyboardInterrupt):
            source.watch(arguments.seconds or (None if arguments.bag else _LIVE_S))
        doctor.endpoints = source.endpoints()
        findings = doctor.findings()
        if not findings and not doctor.transforms:
            raise nothing_arrived(source)
        report = _report(source, doctor, findings)
    if arguments.json:
        print_json(report)
    else:
        _print(report, findings, arguments.notes)
    strictly = arguments.strict and (report['warnings'] or report['damage'])
    return FOUND if report['errors'] or strictly else FINE


def _report(source: TreeSource, doctor: Doctor, findings: Sequence[Finding]) -> dict[str, Any]:
    counts = Counter(finding.severity for finding in findings)
    return {
        'version': VERSION,
        'source': source.name,
        'watched_s': doctor.watched / 1e9,
        'transforms': doctor.transforms,
        'frames': len(source.buffer.frames()),
        'damage': source.damage(),
        **{f'{severity.value}s': counts[severity] for severity in Severity},
        'findings': [finding.as_dict() for finding in findings],
    }


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


if __name__ == '__main__':
    sys.exit(main())
