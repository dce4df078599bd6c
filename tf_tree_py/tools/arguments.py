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

"""The arguments that all tools share, and what else a command line of theirs holds."""

import argparse
from collections.abc import Sequence
from decimal import Decimal
import math
from typing import Any, NamedTuple, NoReturn

from tf_tree_py.core.stamp import FOREVER, NANOSECONDS_PER_SECOND

from .endings import CANNOT

_TOPICS = """\
topics and names as ROS has them: --ros-args -r /tf:=/robot1/tf, -r __ns:=/robot1"""


class CommandLine(NamedTuple):
    """
    A command line, taken apart.

    :ivar own: the tool's own arguments.
    :ivar ros: those for ROS, ``--ros-args`` and what follows.
    """

    own: list[str]
    ros: list[str]


def taken_apart(argv: Sequence[str]) -> CommandLine:
    """
    Return the arguments of a tool and those of ROS, as rclpy tells them apart.

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
    """Reads a tool's own arguments; an error is one sentence."""

    def __init__(self, name: str, description: str, examples: Sequence[tuple[str, str]]) -> None:
        """
        Make a parser without arguments.

        :param examples: for each a command line, and what it does.
        """
        width = max(len(command) for command, _ in examples)
        lines = [f'  {command:<{width}}   {what}' for command, what in examples]
        super().__init__(
            prog=name, description=description, allow_abbrev=False,
            epilog='\n'.join(['examples:', *lines]),
            formatter_class=argparse.RawDescriptionHelpFormatter)

    def error(self, message: str) -> NoReturn:
        """Exit as is usual after wrong arguments."""
        self.exit(CANNOT, f'{self.prog}: {message} (--help tells more)\n')

    def parse(self, argv: Sequence[str]) -> argparse.Namespace:
        """
        Return the arguments; those for ROS are in ``ros_arguments``.

        :param argv: without the program's name.
        """
        own, ros = taken_apart(argv)
        arguments = self.parse_args(own)
        arguments.ros_arguments = ros
        self._check_source(arguments)
        return arguments

    def _check_source(self, arguments: argparse.Namespace) -> None:
        given = [f'--{name}' for name in ('bag', 'fleet', 'fleet-config')
                 if getattr(arguments, name.replace('-', '_'), None) is not None]
        if '--bag' in given and len(given) > 1:
            self.error(f'{" and ".join(given)} are two places that the tree may come from')

    def add_source(self) -> None:
        """Add what says where the tree comes from: see ``source.TreeSource``."""
        self.epilog = f'{self.epilog}\n\n{_TOPICS}'
        group = self.add_argument_group('where the tree comes from')
        group.add_argument('--bag', metavar='PATH',
                           help='a recording, without ROS; live unless given')
        group.add_argument('--fleet', metavar='ROUTER',
                           help='robots over Zenoh, without ROS: tcp/hall:7447')
        group.add_argument('--fleet-config', metavar='FILE',
                           help='of Zenoh, JSON5: certificates, a password, a router')
        group.add_argument('--robots', metavar='NAMES', type=names, default=['*'],
                           help='of the fleet, with commas: all unless given, robot* is some')
        group.add_argument('--shared-frames', metavar='NAMES', type=names, default=['map'],
                           help='of all its robots, with commas; map unless given')
        group.add_argument('--tf-topic', metavar='TOPIC', default=None,
                           help='of what moves, instead of /tf')
        group.add_argument('--tf-static-topic', metavar='TOPIC', default=None,
                           help='of what does not, instead of /tf_static')

    def add_json(self) -> None:
        """Add the argument for output that programs read."""
        self.add_argument('--json', action='store_true',
                          help='print JSON, whose shape is documented and stable')


def add_number(where: Any, name: str, default: float | None, text: str) -> None:
    """
    Add an argument that is a positive number; its default stands in the help.

    :param where: a parser, or a group of one.
    """
    told = text if default is None else f'{text} ({default:g} unless given)'
    where.add_argument(name, type=positive_number, default=default, metavar='X', help=told)


def positive_number(text: str) -> float:
    """Return a number of the command line that is finite and greater than zero."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
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


def frame(text: str) -> str:
    """Return the name of a frame of the command line."""
    if not text.strip('/'):
        raise argparse.ArgumentTypeError(f'{text!r} is no frame')
    if text.startswith('/'):
        raise argparse.ArgumentTypeError(
            f'{text!r} begins with a slash, which no frame of tf2 does: {text.lstrip("/")}')
    return text


def stamp(text: str) -> int:
    """Return a stamp of the command line, decimal seconds, as exact nanoseconds."""
    try:
        # A number such as 1e999999 would take for ever to be written out.
        seconds = Decimal(text)
        known = abs(seconds) < FOREVER // NANOSECONDS_PER_SECOND
    except ArithmeticError:
        known = False
    if not known:
        raise argparse.ArgumentTypeError(
            f'{text!r} is no stamp: seconds, such as 1700000000.250')
    return int(seconds.scaleb(9).to_integral_value())
