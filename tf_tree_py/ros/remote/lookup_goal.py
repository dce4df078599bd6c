# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Goals and results of the ``LookupTransform`` action, errors as codes in them, and one lookup.

Client and server have to agree on goals and results, with each other and with tf2's.

The states of a client's lookup and the events that change them are pure logic: no messages, no
threads, no clock. The client reports each ``Event`` and carries out the ``Action`` that it gets.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import auto, Enum
import secrets
import time

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error
from tf_tree_py.core.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tf_tree_py.core.stamp import from_seconds
from unique_identifier_msgs.msg import UUID

from ..messages.convert import time_message
from ..waiting.futures import AwaitableFuture

ACTION_NAME = 'tf2_buffer_server'

_EXCEPTIONS: dict[int, type[TransformException]] = {
    TF2Error.LOOKUP_ERROR: LookupException,
    TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: TimeoutException,
    # The base class: every other error.
    TF2Error.TRANSFORM_ERROR: TransformException,
}


def service_qos() -> QoSProfile:
    """
    Return the profile of the action's services.

    It is the standard profile of services with a greater depth. With the standard depth of
    10, ninety of a hundred requests or results at once would be lost.
    """
    return QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.VOLATILE)


def simple_goal(target_frame: str, source_frame: str, stamp: int) -> LookupTransform.Goal:
    """Return the goal for a lookup at one time, without a timeout."""
    return LookupTransform.Goal(target_frame=target_frame, source_frame=source_frame,
                                source_time=time_message(stamp))


def full_goal(target_frame: str, target_stamp: int, source_frame: str, source_stamp: int,
              fixed_frame: str) -> LookupTransform.Goal:
    """Return the goal for a lookup between two times, without a timeout."""
    goal = simple_goal(target_frame, source_frame, source_stamp)
    goal.target_time = time_message(target_stamp)
    goal.fixed_frame = fixed_frame
    goal.advanced = True
    return goal


def error_result(error: TransformException, timed_out: bool) -> LookupTransform.Result:
    """Return the result with the reason why there is no transform."""
    code = TF2Error.TIMEOUT_ERROR if timed_out else next(
        code for code, cls in _EXCEPTIONS.items() if isinstance(error, cls))
    return LookupTransform.Result(error=TF2Error(error=code, error_string=str(error)))


def _is_unknown(status: int, result: LookupTransform.Result) -> bool:
    """Return whether a server reports that it does not have the goal."""
    # Other servers may omit the status; a transform with frame names is an answer.
    return bool(status == GoalStatus.STATUS_UNKNOWN and not result.transform.child_frame_id
                and result.error.error == TF2Error.NO_ERROR)


def _transform_of(status: int, result: LookupTransform.Result) -> TransformStamped:
    """
    Return the transform of a result.

    :param status: of the goal. On a timeout tf2's server aborts the goal with an identity and no
        error, so that only the status shows it.
    :raises TransformException: of the class that the result names.
    """
    error = result.error
    if error.error != TF2Error.NO_ERROR:
        raise _EXCEPTIONS.get(error.error, TransformException)(error.error_string)
    if status == GoalStatus.STATUS_SUCCEEDED or result.transform.child_frame_id:
        return result.transform
    if status == GoalStatus.STATUS_ABORTED:
        raise TimeoutException('The buffer server did not find the transform in time')
    if status == GoalStatus.STATUS_CANCELED:
        raise TransformException('The lookup was canceled at the buffer server')
    raise TransformException(
        'The buffer server no longer knows the goal that it accepted: was it restarted?')


# --- one lookup of a client

class State(Enum):
    """The state of a goal."""

    #: It waits in the queue until a server with room for it is available.
    TO_BE_SENT = auto()
    #: A server was requested to accept it.
    SENT = auto()
    #: A server has accepted it and looks the transform up.
    ACCEPTED = auto()
    #: The answer is no longer needed. A server can cancel only accepted goals.
    CANCELLING = auto()
    #: Nothing is left to do.
    ENDED = auto()


class Event(Enum):
    """An event of a goal."""

    #: The client requests a server to accept it.
    SENT = auto()
    #: The server has accepted it.
    ACCEPTED = auto()
    #: The server has refused it.
    REJECTED = auto()
    #: The server has sent the result of the lookup.
    RESULT = auto()
    #: The server waited for the requested time, or answered, which was one part of a longer wait.
    PART_OVER = auto()
    #: That part is over by the local clock, without a response: the server's clock may be slow.
    PART_LATE = auto()
    #: The server that received the request for the result does not have the goal: another
    #: server accepted it.
    UNKNOWN_THERE = auto()
    #: The server did not accept it, and may not have received it.
    LOST = auto()
    #: Another server has appeared: the one that has the goal may be dead.
    SERVER_CHANGED = auto()
    #: The answer is no longer needed.
    CANCELLED = auto()
    #: The client gives up: the server has disappeared or is too late.
    TIMED_OUT = auto()


