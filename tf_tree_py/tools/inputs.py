# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What all inputs of tools have in common: a live system, a recording, and a fleet."""

from collections.abc import Iterable
from typing import Any

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.command import signals
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.health.checks.finding import Finding
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.ros_graph import NO_GRAPH, RosGraph
from tf_tree_py.reports.switch_status import SwitchReports
from tf_tree_py.shared.status import Status


class TreeInput(Closable):
    """
    What a tool reads its tree from.

    :ivar name: its description, for people.
    :ivar buffer: the tree; a recorded one fills while ``watch`` reads, a live one always.
    """

    name: str
    buffer: BufferCore

    @property
    def hint(self) -> str:
        """Return what to check if nothing arrives."""
        raise NotImplementedError

    def watch(self, seconds: float | None) -> bool:
        """
        Receive transforms for so many seconds; of a recording, recorded ones.

        :param seconds: None: to the end of the recording, or until Ctrl-C.
        :return: whether more may arrive.
        :raises KeyboardInterrupt: Ctrl-C.
        """
        signals.wait(seconds)
        return True

    def await_covariances(self) -> None:
        """Wait a moment for those of static edges, if they are published."""

    def endpoints(self) -> list[Endpoint]:
        """Return the publishers and subscriptions of its topics, as far as they are known."""
        return []

    def graph(self) -> RosGraph:
        """Return what else the ROS graph shows; nothing without ROS."""
        return NO_GRAPH

    def shared(self) -> Status | None:
        """Return the status of the tree that is shared for its topics, if there is one."""
        return None

    def now(self) -> int:
        """Return the time by the clock of the arrivals, nanoseconds; 0: there is none yet."""
        raise NotImplementedError

    def damage(self) -> list[str]:
        """Return the parts that cannot be read, one sentence each."""
        return []

    def findings(self, doctor: Doctor, now: int | None = None) -> list[Finding]:
        """Show the graph to a doctor that observes the buffer; return the present findings."""
        doctor.endpoints, doctor.graph = self.endpoints(), self.graph()
        return doctor.findings(self.now() if now is None else now)


def note_switches(reports: SwitchReports, statuses: Iterable[Any], buffer: BufferCore) -> None:
    """Notify observers of what diagnostics report of the sources of other buffers."""
    for status in statuses:
        values = {pair.key: pair.value for pair in status.values}
        for incident in reports.news(status.name, values):
            buffer.intake.refuse(incident)


def nothing_arrived(tree_input: TreeInput) -> Cannot:
    """Return the error for an input without any transform."""
    damage = ''.join(f'; {sentence}' for sentence in tree_input.damage())
    return Cannot(f'no transform arrived from {tree_input.name}{damage or f": {tree_input.hint}"}')
