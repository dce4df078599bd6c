"""
Small nodes that nobody else spins, for what has to be served while a user's node is busy.

They answer no parameter services, for nobody would serve those. ``ros2 param list``
waits five seconds for each node that it lists and that has none, so they are hidden.
"""

import secrets
from typing import Any

import rclpy
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.parameter import Parameter

USE_SIM_TIME = 'use_sim_time'

_OPTIONS: dict[str, Any] = {'enable_rosout': False, 'start_parameter_services': False}
# A service that a receiver would never answer.
_NO_TYPE_DESCRIPTION = Parameter('start_type_description_service', value=False)


def companion(node: Node, name: str, *, with_clock: bool = True) -> Node:
    """
    Return a node beside another, unseen by its executor, with its context and namespace.

    :param with_clock: whether it goes by the other node's clock; then whoever serves it
        has to take ``/clock`` too.
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
        # The topics are resolved by the other node already; a rename is meant for it alone.
        use_global_arguments=False,
        cli_args=arguments,
        parameter_overrides=overrides,
        **_OPTIONS,
    )


def node_of_its_own(name: str) -> Node:
    """
    Return a node that goes by the command line, except for its name.

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
