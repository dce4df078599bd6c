# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""When a deadline is over, why, and after how long; and which alarms ring, and in which order."""

from collections import deque
import gc
import math
import os
import sys
import threading
import time

import pytest
from rclpy.clock import ROSClock
from ros_helpers import at, PATIENCE_S, simulated_clock, until
from tf_tree_py import LookupException
from tf_tree_py.ros.waiting.clock import ClockWatch, RosClock
from tf_tree_py.ros.waiting.deadlines import Alarms, ClockDeadline

SECOND = 1_000_000_000
STEP = 1_000_000
CLOSED = 'Given up: the listener was closed, or ROS was shut down'
GUARDED = 'Given up because of the wall_guard: is any node publishing /clock?'
STOPPED_S = 'tf_tree_py.ros.waiting.deadlines.STOPPED_S'


@pytest.fixture
def watch():
    return ClockWatch(lambda jump: None)


@pytest.fixture
def clock(watch):
    """Return a simulated clock at 10 s, which the watch uses."""
    clock = simulated_clock(10.0)
    watch.use_clock(RosClock(clock))
    return clock


def show(clock, seconds):
    clock.set_ros_time_override(at(seconds))


def is_set():
    event = threading.Event()
    event.set()
    return event


# --- one deadline


@pytest.mark.parametrize(('simulated', 'timeout', 'guard_s', 'by_wall', 'lasts_s'), [
    (False, 3 * SECOND // 2, None, False, 1.5),
    (False, 3 * SECOND // 2, 0.25, False, 1.5),
    (False, None, 0.25, False, math.inf),
    (False, 0, None, True, 0.0),
    (True, 3 * SECOND // 2, None, False, math.inf),
    (True, 3 * SECOND // 2, 0.25, False, 0.25),
    (True, None, None, False, math.inf),
    (True, 3 * SECOND // 2, 0.25, True, 1.5),
    (True, None, 0.25, True, math.inf),
])
def test_end_by_the_wall_clock(watch, simulated, timeout, guard_s, by_wall, lasts_s):
    watch.use_clock(RosClock(simulated_clock(10.0) if simulated else ROSClock()))
    before = time.monotonic()
    deadline = ClockDeadline(watch, timeout, guard_s, by_wall=by_wall)
    after = time.monotonic()
    assert before + lasts_s <= deadline.wall_end <= after + lasts_s
    assert deadline.is_simulated is (simulated and not by_wall)
    assert deadline.is_over() is (lasts_s == 0.0)
    assert deadline.why_early == ''
    assert deadline.released is False


def test_simulated_deadline_is_over_at_its_end_and_stays_so(watch, clock):
    deadline = ClockDeadline(watch, 2 * SECOND, 3600.0)
    assert deadline.elapsed_s() == 0.0
    for seconds, over in ((10.5, False), (11.999999999, False), (12.0, True), (11.0, True)):
        show(clock, seconds)
        assert deadline.is_over() is over
        assert deadline.elapsed_s() == pytest.approx(min(seconds, 12.0) - 10.0 if seconds != 11.0
                                                     else 2.0)
        assert deadline.wait(is_set()) is True
        if over:
            assert deadline.wait(threading.Event()) is False
    assert deadline.why_early == ''


def test_elapsed_time_is_that_of_the_last_look(watch, clock):
    deadline = ClockDeadline(watch, 20 * SECOND, None)
    show(clock, 13.0)
    assert deadline.elapsed_s() == 0.0
    assert not deadline.is_over()
    show(clock, 14.5)
    assert deadline.elapsed_s() == 3.0
    watch.leave(RosClock(clock))
    assert deadline.is_over()
    assert deadline.why_early == CLOSED
    assert 0.0 <= deadline.elapsed_s() < PATIENCE_S, 'by the wall clock then'


def test_timeout_before_the_first_time_begins_with_it(watch):
    clock = simulated_clock(0.0)
    watch.use_clock(RosClock(clock))
    deadline = ClockDeadline(watch, 2 * SECOND, None)
    assert deadline.is_simulated
    for seconds, over, elapsed_s in ((100.0, False, 0.0), (101.5, False, 1.5), (102.0, True, 2.0)):
        show(clock, seconds)
        assert deadline.is_over() is over
        assert deadline.elapsed_s() == elapsed_s


def leave(watch, clock):
    watch.leave(RosClock(clock))


def follow_the_system(watch, clock):
    watch.use_clock(RosClock(ROSClock()))


@pytest.mark.parametrize(('end', 'released', 'why'), [
    (leave, False, CLOSED), (follow_the_system, False, ''),
    (lambda watch, clock: watch.release(), True, CLOSED),
    (lambda watch, clock: show(clock, 12.0), False, '')],
    ids=['clock left', 'not simulated any more', 'released', 'in time'])
@pytest.mark.parametrize('ask', [
    ClockDeadline.is_over, lambda deadline: not deadline.wait(threading.Event())],
    ids=['is_over', 'wait'])
def test_reason_why_a_wait_ends(watch, clock, ask, end, released, why):
    deadline, silent = ClockDeadline(watch, 2 * SECOND, None), ClockDeadline(watch, SECOND, None)
    end(watch, clock)
    assert ask(deadline) is True
    assert (deadline.why_early, deadline.released) == (why, released)
    assert deadline.wait(is_set()) is True
    assert silent.why_early == '', 'it was not asked'
    assert ClockDeadline(watch, None, None).released is False, 'it began later'


def test_wait_by_the_wall_clock_ends_when_it_is_released(watch):
    deadline = ClockDeadline(watch, 3600 * SECOND, None)
    assert not deadline.is_over()
    watch.release()
    assert deadline.is_over()
    assert deadline.why_early == CLOSED


def test_guard_ends_a_wait_by_a_clock_that_stands_still(watch, clock):
    waiting, asked = (ClockDeadline(watch, 2 * SECOND, guard_s) for guard_s in (0.02, 0.0))
    assert asked.is_over()
    assert asked.why_early == GUARDED
    assert waiting.wait(threading.Event()) is False
    begin, seconds, end = waiting.why_early.partition(' s of wall time')
    assert begin.startswith('Given up after ')
    assert 0.02 <= float(begin.split()[-1]) < PATIENCE_S
    assert begin + seconds + end == (f'{begin} s of wall time, the wall_guard: is any node '
                                     'publishing /clock?')
    assert waiting.elapsed_s() == 0.0, 'of simulated time'


def test_timeout_by_the_wall_clock_needs_no_reason(watch):
    deadline = ClockDeadline(watch, SECOND // 50, 3600.0)
    assert deadline.wait(threading.Event()) is False
    assert deadline.why_early == ''
    assert deadline.elapsed_s() >= 0.02
    assert deadline.wait(is_set()) is True


@pytest.mark.parametrize(('guard_s', 'stopped_s', 'simulated', 'reported'), [
    (0.02, 0.01, True, True), (0.02, 0.03, True, False), (0.02, 0.01, False, False)])
def test_clock_that_stands_still_is_reported_if_the_wait_is_long(
        watch, log, monkeypatch, guard_s, stopped_s, simulated, reported):
    monkeypatch.setattr(STOPPED_S, stopped_s)
    watch.use_clock(RosClock(simulated_clock(10.0) if simulated else ROSClock()))
    for _ in range(2):
        deadline = ClockDeadline(watch, SECOND // 50, guard_s)
        assert deadline.wait(threading.Event()) is False
        assert deadline.wait(is_set()) is True
    assert log().count('has stood still at 10.000000000 s') == reported
    assert watch.may_report is not reported


def test_what_wakes_a_deadline_is_called_once_when_time_reaches_it(watch, clock):
    calls, deadline = [], ClockDeadline(watch, SECOND, None)
    deadline.call(lambda: calls.append('first'))
    deadline.call(lambda: calls.append('second'))
    assert calls == []
    show(clock, 11.0)
    assert calls == ['second']
    deadline.call(lambda: calls.append('late'))
    assert calls == ['second', 'late']


@pytest.mark.parametrize(('early', 'blocked', 'cause', 'hint'), [
    (False, (('base', 1),), '', 'its own'), (False, (('base', 1),), 'no spin', 'no spin'),
    (False, None, 'no spin', 'its own'), (False, (), 'no spin', 'no spin'),
    (True, (('base', 1),), 'no spin', CLOSED), (True, None, 'no spin', CLOSED),
    (True, None, '', CLOSED)])
def test_hint_of_the_error_with_which_a_wait_ends(watch, early, blocked, cause, hint):
    deadline = ClockDeadline(watch, SECOND, None, why_nothing_arrives=lambda: cause)
    if early:
        watch.release()
    assert deadline.is_over() is early
    error = LookupException('no transform', hint='its own', blocked_on=blocked)
    deadline.explain(error)
    assert error.hint == hint


def test_deadline_knows_no_cause_by_itself(watch):
    error = LookupException('no transform', hint='its own', blocked_on=(('base', 1),))
    ClockDeadline(watch, SECOND, None).explain(error)
    assert error.hint == 'its own'


# --- alarms


class Sleeper:
    """Notes its name when its time is over; keeps its deadline, as a wait does."""

    def __init__(self, rung, name, deadline=None):
        self.rung, self.name, self.deadline = rung, name, deadline

    def expire(self):
        self.rung.append((self.name, threading.current_thread()))


@pytest.fixture
def alarms(watch):
    """Return alarms, whose thread ends with the test."""
    alarms = Alarms(watch, lambda: None)
    yield alarms
    until(lambda: not [each for each in threading.enumerate() if alarms.run_in(each)])


@pytest.fixture
def at_once(monkeypatch):
    """Let the thread of the alarms end as soon as no alarm is left."""
    monkeypatch.setattr('tf_tree_py.ros.waiting.deadlines.LINGER_S', 0.0)


def in_ms(watch, milliseconds):
    return ClockDeadline(watch, milliseconds * STEP, None)


@pytest.mark.usefixtures('at_once')
def test_alarms_ring_in_the_order_of_their_ends_in_one_thread(watch, alarms):
    rung = []
    # The first is not due for long: the others are earlier than what the thread waits for.
    sleepers = {each: Sleeper(rung, each) for each in (3_600_000, 40, 20, 60, 30, 50)}
    numbers = [alarms.add(sleeper, in_ms(watch, each)) for each, sleeper in sleepers.items()]
    assert len(set(numbers)) == 6
    until(lambda: len(rung) == 5)
    assert [name for name, _ in rung] == [20, 30, 40, 50, 60]
    [thread] = {thread for _, thread in rung}
    assert alarms.run_in(thread) is True
    assert alarms.run_in(threading.current_thread()) is False
    assert thread.daemon and thread.name == 'tf_tree_py alarms'
    assert len(alarms) == 1
    alarms.forget(numbers[0])
    alarms.forget(numbers[0])
    assert len(alarms) == 0
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    assert not alarms.run_in(thread)
    again = Sleeper(rung, 'again')
    alarms.add(again, in_ms(watch, 1))
    until(lambda: rung[-1][0] == 'again')
    assert len(rung) == 6
    assert rung[-1][1] is not thread


@pytest.mark.usefixtures('at_once')
def test_alarm_rings_at_its_simulated_time_or_its_guard(watch, clock, alarms):
    rung = []
    limits = [(2, None), (1, 3600.0), (3, None), (9, 0.05)]
    sleepers = [Sleeper(rung, number, ClockDeadline(watch, seconds * SECOND, guard_s))
                for number, (seconds, guard_s) in enumerate(limits)]
    for each in sleepers:
        alarms.add(each, each.deadline)
    until(lambda: len(rung) == 1)
    assert rung[0][0] == 3
    show(clock, 11.0)
    until(lambda: len(rung) == 2)
    show(clock, 12.5)
    until(lambda: len(rung) == 3)
    assert [name for name, _ in rung] == [3, 1, 0]
    watch.release()
    until(lambda: len(rung) == 4)
    assert rung[3][0] == 2
    assert len(alarms) == 0


@pytest.mark.usefixtures('at_once')
def test_alarm_that_was_cancelled_or_has_no_owner_rings_no_more(watch, clock, alarms):
    rung = []
    sleepers = [Sleeper(rung, number, ClockDeadline(watch, SECOND, None)) for number in range(4)]
    numbers = [alarms.add(each, each.deadline) for each in sleepers]
    alarms.forget(numbers[1])
    deadline = sleepers.pop(2).deadline
    assert len(alarms) == 3
    show(clock, 12.0)
    assert deadline.is_over()
    until(lambda: len(alarms) == 0 and len(rung) == 2)
    assert [name for name, _ in rung] == [0, 3]


@pytest.mark.usefixtures('at_once')
def test_sleeper_that_raises_anything_keeps_no_other_from_being_called(watch, alarms, log):
    class Failing(Sleeper):

        def expire(self):
            super().expire()
            raise SystemExit(self.name)

    rung = []
    sleepers = [Failing(rung, 1), Failing(rung, 2), Sleeper(rung, 3)]
    for each in sleepers:
        alarms.add(each, in_ms(watch, 30))
    until(lambda: len(rung) == 3)
    [thread] = {thread for _, thread in rung}
    thread.join(PATIENCE_S)
    assert log().count('a callback after a timeout failed:') == 1, 'and the other one is counted'
    assert 'SystemExit: 1' in log()


@pytest.mark.usefixtures('at_once')
def test_thread_that_has_failed_is_replaced(watch, monkeypatch):
    failures, raised, rung = [ValueError('first')], [], []
    monkeypatch.setattr(threading, 'excepthook', lambda error: raised.append(error.exc_value))

    def on_wake():
        if failures:
            raise failures.pop()

    alarms, sleeper = Alarms(watch, on_wake), Sleeper([], 'never')
    number = alarms.add(sleeper, in_ms(watch, 3_600_000))
    until(lambda: raised)
    assert str(raised[0]) == 'first'
    second = Sleeper(rung, 'second')
    alarms.add(second, in_ms(watch, 1))
    until(lambda: rung)
    alarms.forget(number)
    rung[0][1].join(PATIENCE_S)
    assert not rung[0][1].is_alive()


@pytest.mark.usefixtures('at_once')
def test_thread_calls_back_each_time_it_wakes(watch):
    woken, sleeper = threading.Semaphore(0), Sleeper([], 'never')
    alarms = Alarms(watch, woken.release)
    alarms.ring()
    assert not woken.acquire(blocking=False), 'there is no thread'
    number = alarms.add(sleeper, in_ms(watch, 3_600_000))
    assert woken.acquire(timeout=PATIENCE_S)
    for _ in range(3):
        # An earlier ring may still be on its way; each of these is followed by a call.
        alarms.ring()
        assert woken.acquire(timeout=PATIENCE_S)
    alarms.forget(number)
    until(lambda: not [each for each in threading.enumerate() if alarms.run_in(each)])


@pytest.mark.usefixtures('at_once')
def test_earlier_alarm_wakes_the_thread_that_sleeps_for_later_ones(watch):
    rung, woken = [], threading.Semaphore(0)
    alarms = Alarms(watch, woken.release)
    sleepers = [Sleeper(rung, each) for each in (3_600_000, 3_700_000, 5)]
    numbers = []
    for each in sleepers:
        numbers.append(alarms.add(each, in_ms(watch, each.name)))
        if len(numbers) == 1:
            assert woken.acquire(timeout=PATIENCE_S)
    until(lambda: rung)
    assert rung[0][0] == 5
    for number in numbers:
        alarms.forget(number)
    rung[0][1].join(PATIENCE_S)
    assert not rung[0][1].is_alive()


@pytest.mark.usefixtures('at_once')
@pytest.mark.filterwarnings('ignore:This process .* is multi-threaded:DeprecationWarning')
def test_child_of_a_fork_starts_a_thread_of_its_own(watch, alarms):
    rung, late = threading.Event(), Sleeper([], 'late')

    class Soon:
        expire = rung.set

    soon = Soon()
    number = alarms.add(late, in_ms(watch, 3_600_000))
    child = os.fork()
    if not child:
        alarms.add(soon, in_ms(watch, 1))
        os._exit(not rung.wait(PATIENCE_S))
    assert os.waitpid(child, 0)[1] == 0
    alarms.forget(number)


@pytest.mark.usefixtures('at_once')
@pytest.mark.parametrize(('guard_s', 'stopped_s', 'simulated', 'reported'), [
    (0.05, 0.01, True, True), (0.02, 3600.0, True, False), (None, 0.01, True, True),
    (None, 0.01, False, False)])
def test_thread_reports_a_clock_that_stands_still(
        watch, alarms, log, monkeypatch, guard_s, stopped_s, simulated, reported):
    monkeypatch.setattr(STOPPED_S, stopped_s)
    watch.use_clock(RosClock(simulated_clock(10.0)))
    rung = []
    sleeper = Sleeper(rung, 'a')
    number = alarms.add(sleeper, ClockDeadline(watch, SECOND // 20, guard_s,
                                               by_wall=not simulated))
    until(lambda: rung or (reported and 'stood still' in log()))
    alarms.forget(number)
    assert log().count('has stood still at 10.000000000 s') == reported
    assert watch.may_report is not reported


@pytest.mark.usefixtures('at_once')
def test_ten_thousand_cancelled_alarms_take_no_memory(watch, alarms):
    rung = []
    sleeper = Sleeper(rung, 'a')
    first = alarms.add(sleeper, in_ms(watch, 3_500_000))

    def turn(count):
        for _ in range(count):
            alarms.forget(alarms.add(sleeper, in_ms(watch, 3_600_000)))

    turn(100)
    gc.collect()
    blocks = sys.getallocatedblocks()
    turn(10_000)
    assert sys.getallocatedblocks() - blocks < 3_000
    assert len(alarms) == 1
    alarms.forget(first)
    assert len(alarms) == 0


@pytest.mark.usefixtures('at_once')
def test_ten_thousand_alarms_that_rang_in_simulated_time_take_no_memory(watch, clock, alarms):
    rung = deque(maxlen=1)

    def turns(seconds):
        for second in seconds:
            sleepers = [Sleeper(rung, 'a', ClockDeadline(watch, SECOND // 2, None))
                        for _ in range(500)]
            for each in sleepers:
                alarms.add(each, each.deadline)
            show(clock, second)
            until(lambda: len(alarms) == 0)

    turns(range(11, 13))
    gc.collect()
    blocks = sys.getallocatedblocks()
    turns(range(13, 33))
    gc.collect()
    assert sys.getallocatedblocks() - blocks < 3_000
