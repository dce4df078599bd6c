# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command line of a program: its arguments, and its output.

A command line has a program's own arguments, arguments for ROS, and numbers. The output has
tables and coloured text with rich, or JSON.
"""

import argparse
from collections.abc import Mapping, Sequence
import json
import math
import os
import shutil
import sys
from typing import Any, NamedTuple, NoReturn, TYPE_CHECKING

from .endings import CANNOT, needs

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text


class CommandLine(NamedTuple):
    """
    A command line, split into two parts.

    :ivar own: the program's own arguments.
    :ivar ros: the arguments for ROS: ``--ros-args`` and those that follow it.
    """

    own: list[str]
    ros: list[str]


def _split_arguments(argv: Sequence[str]) -> CommandLine:
    """
    Return the arguments of a program and those of ROS, as rclpy distinguishes them.

    :param argv: without the program's name.
    """
    own, ros, to_ros = list[str](), list[str](), False
    for argument in argv:
        if argument == '--ros-args':
            to_ros = True
        (ros if to_ros else own).append(argument)
        if argument == '--':
            to_ros = False
    return CommandLine(own, ros)


class Parser(argparse.ArgumentParser):
    """Reads a program's own arguments; an error is one sentence."""

    def __init__(self, name: str, description: str, examples: Sequence[tuple[str, str]] = (), *,
                 epilog: str = '', **options: Any) -> None:
        """
        Make a parser without arguments.

        :param examples: command lines, each with a description.
        :param epilog: the text of the help after the examples.
        :param options: passed to ``ArgumentParser``.
        """
        super().__init__(
            prog=name, description=description, allow_abbrev=False,
            epilog='\n\n'.join(filter(None, (_listed(examples), epilog))),
            formatter_class=argparse.RawDescriptionHelpFormatter, **options)
        self.add_argument('--version', action=_ShowVersion, nargs=0, default=argparse.SUPPRESS,
                          help='show the version, and whether formulas are compiled, and exit')

    def error(self, message: str) -> NoReturn:
        """Print the error, and exit with the status for wrong arguments."""
        self.exit(CANNOT, f'{self.prog}: {message} (see --help)\n')

    def parse(self, argv: Sequence[str]) -> argparse.Namespace:
        """
        Return the arguments; those for ROS are in ``ros_arguments``.

        :param argv: without the program's name.
        """
        own, ros = _split_arguments(argv)
        arguments = self.parse_args(own)
        arguments.ros_arguments = ros
        return arguments

    def own_arguments(self, argv: Sequence[str] | None) -> list[str]:
        """
        Return the arguments that are not for ROS, without the program's name.

        :param argv: the whole command line; None: that of this process.
        """
        return _split_arguments((sys.argv if argv is None else argv)[1:]).own

    def add_json(self) -> None:
        """Add the option ``--json``."""
        self.add_argument('--json', action='store_true',
                          help='print JSON, whose shape is documented and stable')


class _ShowVersion(argparse.Action):
    """Prints the version only when it is asked for, because that imports the core."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        from tf_tree_py import core
        try:
            version = metadata.version('tf_tree_py')
        except metadata.PackageNotFoundError:
            version = 'not installed'
        how = 'compiled formulas' if core.COMPILED else 'pure Python'
        print(f'tf_tree_py {version} ({how})')
        parser.exit()


def _listed(examples: Sequence[tuple[str, str]]) -> str:
    if not examples:
        return ''
    width = max(len(command) for command, _ in examples)
    return '\n'.join(['examples:', *(f'  {command:<{width}}   {what}'
                                     for command, what in examples)])


def add_number(where: argparse._ActionsContainer, name: str, default: float | None,
               text: str) -> None:
    """
    Add an option that is a positive number; the help states its default.

    :param where: a parser, or a group of one.
    """
    explained = text if default is None else f'{text} (default {default:g})'
    where.add_argument(name, type=positive_number, default=default, metavar='X', help=explained)


def number(text: str) -> float:
    """Return a finite number of the command line."""
    value = _float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'{text!r} is not a finite number')
    return value


def positive_number(text: str) -> float:
    """
    Return a number of the command line that is greater than zero.

    Its limits keep seconds, and the period of a rate, within 64 bits of nanoseconds.
    """
    value = _float(text)
    if not 1e-9 <= value <= 1e9:
        which = 'from 1e-9 to 1e9' if 0.0 < value < math.inf else 'greater than zero'
        raise argparse.ArgumentTypeError(f'{text!r} is not a number {which}')
    return value


def positive_integer(text: str) -> int:
    """Return a whole number of the command line that is greater than zero."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f'{text!r} is not a whole number greater than zero')
    return int(text)


