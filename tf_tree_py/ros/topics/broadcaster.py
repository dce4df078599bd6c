# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Publishes transforms: moving ones on /tf, static ones on /tf_static."""

from collections.abc import Collection, Iterable
import copy
from typing import TypeAlias

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core import fork_locks
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.frame_names import rename

from .qos import dynamic_qos, static_broadcaster_qos, tf_publisher, TF_STATIC_TOPIC, TF_TOPIC
from ..buffer.interface import check_places
from ..messages.convert import with_float_fields, with_frames

Transforms: TypeAlias = TransformStamped | Iterable[TransformStamped]


class TransformBroadcaster:
    """Publishes moving transforms on ``/tf``."""

    def __init__(self, node: Node, qos: QoSProfile | int | None = None, *,
                 tf_topic: str = TF_TOPIC, frame_prefix: str = '',
                 shared_frames: Collection[str] = ()) -> None:
        """
        Make the publisher.

        :param node: gets the publisher.
        :param qos: reliable, volatile, depth 100 unless given.
        :param tf_topic: the topic; a relative name is in the node's namespace.
        :param frame_prefix: prepended to every published frame, without its leading slash.
        :param shared_frames: frames that get no prefix, such as ``map``.
        :raises ValueError: a string instead of a collection of frames.
        """
        check_places(f'{type(self).__name__}(node)', node=node)
        self._names = _names(frame_prefix, shared_frames)
        self.pub_tf = tf_publisher(node, tf_topic, qos or dynamic_qos(), static=False)

    def sendTransform(self, transform: Transforms) -> None:
        """
        Publish one ``TransformStamped`` or several, in one message.

        :raises AttributeError: something else, such as a ``Transform``.
        """
        messages = _as_sent(transform, self._names)
        self.pub_tf.publish(TFMessage(transforms=messages))


class StaticTransformBroadcaster:
    """
    Publishes transforms that never change on ``/tf_static``.

    The topic keeps one message for late joiners, so each message holds the newest transform of
    every child frame that this broadcaster has sent. Messages are copied, so the caller may change
    them afterwards.

    :ivar net_message: the last published message.
    """

    def __init__(self, node: Node, qos: QoSProfile | int | None = None, *,
                 tf_static_topic: str = TF_STATIC_TOPIC, frame_prefix: str = '',
                 shared_frames: Collection[str] = ()) -> None:
        """
        Make the publisher.

        :param node: gets the publisher.
        :param qos: reliable, transient local, depth 1 unless given.
        :param tf_static_topic: the topic; the others are as for ``TransformBroadcaster``.
        """
        check_places(f'{type(self).__name__}(node)', node=node)
        self._names = _names(frame_prefix, shared_frames)
        self.pub_tf = tf_publisher(
            node, tf_static_topic, qos or static_broadcaster_qos(), static=True)
        self.net_message = TFMessage()
        self._lock = fork_locks.lock()

    def sendTransform(self, transform: Transforms) -> None:
        """Publish one ``TransformStamped`` or several, with all earlier ones."""
        messages = copy.deepcopy(_as_sent(transform, self._names))
        # If two threads send, the message that is published last must hold all transforms.
        with self._lock:
            # For listeners, a name with a leading slash is the same as without.
            newest = {message.child_frame_id.removeprefix('/'): message
                      for message in (*self.net_message.transforms, *messages)}
            self.net_message.transforms = list(newest.values())
            self.pub_tf.publish(self.net_message)


def _names(frame_prefix: str, shared_frames: Collection[str]) -> Rename:
    """Return how frames are renamed; without a prefix they stay as they are, as in tf2."""
    if not frame_prefix:
        return _unchanged
    return rename(frame_prefix=frame_prefix, shared_frames=shared_frames)


def _unchanged(parent: str, child: str) -> tuple[str, str]:
    return parent, child


def _as_sent(transform: Transforms, names: Rename) -> list[TransformStamped]:
    """Return the messages to publish; the caller's messages are not changed."""
    return [with_frames(with_float_fields(message), names) for message in _as_list(transform)]


def _as_list(transform: Transforms) -> list[TransformStamped]:
    if isinstance(transform, TransformStamped):
        return [transform]
    messages = list(transform) if isinstance(transform, Iterable) else [transform]
    for message in messages:
        # As in tf2, where reading the header raises this.
        if not hasattr(message, 'child_frame_id') or not hasattr(message, 'transform'):
            raise AttributeError(
                f'sendTransform takes a TransformStamped, or several, and this is a '
                f"{type(message).__name__}, which has no 'header' and 'child_frame_id'")
    return messages
