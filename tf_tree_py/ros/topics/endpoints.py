# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The publishers and subscriptions of topics of transforms, and their quality of service."""

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from tf_tree_py.core.messages.observers import Endpoint

from .publisher_names import node_name


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


def _endpoint(info: Any, topic: str, static: bool, publishes: bool) -> Endpoint:
    qos = info.qos_profile
    return Endpoint(
        topic, static, node_name(info), publishes,
        qos.reliability != ReliabilityPolicy.BEST_EFFORT,
        qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)
