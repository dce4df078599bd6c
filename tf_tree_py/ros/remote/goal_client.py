# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sends ``LookupTransform`` goals from any thread, and follows each to its end.

An action is three services and two topics. On one topic the server publishes the states of all
goals whenever one of them changes. rclpy's ``ActionClient`` subscribes to it, which alone would
keep a hundred clients busy. This client uses only the services. It also discovers the action's
servers, and new ones among them.
"""

from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
import math
import threading
import time
from typing import Any

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from rclpy.action.server import RCLError
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.task import Future
from tf2_msgs.action import LookupTransform
from tf_tree_py.core.buffer.waiting import call_all
from unique_identifier_msgs.msg import UUID

from .lookup_goal import Action, Event, Goals, LookupCall, service_qos, State, UNACCEPTED, WANTED
from ..threads.internal_node import internal_node, is_running
from ..threads.responses import Responses

# The errors of rclpy when a node has been destroyed, or its context has ended.
_GONE = InvalidHandle, RCLError

# DDS discovers a server part by part: at first requests or responses may be lost.
DISCOVERY_S = 10.0
# A request to a server that replaces another is sent again after this time without a response.
_AGAIN_S = 0.5
# A request to the first server, in parts of the time in which the server has to accept it. That
# server was completely discovered by the client, so it is more likely slow than deaf: a hundred
# clients that repeat their requests soon would make it slower still.
AGAIN_AT_FIRST = 0.5


class ServerWatch:
    """
    A comparison of the present servers with the earlier ones.

    A server that was killed seems to be present until its DDS lease ends, after about 20 s. The
    server that was started in its place shows up sooner.
    """

    def __init__(self, node: Node, name: str) -> None:
        """
        Begin without a server.

        :param node: reads the graph.
        :param name: the action's name, absolute.
        """
        self._node = node
        self._status_topic = f'{name}/_action/status'
        self._known: frozenset[bytes] = frozenset()
        self._discovered_at = -math.inf
        self._is_first = True

    def is_there(self) -> bool:
        """Return whether there is a server, though it may not receive requests yet."""
        return bool(self._find())

    def note_first(self) -> None:
        """Treat the present servers as known, if none is known yet."""
        if not self._known:
            self._known = self._find()
            self._discovered_at = time.monotonic()

    def has_new(self) -> bool:
        """Return whether there is a server that was absent at the last call."""
        servers = self._find()
        is_new = bool(self._known and servers - self._known)
        if is_new:
            self._discovered_at = time.monotonic()
            self._is_first = False
        if servers:
            self._known = servers
        return is_new

    def may_have_lost(self, silent_s: float, acceptance_s: float) -> bool:
        """
        Return whether the newest server is so new that a request to it may be lost.

        A server that replaces another is granted twice as much time for each repetition.

        :param silent_s: the seconds since the request, without a response.
        :param acceptance_s: the seconds in which a server has to accept a request.
        """
        age_s = time.monotonic() - self._discovered_at
        again_s = (AGAIN_AT_FIRST * acceptance_s if self._is_first
                   else _AGAIN_S + age_s - silent_s)
        return age_s < DISCOVERY_S and silent_s >= again_s

    def _find(self) -> frozenset[bytes]:
        """Return an identity of each server: that of its publisher of the goals' states."""
        with suppress(*_GONE):
            return frozenset(bytes(publisher.endpoint_gid) for publisher
                             in self._node.get_publishers_info_by_topic(self._status_topic))
        return frozenset()


# --- the client

_SendGoal = LookupTransform.Impl.SendGoalService
_GetResult = LookupTransform.Impl.GetResultService

# So many goals may wait for acceptance at a time: tf2's server has a queue of ten, and loses the
# goals that do not fit.
_MAX_UNACCEPTED = 8
# The longest wait at the end for the server to drop this client's requests.
FAREWELL_S = 1.0


