"""
Sending ``LookupTransform`` goals from any thread, and following them to their end.

An action is three services and two topics. rclpy's ``ActionClient`` hears the topics
too, on one of which the server tells all clients the states of all goals whenever one
changes: a hundred clients would be busy with nothing else. This one uses the services.
"""

from collections.abc import Iterable
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
from rclpy.parameter import Parameter
from rclpy.task import Future
from tf2_msgs.action import LookupTransform
from tf_tree_py.core.calling import call_all

from .lookup_call import LookupCall
from .lookup_goal import service_qos
from ..threads.companion import hidden_name
from ..threads.response_receiver import Responses

_SendGoal = LookupTransform.Impl.SendGoalService
_GetResult = LookupTransform.Impl.GetResultService

# What rclpy raises when a node has been destroyed, or its context has ended.
_GONE = InvalidHandle, RCLError

# So many goals may be on their way to be accepted: tf2's server holds ten, and would
# lose what comes on top.
_MAX_UNACCEPTED = 8
# A server is discovered part by part: it may not hear what it is asked too soon, nor be heard.
# For so long it is asked once more when it does not accept, once in so many seconds.
_DISCOVERY_S = 10.0
_AGAIN_S = 0.5
# How long to wait at the end until the server has dropped what was asked of it.
_FAREWELL_S = 1.0


