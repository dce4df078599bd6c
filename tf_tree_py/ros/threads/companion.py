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
Small nodes beside a user's node, served by a thread of ours while the user's is busy.

The threads serve subscriptions or service clients only, so these nodes offer no parameter
services. ``ros2 param list`` waits five seconds for each listed node without them; so the
nodes have hidden names.
"""

import secrets
from typing import Any

import rclpy
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.parameter import Parameter

USE_SIM_TIME = 'use_sim_time'

_OPTIONS: dict[str, Any] = {'enable_rosout': False, 'start_parameter_services': False}
# A thread of ours would never answer this service.
_NO_TYPE_DESCRIPTION = Parameter('start_type_description_service', value=False)


def companion(node: Node, name: str, *, with_clock: bool = True) -> Node:
    """
    Return a node beside another, with its context and namespace, but in no executor.

    :param with_clock: whether it follows the other node's clock, simulated time included;
        then the thread that serves it has to take ``/clock`` too.
    """
    overrides: list[Any] = [_NO_TYPE_DESCRIPTION]
    arguments: list[str] = []
    if with_clock:
        overrides.append(node.get_parameter(USE_SIM_TIME))
        arguments = ['--ros-args', '-r', f'/clock:={node.resolve_topic_name("/clock")}']
    return Node(
        hidden_name(name),
        context=node.context,
        namespace=node.get_namespace(),
        # The other node has resolved the topics already; ``__node:=`` is meant for that one alone.
        use_global_arguments=False,
        cli_args=arguments,
        parameter_overrides=overrides,
        **_OPTIONS,
    )


def node_of_its_own(name: str) -> Node:
    """
    Return a node that obeys the command line (remappings, parameters), except for its name.

    :raises RuntimeError: ROS is not initialised.
    """
    if not rclpy.ok():
        raise RuntimeError('Without a node, rclpy.init() has to be called first')
    name = hidden_name(name)
    return Node(name, cli_args=['--ros-args', '-r', f'__node:={name}'],
                parameter_overrides=[_NO_TYPE_DESCRIPTION], **_OPTIONS)


def hidden_name(name: str) -> str:
    """Return a name that no other node has, and that ``ros2`` lists only with ``--all``."""
    return f'{HIDDEN_NODE_PREFIX}{name}_{secrets.token_hex(6)}'
