# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2's listeners, on top of this package's.

They read in a separate thread, as this package's do. If a program handles messages or
subscriptions itself, the subscriptions are on its node instead, as in tf2.

tf2's thread for ``spin_thread=True`` begins at once, so callbacks run before the node is complete.
The one here first waits for a second, because most programs soon spin their node themselves.
"""

import atexit
from collections.abc import Callable, Sequence
from contextlib import suppress
import threading
from typing import Any
import weakref

from geometry_msgs.msg import TransformStamped
from rclpy.action.server import RCLError
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.task import Future
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY
from tf_tree_py.ros.buffer.buffer import Buffer as OwnBuffer
from tf_tree_py.ros.buffer.interface import check_places
from tf_tree_py.ros.threads.internal_node import is_running
from tf_tree_py.ros.topics.listener import TransformListener as OurListener
from tf_tree_py.ros.topics.qos import dynamic_qos, static_listener_qos, TF_STATIC_TOPIC, TF_TOPIC

from .buffer import BufferCore

UNTIL_SPUN_S = 1.0
_TO_END_S = 1.0


def spin_if_nobody_does(node: Node) -> threading.Timer:
    """
    Spin a node in a thread, unless the program begins to spin it within a second.

    If the program later adds the node to an executor, that takes it over, by rclpy's rule.
    """
    timer = threading.Timer(UNTIL_SPUN_S, _spin, [weakref.ref(node)])
    timer.daemon = True
    timer.start()
    return timer


def _spin(reference: weakref.ref[Node]) -> None:
    node = reference()
    if node is None or node.executor is not None or not node.context.ok():
        return
    executor = SingleThreadedExecutor(context=node.context)
    # The node may be destroyed, or ROS shut down, at any moment.
    with suppress(InvalidHandle, ExternalShutdownException):
        with node.handle:
            executor.add_node(node)
            node.get_logger().info(
                "Nothing else spins this node, so its TransformListener's thread does, as "
                'spin_thread=True requests')
        del node
        _spin_until_exit(executor)


def _spin_until_exit(executor: SingleThreadedExecutor) -> None:
    stop = Future()
    thread = threading.current_thread()

    def end() -> None:
        stop.set_result(None)
        executor.wake()
        thread.join(_TO_END_S)

    # If the thread were still inside rclpy when Python ends, the process would abort. Ctrl-C may
    # interrupt the first of the two calls.
    for _ in range(2):
        atexit.register(end)
    try:
        executor.spin_until_future_complete(stop)
    except RCLError:
        # ROS was shut down between the executor's check and its wait.
        if is_running(executor.context):
            raise
    finally:
        atexit.unregister(end)
        executor.shutdown()


# --- the listeners

class TransformListener:
    """
    ``tf2_ros.TransformListener``.

    tf2's listener subscribes on the user's node by default, so that ``rclpy.spin_once`` returns
    when a transform has arrived. It returns here, too. With ``spin_thread=True`` tf2's listener
    spins the whole node in a thread; this one does that only if nothing else spins the node.

    Some programs override ``callback``, use ``tf_sub``, set another ``buffer``, or pass a buffer
    that overrides ``set_transform``. For these the subscriptions are on the node, as in tf2, and
    the program has to spin it.
    """

    def __init__(self, buffer: Any, node: Node | None = None, *, spin_thread: bool = False,
                 qos: QoSProfile | int | None = None, static_qos: QoSProfile | int | None = None,
                 tf_topic: str = TF_TOPIC, tf_static_topic: str = TF_STATIC_TOPIC,
                 static_only: bool = False, **options: Any) -> None:
        """
        Begin to listen.

        :param node: None, as in later releases of tf2: a separate node.
        :param options: those of ``tf_tree_py.TransformListener``; the others likewise.
        """
        check_places('TransformListener(buffer, node)', buffer=buffer, node=node)
        self.node = node
        self._buffer = buffer
        self._subscriptions: dict[str, Subscription] = {}
        self._topics = {'tf_static_sub': (
            tf_static_topic, static_qos or static_listener_qos(), self.static_callback)}
        if not static_only:
            self._topics['tf_sub'] = (tf_topic, qos or dynamic_qos(), self.callback)
        self._listener: OurListener | None = None
        self._leave: Callable[[], None] | None = None
        self.group = ReentrantCallbackGroup()
        if node is not None and not self._may_read_aside(buffer):
            self._read_on_node()
            return
        self._listener = OurListener(
            buffer, node, qos=qos, static_qos=static_qos, tf_topic=tf_topic,
            tf_static_topic=tf_static_topic, static_only=static_only, **options)
        if node is not None and isinstance(buffer, BufferCore):
            self._leave = buffer.join_spinning_thread(
                node, weakref.WeakMethod(self._listener.catch_up), wake_always=not spin_thread)
        if node is not None and spin_thread:
            spin_if_nobody_does(node)

    def unregister(self) -> None:
        """Stop listening."""
        self._stop_reading_aside()
        self._topics.clear()
        if self.node is not None:
            for subscription in self._subscriptions.values():
                self.node.destroy_subscription(subscription)

    def callback(self, data: TFMessage) -> None:
        """Insert a message of ``/tf``; programs may override or call this, as in tf2."""
        for transform in self._news(data):
            self.buffer.set_transform(transform, DEFAULT_AUTHORITY)

    def static_callback(self, data: TFMessage) -> None:
        """Insert a message of ``/tf_static``, likewise."""
        for transform in self._news(data):
            self.buffer.set_transform_static(transform, DEFAULT_AUTHORITY)

    def _news(self, data: TFMessage) -> Sequence[TransformStamped]:
        """Return the transforms that are not in the buffer anyway, from another process."""
        return () if getattr(self.buffer, 'is_shared', False) else data.transforms

    @property
    def buffer(self) -> Any:
        """Return the buffer that is filled; it may be replaced."""
        return self._buffer

    @buffer.setter
    def buffer(self, buffer: Any) -> None:
        self._read_on_node()
        self._buffer = buffer

    @property
    def tf_sub(self) -> Subscription:
        """Return the subscription to ``/tf``; it is on the node from now on."""
        return self._subscription('tf_sub')

    @tf_sub.setter
    def tf_sub(self, subscription: Subscription) -> None:
        self._subscriptions['tf_sub'] = subscription

    @property
    def tf_static_sub(self) -> Subscription:
        """Return the subscription to ``/tf_static``; it is on the node from now on."""
        return self._subscription('tf_static_sub')

    @tf_static_sub.setter
    def tf_static_sub(self, subscription: Subscription) -> None:
        self._subscriptions['tf_static_sub'] = subscription

    def _subscription(self, name: str) -> Subscription:
        self._read_on_node()
        if name not in self._subscriptions:
            raise AttributeError(f'this listener has no {name!r}')
        return self._subscriptions[name]

    def _may_read_aside(self, buffer: object) -> bool:
        """Return whether no override needs messages, so that bytes are enough."""
        methods = (self.callback, self.static_callback, getattr(buffer, 'set_transform', None),
                   getattr(buffer, 'set_transform_static', None))
        return all(getattr(method, '__func__', None) in _NOT_OVERRIDDEN for method in methods)

    def _read_on_node(self) -> None:
        """Subscribe on the node from now on, as tf2 does."""
        if self._subscriptions or self.node is None:
            return
        self._stop_reading_aside()
        for name, (topic, qos, callback) in self._topics.items():
            self._subscriptions[name] = self.node.create_subscription(
                TFMessage, topic, callback, qos, callback_group=self.group)

    def _stop_reading_aside(self) -> None:
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        if self._leave is not None:
            self._leave()
            self._leave = None


_NOT_OVERRIDDEN = {
    TransformListener.callback, TransformListener.static_callback,
    OwnBuffer.set_transform, OwnBuffer.set_transform_static,
    BufferCore.set_transform, BufferCore.set_transform_static,
}


class StaticTransformListener(TransformListener):
    """``tf2_ros.StaticTransformListener``: it does not subscribe to ``/tf``."""

    def __init__(self, buffer: Any, node: Node, *, spin_thread: bool = False,
                 static_qos: QoSProfile | int | None = None,
                 tf_static_topic: str = TF_STATIC_TOPIC) -> None:
        super().__init__(buffer, node, spin_thread=spin_thread, static_qos=static_qos,
                         tf_static_topic=tf_static_topic, static_only=True)
