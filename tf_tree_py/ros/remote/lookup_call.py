# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One lookup that a client sends to a buffer server."""

from __future__ import annotations

import secrets
import time
from typing import Any, Protocol

from rclpy.duration import Duration
from rclpy.task import Future
from tf2_msgs.action import LookupTransform
from tf_tree_py.core.errors import TimeoutException, TransformException
from tf_tree_py.core.stamp import from_seconds
from unique_identifier_msgs.msg import UUID

from .goal_state import AT_A_SERVER, Event, State
from .lookup_goal import is_unknown, transform_of
from ..waiting.awaitable import AwaitableFuture

# A server accepts a goal at once, no matter how long the lookup takes.
_ACCEPTANCE_S = 10.0
# A longer wait is sent in parts, so that a server forgets the goals of a client that died.
_LEASE_S = 60.0
# The last part of a wait is at least as long as this.
_LEAST_S = 0.001
# A server that times out sooner than this would do so again.
_QUICK_S = 0.1


class Client(Protocol):
    """The client that sends the goal of a call."""

    def report(self, call: LookupCall, event: Event) -> None:
        """Move a call to its next state, and carry out the resulting actions."""


class LookupCall(AwaitableFuture):
    """
    A future of the ``TransformStamped`` that a server finds.

    Callbacks run in the client's thread. ``cancel`` cancels the goal at the server. The call lives
    until it ends, even without a reference to it.

    A wait longer than a minute is sent in parts, each as a separate goal.

    :ivar state: the state of its goal; changed by the client only.
    :ivar goal_id: of the goal that was last sent.
    :ivar request: the future of the last request to the server.
    """

    def __init__(self, client: Client, goal: LookupTransform.Goal, timeout_s: float,
                 padding_s: float) -> None:
        """
        Store the goal, and how long to wait for the answer.

        :param goal: its timeout is set when it is sent.
        :param padding_s: how much longer than its timeout the server may take.
        """
        super().__init__()
        self.state = State.TO_BE_SENT
        self.goal_id = UUID()
        self.request: Future | None = None
        self._client = client
        self._goal = goal
        self._begin = self._sent_at = time.monotonic()
        self._lease_s = self._timeout_s = timeout_s
        self._padding_s = padding_s
        self._is_part = False

    @property
    def sent(self) -> bool:
        """Return whether a request was sent to a server, accepted or not."""
        return self.state in AT_A_SERVER

    @property
    def accepted(self) -> bool:
        """Return whether a server looks the transform up."""
        return self.state is State.ACCEPTED

    def left_s(self) -> float:
        """Return how long the lookup may still take at a server, or a server to appear."""
        return max(0.0, self._begin + self._timeout_s - time.monotonic())

    def sent_s(self) -> float:
        """Return the seconds since the last request to a server."""
        return time.monotonic() - self._sent_at if self.sent else 0.0

    def is_late(self) -> bool:
        """Return whether an available server should have answered by now."""
        limit_s = self._lease_s
        if self.sent and not self.accepted:
            limit_s = min(limit_s, _ACCEPTANCE_S)
        return time.monotonic() >= self._sent_at + limit_s + self._padding_s

    def acceptance_s(self) -> float:
        """Return in how many seconds a server has to accept a request, without the padding."""
        return min(self._timeout_s, _ACCEPTANCE_S)

    def goal(self) -> LookupTransform.Goal:
        """Return the goal to send now, under a new ``goal_id``."""
        self.goal_id = UUID(uuid=list(secrets.token_bytes(16)))
        self._sent_at = time.monotonic()
        # Without a timeout a server returns the missing data as the reason, and not the timeout.
        left_s = max(self.left_s(), min(self._timeout_s, _LEAST_S))
        self._lease_s = min(left_s, _LEASE_S)
        self._is_part = self._lease_s < left_s
        self._goal.timeout = Duration(nanoseconds=from_seconds(self._lease_s)).to_msg()
        return self._goal

    def answer(self, response: Any) -> None:
        """End with the transform or the error of a server's response."""
        if is_unknown(response.status, response.result) and self._is_in_time():
            # A request goes to all servers: here a server that has just appeared responded first.
            self._client.report(self, Event.UNKNOWN_THERE)
            return
        try:
            transform = transform_of(response.status, response.result)
        except TransformException as error:
            if isinstance(error, TimeoutException) and self._may_ask_again():
                self._client.report(self, Event.PART_OVER)
                return
            self._client.report(self, Event.RESULT)
            self.set_exception(error.with_traceback(None))
        else:
            self._client.report(self, Event.RESULT)
            self.set_result(transform)

    def _may_ask_again(self) -> bool:
        """Return whether the server timed out because the request was for a part of the time."""
        # The server uses its own clock, which may be simulated and fast.
        took_s = time.monotonic() - self._sent_at
        return self._is_part and took_s >= min(self._lease_s, _QUICK_S)

    def _is_in_time(self) -> bool:
        return time.monotonic() < self._begin + self._timeout_s + self._padding_s

    def has_late_part(self) -> bool:
        """Return whether only a part of the time is over: the server's clock may be slow."""
        return self.accepted and self._is_part

    def give_up(self, why: str) -> None:
        """End without an answer."""
        error = TimeoutException(why)
        error.waited_s = time.monotonic() - self._begin
        self.set_exception(error)

    def _end(self) -> bool:
        first = super()._end()
        if first:
            # After an answer the goal has ended already, and this changes nothing.
            self._client.report(self, Event.CANCELLED)
        return first
