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

"""Publishes transforms: moving ones on /tf, static ones on /tf_static."""

from collections.abc import Collection, Iterable
import copy
import threading
from typing import TypeAlias

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.frame_names import Rename, rename

from .qos import dynamic_qos, static_broadcaster_qos, TF_STATIC_TOPIC, TF_TOPIC
from ..buffer.wrong_arguments import check_places
from ..messages.convert import with_float_fields, with_frames

Transforms: TypeAlias = TransformStamped | Iterable[TransformStamped]


class TransformBroadcaster:
    """Publishes moving transforms on ``/tf``."""

    def __init__(self, node: Node, qos: QoSProfile | int | None = None, *,
                 tf_topic: str = TF_TOPIC, frame_prefix: str = '',
                 shared_frames: Collection[str] = ()) -> None:
        """
        Make the publisher.

        :param node: whose publisher it is.
        :param qos: reliable, volatile, depth 100 unless given.
        :param tf_topic: where to publish; a relative one lies in the node's namespace.
        :param frame_prefix: put in front of every frame that is published.
        :param shared_frames: frames that keep their name all the same, such as ``map``.
        :raises ValueError: a string where a collection of frames belongs.
        """
        check_places(f'{type(self).__name__}(node)', node=node)
        self._names = rename(frame_prefix=frame_prefix, shared_frames=shared_frames)
        self.pub_tf = node.create_publisher(TFMessage, tf_topic, qos or dynamic_qos())

    def sendTransform(self, transform: Transforms) -> None:
        """Publish one ``TransformStamped`` or several, in one message."""
        messages = _as_sent(transform, self._names)
        self.pub_tf.publish(TFMessage(transforms=messages))


class StaticTransformBroadcaster:
    """
    Publishes transforms that never change on ``/tf_static``.

    The topic keeps one message for late joiners, so each message holds everything that
    this broadcaster ever sent: the newest transform of every child frame. Messages are
    copied, so the caller may change them afterwards.

    :ivar net_message: what was published last.
    """

    def __init__(self, node: Node, qos: QoSProfile | int | None = None, *,
                 tf_static_topic: str = TF_STATIC_TOPIC, frame_prefix: str = '',
                 shared_frames: Collection[str] = ()) -> None:
        """
        Make the publisher.

        :param node: whose publisher it is.
        :param qos: reliable, transient local, depth 1 unless given.
        :param tf_static_topic: where to publish; else as ``TransformBroadcaster``.
        """
        check_places(f'{type(self).__name__}(node)', node=node)
        self._names = rename(frame_prefix=frame_prefix, shared_frames=shared_frames)
        self.pub_tf = node.create_publisher(
            TFMessage, tf_static_topic, qos or static_broadcaster_qos())
        self.net_message = TFMessage()
        self._lock = threading.Lock()

    def sendTransform(self, transform: Transforms) -> None:
        """Publish one ``TransformStamped`` or several, with all those before."""
        messages = copy.deepcopy(_as_sent(transform, self._names))
        # If two threads send, the message that is published last must hold all transforms.
        with self._lock:
            # A listener strips a leading slash: both spellings are one frame.
            newest = {message.child_frame_id.removeprefix('/'): message
                      for message in (*self.net_message.transforms, *messages)}
            self.net_message.transforms = list(newest.values())
            self.pub_tf.publish(self.net_message)


def _as_sent(transform: Transforms, names: Rename) -> list[TransformStamped]:
    """Return what to publish; the caller's messages stay as they are."""
    return [with_frames(with_float_fields(message), names) for message in _as_list(transform)]


def _as_list(transform: Transforms) -> list[TransformStamped]:
    if isinstance(transform, TransformStamped):
        return [transform]
    return list(transform)
