# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Receives a robot's topics of transforms, and publishes samples as bytes.

Transforms that a buffer would refuse are dropped. Serialized bytes cost a tenth of message
objects.
"""

from collections.abc import Callable, Collection

from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.sample import bad_name, Batch, checked, Sample
from tf_tree_py.core.messages.wire import WireReader, write
from tf_tree_py.limited_log import IncidentLog, LimitedLog
from tf_tree_py.ros.threads.internal_node import internal_node, is_running
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics.endpoints import PublisherNames
from tf_tree_py.ros.topics.qos import (
    dynamic_qos,
    mismatches,
    overriding,
    static_listener_qos,
    tf_publisher,
)
from tf_tree_py.thinning import MovingSender, StaticSender

from .bad_input import BadInput

Receive = Callable[[list[Sample]], None]


class RobotTopics:
    """Receives a robot's transforms in an internal thread, and passes them on."""

    def __init__(self, node: Node, names: Rename) -> None:
        """
        Start without topics.

        :param names: renames edges, or drops them.
        """
        self._names = names
        self._log = IncidentLog(node.get_logger())
        self._home = internal_node(node, f'{node.get_name()}_impl')

    def listen(self, topic: str, static_topic: str, moving: MovingSender, static: StaticSender,
               filtered: Callable[[Receive], Receive] = lambda receive: receive) -> Receiver:
        """
        Pass on the transforms of two topics, until the receiver is closed or ROS shuts down.

        :param moving: receives those of the first topic, and is closed at the end.
        :param filtered: wraps a function that takes a message in one that drops some samples.
        """
        self._subscribe(topic, dynamic_qos(), False, filtered(moving.offer))
        self._subscribe(static_topic, static_listener_qos(), True, filtered(static.offer))
        return Receiver(self._home, moving.close, write_counts=self._log.write_counts)

    def _subscribe(self, topic: str, qos: QoSProfile, static: bool, receive: Receive) -> None:
        reader = WireReader(self._names, static=static)
        authority = PublisherNames(self._home, topic)

        def on_message(data: bytes) -> None:
            publisher = authority.name()
            batch = reader.read_or_refuse(data, publisher)
            if isinstance(batch, Incident):
                self._log.report([batch])
            else:
                receive(fit_samples(batch, publisher, self._log.report))

        self._home.create_subscription(
            TFMessage, topic, on_message, qos, raw=True,
            event_callbacks=mismatches(topic, self._log), qos_overriding_options=overriding(
                self._home, self._home.resolve_topic_name(topic), 'subscription', static))


def fit_samples(batch: Batch, publisher: str,
                report: Callable[[list[Incident]], object] = lambda refused: None) -> list[Sample]:
    """Return the samples that a buffer would take, and report why it would refuse the others."""
    judged = [_fit(sample, publisher) for sample in batch.samples()]
    report([*(stamp.incident(publisher) for stamp in batch.impossible),
            *(each for each in judged if isinstance(each, Incident))])
    return [each for each in judged if isinstance(each, Sample)]


def _fit(sample: Sample, publisher: str) -> Sample | Incident:
    bad = bad_name(sample.parent, sample.child, sample.stamp, publisher, DEFAULT_MAX_NAME_BYTES)
    return bad or checked(sample, publisher)


def topic_of(node: Node, parameter: str, topic: str) -> str:
    """
    Return the full name of a topic, remapped.

    :param parameter: that names it, for the error.
    :raises BadInput: it is not a topic name.
    """
    try:
        resolved: str = node.resolve_topic_name(topic)
    except Exception as error:  # noqa: B902 - rclpy has several for it, some of them private
        raise BadInput(f'parameter {parameter} must be a topic name, not {topic!r}') from error
    return resolved


# --- publishing

class RawPublisher:
    """A topic of TFMessages."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile, static: bool = False) -> None:
        """Make the publisher."""
        self._node = node
        self._topic = topic
        self._publisher = tf_publisher(node, topic, qos, static)
        self._log = LimitedLog(lambda line: node.get_logger().error(line))

    def send(self, samples: Collection[Sample]) -> None:
        """Publish one message."""
        try:
            self._publisher.publish(write(samples))
        except Exception as error:  # noqa: B902 - the next message must be sent in any case
            # While the context shuts down, rclpy raises various exceptions.
            if is_running(self._node.context):
                self._log.write(f'unpublished, {type(error).__name__}', self._topic,
                                f'{len(samples)} transforms could not be published: {error}')