class Action(Enum):
    """The client's reaction to an event."""

    #: Request the result from the server.
    FETCH_RESULT = auto()
    #: Request the server to drop the goal.
    CANCEL_GOAL = auto()
    #: Ignore the response to the last request.
    DROP_REQUEST = auto()


# The server drops the goal; a dead one does not receive that.
_ABANDON = Action.CANCEL_GOAL, Action.DROP_REQUEST

# An event that is not listed for a state changes nothing: a response may be too late, and an ended
# goal may be cancelled again.
_TRANSITIONS: dict[State, dict[Event, tuple[State, tuple[Action, ...]]]] = {
    State.TO_BE_SENT: {
        Event.SENT: (State.SENT, ()),
        Event.CANCELLED: (State.ENDED, ()),
        Event.TIMED_OUT: (State.ENDED, ()),
    },
    State.SENT: {
        Event.ACCEPTED: (State.ACCEPTED, (Action.FETCH_RESULT,)),
        Event.REJECTED: (State.ENDED, ()),
        Event.LOST: (State.TO_BE_SENT, _ABANDON),
        Event.SERVER_CHANGED: (State.TO_BE_SENT, _ABANDON),
        Event.CANCELLED: (State.CANCELLING, ()),
        Event.TIMED_OUT: (State.ENDED, (Action.DROP_REQUEST,)),
    },
    State.ACCEPTED: {
        Event.RESULT: (State.ENDED, ()),
        Event.PART_OVER: (State.TO_BE_SENT, ()),
        Event.PART_LATE: (State.TO_BE_SENT, _ABANDON),
        Event.UNKNOWN_THERE: (State.TO_BE_SENT, _ABANDON),
        Event.SERVER_CHANGED: (State.TO_BE_SENT, _ABANDON),
        Event.CANCELLED: (State.ENDED, _ABANDON),
        Event.TIMED_OUT: (State.ENDED, _ABANDON),
    },
    State.CANCELLING: {
        Event.ACCEPTED: (State.ENDED, (Action.CANCEL_GOAL,)),
        Event.REJECTED: (State.ENDED, ()),
        Event.LOST: (State.ENDED, _ABANDON),
        Event.SERVER_CHANGED: (State.ENDED, _ABANDON),
        Event.TIMED_OUT: (State.ENDED, (Action.DROP_REQUEST,)),
    },
    State.ENDED: {},
}

# The states in which a server has the goal, or the request to accept it.
_AT_A_SERVER = State.SENT, State.ACCEPTED, State.CANCELLING
# The states in which a server has not yet accepted or refused the goal.
UNACCEPTED = State.SENT, State.CANCELLING
# The states in which the answer is still needed.
WANTED = State.TO_BE_SENT, State.SENT, State.ACCEPTED


class Goals:
    """
    All goals of a client, those of its calls, by state; each state in order of arrival.

    The caller holds a lock, so that each event is one atomic step.
    """

    def __init__(self, max_unaccepted: int) -> None:
        """
        Begin without goals.

        :param max_unaccepted: so many may wait for a server's acceptance at a time.
        """
        self._max_unaccepted = max_unaccepted
        self._goals: dict[State, dict[LookupCall, None]] = {state: {} for state in State}

    def add(self, goal: LookupCall) -> None:
        """Append a goal to the queue of those to be sent."""
        self._goals[goal.state][goal] = None

    def in_state(self, *states: State) -> list[LookupCall]:
        """Return the goals in these states; those that have ended are forgotten."""
        return [goal for state in states for goal in self._goals[state]]

    def next_to_send(self) -> LookupCall | None:
        """Return the first goal that is due; None: there is none, or no room for it yet."""
        if sum(len(self._goals[state]) for state in UNACCEPTED) >= self._max_unaccepted:
            return None
        return next((goal for goal in self._goals[State.TO_BE_SENT] if goal.is_due()), None)

    def move(self, goal: LookupCall, event: Event) -> tuple[Action, ...]:
        """Move a goal to its next state; return the actions to carry out, in order."""
        before = goal.state
        if event not in _TRANSITIONS[before]:
            return ()
        goal.state, actions = _TRANSITIONS[before][event]
        self._goals[before].pop(goal, None)
        if goal.state is not State.ENDED:
            self._goals[goal.state][goal] = None
        return actions


# --- one lookup