class GoalClient:
    """
    The client side of the action, on a small node with a thread of its own.

    So answers arrive while a callback of your node waits for one. Every call ends: at
    the latest a check period after its deadline, or after its server disappeared. Where
    another server has come, it gets all that is on its way.
    """

    def __init__(self, node: Node, name: str, check_period_s: float) -> None:
        """
        Make the services' clients.

        :param node: whose context, namespace and remappings to use.
        :param name: the action's, relative to the node or absolute.
        """
        self.name = node.resolve_service_name(name)
        self._period_s = check_period_s
        self._lock = threading.Lock()
        self._calls: set[LookupCall] = set()
        # In the order in which they came.
        self._unsent: dict[LookupCall, None] = {}
        self._unaccepted: set[LookupCall] = set()
        self._closed = threading.Event()
        self._farewells: list[Future] = []
        # Those that were there when last looked, and until when one that came may be half there.
        self._servers: frozenset[bytes] = frozenset()
        self._discovered_at = 0.0
        home = _companion(node)
        self._send, self._fetch, self._cancel = (
            home.create_client(kind, node.resolve_service_name(f'{name}/_action/{service}'),
                               qos_profile=service_qos())
            for kind, service in ((_SendGoal, 'send_goal'), (_GetResult, 'get_result'),
                                  (CancelGoal, 'cancel_goal')))
        self._home = home
        self._responses = Responses(home, self._end_calls, self._check, check_period_s)

    @property
    def thread(self) -> threading.Thread:
        """Return the thread that takes the answers."""
        return self._responses.thread

    def server_is_ready(self) -> bool:
        """Return whether a server is there."""
        with suppress(*_GONE):
            return self._send.service_is_ready() and self._fetch.service_is_ready()
        return False

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """
        Wait until a server is there, seconds or as long as it takes; return whether it is.

        Of what comes and goes on the graph rclpy tells nobody, so this looks again and again.
        """
        end = math.inf if timeout_sec is None else time.monotonic() + timeout_sec
        while not self.server_is_ready():
            left_s = end - time.monotonic()
            if self._closed.is_set() or left_s <= 0.0:
                return False
            self._closed.wait(min(self._period_s, left_s))
        return True

    def start(self, call: LookupCall) -> LookupCall:
        """Send a call's goal, now or when it can be; return the call."""
        with self._lock:
            if not self._closed.is_set():
                self._calls.add(call)
                self._unsent[call] = None
                if len(self._calls) == 1:
                    self._responses.wake()
        self._send_next()
        if not call.sent:
            self._look_after(call, self.server_is_ready())
        return call

    def send_later(self, call: LookupCall) -> None:
        """Send a call's goal, behind those that are to be sent already."""
        with self._lock:
            if call in self._calls:
                self._unsent[call] = None
        self._send_next()

    def forget(self, call: LookupCall) -> None:
        """Let a call go that has ended, at the server too."""
        with self._lock:
            self._calls.discard(call)
            self._unsent.pop(call, None)
        if call.accepted and not call.answered:
            self._cancel_goal(call)

    def _cancel_goal(self, call: LookupCall) -> None:
        """Let the server drop a call's goal."""
        with suppress(*_GONE):
            goal = GoalInfo(goal_id=call.goal_id)
            request = self._cancel.call_async(CancelGoal.Request(goal_info=goal))
            if self._closed.is_set():
                self._farewells += [
                    request, self._fetch.call_async(_GetResult.Request(goal_id=call.goal_id))]
            else:
                # What comes back changes nothing.
                self._cancel.remove_pending_request(request)

    def stop(self) -> None:
        """End the thread soon, and with it the calls."""
        self._responses.stop()

    def close(self) -> None:
        """Give up what is on its way, and end the thread."""
        self._end_calls()
        if threading.current_thread() is not self.thread and self.server_is_ready():
            self._take_leave()
        self._responses.close()

    def destroy(self) -> None:
        """Give up what is on its way, and stop: rclpy's name for ``close``."""
        self.close()

    def _take_leave(self) -> None:
        """Wait until the server has answered, for it cannot answer who is gone."""
        end = time.monotonic() + _FAREWELL_S
        with self._lock:
            requests = [call.request for call in self._unaccepted if call.request is not None]
        _wait(requests, end)
        # What was just accepted was then cancelled.
        _wait(self._farewells, end)

    def _send_next(self) -> None:
        """Send the next goals, if a server is there that surely has room for them."""
        while True:
            with self._lock:
                if (not self._unsent or len(self._unaccepted) >= _MAX_UNACCEPTED
                        or not self.server_is_ready()):
                    return
                if not self._servers:
                    self._servers = self._find_servers()
                call = next(iter(self._unsent))
                del self._unsent[call]
                self._unaccepted.add(call)
                call.sent = True
            with suppress(*_GONE):
                goal = call.goal()
                request = _SendGoal.Request(goal_id=call.goal_id, goal=goal)
                call.follow(self._send.call_async(request), partial(self._note_acceptance, call))

    def _note_acceptance(self, call: LookupCall, response: Any) -> None:
        with self._lock:
            self._unaccepted.discard(call)
        call.accepted = response.accepted
        if not call.accepted:
            call.give_up(f'The buffer server {self.name} did not accept the goal')
        elif call.over:
            # It could not be cancelled before.
            self._cancel_goal(call)
        else:
            self._fetch_result(call)
        self._send_next()

    def _fetch_result(self, call: LookupCall) -> None:
        with suppress(*_GONE):
            request = _GetResult.Request(goal_id=call.goal_id)
            call.follow(self._fetch.call_async(request), call.answer)

    def _check(self) -> bool:
        """Look after the calls; return whether there are any."""
        if self._closed.is_set():
            return False
        self._send_next()
        is_ready = self.server_is_ready()
        with self._lock:
            calls = self._calls | self._unaccepted
        if any(call.sent_s() >= self._period_s for call in calls):
            self._move_to_a_new_server(calls)
        call_all(partial(self._look_after, call, is_ready) for call in calls)
        return bool(calls)

    def _move_to_a_new_server(self, calls: Iterable[LookupCall]) -> None:
        """
        Ask a server that has come meanwhile what others were asked before.

        One that was killed seems to be there until its lease with DDS ends, 20 s or so.
        """
        servers, now = self._find_servers(), time.monotonic()
        is_new = bool(self._servers and servers - self._servers)
        if is_new:
            self._discovered_at = now + _DISCOVERY_S
        if servers:
            self._servers = servers
        for call in calls:
            is_lost = not call.accepted and call.sent_s() >= _AGAIN_S
            if call.sent and (is_new or is_lost and now < self._discovered_at):
                self._ask_again(call)
        self._send_next()

    def _find_servers(self) -> frozenset[bytes]:
        """Return an identity of each server: that of its publisher of the goals' states."""
        with suppress(*_GONE):
            return frozenset(
                bytes(publisher.endpoint_gid) for publisher
                in self._home.get_publishers_info_by_topic(f'{self.name}/_action/status'))
        return frozenset()

    def _ask_again(self, call: LookupCall) -> None:
        """Send a call's goal anew, if it has not ended; whoever has it now is to drop it."""
        self._cancel_goal(call)
        with self._lock:
            self._unaccepted.discard(call)
        call.ask_again()

    def _look_after(self, call: LookupCall, is_ready: bool) -> None:
        """Give a call up that has become hopeless."""
        if is_ready and call.is_late() and call.has_late_part():
            self._ask_again(call)
            return
        why = self._why_hopeless(call, is_ready)
        if why:
            with self._lock:
                self._unaccepted.discard(call)
            call.give_up(why)
            call.drop_request()

    def _why_hopeless(self, call: LookupCall, is_ready: bool) -> str:
        name = self.name
        if self._closed.is_set() or not self._responses.context.ok():
            return f'The client of the buffer server {name} was closed, or ROS shut down'
        if is_ready and call.is_late():
            return f'The buffer server {name} is there, and did not answer in time'
        if not is_ready and call.sent:
            return f'The buffer server {name} went away before it answered'
        if not is_ready and not call.left_s():
            return (f'There is no buffer server {name}: is a buffer_server running, '
                    'and is that its name?')
        return ''

    def _end_calls(self) -> None:
        with self._lock:
            self._closed.set()
            calls = list(self._calls)
        call_all(partial(call.give_up, self._why_hopeless(call, is_ready=False))
                 for call in calls)


def _wait(futures: Iterable[Future], end: float) -> None:
    """Sleep until all futures have ended, or the monotonic time is up."""
    for future in futures:
        ended = threading.Event()
        future.add_done_callback(lambda _, ended=ended: ended.set())
        ended.wait(max(0.0, end - time.monotonic()))


def _companion(node: Node) -> Node:
    """Return a small node beside another, which its executor does not see."""
    return Node(
        hidden_name('buffer_client_impl'),
        context=node.context,
        namespace=node.get_namespace(),
        # The names are resolved by the other node already; a rename is meant for it alone.
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )
