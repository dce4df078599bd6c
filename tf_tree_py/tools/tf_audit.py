# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_audit``: runs a program, and reports the lookups of each of its lines."""

from collections.abc import Sequence
import json
import math
import os
from pathlib import Path
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory

from tf_tree_py.command import signals
from tf_tree_py.command.arguments import console, fields, Parser, print_json, styled
from tf_tree_py.command.endings import Cannot, entry_point, FINE, FOUND
from tf_tree_py.core.messages.observers import AUDIT_FOLDER
from tf_tree_py.core.stamp import format_span
from tf_tree_py.health.checks.finding import times
from tf_tree_py.reports.audit import Line, read

NAME = 'tf_audit'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

_DESCRIPTION = """\
Runs a program that uses this package, directly or through its drop-in for tf2, with the
lookup audit enabled. When the program ends, it reports each line of code that looked up a
transform: the time requested, its age, and how far the frame had moved since.

The exit status is 0 if all is well; 1 if a lookup failed, or used another time than that
of its data and was wrong because of it; 2 if the program could not run, failed, or looked
up nothing. The program's own output is unchanged; with --json the audit follows it."""

_EXAMPLES = (
    (f'{NAME} -- ros2 run my_robot detector', 'a node, until Ctrl-C'),
    (f'{NAME} -- python -m tf_tree_py.dropin detector.py', 'a program that imports tf2_ros'),
)
# The error that a lookup of another time may cause without a warning: metres, radians.
_LITTLE_M, _LITTLE_RAD = 0.01, math.radians(1.0)


def _work(argv: Sequence[str]) -> int:
    own, dashes, command = _split(argv)
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.usage = '%(prog)s [-h] [--json] -- COMMAND...'
    parser.add_json()
    arguments = parser.parse_args(own)
    if not dashes or not command:
        parser.error('no command to run: give it after two dashes, as in '
                     f'{NAME} -- ros2 run my_robot detector')
    if not arguments.json:
        console()  # a missing package has to be reported before the program runs
    signals.raise_interrupts()
    with TemporaryDirectory(prefix='tf_audit.') as folder:
        status = _run(command, Path(folder))
        lines = read(Path(folder))
    _tell(lines or [], arguments.json)
    if status not in (0, -signal.SIGINT, 128 + signal.SIGINT):
        raise Cannot(f'the program ended with status {status}')
    if not lines:
        raise Cannot('the program created no buffer of tf_tree_py' if lines is None
                     else 'the program looked up nothing')
    return FOUND if any(map(_is_doubtful, lines)) else FINE


def _split(argv: Sequence[str]) -> tuple[list[str], bool, list[str]]:
    """Return this tool's arguments, whether two dashes follow, and the arguments behind them."""
    if '--' not in argv:
        return list(argv), False, []
    place = list(argv).index('--')
    return list(argv[:place]), True, list(argv[place + 1:])


def _run(command: Sequence[str], folder: Path) -> int:
    """Run a program to its end, and return its status; an interrupt is passed on to it."""
    try:
        process = subprocess.Popen(command, env={**os.environ, AUDIT_FOLDER: str(folder)},
                                   start_new_session=True)
    except OSError as error:
        raise Cannot(f'{command[0]!r} cannot be run: {error.strerror}') from error
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            os.killpg(process.pid, signal.SIGINT)


def _is_doubtful(line: Line) -> bool:
    """Return whether a line of code needs attention."""
    off = line.moved_m > _LITTLE_M or line.turned_rad > _LITTLE_RAD
    return line.failed > 0 or (off and (line.latest or line.stamp_known))


def _tell(lines: Sequence[Line], as_json: bool) -> None:
    if as_json:
        print_json({'version': VERSION, 'lines': [_plain(line) for line in lines]})
        return
    out = console()
    for line in lines:
        out.print(styled(f'{line.caller}', 'warning' if _is_doubtful(line) else 'fine'))
        asked = 'the latest' if line.latest else 'a stamp'
        often = times(line.lookups) + (f', {line.failed} failed' if line.failed else '')
        out.print(fields({
            '': f'{line.target} <- {line.source}: asked for {asked}, {often}',
            'time': _times(line), 'moved': _moved(line)}))


def _times(line: Line) -> str:
    if not line.compared:
        return ''
    newest, now = (format_span(round(span * 1e9))
                   for span in (line.behind_newest_s, line.behind_now_s))
    return f'{newest} behind the newest data, {now} behind the present'


def _moved(line: Line) -> str:
    if not line.compared:
        return ''
    return (f'at most {line.moved_m * 100.0:.2f} cm and {math.degrees(line.turned_rad):.2f} deg '
            f'in {format_span(round(line.apart_s * 1e9))}: {line.meaning}')


def _plain(line: Line) -> dict[str, object]:
    found: dict[str, object] = json.loads(json.dumps(vars(line)))
    return {**found, 'caller': line.caller._asdict(), 'meaning': line.meaning,
            'doubtful': _is_doubtful(line)}


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