class GoalClient:
    """
    The client side of the action, on a small node with its own thread.

    An answer therefore arrives even while a callback of the user's node waits for it. Every call
    ends: at the latest one check period after its deadline, or after its server disappeared. When
    a new server appears, all goals are sent to it.
    """

    def __init__(self, node: Node, name: str, check_period_s: float) -> None:
        """
        Make the services' clients.

        :param node: supplies the context, the namespace and the remappings.
        :param name: the action's name, relative to the node or absolute.
        """
        self.name = node.resolve_service_name(name)
        self._period_s = check_period_s
        self._lock = threading.Lock()
        self._goals = Goals(_MAX_UNACCEPTED)
        # The calls that a garbage collection has dropped, for the thread to cancel.
        self._dropped: deque[LookupCall] = deque()
        self._closed = threading.Event()
        # After closing: the goals to cancel, and then the requests for that until the responses.
        self._farewells: set[LookupCall | Future] = set()
        self._progress = threading.Condition(self._lock)
        home = internal_node(node, 'buffer_client_impl', with_clock=False)
        self._send, self._fetch, self._cancel = (
            home.create_client(srv_type, node.resolve_service_name(f'{name}/_action/{service}'),
                               qos_profile=service_qos())
            for srv_type, service in ((_SendGoal, 'send_goal'), (_GetResult, 'get_result'),
                                      (CancelGoal, 'cancel_goal')))
        self._servers = ServerWatch(home, self.name)
        self._responses = Responses(home, self._end_calls, self._check, check_period_s)

    @property
    def thread(self) -> threading.Thread:
        """Return the thread that takes the responses."""
        return self._responses.thread

    def server_is_ready(self) -> bool:
        """Return whether a server is available."""
        with suppress(*_GONE):
            return self._send.service_is_ready() and self._fetch.service_is_ready()
        return False

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """
        Wait until a server is available, and return whether it is.

        rclpy has no event for that, so this checks once in a period.

        :param timeout_sec: None waits without a limit.
        """
        end = math.inf if timeout_sec is None else time.monotonic() + timeout_sec
        while not self.server_is_ready():
            left_s = end - time.monotonic()
            if self._closed.is_set() or left_s <= 0.0:
                return False
            self._closed.wait(min(self._period_s, left_s))
        return True

    def goals_in(self, *states: State) -> list[LookupCall]:
        """Return the calls whose goals are in these states."""
        with self._lock:
            return self._goals.in_state(*states)

    def start(self, call: LookupCall) -> LookupCall:
        """Send a call's goal as soon as possible; return the call."""
        with self._lock:
            if not self._closed.is_set():
                self._goals.add(call)
                if len(self._goals.in_state(*WANTED)) == 1:
                    self._responses.wake()
        self._send_next()
        if not call.sent:
            self._look_after(call, self._server_is_there())
        return call

    def report(self, call: LookupCall, event: Event) -> None:
        """Move a call to its next state, and carry out the resulting actions."""
        with self._lock:
            actions = self._goals.move(call, event)
            request = call.request
            if self._closed.is_set() and Action.CANCEL_GOAL in actions:
                self._farewells.add(call)
            self._progress.notify_all()
        for action in actions:
            if action is Action.FETCH_RESULT:
                self._fetch_result(call)
            elif action is Action.CANCEL_GOAL:
                self._cancel_goal(call)
            elif request is not None:
                request.cancel()
        if event is not Event.CANCELLED:
            # A server may have room for another, or this one has to be sent again.
            self._send_next()

    def drop(self, call: LookupCall) -> None:
        """Cancel a call soon, in the thread; takes no lock."""
        self._dropped.append(call)
        self._responses.wake()

    def _cancel_goal(self, call: LookupCall) -> None:
        """Send the server a request to drop a call's goal."""
        with suppress(*_GONE):
            goal = GoalInfo(goal_id=call.goal_id)
            request = self._cancel.call_async(CancelGoal.Request(goal_info=goal))
            if call in self._farewells:
                self._replace_farewell(call, [
                    request, self._fetch.call_async(_GetResult.Request(goal_id=call.goal_id))])
            else:
                # Its response is not needed.
                self._cancel.remove_pending_request(request)

    def _replace_farewell(self, farewell: LookupCall | Future, requests: list[Future]) -> None:
        """Let the client wait at its end for these requests instead."""
        with self._lock:
            self._farewells.update(requests)
            self._farewells.discard(farewell)
            self._progress.notify_all()
        for request in requests:
            request.add_done_callback(partial(self._replace_farewell, requests=[]))

    def stop(self) -> None:
        """Signal the thread to end; it ends the calls."""
        self._responses.stop()

    def close(self) -> None:
        """End the calls and the thread."""
        self._end_calls()
        if threading.current_thread() is not self.thread and self.server_is_ready():
            self._take_leave()
        self._responses.close()

    def destroy(self) -> None:
        """End the calls and the thread: rclpy's name for ``close``."""
        self.close()

    def _take_leave(self) -> None:
        """Wait for the server's responses: it warns of each that it cannot deliver."""
        with self._lock:
            # A goal that is accepted only now is cancelled.
            self._progress.wait_for(
                lambda: not self._goals.in_state(*UNACCEPTED) and not self._farewells, FAREWELL_S)

    def _send_next(self) -> None:
        """Send the next goals, if a server is available and has room for them."""
        while True:
            with self._lock:
                call = self._goals.next_to_send()
                if call is None or not self.server_is_ready():
                    return
                self._servers.note_first()
                self._goals.move(call, Event.SENT)
                goal, goal_id = call.goal(), call.goal_id
                request = _SendGoal.Request(goal_id=goal_id, goal=goal)
            with suppress(*_GONE):
                self._expect(call, goal_id, self._send.call_async(request), self._note_acceptance)

    def _note_acceptance(self, call: LookupCall, response: Any) -> None:
        self.report(call, Event.ACCEPTED if response.accepted else Event.REJECTED)
        if not response.accepted:
            call.give_up(f'The buffer server {self.name} did not accept the goal')

    def _fetch_result(self, call: LookupCall) -> None:
        with suppress(*_GONE):
            goal_id = call.goal_id
            request = self._fetch.call_async(_GetResult.Request(goal_id=goal_id))
            self._expect(call, goal_id, request, LookupCall.answer)

    def _expect(self, call: LookupCall, goal_id: UUID, request: Future,
                step: Callable[[LookupCall, Any], None]) -> None:
        """Take a step when the service responds, unless the call no longer needs it."""
        with self._lock:
            is_wanted = call.sent and call.goal_id is goal_id
            if is_wanted:
                call.request = request
        if is_wanted:
            request.add_done_callback(
                lambda done: None if done.cancelled() else step(call, done.result()))
        else:
            request.cancel()

    def _check(self) -> bool:
        """Send, resend and give up calls as needed; return whether there are any."""
        if self._closed.is_set():
            return False
        while self._dropped:
            self._dropped.popleft().cancel()
        self._send_next()
        calls = self.goals_in(*State)
        if any(call.sent_s() >= self._period_s for call in calls):
            self._move_to_a_new_server(calls)
        is_there = self._server_is_there()
        call_all(partial(self._look_after, call, is_there) for call in calls)
        return bool(calls)

    def _server_is_there(self) -> bool:
        """
        Return whether there is a server.

        While DDS discovers a second server, its services are not ready for a moment, nor are those
        of the first.
        """
        return self.server_is_ready() or self._servers.is_there()

    def _move_to_a_new_server(self, calls: Iterable[LookupCall]) -> None:
        """Send the goals again if a new server has appeared, or if their requests may be lost."""
        is_new = self._servers.has_new()
        # Not those that are sent during this loop: they go to the new server.
        for call in [call for call in calls if call.sent]:
            if is_new:
                self.report(call, Event.SERVER_CHANGED)
            elif (not call.accepted and call.left_s()
                  and self._servers.may_have_lost(call.sent_s(), call.acceptance_s())):
                self.report(call, Event.LOST)

    def _look_after(self, call: LookupCall, is_there: bool) -> None:
        """End a call that can no longer get an answer."""
        if self._closed.is_set() or not is_running(self._responses.context):
            # Not TIMED_OUT, after which a goal that is accepted only now would not be cancelled.
            call.give_up(
                f'The client of the buffer server {self.name} was closed, or ROS shut down')
            return
        if is_there and call.is_late() and call.has_late_part():
            self.report(call, Event.PART_LATE)
            return
        why = self._why_hopeless(call, is_there)
        if why:
            self.report(call, Event.TIMED_OUT)
            call.give_up(why)

    def _why_hopeless(self, call: LookupCall, is_there: bool) -> str:
        name = self.name
        if is_there and call.is_late():
            return f'The buffer server {name} is available, but did not answer in time'
        if not is_there and call.sent:
            return f'The buffer server {name} went away before it answered'
        if not is_there and not call.left_s():
            return (f'There is no buffer server {name}: is a buffer_server running, '
                    'and is that its name?')
        return ''

    def _end_calls(self) -> None:
        with self._lock:
            self._closed.set()
        call_all(partial(self._look_after, call, is_there=False)
                 for call in self.goals_in(*WANTED))
