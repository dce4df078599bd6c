# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""tf2's ``BufferClient``: the interface to a buffer in another process."""

from collections.abc import Callable
from functools import partial
from threading import current_thread, Event
import weakref

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from tf2_msgs.action import LookupTransform
from tf_tree_py.beyond.freshness.ages import checked_max_age
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.errors import TimeoutException
from tf_tree_py.core.stamp import LATEST

from .fresh_call import FreshCall
from .goal_client import GoalClient
from .lookup_goal import full_goal, LookupCall, simple_goal
from ..buffer.interface import BufferInterface, check_places, NO_TIME
from ..messages.convert import as_nanoseconds, as_span, as_stamp, DurationLike, SpanLike, TimeLike
from ..waiting.clock import is_simulated

_PADDING = Duration(seconds=2.0)
# 31 years, in seconds. The message holds up to 68 years.
_FOREVER_S = 1e9


class BufferClient(Closable, BufferInterface):
    """
    A client for the transforms of a buffer server, tf2's or this package's.

    It works from any thread and inside callbacks, also of a single-threaded executor, because the
    client has its own thread for the responses. Any number of lookups may be pending at once; none
    of them needs a thread.

    The client measures timeouts by the wall clock, as tf2's does; this package's server uses its
    own clock. The client lives until ``close()`` or the end of its context; it is a context
    manager.

    :ivar action_client: has ``wait_for_server`` and ``server_is_ready``.
    """

    def __init__(self, node: Node, ns: str, check_frequency: float = 10.0,
                 timeout_padding: DurationLike | float = _PADDING) -> None:
        """
        Begin to search for the server.

        :param node: supplies the context, the namespace and the remappings.
        :param ns: the action's name, such as ``tf2_buffer_server``.
        :param check_frequency: how often to check, during a lookup, that the server still exists
            and the time is not over, Hz.
        :param timeout_padding: how much longer than the timeout the answer may take; an rclpy
            ``Duration``, or seconds.
        :raises ValueError: ``check_frequency`` is not from 1e-9 to 1e9.
        """
        check_places('BufferClient(node, name)', node=node)
        if not 1e-9 <= check_frequency <= 1e9:
            raise ValueError(f'check_frequency={check_frequency!r} has to be from 1e-9 to 1e9 Hz')
        self.node = node
        self.check_frequency = check_frequency
        self.timeout_padding = timeout_padding
        self.action_client = GoalClient(node, ns, 1.0 / check_frequency)
        weakref.finalize(self, self.action_client.stop)

    def close(self) -> None:
        """End the pending lookups, and stop."""
        self.action_client.close()

    def destroy(self) -> None:
        """End the pending lookups, and stop: tf2's name for ``close``."""
        self.close()

    def wait_for_server(self, timeout: DurationLike | None = None) -> bool:
        """
        Wait until a server is available.

        :param timeout: an rclpy ``Duration``; None: without a limit.
        :return: whether one is available.
        """
        return self.action_client.wait_for_server(
            None if timeout is None else as_nanoseconds(timeout) / 1e9)

    # --- blocking

    def lookup_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                         timeout: DurationLike = NO_TIME, *,
                         max_age: SpanLike = None) -> TransformStamped:
        """
        Return the transform that takes coordinates in source to coordinates in target.

        :param time: an rclpy ``Time``, or a message's ``header.stamp``; zero is the latest.
        :param timeout: an rclpy ``Duration`` to wait for the transform, and for a server.
        :param max_age: an rclpy ``Duration``: how old the latest may be by the clock of the node.
            None, or ``UNLIMITED``: as old as the server allows. It does not concern other times.
            While it waits, it asks the server again several times a second.
        :raises TimeoutException: it was not available in time; or there is no server, it
            disappeared, or it did not answer: the text names the case.
        :raises StaleException: the latest is older than ``max_age``.
        :raises TransformException: of the class that the server's buffer raised.
        """
        return self._answer(lambda: self.wait_for_transform_async(
            target_frame, source_frame, time, timeout, max_age=max_age))

    def lookup_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                              source_time: TimeLike, fixed_frame: str,
                              timeout: DurationLike = NO_TIME) -> TransformStamped:
        """
        Return the transform from a source at one time to a target at another.

        It goes through a frame that does not move between the two times. Parameters and
        errors are those of ``lookup_transform``.
        """
        return self._answer(lambda: self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout))

    # --- futures

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: TimeLike,
                                 timeout: DurationLike | None = None, *,
                                 max_age: SpanLike = None) -> LookupCall:
        """Return a future of the transform; a timeout of None waits without a limit."""
        stamp, given = self._as_stamp(time), as_span(max_age, 'max_age')
        limit = None if given is None else checked_max_age(given)
        goal = simple_goal(target_frame, source_frame, stamp)
        if limit is None or stamp != LATEST:
            return self._begin(goal, timeout)
        return self._begin(goal, timeout, partial(FreshCall, max_age=limit, now=self._now))

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str,
            timeout: DurationLike | None = None) -> LookupCall:
        """Return a future of the transform between two times; the timeout is as above."""
        return self._begin(full_goal(target_frame, self._as_stamp(target_time), source_frame,
                                     self._as_stamp(source_time), fixed_frame), timeout)

    def _as_stamp(self, time: TimeLike) -> int:
        return as_stamp(time, self._is_simulated)

    def _is_simulated(self) -> bool:
        return is_simulated(self.node.get_clock())

    def _now(self) -> int:
        return self.node.get_clock().now().nanoseconds  # type: ignore[no-any-return]

    def _begin(self, goal: LookupTransform.Goal, timeout: DurationLike | None,
               call: Callable[..., LookupCall] = LookupCall) -> LookupCall:
        timeout_s = _FOREVER_S if timeout is None else as_nanoseconds(timeout) / 1e9
        padding = self.timeout_padding
        padding_s = padding if isinstance(padding, (int, float)) else as_nanoseconds(padding) / 1e9
        client = self.action_client
        return client.start(call(
            client.report, client.drop, goal, max(0.0, timeout_s), padding_s))

    def _answer(self, begin: Callable[[], LookupCall]) -> TransformStamped:
        if current_thread() is self.action_client.thread:
            raise TimeoutException(
                'Did not wait: this thread receives the answers of the buffer server')
        call = begin()
        ended = Event()
        call.add_done_callback(lambda _: ended.set())
        try:
            ended.wait()
        finally:
            call.cancel()
        return call.result()
