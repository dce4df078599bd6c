# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The levels on /diagnostics that a program reports for a fault.

They come from tf_tree_py/ros/diagnostics.py; because of this line, ``scripts/test --near`` knows.
"""

from functools import partial

from bags import as_cdr, BEST_EFFORT, LATCHED, SECOND
from conditions import until
from patients import FAULTY, SWITCHED, switched
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from ros_helpers import simulated_clock
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, TransformDiagnostics, TransformListener
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.sample import Batch

_LEVELS = ('OK', 'WARN', 'ERROR', 'STALE')
# These faults are in the ROS graph or in the bytes of a message, so they are sent over DDS.
_OVER_DDS = ('two_publishers', 'late_joiner', 'qos_mismatch', 'unreadable', 'impossible_stamp')
_TOPICS = ('/tf', '/tf_static')


def levels(code, node):
    """
    Return the worst level of any status of a program that reports every second.

    If the level differs in its last report, return both.
    """
    buffer = Buffer()
    if code in _OVER_DDS:
        with TransformListener(buffer, node):
            return _levels(code, buffer, node, _play_over_dds)
    return _levels(code, buffer, node, _switch if code in SWITCHED else _insert)


def _levels(code, buffer, node, play):
    clock = simulated_clock()
    buffer.use_clock(clock)
    worst, reports = [], []

    def show(now):
        clock.set_ros_time_override(Time(nanoseconds=now, clock_type=clock.clock_type))
        if not reports or now >= reports[-1] + SECOND:
            reports.append(now)
            worst.append(max(ord(status.level) for status in diagnostics.report().status))

    with TransformDiagnostics(buffer, node) as diagnostics:
        play(code, buffer, node, show)
    return ', then '.join(dict.fromkeys(_LEVELS[each] for each in (max(worst), worst[-1])))


def _in_order(code):
    return sorted(FAULTY[code], key=lambda each: each.received)


def _switch(code, buffer, node, show):
    switched(code, buffer, show)


def _insert(code, buffer, node, show):
    for message in _in_order(code):
        if message.transforms:
            edges, stamps, poses = zip(*(
                ((parent.strip('/'), child.strip('/')), stamp, pack_pose(*pose))
                for parent, child, stamp, pose in message.transforms), strict=True)
            show(message.received)
            buffer.insert_batch(Batch(edges, stamps, poses), f'/sender_of_{edges[0][0]}',
                                message.topic == '/tf_static')


def _play_over_dds(code, buffer, node, show):
    """Publish each message after the previous one has arrived, if there is a subscription."""
    nodes, publishers, sent = {}, {}, 0
    messages = [message for message in _in_order(code) if message.topic in _TOPICS]
    for name, topic, qos in dict.fromkeys(map(_sender, messages)):
        if name not in nodes:
            nodes[name] = Node(name, context=node.context)
        publishers[name, topic, qos] = nodes[name].create_publisher(TFMessage, topic, _qos(qos))
    until(lambda: {*nodes} <= {info.node_name for info in _infos(node)})
    until(lambda: all(publisher.get_subscription_count() for (_, topic, qos), publisher
                      in publishers.items() if _is_heard(topic, qos)))
    for message in messages:
        show(message.received)
        data = as_cdr(message.transforms) if message.data is None else message.data
        publishers[_sender(message)].publish(data)
        if _is_heard(message.topic, message.qos):
            sent += len(message.transforms) or 1
            until(partial(_has_arrived, buffer, sent))
    for each in nodes.values():
        each.destroy_node()
    until(lambda: not _infos(node))


def _sender(message):
    first = message.transforms[0][0] if message.transforms else 'nobody'
    return message.publisher or f'sender_of_{first}', message.topic, message.qos


def _qos(qos):
    return QoSProfile(
        depth=100,
        reliability=(ReliabilityPolicy.BEST_EFFORT if qos == BEST_EFFORT
                     else ReliabilityPolicy.RELIABLE),
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if qos == LATCHED
                    else DurabilityPolicy.VOLATILE))


def _is_heard(topic, qos):
    return qos == LATCHED if topic == '/tf_static' else qos != BEST_EFFORT


def _infos(node):
    return [info for topic in _TOPICS for info in node.get_publishers_info_by_topic(topic)]


def _has_arrived(buffer, count):
    counts = buffer.statistics()
    return counts.accepted + counts.refused >= count
