# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The ends of the relay that are not topics: a robot's link to a fleet, and a fleet."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
import logging
from typing import Any

from rclpy.node import Node
from tf_tree_py.core.messages.observers import Observer, ReceivedMessage
from tf_tree_py.fleet import FleetError, FleetListener
from tf_tree_py.fleet.connection import log, Uplink
from tf_tree_py.fleet.trust import without_others
from tf_tree_py.thinning import MovingSender, StaticSender

from .bad_input import BadInput
from .robot_topics import fit_samples


class _ToNode(logging.Handler):
    """Forwards records of Python's ``logging`` to the log of a node."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._logger = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        """Say a line."""
        self._logger.warning(self.format(record))


@contextmanager
def logged_by(node: Node) -> Iterator[None]:
    """Log events of the connection to a fleet with a node's logger, within the context."""
    handler = _ToNode(node)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


def uplink(node: Node, values: Mapping[str, Any]) -> Uplink:
    """
    Return a robot's link to its fleet, configured by the parameters.

    :raises BadInput: a parameter is invalid, or Zenoh is not installed.
    """
    robot = values['robot'] or node.get_namespace().strip('/')
    if not robot:
        raise BadInput('the name of this robot is missing: give --robot NAME, or run in its '
                       'namespace (--ros-args -r __ns:=/robot1)')
    try:
        return Uplink(values['zenoh'] or None, robot, config=values['zenoh_config'] or None,
                      key_prefix=values['key_prefix'])
    except FleetError as error:
        raise BadInput(str(error)) from error


class FleetInput(Observer):
    """Receives from a fleet, and passes messages on; frames are prefixed with robots' names."""

    def __init__(self, values: Mapping[str, Any], moving: MovingSender,
                 static: StaticSender) -> None:
        """
        Start to receive, until ``close``.

        :raises BadInput: a parameter is invalid, or Zenoh is not installed.
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

    def received(self, arrival: ReceivedMessage) -> None:
        """Pass a message on; the listener logs what is wrong with it."""
        own, _ = without_others(arrival.batch, self._shared, arrival.authority)
        samples = fit_samples(own, arrival.authority)
        (self._static if arrival.static else self._moving).take(samples)

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()
