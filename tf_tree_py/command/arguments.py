# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parsing of command lines: a program's own arguments, arguments for ROS, and numbers."""

import argparse
from collections.abc import Sequence
import math
import sys
from typing import Any, NamedTuple, NoReturn

from .endings import CANNOT


class CommandLine(NamedTuple):
    """
    A command line, split into two parts.

    :ivar own: the program's own arguments.
    :ivar ros: the arguments for ROS: ``--ros-args`` and those that follow it.
    """

    own: list[str]
    ros: list[str]


def taken_apart(argv: Sequence[str]) -> CommandLine:
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

    def error(self, message: str) -> NoReturn:
        """Print the error, and exit with the status for wrong arguments."""
        self.exit(CANNOT, f'{self.prog}: {message} (see --help)\n')

    def parse(self, argv: Sequence[str]) -> argparse.Namespace:
        """
        Return the arguments; those for ROS are in ``ros_arguments``.

        :param argv: without the program's name.
        """
        own, ros = taken_apart(argv)
        arguments = self.parse_args(own)
        arguments.ros_arguments = ros
        return arguments

    def own_arguments(self, argv: Sequence[str] | None) -> list[str]:
        """
        Return the arguments that are not for ROS, without the program's name.

        :param argv: the whole command line; None: that of this process.
        """
        return taken_apart((sys.argv if argv is None else argv)[1:]).own

    def add_json(self) -> None:
        """Add the option ``--json``."""
        self.add_argument('--json', action='store_true',
                          help='print JSON, whose shape is documented and stable')


def _listed(examples: Sequence[tuple[str, str]]) -> str:
    if not examples:
        return ''
    width = max(len(command) for command, _ in examples)
    return '\n'.join(['examples:', *(f'  {command:<{width}}   {what}'
                                     for command, what in examples)])


def add_number(where: Any, name: str, default: float | None, text: str) -> None:
    """
    Add an option that is a positive number; the help states its default.

    :param where: a parser, or a group of one.
    """
    told = text if default is None else f'{text} (default {default:g})'
    where.add_argument(name, type=positive_number, default=default, metavar='X', help=told)


def number(text: str) -> float:
    """Return a finite number of the command line."""
    value = _float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'{text!r} is not a finite number')
    return value


def positive_number(text: str) -> float:
    """Return a number of the command line that is finite and greater than zero."""
    value = _float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f'{text!r} is not a number greater than zero')
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
