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

"""A fleet's tree: what robots send over Zenoh, without ROS."""

from argparse import Namespace
from collections.abc import Sequence
import logging
import threading
import time

from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.arrivals.received import Endpoint
from tf_tree_py.fleet import FleetError, FleetListener

from .endings import Cannot


class Fleet:
    """A buffer that hears robots through a router; see ``source.TreeSource``."""

    hint = 'does a robot send there, and do --robots and its access control let it be heard?'

    def __init__(self, arguments: Namespace, observers: Sequence[Observer]) -> None:
        """
        Begin to listen.

        :raises Cannot: Zenoh is not installed, or an argument cannot be.
        """
        try:
            self._listener = FleetListener(
                arguments.fleet, arguments.robots, config=arguments.fleet_config,
                shared_frames=arguments.shared_frames, observers=observers)
        except FleetError as error:
            raise Cannot(str(error)) from error
        # What is refused or odd is the tool's to tell; a connection that is lost is not.
        self._log = logging.getLogger('tf_tree_py.fleet.incidents')
        self._level = self._log.level
        self._log.setLevel(logging.ERROR)
        self.name = self._listener.name
        self.buffer = self._listener.buffer
        self.now = time.time_ns

    def __enter__(self) -> 'Fleet':
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()
        self._log.setLevel(self._level)

    def watch(self, seconds: float | None) -> bool:
        """Let transforms arrive, in the listener's threads."""
        threading.Event().wait(seconds)
        return True

    def await_covariances(self) -> None:
        """Return at once: nobody tells any over Zenoh."""

    def endpoints(self) -> list[Endpoint]:
        """Return nothing: tokens say which robots there are, and not how they send."""
        return []

    def damage(self) -> list[str]:
        """Return that there is no connection, if there is none."""
        return [] if self._listener.connected else [f'there is no connection to {self.name}']
