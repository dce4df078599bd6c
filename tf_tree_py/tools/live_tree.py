# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A live tree: the transforms on /tf and /tf_static, received by the tool's own node."""

from argparse import Namespace
from collections.abc import Sequence
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.logging import LoggingSeverity
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from tf_tree_py.beyond.uncertainty.insertion import STATIC_COVARIANCE_TOPIC
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.buffer.waiting import WallDeadline
from tf_tree_py.core.messages.observers import Endpoint, Observer
from tf_tree_py.core.text import listed
from tf_tree_py.health.checks.graph import graph_findings
from tf_tree_py.health.ros_graph import RosGraph
from tf_tree_py.reports.switch_status import DIAGNOSTICS_TOPIC, SwitchReports
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.threads.internal_node import node_of_its_own
from tf_tree_py.ros.topics.endpoints import endpoints_of, graph_beside
from tf_tree_py.ros.topics.listener import TransformListener
from tf_tree_py.ros.topics.qos import sensor_qos, TF_STATIC_TOPIC, TF_TOPIC
from tf_tree_py.ros.topics.side_topics import CovarianceListener, SideTopics
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.status import Status, status_of

from .inputs import note_switches, TreeInput
from .missing import hint_of

# How much later than the first transforms static covariances may arrive; the period of checks.
_MOMENT_S = 1.0
_GLANCE_S = 0.02
# By then the nodes have found each other: Fast DDS announces itself every three seconds.
SETTLED_S = 4.0
# At most this many faults that the graph shows are named.
_MOST_REASONS = 4


class LiveTree(TreeInput):
    """
    A buffer that receives a running system's transforms; see ``TreeInput``.

    :ivar node: the tool's node, with a hidden name; it is not spun.
    """

    buffer: Buffer

    def __init__(self, arguments: Namespace, name: str, observers: Sequence[Observer], *,
                 cache_time: int | None = None) -> None:
        """
        Begin to listen.

        :param cache_time: the length of the history, nanoseconds; a node's default unless given.
        :raises Cannot: the ROS arguments are invalid.
        """
        try:
            rclpy.init(args=[name, *arguments.ros_arguments],
                       signal_handler_options=SignalHandlerOptions.NO)
            self.node = node_of_its_own(name)
        except Exception as error:  # noqa: B902 - rcl raises several kinds for invalid arguments
            try_shutdown()
            raise Cannot(_sentence(error)) from error
        # The tool reports incidents itself.
        self.node.get_logger().set_level(LoggingSeverity.ERROR)
        self.buffer = Buffer(cache_time)
        for observer in observers:
            self.buffer.observers.add(observer)
        moving = self._resolved(arguments.tf_topic or TF_TOPIC)
        fixed = self._resolved(arguments.tf_static_topic or TF_STATIC_TOPIC)
        self._topics = {moving: False, fixed: True}
        # First, so that static covariances have arrived when the first lookup succeeds.
        self._static_covariances = self._resolved(STATIC_COVARIANCE_TOPIC)
        self._covariances = CovarianceListener(self.buffer, self.node)
        self._listener = TransformListener(
            self.buffer, self.node, tf_topic=moving, tf_static_topic=fixed)
        self._diagnostics = SideTopics(self, self.node, 'diagnostics_impl')
        reports = SwitchReports()
        self._diagnostics.subscribe(
            DiagnosticArray, DIAGNOSTICS_TOPIC,
            lambda message: note_switches(reports, message.status, self.buffer), sensor_qos())
        self._begin_s = time.monotonic()
        self.name = ' and '.join(self._topics)

    def close(self) -> None:
        """Stop listening, and destroy the node."""
        self._listener.close()
        self._covariances.close()
        self._diagnostics.close()
        self.node.destroy_node()
        try_shutdown()

    def _resolved(self, topic: str) -> str:
        """Return a topic's full name, remapped."""
        try:
            return self.node.resolve_topic_name(topic)
        except Exception as error:  # noqa: B902 - likewise
            try_shutdown()
            raise Cannot(f'{topic!r} is not a valid topic name: {_sentence(error)}') from error

    def now(self) -> int:
        """Return the time by the node's clock."""
        return self.buffer.now()

    def await_covariances(self) -> None:
        """Wait a moment for those of static edges, if the graph shows a publisher of any."""
        deadline = WallDeadline(_MOMENT_S)
        while (not self.buffer.has_covariances and deadline.elapsed_s() < _MOMENT_S
               and self.node.count_publishers(self._static_covariances)):
            threading.Event().wait(_GLANCE_S)  # no event signals the arrival of a covariance

    def endpoints(self) -> list[Endpoint]:
        """Return the publishers and subscriptions of the topics in the graph, this tool's too."""
        return endpoints_of(self.node, self._topics)

    def graph(self) -> RosGraph:
        """Return the publishers of transforms on other topics, and those of simulated time."""
        settled = time.monotonic() - self._begin_s >= SETTLED_S
        return graph_beside(self.node, self._topics, settled=settled)

    def shared(self) -> Status | None:
        """Return the status of the tree that ``tf_share`` shares for these topics, if it does."""
        try:
            return status_of(Place(self.node.context.get_domain_id(), list(self._topics)))
        except SharedTreeException:  # not on this kind of machine
            return None

    @property
    def hint(self) -> str:
        """Return what the graph shows; what to check, as long as that explains nothing."""
        graph, endpoints = self.graph(), self.endpoints()
        senders = sorted({one.node or 'an unknown node' for one in endpoints if one.publishes})
        faults = graph_findings(graph, endpoints)[:_MOST_REASONS]
        reasons = [hint_of(fault) for fault in faults]
        if senders:
            verb = 'publishes' if len(senders) == 1 else 'publish'
            reasons.insert(0, f'{listed(senders)} {verb} there, but nothing has arrived')
        elif not graph.elsewhere:
            reasons.insert(0, self._without_publisher(graph.settled))
        return '. '.join(reasons)

    def _without_publisher(self, settled: bool) -> str:
        domain = self.node.context.get_domain_id()
        if not settled:
            return f'does any node publish there with the same ROS_DOMAIN_ID, which is {domain}?'
        return ('no node publishes tf2_msgs/msg/TFMessage on any topic. Do the nodes run, on this '
                f'network and with the ROS_DOMAIN_ID {domain}, as this tool does?')


def _sentence(error: Exception) -> str:
    """Return the text of an rcl error, without file names and line numbers."""
    text = str(error).split(', at /')[0].strip()
    # For unknown arguments its text is only their list.
    return f'unknown ROS arguments {text}' if text.startswith('[') else ' '.join(text.split())