def names(text: str) -> list[str]:
    """Return the names of the command line that commas separate."""
    return [name.strip() for name in text.split(',') if name.strip()]


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


# --- output

# The most characters of a name or a line, and of a sentence, that are printed.
_LONGEST = 200
_LONGEST_SENTENCE = 1200
# The width of lines if the output is not a terminal.
_WIDTH = 100
# The least width of the last column of a table.
_NARROWEST = 9

_COLOURS = {'error': 'bold red', 'warning': 'yellow', 'note': 'cyan', 'fine': 'green'}


def console(**options: Any) -> 'Console':
    """
    Return a rich ``Console`` that writes to standard output.

    In a pipe it writes plain text, 100 columns wide unless ``COLUMNS`` sets another width.

    :raises Cannot: rich is not installed.
    """
    rich = needs('rich.console', 'rich')
    width = None if sys.stdout.isatty() or 'COLUMNS' in os.environ else _WIDTH
    made = rich.Console(highlight=False, width=width, soft_wrap=False, **options)
    made.on_broken_pipe = _leave  # rich would end the process, with the status 1
    typed: Console = made
    return typed


def _leave() -> NoReturn:
    """Report that the reader of the output has closed it."""
    raise BrokenPipeError


def table(headings: Sequence[str], rows: Sequence[Sequence['str | Text']],
          right: Sequence[str] = ()) -> 'Table':
    """
    Return a rich ``Table`` with one line per row; the last column is shortened to fit.

    :param rows: cells: untrusted text, which is not parsed as markup, or rich's ``Text``.
    :param right: the headings of right-aligned columns, such as numbers.
    """
    box = needs('rich.box', 'rich')
    text = needs('rich.text', 'rich')
    made: Table = needs('rich.table', 'rich').Table(
        box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, padding=(0, 1, 0, 0))
    for heading in headings:
        is_last = heading == headings[-1]
        made.add_column(heading, justify='right' if heading in right else 'left',
                        no_wrap=not is_last, min_width=_NARROWEST if is_last else None,
                        overflow='ellipsis')
    for row in rows:
        made.add_row(*(text.Text(shown(cell)) if isinstance(cell, str) else cell for cell in row))
    return made


def styled(text: str, what: str) -> 'Text':
    """Return rich's ``Text`` in a colour of ``_COLOURS``."""
    made: Text = needs('rich.text', 'rich').Text(shown(text), style=_COLOURS[what])
    return made


def fields(named: Mapping[str, str]) -> 'Table':
    """Return texts beside their names, indented; empty texts are omitted."""
    text = needs('rich.text', 'rich')
    grid: Table = needs('rich.table', 'rich').Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(min_width=7, justify='right', style='dim')
    grid.add_column()
    for name, value in named.items():
        if value:
            grid.add_row(name, text.Text(shown(value, _LONGEST_SENTENCE)))
    return grid


def shown(text: str, most: int = _LONGEST) -> str:
    """Return untrusted text, shortened in its middle, with control characters escaped."""
    if len(text) > most:
        text = f'{text[:most // 2]} ... {text[-(most // 2):]}'
    return ''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def fits(line: str) -> bool:
    """Return whether a line fits the width of the terminal; in a pipe every line fits."""
    return not sys.stdout.isatty() or len(line) <= shutil.get_terminal_size().columns


def print_json(data: object) -> None:
    """Print data as indented JSON."""
    print(json.dumps(data, indent=2, allow_nan=False))


def print_json_line(data: object) -> None:
    """Print data as one line of JSON, and flush it: one record of a stream."""
    print(json.dumps(data, allow_nan=False), flush=True)
