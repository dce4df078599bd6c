# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Small nodes in addition to a user's node, served by threads of this package.

The threads serve subscriptions or service clients only, so these nodes offer no parameter
services. ``ros2 param list`` waits five seconds for each listed node without them; so the nodes
have hidden names.
"""

import secrets
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.parameter import Parameter

USE_SIM_TIME = 'use_sim_time'

_OPTIONS: dict[str, Any] = {'enable_rosout': False, 'start_parameter_services': False}
# The threads here would never answer this service.
_NO_TYPE_DESCRIPTION = Parameter('start_type_description_service', value=False)


def internal_node(node: Node, name: str, *, with_clock: bool = True) -> Node:
    """
    Return a node with the context and namespace of another one, but in no executor.

    It has the other's overrides of profiles, such as ``qos_overrides./tf.subscription.depth``.

    :param with_clock: whether it follows the other node's clock, simulated time included; then the
        thread that serves it has to take ``/clock``, too.
    """
    overrides: list[Any] = [_NO_TYPE_DESCRIPTION, *qos_overrides_of(node)]
    arguments: list[str] = []
    if with_clock:
        overrides.append(node.get_parameter(USE_SIM_TIME))
        arguments = ['--ros-args', '-r', f'/clock:={node.resolve_topic_name("/clock")}']
    return Node(
        hidden_name(name),
        context=node.context,
        namespace=node.get_namespace(),
        # The other node has resolved the topics already; ``__node:=`` applies to that one only.
        use_global_arguments=False,
        cli_args=arguments,
        parameter_overrides=overrides,
        **_OPTIONS,
    )


def node_of_its_own(name: str, context: Context | None = None) -> Node:
    """
    Return a node that follows the command line (remappings, parameters), except for its name.

    :param context: None: the default one.
    :raises RuntimeError: ROS is not initialised.
    """
    if not rclpy.ok(context=context):
        raise RuntimeError('Without a node, rclpy.init() has to be called first')
    name = hidden_name(name)
    return Node(name, context=context, cli_args=['--ros-args', '-r', f'__node:={name}'],
                parameter_overrides=[_NO_TYPE_DESCRIPTION], **_OPTIONS)


def qos_overrides_of(node: Node) -> list[Parameter]:
    """Return the parameters of a node that override profiles of its topics."""
    # rclpy has no public way to get the parameters that were given but not declared.
    given: dict[str, Parameter] = getattr(node, '_parameter_overrides', {})
    return [parameter for name, parameter in given.items() if name.startswith('qos_overrides.')]


def hidden_name(name: str) -> str:
    """Return a name that no other node has, and that ``ros2`` lists only with ``--all``."""
    return f'{HIDDEN_NODE_PREFIX}{name}_{secrets.token_hex(6)}'
