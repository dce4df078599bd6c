# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The publishers and subscriptions of topics, from the ROS graph: names, and quality of service.

Edges that two publishers send are found by the numbers of their messages and the ROS graph.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
import math
import time

from rclpy.exceptions import InvalidHandle
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from tf_tree_py.core.messages.incidents import Incident, Kind, one_of
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.duplicate_streams import DuplicateStreams, Edge
from tf_tree_py.health.ros_graph import RosGraph

from ..threads.internal_node import is_running, USE_SIM_TIME

_REFRESH_S = 1.0
_RETRY_S = 0.05
# Messages of a publisher and the news that it has left arrive in any order, within this time.
_SETTLED_S = 1.0
# After a crash a node stays in the graph for 20 s, the lease of Fast DDS.
LEASE_S = 25.0
# The graph's name of an endpoint before its node has announced itself.
_UNNAMED = '_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_'
_TYPE = 'tf2_msgs/msg/TFMessage'
_CLOCK = '/clock'


class PublisherNames:
    """
    The name of the node that publishes on a topic, or of several nodes.

    A message does not name its sender; the graph lists the publishers of its topic. With several
    publishers the name is therefore ``one of a, b``. The graph is read at most once a second. It
    is read more often while a name is missing, because the first message may arrive before the
    publisher's name, and before an incident is reported.

    :ivar placeholder: replaces the name while it is missing.
    :ivar endpoints: the publishers' ids in the middleware.
    :ivar names: the publishers' node names, one for each; empty while one is missing.
    """

    def __init__(self, node: Node, topic: str) -> None:
        self._node = node
        self._topic = topic
        self._ask_at = -math.inf
        self._corrected_at = self._presented_at = -math.inf
        self.placeholder = self._name = f'unknown publisher of {topic}'
        self.endpoints: frozenset[bytes] = frozenset()
        self.names: list[str] = []

    def name(self) -> str:
        """Return the publisher's full node name, or all candidates."""
        now = time.monotonic()
        if now >= self._ask_at:
            self.ask()
            self._ask_at = now + (_RETRY_S if self._name == self.placeholder else _REFRESH_S)
        return self._name

    def ask(self) -> None:
        """Read the graph now."""
        # The last result stays once the listener is closed or ROS has shut down.
        if is_running(self._node.context):
            with suppress(InvalidHandle):
                self._name = self._ask()

    def correct(self, incidents: list[Incident]) -> list[Incident]:
        """
        Return incidents with the current name: a second publisher may have just appeared.

        :param incidents: of messages of this topic that have just arrived.
        """
        if not incidents:
            return incidents
        self._corrected_at = self._asked_again(self._corrected_at)
        name = self.name()
        return [replace(incident, authority=name) for incident in incidents]

    def present_name(self) -> str:
        """Return the current name from the graph, which is read at most twenty times a second."""
        self._presented_at = self._asked_again(self._presented_at)
        return self.name()

    def _asked_again(self, last: float) -> float:
        """Let the graph be read, unless it just was; return the time."""
        now = time.monotonic()
        if now < last + _RETRY_S:
            return last
        self._ask_at = now
        return now

    def _ask(self) -> str:
        infos = self._node.get_publishers_info_by_topic(self._topic)
        endpoints = frozenset(bytes(info.endpoint_gid) for info in infos)
        if endpoints != self.endpoints:
            self.endpoints = endpoints
        names = [node_name(info) for info in infos]
        self.names = [] if _UNNAMED in names else sorted(names)
        return one_of(set(names)) if self.names else self.placeholder


