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

"""Fills a buffer from /tf and /tf_static."""

from collections.abc import Collection
import functools
import threading
from typing import Any, cast
import weakref

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.arrivals.frame_names import FrameFilter, Rename, rename
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.received import Received
from tf_tree_py.core.arrivals.wire import WireReader

from .authority import Authority
from .qos import dynamic_qos, static_listener_qos, TF_STATIC_TOPIC, TF_TOPIC
from .rivals import Rivals
from ..buffer.buffer import Buffer
from ..buffer.wrong_arguments import check_is_ours, check_places
from ..threads.companion import companion, node_of_its_own, USE_SIM_TIME
from ..threads.receiver import Receiver

_NAME = 'transform_listener_impl'


class TransformListener:
    """
    Fills a buffer with what is published on ``/tf`` and ``/tf_static``.

    It reads in a thread of its own, on a small node of its own beside yours, and never
    spins your node. The small node has your node's context, namespace, remappings and
    clock. So a lookup with a timeout works inside a callback, also of a single-threaded
    executor: transforms go on arriving while it waits.

    It lives as long as your node (without one, as ROS) or until ``close()``; it is a
    context manager. Several may fill one buffer.
    """

    def __init__(self, buffer: Buffer, node: Node | None = None, *, spin_thread: bool = True,
                 qos: QoSProfile | int | None = None,
                 static_qos: QoSProfile | int | None = None,
                 tf_topic: str = TF_TOPIC, tf_static_topic: str = TF_STATIC_TOPIC,
                 static_only: bool = False, frame_prefix: str = '',
                 strip_frame_prefix: str = '', shared_frames: Collection[str] = (),
                 frame_filter: FrameFilter | None = None) -> None:
        """
        Begin to listen.

        :param buffer: what to fill.
        :param node: whose names, remappings and clock to use; None: those of the
            command line.
        :param spin_thread: read in a thread of its own. False puts the subscriptions
            on your node for your executor to serve. Then a lookup that waits in a callback
            of a single-threaded executor would block its own transforms: it fails at once.
        :param qos: of ``/tf``; reliable, volatile, depth 100 unless given.
        :param static_qos: of ``/tf_static``; reliable, transient local, depth 100.
        :param tf_topic: where moving transforms are published.
        :param tf_static_topic: where static ones are.
        :param static_only: leave ``/tf`` alone.
        :param frame_prefix: put in front of every frame, such as ``robot1/``.
        :param strip_frame_prefix: taken from the front before that; an edge of a frame
            that does not have it is left out.
        :param shared_frames: keep their name all the same, such as ``map``.
        :param frame_filter: whether to take (parent, child), or the frames to take: an
            edge between two of them. It is called with names as they arrive, and not for
            every message, so it has to give the same answer every time.
        :raises TypeError: another buffer than ours, such as tf2's.
        :raises RuntimeError: there is no node, and ROS is not initialised.
        :raises ValueError: ``spin_thread=False`` and no node to spin, or a string where
            a collection of frames belongs.
        """
        check_is_ours(buffer, Buffer, 'TransformListener')
        names = rename(frame_prefix=frame_prefix, strip_frame_prefix=strip_frame_prefix,
                       shared_frames=shared_frames, frame_filter=frame_filter)
        check_places('TransformListener(buffer, node)', node=node)
        lives_with_node = node is not None
        self._home = _home(node, spin_thread)
        self.node = node = node or self._home
        self.buffer = buffer
        self._receiver: Receiver | None = None
        self._spinner = _Spinner(buffer, self._home)
        topics = [(tf_topic, False, qos or dynamic_qos()),
                  (tf_static_topic, True, static_qos or static_listener_qos())]
        # All names are resolved before the first subscription: a bad one must leave none behind.
        resolved = [(node.resolve_topic_name(topic), static, profile)
                    for topic, static, profile in topics if static or not static_only]
        buffer.feeds.log_to(node.get_logger())
        self._feeds = [_Feed(buffer, self._home, topic, static, profile, names, self._spinner)
                       for topic, static, profile in resolved]
        feed_of = self._home.get_clock(), node.context
        buffer.feeds.begin(*feed_of)
        self._end_feed = functools.partial(buffer.feeds.end, *feed_of)
        if spin_thread:
            self._receiver = Receiver(
                self._home, self._end_feed, rest=buffer.waiting.sleep_until_somebody)
            buffer.feeds.add_thread(self._receiver.thread)
            if lives_with_node:
                # The node's callback list references self: it lives as long as the node, as tf2's.
                node.add_post_set_parameters_callback(self._switch_clock)
                weakref.finalize(self, self._receiver.stop)

    def close(self) -> None:
        """Stop listening; what is in the buffer stays there."""
        feeds, self._feeds = self._feeds, []
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            if self.node is not self._home:
                self.node.remove_post_set_parameters_callback(self._switch_clock)
            receiver.close()
        elif feeds:
            for feed in feeds:
                feed.close()
            self._spinner.forget()
            self._end_feed()

    def unregister(self) -> None:
        """Stop listening: tf2's name for ``close``."""
        self.close()

    def __enter__(self) -> 'TransformListener':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _switch_clock(self, parameters: list[Parameter]) -> None:
        """Switch to simulated time and back when the node does."""
        changed = [parameter for parameter in parameters if parameter.name == USE_SIM_TIME]
        receiver = self._receiver
        if changed and receiver is not None and self.node.context.ok():
            self._home.set_parameters(changed)
            receiver.wake()


