# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The source of a tool's tree: a live system, a recording, or a fleet.

Only this file depends on which of them it is. Only a live system needs ROS.
"""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.command import signals
from tf_tree_py.command.endings import Cannot, needs_ros
from tf_tree_py.core.messages.observers import Endpoint, Observer
from tf_tree_py.core.stamp import UNLIMITED

from .tree_arguments import check_source


class TreeSource(Protocol):
    """
    A source of a tree.

    :ivar name: its description, for people.
    :ivar hint: what to check if nothing arrives.
    """

    name: str
    hint: str

    @property
    def buffer(self) -> BufferCore:
        """Return the tree; a recorded one fills while ``watch`` reads, a live one always."""

    def watch(self, seconds: float | None) -> bool:
        """
        Receive transforms for so many seconds; of a recording, recorded ones.

        :param seconds: None: to the end of the recording, or until Ctrl-C.
        :return: whether more may arrive.
        :raises KeyboardInterrupt: Ctrl-C.
        """

    def await_covariances(self) -> None:
        """Wait a moment for those of static edges, if they are published."""

    def endpoints(self) -> list[Endpoint]:
        """Return the publishers and subscriptions of its topics, as far as they are known."""

    def now(self) -> int:
        """Return the time by the clock of the arrivals, nanoseconds; 0: there is none yet."""

    def damage(self) -> list[str]:
        """Return the parts that cannot be read, one sentence each."""


@contextmanager
def open_source(arguments: Namespace, name: str, observers: Sequence[Observer] = (), *,
                cache_time: int = UNLIMITED, live_cache_time: int | None = None
                ) -> Iterator[TreeSource]:
    """
    Open the source that the arguments of ``add_source`` name.

    From here on Ctrl-C raises ``KeyboardInterrupt``, so that the source is closed.

    :param name: of the tool, and of its node if there is one.
    :param observers: observe the buffer from the first message on.
    :param cache_time: the length of the history of a recording's buffer, nanoseconds.
    :param live_cache_time: likewise of a live buffer; a node's default unless given.
    :raises Cannot: there is no such recording, no such fleet, no ROS, or there are two sources.
    """
    check_source(arguments)
    with _opened(arguments, name, observers, cache_time, live_cache_time) as source:
        signals.raise_interrupts()
        yield source


def _opened(arguments: Namespace, name: str, observers: Sequence[Observer], cache_time: int,
            live_cache_time: int | None) -> AbstractContextManager[TreeSource]:
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


def nothing_arrived(source: TreeSource) -> Cannot:
    """Return the error for a source without any transform."""
    damage = ''.join(f'; {sentence}' for sentence in source.damage())
    return Cannot(f'no transform arrived from {source.name}{damage or f": {source.hint}"}')
