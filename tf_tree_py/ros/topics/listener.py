# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fills a buffer from /tf and /tf_static."""

from collections.abc import Callable, Collection
import functools
from typing import cast, TYPE_CHECKING, TypeVar
import weakref

from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from tf_tree_py.core.closable import Closable
from tf_tree_py.frame_names import FrameFilter, rename

from .endpoints import clock_publishers
from .feed import Feed, TransformFeed
from .qos import dynamic_qos, sensor_qos, static_listener_qos, TF_STATIC_TOPIC, TF_TOPIC
from .reception import reception_of
from .spinner import Spinner
from ..buffer.buffer import Buffer
from ..buffer.interface import check_is_ours, check_places
from ..threads.backlog import Backlog
from ..threads.internal_node import internal_node, is_alive, node_of_its_own, USE_SIM_TIME
from ..threads.receiver import Receiver
from ..waiting.clock import RosClock

if TYPE_CHECKING:
    from .pose_feed import Said

Message = TypeVar('Message')

NAME = 'transform_listener_impl'
"""The name of the small nodes of listeners, without its hidden prefix and random digits."""
# Of a topic with a message for each of many frames; a busy thread may be delayed for a second.
_DEPTH = 1000
# Of messages that are read in steps.
MOST_WAITING_BYTES = 16_000_000


