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

"""Who publishes and hears topics of transforms, and with which quality of service."""

from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from tf_tree_py.core.arrivals.received import Endpoint

from .authority import node_name


def endpoints_of(node: Node, topics: Mapping[str, bool]) -> list[Endpoint]:
    """
    Return who publishes and hears some topics, as the ROS graph says.

    :param node: asks the graph; its own subscriptions are among the answers.
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