def node_name(info: TopicEndpointInfo) -> str:
    """Return the full name of an endpoint's node, from the graph."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


# --- endpoints

def endpoints_of(node: Node, topics: Mapping[str, bool]) -> list[Endpoint]:
    """
    Return the publishers and subscriptions of some topics, from the ROS graph.

    :param node: reads the graph; its own subscriptions are in the result.
    :param topics: full names, each with whether its transforms are valid at all times.
    """
    return [_endpoint(info, topic, static, publishes)
            for topic, static in topics.items()
            for publishes, infos in ((True, node.get_publishers_info_by_topic(topic)),
                                     (False, node.get_subscriptions_info_by_topic(topic)))
            for info in infos]


def _known_name(info: TopicEndpointInfo) -> str:
    name = node_name(info)
    return '' if name == _UNNAMED else name


def clock_publishers(node: Node) -> list[str]:
    """Return the names of the nodes that publish simulated time, as far as they are known."""
    if not is_running(node.context):
        return []
    with suppress(InvalidHandle):
        infos = node.get_publishers_info_by_topic(node.resolve_topic_name(_CLOCK))
        return [name for name in map(_known_name, infos) if name]
    return []


def graph_beside(node: Node, topics: Mapping[str, bool], *, settled: bool) -> RosGraph:
    """
    Return the publishers of transforms on other topics, and those of simulated time.

    :param node: reads the graph; nodes with hidden names, such as this package's and those of
        the ``ros2`` command, do not count as users of simulated time.
    :param topics: the full names of the topics of transforms that are read.
    :param settled: whether all nodes have had the time to appear in the graph.
    """
    others = [topic for topic, types in node.get_topic_names_and_types()
              if _TYPE in types and topic not in topics]
    clock = node.resolve_topic_name(_CLOCK)
    return RosGraph(
        [_endpoint(info, topic, info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
                   True) for topic in others for info in node.get_publishers_info_by_topic(topic)],
        clock, [_known_name(info) for info in node.get_publishers_info_by_topic(clock)],
        [node_name(info) for info in node.get_subscriptions_info_by_topic(clock)
         if not info.node_name.startswith(HIDDEN_NODE_PREFIX)],
        bool(node.get_parameter(USE_SIM_TIME).value), settled)


def _endpoint(info: TopicEndpointInfo, topic: str, static: bool, publishes: bool) -> Endpoint:
    qos = info.qos_profile
    return Endpoint(
        topic, static, _known_name(info), publishes,
        qos.reliability != ReliabilityPolicy.BEST_EFFORT,
        qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)


# --- two publishers of one edge

class DuplicatePublishers:
    """
    Reports each edge of a topic that two publishers send, once.

    It reports an edge again if two still send it after another publisher has left.

    While the graph shows one publisher, messages of ``/tf`` are not examined. When a publisher
    leaves, all numbers are forgotten, so that a restarted node does not count as a second
    publisher; the graph, which is not read all the time, may never have shown it. If the
    middleware does not number messages, nothing is reported.
    """

    def __init__(self, authority: PublisherNames, static: bool) -> None:
        """
        Begin without any numbers.

        :param authority: of the topic.
        :param static: whether each edge is sent once, as on ``/tf_static``.
        """
        self._authority = authority
        self._static = static
        self._streams = DuplicateStreams(static)
        self._endpoints = authority.endpoints
        self._quiet_until = -math.inf
        # Static edges that two have sent, unless one of them had left before: that is known later.
        self._suspected: dict[Edge, int] = {}
        self._suspected_at = 0.0

    def forget_for_a_while(self) -> None:
        """
        Forget all numbers, because a publisher has left.

        Messages of it may still be on their way, so those of the next second are not examined.
        """
        self._quiet_until = time.monotonic() + _SETTLED_S
        self._forget()

    def judge(self, batch: Batch, info: Mapping[str, int | None]) -> list[Incident]:
        """
        Examine a message, and return the incidents to report.

        :param batch: its transforms; none if all were refused.
        :param info: rclpy's message info.
        """
        authority = self._authority
        if authority.endpoints is not self._endpoints:
            self._forget_if_one_left()
        if len(self._endpoints) < 2 and not self._static:
            return []
        number = info['publication_sequence_number']
        if number is None:
            return []
        if self._quiet_until > 0.0:
            if time.monotonic() < self._quiet_until:
                return []
            self._quiet_until = -math.inf
        suspects = self._streams.examine(batch.edges, number)
        if not suspects:
            return self.settled()
        stamps = dict(zip(batch.edges, batch.stamps, strict=True))
        suspected = {edge: stamps[edge] for edge in suspects}
        if self._static:
            if not self._suspected:
                self._suspected_at = time.monotonic()
            self._suspected |= suspected
            return self.settled()
        incidents = self._judged(suspected)
        if self._streams.is_empty:
            # The publisher was most likely restarted, and this is its first message.
            self._streams.examine(batch.edges, number)
        return incidents

    def settled(self) -> list[Incident]:
        """Return incidents of static edges whose publishers are both known to live; call often."""
        if not self._suspected or time.monotonic() < self._suspected_at + LEASE_S:
            return []
        return self._judged(self._suspected)

    def _forget_if_one_left(self) -> bool:
        before, self._endpoints = self._endpoints, self._authority.endpoints
        one_left = bool(before - self._endpoints)
        if one_left:
            self._forget()
        return one_left

    def _forget(self) -> None:
        self._streams.begin_anew()
        self._suspected = {}

    def _judged(self, suspected: Mapping[Edge, int]) -> list[Incident]:
        """Return the incidents of suspected edges, with their stamps, that the graph confirms."""
        self._authority.ask()
        if self._forget_if_one_left():
            return []
        names = self._authority.names
        if not names:
            return []
        self._suspected = {}
        # One node may have two static publishers. Of moving transforms, both have sent some.
        if len(names) < 2 or (self._static and len(set(names)) < 2):
            return []
        for edge in suspected:
            self._streams.mark_reported(edge)
        return [self._incident(edge, stamp, names) for edge, stamp in suspected.items()]

    def _incident(self, edge: Edge, stamp: int, names: Sequence[str]) -> Incident:
        parent, child = (name.removeprefix('/') for name in edge)
        return Incident(
            Kind.TWO_PUBLISHERS, parent, child, stamp, self._authority.name(),
            f'{_both(names)} send it, as the numbers of its messages show. Their values are '
            'mixed, and every lookup through it uses whichever arrived last. Stop one of them')


def _both(names: Sequence[str]) -> str:
    """Return the names of the two publishers, as far as they are known."""
    if len(names) > 2:
        return f'two of {", ".join(names)}'
    first, second = names
    return f'two publishers of {first}' if first == second else f'both {first} and {second}'