class TransformListener(Closable):
    """
    Fills a buffer with the transforms on ``/tf`` and ``/tf_static``.

    It reads in its own thread, on a small node in addition to the user's, and never spins the
    user's node. The small node has the context, namespace, remappings and clock of the user's
    node. A lookup with a timeout therefore works inside a callback, also of a single-threaded
    executor: transforms still arrive while it waits.

    It lives as long as the user's node (without one, as long as ROS) or until ``close()``; it is a
    context manager. Several listeners may fill one buffer.

    If the buffer is one that shows the tree of ``tf_share``, and that receives what the listener
    would receive, the listener does not subscribe: see ``Buffer``.
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

        :param buffer: the buffer to fill.
        :param node: supplies the names, remappings and clock; None: those of the command line.
        :param spin_thread: read in a separate thread. False adds the subscriptions to the user's
            node, for its executor to serve. Then a lookup that waits in a callback of a
            single-threaded executor would block its own transforms: it fails at once.
        :param qos: of ``/tf``; reliable, volatile, depth 100 unless given.
        :param static_qos: of ``/tf_static``; reliable, transient local, depth 100.
        :param tf_topic: the topic of moving transforms.
        :param tf_static_topic: the topic of static transforms.
        :param static_only: do not subscribe to ``/tf``.
        :param frame_prefix: prepended to every frame, such as ``robot1/``.
        :param strip_frame_prefix: removed before that; an edge of a frame without it is ignored.
        :param shared_frames: frames whose names stay unchanged, such as ``map``.
        :param frame_filter: returns whether to keep (parent, child); or the frames to keep: only
            edges between two of them are stored. It is called with the names as received, and not
            for every message, so it has to return the same result every time.
        :raises TypeError: a buffer of another library, such as tf2's.
        :raises RuntimeError: there is no node, and ROS is not initialised.
        :raises ValueError: ``spin_thread=False`` without a node, or a string instead of a
            collection of frames.
        """
        check_is_ours(buffer, Buffer, 'TransformListener')
        names = rename(frame_prefix=frame_prefix, strip_frame_prefix=strip_frame_prefix,
                       shared_frames=shared_frames, frame_filter=frame_filter)
        check_places('TransformListener(buffer, node)', node=node)
        lives_with_node = node is not None
        home = None if node is not None else self._make_home(node, spin_thread)
        self.node = node = node or cast(Node, home)
        self.buffer, self._names = buffer, names
        self._receiver: Receiver | None = None
        topics = [(tf_topic, False, qos or dynamic_qos()),
                  (tf_static_topic, True, static_qos or static_listener_qos())]
        # All names are resolved before the first subscription: an error must leave none of them.
        resolved = [(node.resolve_topic_name(topic), static, profile)
                    for topic, static, profile in topics if static or not static_only]
        buffer.feeds.log_to(node.get_logger())
        self._reception = functools.partial(
            reception_of, node, tf_topic=tf_topic, tf_static_topic=tf_static_topic,
            static_only=static_only, frame_prefix=frame_prefix,
            strip_frame_prefix=strip_frame_prefix, shared_frames=shared_frames,
            frame_filter=frame_filter)
        self.joined = buffer.join(node, self._reception())
        """Whether it does not subscribe, because the buffer is filled anyway."""
        self._home = home or self._make_home(node, spin_thread)
        self._spinner = Spinner(buffer, self._home)
        # Static transforms have no stamps, so they must stay in order; an executor of the user
        # has no time between messages.
        backlog = Backlog(MOST_WAITING_BYTES)
        feeds: list[Feed] = [
            TransformFeed(buffer, self._home, topic, static, profile, names, self._spinner,
                          backlog if spin_thread and not static else None)
            for topic, static, profile in resolved if not self.joined]
        self._feeds: list[Feed] | None = feeds
        clock = RosClock(self._home.get_clock(), node.context,
                         functools.partial(clock_publishers, self._home))
        to_spin = None if spin_thread or self.joined else self._spinner.check_from_now_on()
        buffer.feeds.begin(clock, to_spin)
        self._end_feed = functools.partial(buffer.feeds.end, clock, to_spin)
        if spin_thread:
            self._receiver = Receiver(
                self._home, self._end_feed, rest=buffer.waiting.sleep_until_somebody,
                end_rest=buffer.waiting.end_sleep,
                work=backlog.step,
                write_counts=functools.partial(_every_second, buffer, feeds),
                is_wanted=functools.partial(is_alive, weakref.ref(node)))
            buffer.feeds.add_thread(self._receiver.thread)
            if lives_with_node:
                # The node's callback list references self: it lives as long as the node, as tf2's.
                node.add_post_set_parameters_callback(self._switch_clock)
                weakref.finalize(self, self._receiver.stop)

    def subscribe(self, msg_type: type[Message], topic: str,
                  read: 'Callable[[Message], Said] | None' = None, *, parent: str | None = None,
                  child: str | None = None, static: bool = False, covariances: bool = False,
                  planar: bool = False, qos: QoSProfile | int | None = None) -> None:
        """
        Also fill the buffer with the poses that the messages of a topic carry.

        The prefixes and the filter of this listener apply to them, too.

        :param msg_type: such as ``Odometry``.
        :param read: returns what a message contains: a ``PoseSample``, several, or None. It is
            called in the thread that also reads ``/tf``, so it must be fast. None for
            ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped`` and ``TransformStamped``.
        :param parent: the frame in whose coordinates the poses are, before it gets a prefix; None:
            the messages name it.
        :param child: the frame whose poses they are, likewise.
        :param static: whether the poses are valid at all times.
        :param covariances: use the covariances of the messages, too; one that cannot be used, such
            as one of zeros, is reported, and its pose is used.
        :param planar: of the covariances, use only x, y and the rotation about z; see
            ``Covariances``.
        :param qos: best effort, which matches every publisher, and depth 1000 unless given; of a
            static topic, reliable and transient local.
        :raises TypeError: not a type of message, or not a function.
        :raises ValueError: a type without a reader, messages that do not name their child, or
            ``planar`` without ``covariances``.
        :raises SharedTreeException: the buffer shows the tree of another process.
        :raises RuntimeError: the listener is closed.
        """
        if not isinstance(msg_type, type) or not (read is None or callable(read)):
            raise TypeError(f'subscribe({msg_type!r}, {topic!r}, {read!r}) takes a type of '
                            'message, a topic, and perhaps a function that reads a message')
        if planar and not covariances:
            raise ValueError('planar=True applies to covariances: pass covariances=True, too')
        from .pose_feed import PoseFeed, reader_of  # it imports messages that few programs need
        self.buffer.check_receives('TransformListener.subscribe')
        feeds = self._feeds
        if feeds is None:
            raise RuntimeError('TransformListener.subscribe: this listener is closed')
        feeds.append(PoseFeed(
            self.buffer, self._home, self.node.resolve_topic_name(topic), static,
            qos or (static_listener_qos() if static else sensor_qos(_DEPTH)), self._names,
            self._spinner, msg_type, read or reader_of(msg_type, child), self.node,
            (parent, child), planar if covariances else None))
        if self._receiver is not None:
            self._receiver.wake()

    def close(self) -> None:
        """Stop listening; the contents of the buffer stay."""
        feeds, self._feeds = self._feeds, None
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            if self.node is not self._home:
                self.node.remove_post_set_parameters_callback(self._switch_clock)
            receiver.close()
        elif feeds is not None:
            for feed in feeds:
                feed.close()
            self._spinner.end()
            self._end_feed()

    def catch_up(self, longest_s: float) -> None:
        """Wait until the messages that have arrived are in the buffer, if a thread reads them."""
        receiver = self._receiver
        if receiver is not None and not self.joined:
            receiver.catch_up(longest_s)

    def unregister(self) -> None:
        """Stop listening: tf2's name for ``close``."""
        self.close()

    def _make_home(self, node: Node | None, spin_thread: bool) -> Node:
        """Return the node that gets the subscriptions."""
        if node is None and not spin_thread:
            raise ValueError('spin_thread=False needs a node of yours, for you to spin')
        if node is None:
            return node_of_its_own(NAME)
        return internal_node(node, NAME) if spin_thread else node

    def _switch_clock(self, parameters: list[Parameter]) -> None:
        """Switch to simulated time and back when the node does."""
        changed = [parameter for parameter in parameters if parameter.name == USE_SIM_TIME]
        receiver = self._receiver
        if changed and receiver is not None and self.node.context.ok():
            self._home.set_parameters(changed)
            receiver.wake()
            self.buffer.rejoin(self._reception())


def _every_second(buffer: Buffer, feeds: 'list[Feed]') -> None:
    """Log what is known only some time after a message, and tidy; keeps no listener alive."""
    for feed in feeds:
        feed.report_settled()
    # As long as anything waits, orphans too, the thread does not gather messages.
    buffer.timeouts.forget_orphans()
    buffer.feeds.log.write_counts()