class _Spinner:
    """
    Notes which thread runs a node's single-threaded executor, and so delivers transforms.

    A program may spin its node first in one thread and then in another; the first then
    delivers nothing any more.
    """

    def __init__(self, buffer: Buffer, node: Node) -> None:
        self._buffer = buffer
        self._node = node
        self._thread: threading.Thread | None = None

    def note(self) -> None:
        """Note that the current thread delivers."""
        alone = isinstance(self._node.executor, SingleThreadedExecutor)
        thread = threading.current_thread() if alone else None
        if thread is not self._thread:
            self.forget()
            self._thread = thread
        if thread is not None:
            self._buffer.feeds.add_thread(thread)

    def forget(self) -> None:
        """Allow the noted thread to wait for transforms again."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._buffer.feeds.remove_thread(thread)


class _Feed:
    """Takes the messages of one topic into the buffer."""

    def __init__(self, buffer: Buffer, node: Node, topic: str, static: bool,
                 qos: QoSProfile | int, names: Rename, spinner: _Spinner) -> None:
        self._buffer = buffer
        self._node = node
        self._static = static
        self._spinner = spinner
        self._reader = WireReader(names)
        self._topic = topic
        self._authority = Authority(node, topic)
        self._rivals = Rivals(self._authority, static)
        buffer.feeds.name_later(self._authority)
        # In a callback group of its own: another callback of the node may block on a lookup.
        self._subscription = node.create_subscription(
            TFMessage, topic, cast('Any', self._receive), qos, raw=True,
            callback_group=MutuallyExclusiveCallbackGroup())

    def close(self) -> None:
        """Stop receiving; needed where the subscription is on the user's node."""
        self._node.destroy_subscription(self._subscription)

    def _receive(self, data: bytes, info: Any) -> None:
        authority = self._authority.name()
        self._spinner.note()
        batch = self._reader.read_or_refuse(data, authority)
        if isinstance(batch, Incident):
            self._buffer.feeds.refuse(*self._authority.correct([batch]))
        elif batch.edges:
            if self._buffer.observers.of_messages:
                self._buffer.observers.tell_received(Received(
                    batch, self._buffer.now(), self._topic, self._static,
                    '' if authority == self._authority.placeholder else authority))
            incidents = self._buffer.insert_batch(batch, authority, self._static)
            self._buffer.feeds.note(self._authority.correct(incidents))
            for rivalry in self._rivals.judge(batch, info):
                self._buffer.feeds.refuse(rivalry)


def _home(node: Node | None, spin_thread: bool) -> Node:
    """Return the node to put the subscriptions on."""
    if node is None and not spin_thread:
        raise ValueError('spin_thread=False needs a node of yours, for you to spin')
    if node is None:
        return node_of_its_own(_NAME)
    return companion(node, _NAME) if spin_thread else node
