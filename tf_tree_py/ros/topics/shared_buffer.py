# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One buffer and one listener for all nodes of a process.

Every listener reads all of ``/tf``. Nodes in one process with the same topics need that only once.
"""

import threading
from typing import Any
import weakref

from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.utilities import get_default_context

from .joining_buffer import Buffer
from .listener import NAME, TransformListener
from .qos import TF_STATIC_TOPIC, TF_TOPIC
from ..threads.internal_node import (
    internal_node,
    is_running,
    node_of_its_own,
    qos_overrides_of,
    USE_SIM_TIME,
)

_lock = threading.Lock()


def shared_buffer(user: Node | Context | None = None, *,
                  cache_time: Duration | int | None = None, tf_topic: str = TF_TOPIC,
                  tf_static_topic: str = TF_STATIC_TOPIC, **options: Any) -> Buffer:
    """
    Return the buffer that nodes of one process share; a listener fills it.

    The first call makes both; a later one returns the same buffer at no cost. They are shared by
    users of one context with the same topics, after namespaces and remappings, with the same
    clock, and with the same ``cache_time`` and options. Other users get a separate buffer.

    The listener stops when the last of its nodes is destroyed or garbage collected, or when the
    context shuts down. The contents of the buffer stay. When one of the nodes changes
    ``use_sim_time``, the buffer changes its clock.

    :param user: the node that makes the lookups; or a context, whose shutdown ends the use. None:
        the default context.
    :param cache_time: the length of the history of each edge, as for ``Buffer``.
    :param tf_topic: the topic of moving transforms.
    :param tf_static_topic: the topic of static transforms.
    :param options: ``qos``, ``static_qos``, ``static_only``, prefixes and filters as for
        ``TransformListener``.
    :raises TypeError: ``spin_thread``, because the listener has its own thread; or an option that
        ``TransformListener`` does not have.
    :raises RuntimeError: there is no node, and ROS is not initialised.
    """
    if 'spin_thread' in options:
        raise TypeError('shared_buffer() takes no spin_thread: its listener has its own thread')
    with _lock:
        node = user if isinstance(user, Node) else _anchor_of(user or get_default_context())
        options.update(tf_topic=node.resolve_topic_name(tf_topic),
                       tf_static_topic=node.resolve_topic_name(tf_static_topic))
        place = {**options, 'cache_time': cache_time,
                 'clock': node.resolve_topic_name('/clock'),
                 USE_SIM_TIME: node.get_parameter(USE_SIM_TIME).value,
                 'qos_overrides': [(given.name, given.value)
                                   for given in qos_overrides_of(node)]}
        shared = _found(node.context, place) or _Shared(node, place, cache_time, options)
        _join(node, shared)
    return shared.buffer


class _Listener(TransformListener):
    """A listener without a user's node: it listens until it is garbage collected."""

    def __init__(self, buffer: Buffer, beside: Node, **options: Any) -> None:
        """
        Begin to listen.

        :param beside: supplies the context, the namespace, the clock and the logger.
        """
        self._beside: Node | None = beside
        super().__init__(buffer, None, **options)
        self._beside = None
        buffer.feeds.log_to(beside.get_logger())
        if self._receiver is not None:
            weakref.finalize(self, self._receiver.stop)

    def _make_home(self, node: Node | None, spin_thread: bool) -> Node:
        assert self._beside is not None
        return internal_node(self._beside, NAME)


class _Shared:
    """A buffer, its listener, and the settings that its users have in common."""

    def __init__(self, node: Node, place: dict[str, object],
                 cache_time: Duration | int | None, options: dict[str, Any]) -> None:
        self.context = node.context
        self.place = place
        self.buffer = Buffer(cache_time)
        self._listener = _Listener(self.buffer, node, **options)

    def switch_clock(self, parameters: list[Parameter]) -> None:
        """Switch to simulated time and back when a node does."""
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME:
                self.place[USE_SIM_TIME] = parameter.value
        self._listener._switch_clock(parameters)


# A node keeps its buffers alive; a buffer without nodes is dropped, and its thread ends.
_users: 'weakref.WeakKeyDictionary[Node, list[_Shared]]' = weakref.WeakKeyDictionary()
_anchors: dict[Context, Node] = {}


def _found(context: Context, place: dict[str, object]) -> _Shared | None:
    """Return the buffer that fits a user's topics and settings, if there is one."""
    return next((shared for held in list(_users.values()) for shared in held
                 if shared.context is context and shared.place == place
                 and is_running(context)), None)


def _join(node: Node, shared: _Shared) -> None:
    if node not in _users:
        _users[node] = []
        _leave_with(node)
    if shared in _users[node]:
        return
    _users[node].append(shared)
    reference = weakref.ref(shared)

    def switch_clock(parameters: list[Parameter]) -> None:
        found = reference()
        if found is not None:
            found.switch_clock(parameters)

    node.add_post_set_parameters_callback(switch_clock)


def _leave_with(node: Any) -> None:
    """
    Release a node's buffers when it is destroyed.

    rclpy has no callback for that. An ``EventsExecutor`` accepts no nodes with guard conditions,
    which would be notified. Nothing is locked here: on Kilted the context may be locked, and
    another thread may wait for it.
    """
    reference = weakref.ref(node)

    def destroy_node() -> None:
        ended = reference()
        if ended is not None:
            _users.pop(ended, None)
            type(ended).destroy_node(ended)

    node.destroy_node = destroy_node


def _anchor_of(context: Context) -> Node:
    """Return the hidden node that uses buffers for a context, until it shuts down."""
    if context not in _anchors:
        anchor = node_of_its_own('shared_buffer', context)
        _anchors[context] = anchor
        context.on_shutdown(lambda: _forget(context))
    return _anchors[context]


def _forget(context: Context) -> None:
    # It returns nothing, because rclpy calls what such a function returns.
    _anchors.pop(context, None)
