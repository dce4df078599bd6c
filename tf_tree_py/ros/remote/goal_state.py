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

"""
The states of a goal between a client and its server, and what moves it from one to the next.

Pure logic: no messages, no threads, no clock. The client reports what happened as an
``Event`` and carries out the ``Action`` it gets back.
"""

from enum import auto, Enum
from typing import Generic, Protocol, TypeVar


class State(Enum):
    """Where a goal stands."""

    #: It waits in line until a server is there that has room for it.
    TO_BE_SENT = auto()
    #: A server was asked to accept it.
    SENT = auto()
    #: A server has accepted it and looks the transform up.
    ACCEPTED = auto()
    #: Nobody wants the answer any more. A server can cancel only what it has accepted.
    CANCELLING = auto()
    #: Nothing is left to do.
    ENDED = auto()


class Event(Enum):
    """What happened to a goal."""

    #: The client asks a server to accept it.
    SENT = auto()
    #: The server has accepted it.
    ACCEPTED = auto()
    #: The server has refused it.
    REJECTED = auto()
    #: The server has said how the lookup ended.
    RESULT = auto()
    #: The server waited for as long as it was asked to: one part of a longer wait.
    PART_OVER = auto()
    #: That part is over by the clock here, and the server has said nothing: its clock may be slow.
    PART_LATE = auto()
    #: A server that was asked for the result does not know the goal: it is not the one that
    #: accepted it.
    UNKNOWN_THERE = auto()
    #: The server did not accept it, and may not have heard of it.
    LOST = auto()
    #: Another server has come: the one that has the goal may be dead.
    SERVER_CHANGED = auto()
    #: Nobody wants the answer any more.
    CANCELLED = auto()
    #: The client gives up: the server is gone or too late.
    TIMED_OUT = auto()


class Action(Enum):
    """What the client has to do about an event."""

    #: Ask the server for the result.
    FETCH_RESULT = auto()
    #: Tell the server to drop the goal.
    CANCEL_GOAL = auto()
    #: Expect no response any more to what the server was last asked.
    DROP_REQUEST = auto()


# The server drops the goal; a dead one does not hear that.
_ABANDON = Action.CANCEL_GOAL, Action.DROP_REQUEST

# An event that a state does not name changes nothing: a response may come too late, and
# what has ended may be cancelled again.
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

# The states in which a server has the goal, or was asked to take it.
AT_A_SERVER = State.SENT, State.ACCEPTED, State.CANCELLING
# The states in which a server still has to say whether it accepts the goal.
UNACCEPTED = State.SENT, State.CANCELLING
# The states in which somebody wants the answer.
WANTED = State.TO_BE_SENT, State.SENT, State.ACCEPTED


class Goal(Protocol):
    """What goes through the states; hashable by identity."""

    state: State


Kind = TypeVar('Kind', bound=Goal)


class Goals(Generic[Kind]):
    """
    All goals of a client, each in its state, in the order in which they came to it.

    The caller holds a lock: an event is one step.
    """

    def __init__(self, max_unaccepted: int) -> None:
        """
        Begin without goals.

        :param max_unaccepted: so many may wait for a server's acceptance at a time.
        """
        self._max_unaccepted = max_unaccepted
        self._goals: dict[State, dict[Kind, None]] = {state: {} for state in State}

    def add(self, goal: Kind) -> None:
        """Put a goal at the end of the line of those to be sent."""
        self._goals[goal.state][goal] = None

    def in_state(self, *states: State) -> list[Kind]:
        """Return the goals in these states; those that have ended are forgotten."""
        return [goal for state in states for goal in self._goals[state]]

    def next_to_send(self) -> Kind | None:
        """Return the first goal in line; None: there is none, or no room for it yet."""
        if sum(len(self._goals[state]) for state in UNACCEPTED) >= self._max_unaccepted:
            return None
        return next(iter(self._goals[State.TO_BE_SENT]), None)

    def move(self, goal: Kind, event: Event) -> tuple[Action, ...]:
        """Bring a goal to its next state; return what is to be done about it, in order."""
        before = goal.state
        if event not in _TRANSITIONS[before]:
            return ()
        goal.state, actions = _TRANSITIONS[before][event]
        self._goals[before].pop(goal, None)
        if goal.state is not State.ENDED:
            self._goals[goal.state][goal] = None
        return actions
