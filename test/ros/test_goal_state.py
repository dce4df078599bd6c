# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Every goal ends, and none is left behind at a server.

Random servers accept, refuse, respond, become silent, die and are replaced, and callers
cancel. After every step, the goals' states are compared with a model of server and callers.
"""

from itertools import count, product

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import invariant, precondition, rule, RuleBasedStateMachine
from tf_tree_py.ros.remote.lookup_goal import Action, Event, Goals, State, UNACCEPTED, WANTED

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
        self.is_paused = False

    def is_due(self):
        return not self.is_paused


# What a client may notice of a call, and in which states.
NOTICED = {
    Event.CANCELLED: set(State) - {State.ENDED},
    Event.TIMED_OUT: set(State) - {State.ENDED},
    Event.LOST: UNACCEPTED,
    Event.PART_LATE: {State.ACCEPTED},
    # As another server says that has just appeared.
    Event.UNKNOWN_THERE: {State.ACCEPTED},
}


class GoalsMachine(RuleBasedStateMachine):
    """A client, its server, and all events between them."""

    def __init__(self):
        super().__init__()
        self.goals = Goals(MAX_UNACCEPTED)
        self.calls, self.line = [], []
        # The numbers of the requests at the server.
        self.asked, self.accepted = [], set()
        self.numbers = count()

    def report(self, call, event):
        before = call.state
        for action in self.goals.move(call, event):
            if action is Action.FETCH_RESULT:
                call.expected = 'result'
            elif action is Action.CANCEL_GOAL:
                self.accepted.discard(call.number)
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
        if how_far > 1 and self.asked:
            self.accept(True)

    # --- the client

    @rule()
    def send(self):
        call = self.goals.next_to_send()
        due = [each for each in self.line if each.is_due()]
        if call is None:
            assert not due or len(self.goals.in_state(*UNACCEPTED)) == MAX_UNACCEPTED
            return
        assert call is due[0]
        call.number, call.expected = next(self.numbers), 'acceptance'
        self.line.remove(call)
        assert self.goals.move(call, Event.SENT) == ()
        self.asked.append(call.number)

    @rule(which=any_call)
    def pause_or_go_on(self, which):
        call = self.some(which, lambda call: call.state is State.TO_BE_SENT)
        if call:
            call.is_paused = not call.is_paused

    @rule(which=any_call,
          events=st.lists(st.sampled_from([*NOTICED]), min_size=1, max_size=3))
    def notice(self, which, events):
        """Notice one thing after another of the same call."""
        call = self.some(which, lambda call: call.state in NOTICED[events[0]])
        for event in events:
            if call and call.state in NOTICED[event]:
                self.notice_of(call, event)

    def notice_of(self, call, event):
        if event in (Event.TIMED_OUT, Event.LOST) and call.number in self.asked:
            # A goal that the server still accepts ends there by its own timeout.
            self.asked.remove(call.number)
        if event in (Event.CANCELLED, Event.TIMED_OUT):
            call.is_wanted = False
        self.report(call, event)

    # --- the server

    @precondition(lambda self: self.asked)
    @rule(accepts=st.booleans())
    def accept(self, accepts):
        number = self.asked.pop(0)
        if accepts:
            self.accepted.add(number)
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
            self.accepted.remove(call.number)
            call.expected = None
            call.is_wanted = event is Event.PART_OVER
            self.report(call, event)

    @rule(keeps=st.booleans())
    def be_replaced(self, keeps):
        # By one without any goals, or by an additional one.
        if not keeps:
            self.accepted = set()
        for call in self.calls:
            self.report(call, Event.SERVER_CHANGED)
        self.asked.clear()

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
        assert self.accepted == {
            call.number for call in self.calls if call.state is State.ACCEPTED}

    def teardown(self):
        """Let the server process everything: then every call ends, and stays ended."""
        for call in self.calls:
            call.is_paused = False
        for _ in range(3 * len(self.calls) + 3):
            self.send()
            if self.asked:
                self.accept(True)
            self.answer(0, Event.RESULT)
        assert not self.goals.in_state(*State)
        assert not self.accepted
        for call, event in product(self.calls, Event):
            assert self.goals.move(call, event) == ()
            assert call.state is State.ENDED


GoalsMachine.TestCase.settings = examples(10, stateful_step_count=40)
TestGoals = GoalsMachine.TestCase
