# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``tf_share --status``: the trees that are shared on this machine. It needs no ROS."""

from collections.abc import Iterator, Sequence
import sys
from typing import Any

from tf_tree_py.command.arguments import Parser, print_json
from tf_tree_py.command.endings import Cannot, cannot_after, entry_point, FINE, FOUND
from tf_tree_py.core.text import listed
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.status import all_statuses, readers_of, Status

NAME = 'tf_share'


def add_arguments(parser: Parser) -> None:
    """Add the options of this file."""
    parser.add_argument('--status', action='store_true',
                        help='print which trees this user shares, and who reads them, and exit: '
                             '0 if all can be read, 1 if one cannot, 2 if there is none')
    parser.add_argument('--json', action='store_true', help='with --status: print JSON')


def _work(argv: Sequence[str]) -> int:
    parser = Parser(NAME, 'Prints the trees that are shared on this machine.')
    add_arguments(parser)
    arguments = parser.parse_args(parser.own_arguments([NAME, *argv]))
    with cannot_after(SharedTreeException):
        statuses = all_statuses()
    if arguments.json:
        print_json([{**status.as_dict(), 'readers': readers_of(status)} for status in statuses])
    if not statuses:
        raise Cannot('no process of this user shares a tree: start one with: '
                     'ros2 run tf_tree_py tf_share')
    if not arguments.json:
        print('\n\n'.join('\n'.join(_lines(status)) for status in statuses))
    return FOUND if any(status.problem for status in statuses) else FINE


def _lines(status: Status) -> Iterator[str]:
    yield str(status.file)
    if status.problem:
        yield f'  problem   {status.problem}'
        return
    yield f'  shared by {status.sentence}'
    received = {name: value for name, value in status.reception.items() if value}
    topics: Any = received.pop('topics', [])
    options = [f'{name}={value}' for name, value in received.items()]
    yield f'  topics    {", ".join([*topics, *options])}'
    yield f'  readers   {listed(list(map(str, readers_of(status)))) or "none"}'


main = entry_point(NAME, _work)


if __name__ == '__main__':
    sys.exit(main())
