# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The arguments of tools that read a tree: its source, frames and stamps."""

import argparse
from decimal import Decimal

from tf_tree_py.command.arguments import names, Parser
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.stamp import FOREVER, NANOSECONDS_PER_SECOND

_TOPICS = """\
ROS remappings of topics and names: --ros-args -r /tf:=/robot1/tf, -r __ns:=/robot1"""


def add_source(parser: Parser) -> None:
    """Add the arguments for the source of the tree: see ``tree_source.TreeSource``."""
    parser.epilog = f'{parser.epilog}\n\n{_TOPICS}'
    group = parser.add_argument_group('where the tree comes from')
    group.add_argument('--bag', metavar='PATH',
                       help='read a recording, without ROS (default: the live tree)')
    group.add_argument('--fleet', metavar='ROUTER',
                       help='receive robots over Zenoh, without ROS, such as tcp/hall:7447')
    group.add_argument('--fleet-config', metavar='FILE',
                       help='a Zenoh configuration (JSON5): certificates, password, router')
    group.add_argument('--robots', metavar='NAMES', type=names, default=['*'],
                       help='robots of the fleet, comma-separated; patterns such as robot* work '
                       '(default: all)')
    group.add_argument('--shared-frames', metavar='NAMES', type=names, default=['map'],
                       help='frames that all robots of the fleet share, comma-separated '
                       '(default: map)')
    group.add_argument('--tf-topic', metavar='TOPIC', default=None,
                       help='the topic of moving transforms (default: /tf)')
    group.add_argument('--tf-static-topic', metavar='TOPIC', default=None,
                       help='the topic of static transforms (default: /tf_static)')


def check_source(arguments: argparse.Namespace) -> None:
    """
    Check that the arguments name one source.

    :raises Cannot: they name two.
    """
    given = [f'--{name}' for name in ('bag', 'fleet', 'fleet-config')
             if getattr(arguments, name.replace('-', '_')) is not None]
    if '--bag' in given and len(given) > 1:
        raise Cannot(f'{" and ".join(given)} cannot be used together: give one source')


def frame(text: str) -> str:
    """Return a frame name from the command line."""
    if not text.strip('/'):
        raise argparse.ArgumentTypeError(f'{text!r} is not a frame name')
    if text.startswith('/'):
        raise argparse.ArgumentTypeError(
            f'{text!r} begins with a slash; frame names do not: use {text.lstrip("/")}')
    return text


def stamp(text: str) -> int:
    """Return a stamp from the command line, decimal seconds, as exact nanoseconds."""
    try:
        # A number such as 1e999999 would take very long to convert.
        seconds = Decimal(text)
        known = abs(seconds) < FOREVER // NANOSECONDS_PER_SECOND
    except ArithmeticError:
        known = False
    if not known:
        raise argparse.ArgumentTypeError(
            f'{text!r} is not a stamp: give seconds, such as 1700000000.250')
    return int(seconds.scaleb(9).to_integral_value())
