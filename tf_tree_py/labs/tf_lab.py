# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command ``tf_lab``: lists the labs, and runs one.

A line on stderr shows the progress, if the work takes longer than two seconds.
"""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
import json
from pathlib import Path
import sys
import threading
import time
from typing import TextIO, TYPE_CHECKING

from tf_tree_py.command import signals
from tf_tree_py.command.arguments import Parser, print_json
from tf_tree_py.command.endings import Cannot, entry_point, FINE, needs_ros
from tf_tree_py.reports.plain_text import as_lines

from .report import NoPicture, Report, save

if TYPE_CHECKING:
    from .catalogue import Lab

PATIENCE_S = 2.0
"""How long nothing is printed."""

_TERMINAL_S, _LOG_S = 1.0, 20.0


@contextmanager
def progress(what: str) -> Iterator[None]:
    """
    Print the current work and its duration to stderr; not in the first 2 s.

    On a terminal one line counts the seconds, and is erased at the end. In a log a line is
    written periodically.

    :param what: such as ``tf_lab: latency, between processes``.
    """
    done = threading.Event()
    printer = threading.Thread(
        target=_print_duration, args=(what, done), name='progress', daemon=True)
    printer.start()
    try:
        yield
    finally:
        done.set()
        printer.join()


def _print_duration(what: str, done: threading.Event) -> None:
    terminal = sys.stderr.isatty()
    begin = time.monotonic()
    pause = PATIENCE_S
    while not done.wait(pause):
        line = f'{what}: {time.monotonic() - begin:.0f} s so far, Ctrl-C ends it'
        print(f'\r{line}' if terminal else line, end='' if terminal else '\n', file=sys.stderr,
              flush=True)
        pause = _TERMINAL_S if terminal else _LOG_S
    if terminal and pause != PATIENCE_S:
        print('\r\x1b[K', end='', file=sys.stderr, flush=True)


# --- the command

NAME = 'tf_lab'

_DESCRIPTION = """\
Short experiments on transform trees. Without a name, the command lists them.

A lab prints its table and the law that the table shows, and draws its picture as
PNG and SVG. All labs run without ROS. With --ros, those marked so run over DDS
between their own processes, on this machine only and in a DDS domain of their own."""

_EXAMPLES = (
    ('tf_lab', 'the list'),
    ('tf_lab latency', 'one, with its picture'),
    ('tf_lab latency --ros', 'over DDS'),
)


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse_args(argv)
    # Imported here, because it takes a while.
    from .catalogue import LABS
    if arguments.lab is None:
        print(_listed(LABS.values(), arguments.json))
        return FINE
    lab = LABS.get(arguments.lab)
    if lab is None:
        raise Cannot(f'there is no lab {arguments.lab!r}; there are {", ".join(LABS)}')
    if arguments.ros and not lab.live:
        raise Cannot(f'{lab.name} has no version over DDS; the labs with --ros are '
                     f'{", ".join(lab.name for lab in LABS.values() if lab.live)}')
    signals.raise_interrupts()
    _run(lab, arguments.ros, arguments.out, arguments.json)
    return FINE


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('lab', nargs='?', metavar='NAME', help='which experiment')
    parser.add_argument('--ros', action='store_true', help='over DDS, between processes')
    parser.add_argument('--out', type=Path, metavar='DIR',
                        help='the folder for the picture; by default the current one')
    parser.add_argument('--json', action='store_true',
                        help='print JSON instead, and draw only if --out is given')
    return parser


def _listed(labs: Collection['Lab'], as_json: bool) -> str:
    if as_json:
        return json.dumps([{'name': lab.name, 'summary': lab.summary, 'ros': lab.live}
                           for lab in labs], indent=2)
    lines = as_lines([[lab.name, '--ros' if lab.live else '', lab.summary] for lab in labs], ())
    return '\n'.join([*lines, '', f'{NAME} NAME runs one; {NAME} --help explains the options.'])


def _run(lab: 'Lab', live: bool, folder: Path | None, as_json: bool) -> None:
    name = f'{lab.name}_ros' if live else lab.name
    try:
        with progress(f'{NAME}: {name}'):
            report = lab.run_live() if live else lab.run()
    except ModuleNotFoundError as error:
        if not live:
            raise
        raise needs_ros('--ros ', error, f'; {NAME} {lab.name} runs without') from error
    if as_json:
        pictures = _draw(report, folder, name, sys.stderr) if folder else []
        print_json({'lab': name, **report.as_dict(), 'pictures': pictures})
        return
    print(report.as_text(), end='\n\n', flush=True)
    pictures = _draw(report, folder or Path(), name, sys.stdout)
    if pictures:
        print('The picture: ' + ', '.join(pictures))


def _draw(report: Report, folder: Path, name: str, tell: TextIO) -> list[str]:
    if report.draw is None:
        return []
    try:
        with progress(f'{NAME}: the picture'):
            return [str(path) for path in save(report.draw, folder, name)]
    except NoPicture as reason:
        print(reason, file=tell)
        return []


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
