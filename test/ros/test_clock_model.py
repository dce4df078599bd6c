# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Waits by a simulated clock end once, at the first tick that reaches their end.

The clock trembles, stands still, runs slowly and fast, jumps both ways, and is replaced by another
one. Threads and futures wait by it, and data arrives that does not help them. After every step,
what has ended is compared with a model.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import count

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import initialize, precondition, rule, RuleBasedStateMachine
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import LATEST, move, result_of, simulated_clock, until_waiting
from tf_tree_py import Buffer, ClockJumpException, LookupException

MILLISECOND = 1_000_000
LIMIT = 1000 * MILLISECOND
STEPS = [step * MILLISECOND for step in (
    0, 1, 1, 4, 10, 10, 50, 500, 3000, 30_000, -1, -3, -20, -20, -500, -999, -1000, -1001, -8000)]
TIMEOUTS = [timeout * MILLISECOND for timeout in (1, 5, 15, 30, 200, 2000, 20_000)]


class Waiting:
    """A wait, and what the model knows about it."""

    def __init__(self, result, begin, timeout):
        self.result, self.begin, self.timeout = result, begin, timeout

    @property
    def end(self):
        return self.begin + self.timeout

    def check_timeout(self, now):
        with pytest.raises(LookupException) as raised:
            result_of(self.result)
        assert raised.value.waited_s == (now - self.begin) / 1e9

    def check_jump(self, before, now):
        with pytest.raises(ClockJumpException, match=(
                f'went back by {(before - now) / 1e9:.3f} s')):
            result_of(self.result)


class ClockMachine(RuleBasedStateMachine):
    """A clock, a buffer that follows it, and those who wait."""

    def __init__(self):
        super().__init__()
        self.pool = ThreadPoolExecutor(8)
        self.buffer = Buffer(clear_on_clock_jump_back=Duration(nanoseconds=LIMIT))
        self.waits, self.frames = [], count()

    @initialize(begin=st.sampled_from([0, 100 * LIMIT, 1_700_000_000 * LIMIT]))
    def begin(self, begin):
        self.use(begin)

    def use(self, begin):
        self.clock = simulated_clock()
        self.show(begin)
        self.buffer.use_clock(self.clock)
        self.now = self.newest = begin

    def show(self, now):
        self.clock.set_ros_time_override(Time(nanoseconds=now, clock_type=self.clock.clock_type))

    @rule(step=st.sampled_from(STEPS))
    def tick(self, step):
        if self.now + step < 0:
            return
        self.now += step
        self.start_those_that_wait_for_the_first_time()
        self.show(self.now)
        before, self.newest = self.newest, max(self.newest, self.now)
        if before - self.now < LIMIT:
            self.end_those_that_are_due()
            return
        self.newest = self.now
        for each in self.waits:
            each.check_jump(before, self.now)
        self.waits = []
        self.check()

    @rule(ahead=st.sampled_from([-5000, -2, 0, 3, 5000]))
    def replace_clock(self, ahead):
        self.use(max(self.now + ahead * MILLISECOND, 0))
        self.start_those_that_wait_for_the_first_time()
        self.end_those_that_are_due()

    @precondition(lambda self: len(self.waits) < 8)
    @rule(timeout=st.sampled_from(TIMEOUTS))
    def wait_in_a_thread(self, timeout):
        self.add(self.pool.submit(self.buffer.lookup_transform, 'map', f'nowhere{len(self.waits)}',
                                  LATEST, Duration(nanoseconds=timeout)), timeout)

    @precondition(lambda self: len(self.waits) < 8)
    @rule(timeout=st.sampled_from(TIMEOUTS))
    def wait_as_a_future(self, timeout):
        self.add(self.buffer.wait_for_transform_async(
            'map', f'nowhere{len(self.waits)}', LATEST, Duration(nanoseconds=timeout)), timeout)

    def add(self, result, timeout):
        self.waits.append(Waiting(result, self.now, timeout))
        self.check()

    @rule()
    def wake_all_for_nothing(self):
        """Insert data that changes the structure, so that all of them look again."""
        move(self.buffer, self.now / 1e9, child=f'other{next(self.frames)}')
        self.check()

    def start_those_that_wait_for_the_first_time(self):
        for each in self.waits:
            each.begin = each.begin or self.now

    def end_those_that_are_due(self):
        due = [each for each in self.waits if each.begin and each.end <= self.now]
        self.waits = [each for each in self.waits if each not in due]
        for each in due:
            each.check_timeout(self.now)
        self.check()

    def check(self):
        until_waiting(self.buffer, len(self.waits))
        assert not any(each.result.done() for each in self.waits)

    def teardown(self):
        self.check()
        self.buffer.waiting.fail(ClockJumpException('the end'))
        self.pool.shutdown()
        for each in self.waits:
            with pytest.raises(ClockJumpException, match='the end'):
                result_of(each.result)


TestClock = ClockMachine.TestCase
TestClock.settings = examples(1, stateful_step_count=40)