# A server accepts a goal at once, no matter how long the lookup takes.
ACCEPTANCE_S = 10.0
# A longer wait is sent in parts, so that a server forgets the goals of a client that died.
LEASE_S = 60.0
# The last part of a wait is at least as long as this.
_LEAST_S = 0.001
# A server that times out sooner than this would do so again.
QUICK_S = 0.1


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

    def __init__(self, report: Callable[[LookupCall, Event], object],
                 cancel_soon: Callable[[LookupCall], object],
                 goal: LookupTransform.Goal, timeout_s: float, padding_s: float) -> None:
        """
        Store the goal, and how long to wait for the answer.

        :param report: of the client that sends the goal; see ``GoalClient``.
        :param cancel_soon: likewise, its ``drop``: it takes no lock.
        :param goal: its timeout is set when it is sent.
        :param padding_s: how much longer than its timeout the server may take.
        """
        super().__init__()
        self.state = State.TO_BE_SENT
        self.goal_id = UUID()
        self.request: Future | None = None
        self._report, self._cancel_soon = report, cancel_soon
        self._goal = goal
        self._begin = self._sent_at = time.monotonic()
        self._lease_s = self._timeout_s = timeout_s
        self._padding_s = padding_s
        self._is_part = False
        self._longest_lease_s = LEASE_S
        self._due_at = self._begin

    @property
    def sent(self) -> bool:
        """Return whether a request was sent to a server, accepted or not."""
        return self.state in _AT_A_SERVER

    @property
    def accepted(self) -> bool:
        """Return whether a server looks the transform up."""
        return self.state is State.ACCEPTED

    def left_s(self) -> float:
        """Return how long the lookup may still take at a server, or a server to appear."""
        return max(0.0, self._begin + self._timeout_s - time.monotonic())

    def is_due(self) -> bool:
        """Return whether it may be sent."""
        return time.monotonic() >= self._due_at

    def sent_s(self) -> float:
        """Return the seconds since the last request to a server."""
        return time.monotonic() - self._sent_at if self.sent else 0.0

    def is_late(self) -> bool:
        """Return whether an available server should have answered by now."""
        limit_s = self._lease_s
        if self.sent and not self.accepted:
            limit_s = min(limit_s, ACCEPTANCE_S)
        return time.monotonic() >= self._sent_at + limit_s + self._padding_s

    def acceptance_s(self) -> float:
        """Return in how many seconds a server has to accept a request, without the padding."""
        return min(self._timeout_s, ACCEPTANCE_S)

    def goal(self) -> LookupTransform.Goal:
        """Return the goal to send now, under a new ``goal_id``."""
        self.goal_id = UUID(uuid=list(secrets.token_bytes(16)))
        self._sent_at = time.monotonic()
        # Without a timeout a server returns the missing data as the reason, and not the timeout.
        left_s = max(self.left_s(), min(self._timeout_s, _LEAST_S))
        self._lease_s = min(left_s, self._longest_lease_s)
        self._is_part = self._lease_s < left_s
        self._goal.timeout = Duration(nanoseconds=from_seconds(self._lease_s)).to_msg()
        return self._goal

    def answer(self, response: LookupTransform.Impl.GetResultService.Response) -> None:
        """End with the transform or the error of a server's response."""
        if _is_unknown(response.status, response.result) and self._is_in_time():
            # A request goes to all servers: here a server that has just appeared responded first.
            self._report(self, Event.UNKNOWN_THERE)
            return
        try:
            transform = self._answer_in(response)
        except TransformException as error:
            self._report(self, Event.RESULT)
            self.set_exception(error.with_traceback(None))
        else:
            self._report(self, Event.PART_OVER if transform is None else Event.RESULT)
            if transform is not None:
                self.set_result(transform)

    def _answer_in(self, response: LookupTransform.Impl.GetResultService.Response
                   ) -> TransformStamped | None:
        """
        Return the transform of a response; None: ask again.

        :raises TransformException: there is none, and no time to ask again.
        """
        try:
            return _transform_of(response.status, response.result)
        except TimeoutException:
            if self._may_ask_again():
                return None
            raise

    def _may_ask_again(self) -> bool:
        """Return whether the server timed out because the request was for a part of the time."""
        # The server uses its own clock, which may be simulated and fast.
        took_s = time.monotonic() - self._sent_at
        return self._is_part and took_s >= min(self._lease_s, QUICK_S)

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

    def drop(self) -> None:
        """Let the client cancel it: this thread may be in the middle of anything."""
        self._cancel_soon(self)

    def _end(self) -> bool:
        first = super()._end()
        if first:
            # After an answer the goal has ended already, and this changes nothing.
            self._report(self, Event.CANCELLED)
        return first
