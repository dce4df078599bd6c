# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The input of a tool: a live system, a recording, or a fleet; and the arguments for it.

Only this file depends on which of them it is. Only a live system needs ROS.
"""

import argparse
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from decimal import Decimal

from tf_tree_py.command import signals
from tf_tree_py.command.arguments import names, Parser
from tf_tree_py.command.endings import Cannot, needs_ros
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import FOREVER, NANOSECONDS_PER_SECOND, UNLIMITED

from .inputs import TreeInput

_TOPICS = """\
ROS remappings of topics and names: --ros-args -r /tf:=/robot1/tf, -r __ns:=/robot1"""


def add_input(parser: Parser) -> None:
    """Add the arguments for the input of a tool: see ``TreeInput``."""
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


def check_input(arguments: argparse.Namespace) -> None:
    """
    Check that the arguments name one input.

    :raises Cannot: they name two.
    """
    given = [f'--{name}' for name in ('bag', 'fleet', 'fleet-config')
             if getattr(arguments, name.replace('-', '_')) is not None]
    if '--bag' in given and len(given) > 1:
        raise Cannot(f'{" and ".join(given)} cannot be used together: give one of them')


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


# --- the input

@contextmanager
def open_input(arguments: Namespace, name: str, observers: Sequence[Observer] = (), *,
               cache_time: int = UNLIMITED, live_cache_time: int | None = None
               ) -> Iterator[TreeInput]:
    """
    Open the input that the arguments of ``add_input`` name.

    From here on Ctrl-C raises ``KeyboardInterrupt``, so that the input is closed.

    :param name: of the tool, and of its node if there is one.
    :param observers: observe the buffer from the first message on.
    :param cache_time: the length of the history of a recording's buffer, nanoseconds.
    :param live_cache_time: likewise of a live buffer; a node's default unless given.
    :raises Cannot: there is no such recording, no such fleet, no ROS, or there are two inputs.
    """
    check_input(arguments)
    with _opened(arguments, name, observers, cache_time, live_cache_time) as tree_input:
        signals.raise_interrupts()
        yield tree_input


def _opened(arguments: Namespace, name: str, observers: Sequence[Observer], cache_time: int,
            live_cache_time: int | None) -> TreeInput:
    if arguments.bag is not None:
        from .recorded_tree import RecordedTree
        return RecordedTree(arguments, observers, cache_time)
    if arguments.fleet is not None or arguments.fleet_config is not None:
        from .fleet_tree import FleetTree
        return FleetTree(arguments, observers)
    try:
        from .live_tree import LiveTree
    except ModuleNotFoundError as error:
        raise needs_ros('a live tree ', error, '; without ROS, --bag PATH reads a recording, '
                        'and --fleet ROUTER receives from robots') from error
    return LiveTree(arguments, name, observers, cache_time=live_cache_time)
