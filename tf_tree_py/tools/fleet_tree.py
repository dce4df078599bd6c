# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fleet's tree: the transforms that robots send over Zenoh, without ROS."""

from argparse import Namespace
from collections.abc import Sequence
import logging
import time

from tf_tree_py.command.endings import cannot_after
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.text import shorten
from tf_tree_py.fleet import FleetError, FleetListener

from .inputs import TreeInput


class FleetTree(TreeInput):
    """A buffer that receives robots through a router; see ``TreeInput``."""

    hint = ('is a robot sending there, and do --robots and the access control of the router '
            'allow it?')

    def __init__(self, arguments: Namespace, observers: Sequence[Observer]) -> None:
        """
        Begin to listen.

        :raises Cannot: Zenoh is not installed, or an argument is invalid.
        """
        with cannot_after(FleetError):
            self._listener = FleetListener(
                arguments.fleet, arguments.robots, config=arguments.fleet_config,
                shared_frames=arguments.shared_frames, observers=observers)
        # The tool reports incidents itself; the log only has to report a lost connection.
        self._log = logging.getLogger('tf_tree_py.fleet.incidents')
        self._level = self._log.level
        self._log.setLevel(logging.ERROR)
        self.name = self._listener.name
        self.buffer = self._listener.buffer

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()
        self._log.setLevel(self._level)

    def now(self) -> int:
        """Return the time by the clock of this machine."""
        return time.time_ns()

    def damage(self) -> list[str]:
        """Return why there is no connection, if so, and what was dropped or ignored."""
        problems = [f'{shorten(robot.name, 80)} sent {robot.limit}; {robot.dropped} '
                    'messages were dropped' for robot in self._listener.robots() if robot.limit]
        if self._listener.ignored:
            problems.append('robots were ignored because of their names, which the log lists: '
                            f'{self._listener.ignored} tokens and messages')
        if not self._listener.connected:
            why = self._listener.why_not_connected()
            problems.insert(0, f'there is no connection to {self.name}{why and f": {why}"}')
        return problems
