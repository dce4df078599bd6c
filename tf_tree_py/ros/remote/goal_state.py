# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The states of a goal between a client and its server, and the events that change them.

Pure logic: no messages, no threads, no clock. The client reports each ``Event`` and carries out
the ``Action`` that is returned.
"""

from enum import auto, Enum
from typing import Generic, Protocol, TypeVar


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
    #: The server waited for the requested time, which was one part of a longer wait.
    PART_OVER = auto()
    #: That part is over by the local clock, without a response: the server's clock may be slow.
    PART_LATE = auto()
    #: The server that received the request for the result does not have the goal: another
    #: server accepted it.
    #: accepted it.
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
AT_A_SERVER = State.SENT, State.ACCEPTED, State.CANCELLING
# The states in which a server has not yet accepted or refused the goal.
UNACCEPTED = State.SENT, State.CANCELLING
# The states in which the answer is still needed.
WANTED = State.TO_BE_SENT, State.SENT, State.ACCEPTED


class Goal(Protocol):
    """An object with a state; hashable by identity."""

    state: State


Kind = TypeVar('Kind', bound=Goal)


class Goals(Generic[Kind]):
    """
    All goals of a client by state, each state in order of arrival.

    The caller holds a lock, so that each event is one atomic step.
    """

    def __init__(self, max_unaccepted: int) -> None:
        """
        Begin without goals.

        :param max_unaccepted: so many may wait for a server's acceptance at a time.
        """
        self._max_unaccepted = max_unaccepted
        self._goals: dict[State, dict[Kind, None]] = {state: {} for state in State}

    def add(self, goal: Kind) -> None:
        """Append a goal to the queue of those to be sent."""
        self._goals[goal.state][goal] = None

    def in_state(self, *states: State) -> list[Kind]:
        """Return the goals in these states; those that have ended are forgotten."""
        return [goal for state in states for goal in self._goals[state]]

    def next_to_send(self) -> Kind | None:
        """Return the first goal in the queue; None: there is none, or no room for it yet."""
        if sum(len(self._goals[state]) for state in UNACCEPTED) >= self._max_unaccepted:
            return None
        return next(iter(self._goals[State.TO_BE_SENT]), None)

    def move(self, goal: Kind, event: Event) -> tuple[Action, ...]:
        """Move a goal to its next state; return the actions to carry out, in order."""
        before = goal.state
        if event not in _TRANSITIONS[before]:
            return ()
        goal.state, actions = _TRANSITIONS[before][event]
        self._goals[before].pop(goal, None)
        if goal.state is not State.ENDED:
            self._goals[goal.state][goal] = None
        return actions
