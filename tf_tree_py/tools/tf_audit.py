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

"""The command ``tf_audit``: runs a program, and tells which of its lines looked up which time."""

from collections.abc import Sequence
import json
import math
import os
from pathlib import Path
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory

from tf_tree_py.core.arrivals.observers import AUDIT_FOLDER
from tf_tree_py.core.stamp import format_span
from tf_tree_py.core.telling.audit import Line
from tf_tree_py.core.telling.audit_file import read
from tf_tree_py.core.text import times

from .arguments import Parser
from .endings import Cannot, entry_point, FINE, FOUND
from .output import console, fields, print_json, styled

NAME = 'tf_audit'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

_DESCRIPTION = """\
Runs a program that uses this package, or tf2's names through its drop-in, with the lookup
audit switched on, and tells at its end of each line of code that looked up a transform:
which time it asked for, how old that was, and how far the frame had moved by then.

The exit status is 0 if all is well, 1 if a lookup failed, or asked for another time than
that of its data and was off by it, 2 if the program could not run, failed, or asked for
nothing. The program's output is left alone; with --json the audit is printed behind it."""

_EXAMPLES = (
    (f'{NAME} -- ros2 run my_robot detector', 'a node, until Ctrl-C'),
    (f'{NAME} -- python -m tf_tree_py.dropin detector.py', 'one that imports tf2_ros'),
)
# What a lookup of another time may cost and still be fine: metres, radians.
_LITTLE_M, _LITTLE_RAD = 0.01, math.radians(1.0)


def _work(argv: Sequence[str]) -> int:
    own, dashes, command = _split(argv)
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.usage = '%(prog)s [-h] [--json] -- COMMAND...'
    parser.add_json()
    arguments = parser.parse_args(own)
    if not dashes or not command:
        parser.error('there is no command to run: behind two dashes, as in '
                     f'{NAME} -- ros2 run my_robot detector')
    if not arguments.json:
        console()  # should be missed before the program runs
    with TemporaryDirectory(prefix='tf_audit.') as folder:
        status = _run(command, Path(folder))
        lines = read(Path(folder))
    _tell(lines or [], arguments.json)
    if status not in (0, -signal.SIGINT, 128 + signal.SIGINT):
        raise Cannot(f'the program ended with status {status}')
    if not lines:
        raise Cannot('the program made no buffer of tf_tree_py' if lines is None
                     else 'the program looked nothing up')
    return FOUND if any(map(is_doubtful, lines)) else FINE


def _split(argv: Sequence[str]) -> tuple[list[str], bool, list[str]]:
    """Return our arguments, whether two dashes follow, and what stands behind them."""
    if '--' not in argv:
        return list(argv), False, []
    place = list(argv).index('--')
    return list(argv[:place]), True, list(argv[place + 1:])


def _run(command: Sequence[str], folder: Path) -> int:
    """Run a program to its end, and return its status; who interrupts us interrupts it."""
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


def is_doubtful(line: Line) -> bool:
    """Return whether somebody should look at a line of code."""
    off = line.moved_m > _LITTLE_M or line.turned_rad > _LITTLE_RAD
    return line.failed > 0 or (off and (line.latest or line.told))


def _tell(lines: Sequence[Line], as_json: bool) -> None:
    if as_json:
        print_json({'version': VERSION, 'lines': [_plain(line) for line in lines]})
        return
    out = console()
    for line in lines:
        out.print(styled(f'{line.caller}', 'warning' if is_doubtful(line) else 'fine'))
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
            'doubtful': is_doubtful(line)}


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
