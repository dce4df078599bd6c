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

"""The command ``tf_lab``: lists the labs, and runs one."""

import argparse
from collections.abc import Collection, Sequence
import json
import os
from pathlib import Path
import signal
import sys
from typing import Any, TYPE_CHECKING

from tf_tree_py.core.telling.table import as_lines

from .pictures import NoPicture, save
from .progress import progress
from .report import Report

if TYPE_CHECKING:
    from .catalogue import Lab

NAME = 'tf_lab'

_DESCRIPTION = """\
The textbook's experiments on transform trees. Without a name: which there are.

A lab prints its table and the law that the table shows, and draws its picture as
PNG and SVG. All of them run without ROS; with --ros, those marked so run over DDS
between processes of their own, on this machine alone and in a domain of their own."""


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the command; return its exit status.

    :param argv: the whole command line; None: this process's.
    """
    parser = _parser()
    arguments = parser.parse_args(list(sys.argv if argv is None else argv)[1:])
    try:
        # Imported here, because it takes a while: Ctrl-C during the import is a normal end too.
        from .catalogue import LABS
        if arguments.lab is None:
            print(_list(LABS.values(), arguments.json))
            return 0
        lab = LABS.get(arguments.lab)
        if lab is None:
            return _complain(f'there is no lab {arguments.lab!r}; there are {", ".join(LABS)}', 2)
        if arguments.ros and not lab.live:
            return _complain(f'{lab.name} needs no DDS to show its law; with --ros there are '
                             f'{", ".join(lab.name for lab in LABS.values() if lab.live)}', 2)
        return _run(lab, arguments.ros, arguments.out, arguments.json)
    except KeyboardInterrupt:
        # The process ends now: a second Ctrl-C must not interrupt the end of the interpreter.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return 130
    except BrokenPipeError:
        # The reader of our output has closed it, as `| head` does. The interpreter flushes
        # stdout once more at its end, which would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=_DESCRIPTION, allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('lab', nargs='?', metavar='NAME', help='which experiment')
    parser.add_argument('--ros', action='store_true', help='over DDS, between processes')
    parser.add_argument('--out', type=Path, metavar='DIR',
                        help='where to put the picture; here unless given')
    parser.add_argument('--json', action='store_true',
                        help='print JSON instead, and draw only if --out is given')
    return parser


def _list(labs: Collection['Lab'], as_json: bool) -> str:
    if as_json:
        return json.dumps([{'name': lab.name, 'summary': lab.summary, 'ros': lab.live}
                           for lab in labs], indent=2)
    lines = as_lines([[lab.name, '--ros' if lab.live else '', lab.summary] for lab in labs], ())
    return '\n'.join([*lines, '', f'{NAME} NAME runs one; {NAME} --help tells more.'])


def _complain(sentence: str, status: int) -> int:
    print(f'{NAME}: {sentence}', file=sys.stderr)
    return status


def _run(lab: 'Lab', live: bool, folder: Path | None, as_json: bool) -> int:
    name = f'{lab.name}_ros' if live else lab.name
    try:
        with progress(f'{NAME}: {name}'):
            report = lab.run_live() if live else lab.run()
    except ModuleNotFoundError as error:
        if not live or error.name is None or error.name.startswith('tf_tree_py'):
            raise
        missing = error.name.partition('.')[0]
        return _complain(f'--ros needs ROS 2, and {missing} is not installed: source a ROS 2 '
                         f'installation; {NAME} {lab.name} runs without', 1)
    if as_json:
        pictures = _draw(report, folder, name, sys.stderr) if folder else []
        print(json.dumps({'lab': name, **report.as_dict(), 'pictures': pictures}, indent=2))
        return 0
    print(report.as_text(), end='\n\n', flush=True)
    pictures = _draw(report, folder or Path(), name, sys.stdout)
    if pictures:
        print('The picture: ' + ', '.join(pictures))
    return 0


def _draw(report: Report, folder: Path, name: str, tell: Any) -> list[str]:
    if report.draw is None:
        return []
    try:
        with progress(f'{NAME}: the picture'):
            return [str(path) for path in save(report.draw, folder, name)]
    except NoPicture as reason:
        print(reason, file=tell)
        return []


if __name__ == '__main__':
    sys.exit(main())
