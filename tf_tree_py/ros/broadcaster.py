"""Publishing transforms: what moves on /tf, what does not on /tf_static."""

from collections.abc import Iterable
import copy
import threading

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage

from .convert import with_float_fields
from .qos import dynamic_qos, static_broadcaster_qos, TF_STATIC_TOPIC, TF_TOPIC

Transforms = TransformStamped | Iterable[TransformStamped]


class TransformBroadcaster:
    """Publishes moving transforms on ``/tf``."""

    def __init__(self, node: Node, qos: QoSProfile | int | None = None) -> None:
        """
        Make the publisher.

        :param node: whose publisher it is.
        :param qos: reliable, volatile, depth 100 unless given.
        """
        self.pub_tf = node.create_publisher(TFMessage, TF_TOPIC, qos or dynamic_qos())

    def sendTransform(self, transform: Transforms) -> None:
        """Publish one ``TransformStamped`` or several, in one message."""
        messages = [with_float_fields(message) for message in _as_list(transform)]
        self.pub_tf.publish(TFMessage(transforms=messages))


class StaticTransformBroadcaster:
    """
    Publishes transforms that never change on ``/tf_static``.

    The topic keeps one message for late joiners, so each holds everything this
    broadcaster ever sent: the newest of every child frame. What was sent is
    copied, so the caller's messages may change afterwards.
    """

    def __init__(self, node: Node, qos: QoSProfile | int | None = None) -> None:
        """
        Make the publisher.

        :param node: whose publisher it is.
        :param qos: reliable, transient local, depth 1 unless given.
        """
        self.pub_tf = node.create_publisher(
            TFMessage, TF_STATIC_TOPIC, qos or static_broadcaster_qos())
        self._sent: dict[str, TransformStamped] = {}
        self._lock = threading.Lock()

    def sendTransform(self, transform: Transforms) -> None:
        """Publish one ``TransformStamped`` or several, with all those before."""
        messages = [copy.deepcopy(with_float_fields(message)) for message in _as_list(transform)]
        # Of two threads, the last to publish must be the one that holds all.
        with self._lock:
            self._sent.update((message.child_frame_id, message) for message in messages)
            self.pub_tf.publish(TFMessage(transforms=list(self._sent.values())))


def _as_list(transform: Transforms) -> list[TransformStamped]:
    if isinstance(transform, TransformStamped):
        return [transform]
    return list(transform)
