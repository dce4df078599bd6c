# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Small nodes in addition to a user's node, served by threads of this package.

The threads serve subscriptions or service clients only, so these nodes offer no parameter
services. ``ros2 param list`` waits five seconds for each listed node without them; so the nodes
have hidden names. An exception of a user's callback in such a thread is logged, and the thread
continues.

From Kilted on, ``Context.shutdown`` destroys all nodes while it holds the lock of the context, and
``Context.ok`` takes that lock. A thread that a node waits for during its destruction therefore
must neither call ``ok`` nor destroy a node itself. So here is also whether a context still runs,
and whether the current thread has it locked.

All functions may be called from any thread. ``is_running`` and ``is_alive`` take no lock, and
raise nothing when the context or the node ends at the same moment.
"""

from contextlib import suppress
import secrets
import sys
from typing import Any
import weakref

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import HIDDEN_NODE_PREFIX, Node
from rclpy.parameter import Parameter
from tf_tree_py.limited_log import FailureLog


def is_running(context: Context) -> bool:
    """Return the same as ``context.ok()``, without the lock of the context."""
    handle = context.handle
    if handle is None:
        return False
    try:
        with handle:
            return bool(handle.ok())
    except InvalidHandle:
        return False


def is_locked_here(context: Context) -> bool:
    """Return whether the current thread holds the context's lock, because it shuts it down."""
    is_owned = getattr(getattr(context, '_lock', None), '_is_owned', None)
    return is_owned is not None and bool(is_owned())


def is_alive(reference: 'weakref.ref[Node]') -> bool:
    """Return whether a node exists, and has not been destroyed."""
    node = reference()
    if node is None:
        return False
    try:
        with node.handle:
            return True
    except InvalidHandle:
        return False


# --- logging

_EXIT = (' sys.exit() would end only the thread that receives transforms, and lookups would stop '
         'working, so it is ignored. To end the program, call rclpy.shutdown().')


class CallbackFailures(FailureLog):
    """
    A log of exceptions of a user's callbacks; it never raises.

    ``sys.exit()`` in a callback would end the thread silently, so it is logged, too.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        """
        Log to this logger.

        :param logger: an rclpy logger.
        """
        self._logger = logger
        super().__init__(self._error)

    def report(self, what: str, sender: str = '', hint: str = '') -> None:
        """Log the exception that is being handled."""
        super().report(what, sender, _EXIT if isinstance(sys.exc_info()[1], SystemExit) else hint)

    def _error(self, text: str) -> None:
        try:
            self._logger.error(text)
        except Exception:  # noqa: B902 - a logger that fails must not end the thread either
            with suppress(Exception):
                print(text, file=sys.stderr)


# --- small nodes

USE_SIM_TIME = 'use_sim_time'

_OPTIONS: dict[str, Any] = {'enable_rosout': False, 'start_parameter_services': False}
# The threads here would never answer this service.
_NO_TYPE_DESCRIPTION = Parameter('start_type_description_service', value=False)


def internal_node(node: Node, name: str, *, with_clock: bool = True) -> Node:
    """
    Return a node with the context and namespace of another one, but in no executor.

    It has the other's overrides of profiles, such as ``qos_overrides./tf.subscription.depth``.

    :param with_clock: whether it follows the other node's clock, simulated time included; then the
        thread that serves it has to take ``/clock``, too.
    """
    overrides: list[Parameter] = [_NO_TYPE_DESCRIPTION, *qos_overrides_of(node)]
    arguments: list[str] = []
    if with_clock:
        overrides.append(node.get_parameter(USE_SIM_TIME))
        arguments = ['--ros-args', '-r', f'/clock:={node.resolve_topic_name("/clock")}']
    return Node(
        _hidden_name(name),
        context=node.context,
        namespace=node.get_namespace(),
        # The other node has resolved the topics already; ``__node:=`` applies to that one only.
        use_global_arguments=False,
        cli_args=arguments,
        parameter_overrides=overrides,
        **_OPTIONS,
    )


def node_of_its_own(name: str, context: Context | None = None) -> Node:
    """
    Return a node that follows the command line (remappings, parameters), except for its name.

    :param context: None: the default one.
    :raises RuntimeError: ROS is not initialised.
    """
    if not rclpy.ok(context=context):
        raise RuntimeError('Without a node, rclpy.init() has to be called first')
    name = _hidden_name(name)
    return Node(name, context=context, cli_args=['--ros-args', '-r', f'__node:={name}'],
                parameter_overrides=[_NO_TYPE_DESCRIPTION], **_OPTIONS)


def qos_overrides_of(node: Node) -> list[Parameter]:
    """Return the parameters of a node that override profiles of its topics."""
    # rclpy has no public way to get the parameters that were given but not declared.
    given: dict[str, Parameter] = getattr(node, '_parameter_overrides', {})
    return [parameter for name, parameter in given.items() if name.startswith('qos_overrides.')]


def _hidden_name(name: str) -> str:
    """Return a name that no other node has, and that ``ros2`` lists only with ``--all``."""
    return f'{HIDDEN_NODE_PREFIX}{name}_{secrets.token_hex(6)}'
