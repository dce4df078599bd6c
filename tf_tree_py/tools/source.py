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

"""
Where a tool's tree comes from: a live system, a recording, or a fleet.

This is the one place that knows the difference. Only a live system needs ROS.
"""

from argparse import Namespace
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.arrivals.received import Endpoint
from tf_tree_py.core.buffer.buffer_core import BufferCore
from tf_tree_py.core.stamp import UNLIMITED

from .endings import Cannot


class TreeSource(Protocol):
    """
    What a tool reads.

    :ivar name: where it comes from, for people.
    :ivar hint: what to ask oneself where nothing comes from there.
    """

    name: str
    hint: str

    @property
    def buffer(self) -> BufferCore:
        """Return the tree; a recorded one fills while ``watch`` reads, a live one always."""

    def watch(self, seconds: float | None) -> bool:
        """
        Let transforms arrive for so many seconds; those of a recording are its own.

        :param seconds: None: to the end of the recording, or until Ctrl-C.
        :return: whether more may come.
        :raises KeyboardInterrupt: Ctrl-C.
        """

    def await_covariances(self) -> None:
        """Wait a moment for those of static edges, if somebody tells any."""

    def endpoints(self) -> list[Endpoint]:
        """Return who publishes and hears its topics, as far as that is known."""

    def now(self) -> int:
        """Return the time by the clock of the arrivals, nanoseconds; 0: there is none yet."""

    def damage(self) -> list[str]:
        """Return what of it cannot be read, one sentence each."""


def open_source(arguments: Namespace, name: str, observers: Sequence[Observer] = (), *,
                cache_time: int = UNLIMITED) -> AbstractContextManager[TreeSource]:
    """
    Return what the arguments of ``Parser.add_source`` name.

    :param name: of the tool: its node, where there is one.
    :param observers: watch the buffer, from the first message on.
    :param cache_time: how much history the buffer of a recording keeps, nanoseconds.
    :raises Cannot: there is no such recording, no such fleet, or no ROS.
    """
    if arguments.bag is not None:
        from .recording import Recording
        return Recording(arguments, observers, cache_time)
    if arguments.fleet is not None or arguments.fleet_config is not None:
        from .fleet import Fleet
        return Fleet(arguments, observers)
    try:
        from .live import Live
    except ModuleNotFoundError as error:
        missing = (error.name or '').partition('.')[0]
        if missing in ('', 'tf_tree_py'):
            raise
        raise Cannot(f'a live tree needs ROS 2, and {missing} is not installed: source a ROS 2 '
                     'installation, or let scripts/setup of the tf_tree_py repository make one '
                     'from PyPI; --bag PATH reads a recording without it, and --fleet ROUTER '
                     'hears robots') from error
    return Live(arguments, name, observers)


def nothing_arrived(source: TreeSource) -> Cannot:
    """Return what to raise where no transform came at all."""
    damage = ''.join(f'; {sentence}' for sentence in source.damage())
    return Cannot(f'no transform arrived from {source.name}{damage or f": {source.hint}"}')
