# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Every goal ends, and none is left behind at a server.

Random servers accept, refuse, respond, become silent, die and are replaced, and callers
cancel. After every step, the goals' states are compared with a model of server and callers.
"""

from itertools import count

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import invariant, precondition, rule, RuleBasedStateMachine
import pytest
from tf_tree_py.ros.remote.goal_state import Action, Event, Goals, State, UNACCEPTED, WANTED

MAX_UNACCEPTED = 2
any_call = st.integers(0, 1000)


class Call:
    """A client's data of a goal: its state, and the number of its last request."""

    def __init__(self):
        self.state = State.TO_BE_SENT
        self.number = None
        # 'acceptance' or 'result': the expected response.
        self.expected = None
        self.is_wanted = True


class Server:
    """The goals at a server."""

    def __init__(self):
        self.asked = []
        self.accepted = set()


class GoalsMachine(RuleBasedStateMachine):
    """A client, its server, and all events between them."""

    def __init__(self):
        super().__init__()
        self.goals = Goals(MAX_UNACCEPTED)
        self.calls, self.line = [], []
        self.server = Server()
        self.numbers = count()

    def report(self, call, event):
        before = call.state
        for action in self.goals.move(call, event):
            if action is Action.FETCH_RESULT:
                call.expected = 'result'
            elif action is Action.CANCEL_GOAL:
                self.server.accepted.discard(call.number)
            else:
                call.expected = None
        if before is not call.state and before is State.TO_BE_SENT:
            self.line.remove(call)
        if before is not call.state and call.state is State.TO_BE_SENT:
            self.line.append(call)

    def some(self, which, condition):
        calls = [call for call in self.calls if condition(call)]
        return calls[which % len(calls)] if calls else None

    # --- the caller

    @rule(how_far=st.integers(0, 2))
    def ask(self, how_far):
        """Begin a call; depending on ``how_far``, send it, and let the server accept it."""
        call = Call()
        self.calls.append(call)
        self.line.append(call)
        self.goals.add(call)
        if how_far > 0:
            self.send()
        if how_far > 1 and self.server.asked:
            self.accept(True)

    @rule(which=any_call)
    def lose_interest(self, which):
        # It may already have ended.
        call = self.some(which, lambda call: True)
        if call:
            call.is_wanted = False
            self.report(call, Event.CANCELLED)

    # --- the client

    @rule()
    def send(self):
        call = self.goals.next_to_send()
        if call is None:
            assert not self.line or len(self.goals.in_state(*UNACCEPTED)) == MAX_UNACCEPTED
            return
        assert call is self.line[0]
        call.number, call.expected = next(self.numbers), 'acceptance'
        self.line.remove(call)
        assert self.goals.move(call, Event.SENT) == ()
        self.server.asked.append(call.number)

    @rule(which=any_call)
    def give_up(self, which):
        call = self.some(which, lambda call: call.state is not State.ENDED)
        if call:
            # A goal that the server still accepts ends there by its own timeout.
            self.server.asked = [each for each in self.server.asked if each != call.number]
            call.is_wanted = False
            self.report(call, Event.TIMED_OUT)

    @rule(which=any_call)
    def get_no_acceptance(self, which):
        call = self.some(which, lambda call: call.state in UNACCEPTED)
        if call:
            self.server.asked.remove(call.number)
            self.report(call, Event.LOST)

    @rule(which=any_call)
    def get_no_result(self, which):
        call = self.some(which, lambda call: call.state is State.ACCEPTED)
        if call:
            self.report(call, Event.PART_LATE)

    @rule(which=any_call)
    def be_told_by_another_server_that_it_does_not_know_the_goal(self, which):
        call = self.some(which, lambda call: call.expected == 'result')
        if call:
            self.report(call, Event.UNKNOWN_THERE)

    # --- the server

    @precondition(lambda self: self.server.asked)
    @rule(accepts=st.booleans())
    def accept(self, accepts):
        number = self.server.asked.pop(0)
        if accepts:
            self.server.accepted.add(number)
        [call] = [call for call in self.calls if call.number == number]
        assert call.expected == 'acceptance'
        call.expected = None
        if not accepts:
            call.is_wanted = False
        self.report(call, Event.ACCEPTED if accepts else Event.REJECTED)

    @rule(which=any_call, event=st.sampled_from([Event.RESULT, Event.PART_OVER]))
    def answer(self, which, event):
        call = self.some(which, lambda call: call.expected == 'result')
        if call:
            self.server.accepted.remove(call.number)
            call.expected = None
            call.is_wanted = event is Event.PART_OVER
            self.report(call, event)

    @rule(keeps=st.booleans())
    def be_replaced(self, keeps):
        # By one without any goals, or by an additional one.
        old = self.server
        self.server = Server() if not keeps else old
        for call in self.calls:
            self.report(call, Event.SERVER_CHANGED)
        old.asked.clear()

    # --- the invariants

    @invariant()
    def only_so_many_wait_for_acceptance(self):
        assert len(self.goals.in_state(*UNACCEPTED)) <= MAX_UNACCEPTED

    @invariant()
    def every_goal_stands_in_its_state_once(self):
        for state in State:
            assert self.goals.in_state(state) == [
                call for call in self.goals.in_state(state) if call.state is state]
        known = self.goals.in_state(*State)
        assert len(known) == len(set(known))
        assert set(known) == {call for call in self.calls if call.state is not State.ENDED}
        assert self.goals.in_state(State.TO_BE_SENT) == self.line

    @invariant()
    def a_call_is_served_for_as_long_as_it_is_wanted(self):
        for call in self.calls:
            assert (call.state in WANTED) == call.is_wanted

    @invariant()
    def a_response_is_expected_exactly_where_a_server_owes_one(self):
        expected = {State.SENT: 'acceptance', State.CANCELLING: 'acceptance',
                    State.ACCEPTED: 'result'}
        for call in self.calls:
            assert call.expected == expected.get(call.state)

    @invariant()
    def a_server_works_for_those_only_who_want_it(self):
        assert self.server.accepted == {
            call.number for call in self.calls if call.state is State.ACCEPTED}

    def teardown(self):
        """Let the server process everything: then every call ends."""
        for _ in range(3 * len(self.calls) + 3):
            self.send()
            if self.server.asked:
                self.accept(True)
            self.answer(0, Event.RESULT)
        assert not self.goals.in_state(*State)
        assert not self.server.accepted


GoalsMachine.TestCase.settings = examples(10, stateful_step_count=40)
TestGoals = GoalsMachine.TestCase


@pytest.mark.parametrize('event', Event)
def test_what_has_ended_stays_ended(event):
    call = Call()
    goals = Goals(1)
    goals.add(call)
    goals.move(call, Event.CANCELLED)
    assert goals.move(call, event) == ()
    assert call.state is State.ENDED
