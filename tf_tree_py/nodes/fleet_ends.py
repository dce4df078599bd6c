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

"""The ends of the relay that are not topics: a robot's way to a fleet, and a fleet."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
import logging
from typing import Any

from rclpy.node import Node
from tf_tree_py.core.arrivals.observers import Observer
from tf_tree_py.core.arrivals.received import Received
from tf_tree_py.core.departures.sending import Moving, Static
from tf_tree_py.fleet import FleetError, FleetListener
from tf_tree_py.fleet.listening import log
from tf_tree_py.fleet.trust import without_others
from tf_tree_py.fleet.uplink import Uplink

from .bad_input import BadInput
from .robot_topics import fit_samples


class _ToNode(logging.Handler):
    """Lets a node say what Python's ``logging`` is told."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._logger = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        """Say a line."""
        self._logger.warning(self.format(record))


@contextmanager
def logged_by(node: Node) -> Iterator[None]:
    """Let a node say what happens to the connection to a fleet, while the block runs."""
    handler = _ToNode(node)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


def uplink(node: Node, values: Mapping[str, Any]) -> Uplink:
    """
    Return a robot's way to its fleet, as the parameters say.

    :raises BadInput: a parameter is wrong, or Zenoh is not installed.
    """
    robot = values['robot'] or node.get_namespace().strip('/')
    if not robot:
        raise BadInput('which robot is this? Name it (--robot NAME), or run it in its namespace '
                       '(--ros-args -r __ns:=/robot1)')
    try:
        return Uplink(values['zenoh'] or None, robot, config=values['zenoh_config'] or None,
                      key_prefix=values['key_prefix'])
    except FleetError as error:
        raise BadInput(str(error)) from error


class Fleet(Observer):
    """Hears a fleet, and hands over what arrives; each robot's frames below its name."""

    def __init__(self, values: Mapping[str, Any], moving: Moving, static: Static) -> None:
        """
        Begin to listen; until ``close``.

        :raises BadInput: a parameter is wrong, or Zenoh is not installed.
        """
        self._moving, self._static = moving, static
        shared: Collection[str] = values['shared_frames'] or ['map']
        self._shared = frozenset(shared)
        try:
            self._listener = FleetListener(
                values['from_zenoh'], values['robots'].split(','), shared_frames=shared,
                config=values['zenoh_config'] or None, key_prefix=values['key_prefix'])
        except FleetError as error:
            raise BadInput(str(error)) from error
        self._listener.buffer.observers.add(self)
        self.name = self._listener.name

    def received(self, arrival: Received) -> None:
        """Pass a message on; what is wrong with it the listener logs."""
        own, _ = without_others(arrival.batch, self._shared, arrival.authority)
        samples = fit_samples(own, arrival.authority)
        (self._static if arrival.static else self._moving).take(samples)

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()
