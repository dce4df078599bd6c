# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The QoS profiles of /tf and /tf_static as in tf2, of sensors, and their overrides.

Also the log lines about endpoints that do not match.
"""

from collections.abc import Callable
from typing import Any, Literal

from rclpy.event_handler import (
    PublisherEventCallbacks,
    QoSRequestedIncompatibleQoSInfo,
    QoSSubscriptionMatchedInfo,
    SubscriptionEventCallbacks,
)
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, qos_policy_name_from_kind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions, QoSPolicyKind
from tf2_msgs.msg import TFMessage
from tf_tree_py.limited_log import LimitedLog

from ..threads.internal_node import qos_overrides_of

TF_TOPIC = '/tf'
TF_STATIC_TOPIC = '/tf_static'


def dynamic_qos() -> QoSProfile:
    """Return the profile of /tf, both sides: reliable, volatile, the last 100."""
    return QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.VOLATILE)


def static_listener_qos() -> QoSProfile:
    """Return the subscriber's profile of /tf_static: a late joiner gets the last 100."""
    return static_qos(100)


def static_broadcaster_qos() -> QoSProfile:
    """Return the publisher's profile: only the last message, since each holds all transforms."""
    return static_qos(1)


def static_qos(depth: int) -> QoSProfile:
    """Return a profile of what never changes, both sides: late joiners get the last messages."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


def sensor_qos(depth: int = 10) -> QoSProfile:
    """Return a subscriber's profile that matches every publisher, also best-effort sensors."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT,
                      durability=DurabilityPolicy.VOLATILE)


def overriding(node: Node, topic: str, entity: Literal['publisher', 'subscription'],
               static: bool) -> QoSOverridingOptions | None:
    """
    Return the options that let parameters of a node override a profile, as in tf2's C++ nodes.

    An example is ``-p qos_overrides./tf.publisher.depth:=10``. The parameters are declared only if
    one of them was given, so all other nodes have only the parameters that they declare.

    :param topic: fully resolved.
    """
    begin = f'qos_overrides.{topic}.{entity}.'
    if not any(parameter.name.startswith(begin) for parameter in qos_overrides_of(node)):
        return None
    policies = [QoSPolicyKind.DEPTH, QoSPolicyKind.HISTORY, QoSPolicyKind.RELIABILITY]
    return QoSOverridingOptions(policies if static else [*policies, QoSPolicyKind.DURABILITY])


def tf_publisher(node: Node, topic: str, qos: QoSProfile | int, static: bool) -> Publisher:
    """Return a publisher of TFMessages; parameters of the node may override its profile."""
    name = node.resolve_topic_name(topic)
    return node.create_publisher(
        TFMessage, topic, qos, qos_overriding_options=overriding(node, name, 'publisher', static),
        event_callbacks=PublisherEventCallbacks(**_mismatch(
            name, LimitedLog(node.get_logger().warning), 'subscription', 'requesting', 'sent to')))


# --- endpoints that do not match

def mismatches(topic: str, log: LimitedLog,
               on_left: Callable[[], object] | None = None) -> SubscriptionEventCallbacks:
    """
    Return a subscription's callbacks that log publishers whose messages cannot arrive.

    rclpy logs a line for each, and anyone can make publishers at any rate.

    :param on_left: called when publishers have left; None: this is not observed.
    """
    def matched(status: QoSSubscriptionMatchedInfo) -> None:
        # Also if as many have come in the meantime.
        if on_left is not None and status.current_count_change < status.total_count_change:
            on_left()

    return SubscriptionEventCallbacks(
        matched=None if on_left is None else matched,
        **_mismatch(topic, log, 'publisher', 'offering', 'received from'))


def _mismatch(topic: str, log: LimitedLog, other: str, does: str, goes: str) -> dict[str, Any]:
    """Return the callbacks, with rclpy's own texts."""
    def quality(event: QoSRequestedIncompatibleQoSInfo) -> None:
        log.write('incompatible QoS', topic, (
            f'New {other} discovered on topic {topic!r}, {does} incompatible QoS. No messages '
            f'will be {goes} it. Last incompatible policy: '
            f'{qos_policy_name_from_kind(event.last_policy_kind)}'))

    def of_type(_: object) -> None:
        log.write('incompatible type', topic, (
            f'Incompatible type on topic {topic!r}, no messages will be {goes} it.'))

    return {'incompatible_qos': quality, 'incompatible_type': of_type}
