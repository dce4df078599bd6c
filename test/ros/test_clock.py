# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The clock of a buffer: rclpy's real clocks, set by hand."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import gc
import itertools
import threading
import weakref

import pytest
from rclpy.clock import Clock, ClockChange, ROSClock, TimeJump
from rclpy.clock_type import ClockType
from rclpy.time_source import TimeSource
from ros_helpers import at, lasting, LATEST, PATIENCE_S, simulated_clock, transform, until
from tf_tree_py import Buffer, TransformException
from tf_tree_py.ros.waiting.clock import ClockWatch, RosClock
from tf_tree_py.ros.waiting.deadlines import ClockDeadline

SECOND = 1_000_000_000


def show(clock, seconds):
    clock.set_ros_time_override(at(seconds))


@pytest.fixture
def jumps():
    """Return the lengths of the jumps that a watch reports."""
    return []


@pytest.fixture
def watch(jumps):
    return ClockWatch(lambda jump: jumps.append(jump.delta.nanoseconds))


@pytest.fixture
def clock(watch):
    """Return a simulated clock at 10 s, which the watch uses."""
    clock = simulated_clock(10.0)
    watch.use_clock(RosClock(clock))
    return clock


@pytest.fixture
def fall_asleep(watch, pool):
    """Let a thread wait for a deadline; return its future when it sleeps."""
    def begin(deadline, event=None):
        waiting = pool.submit(deadline.wait, event or threading.Event())
        until_asleep(watch)
        return waiting

    return begin


def until_asleep(watch, count=1):
    until(lambda: len(watch._sleepers) == count)


@pytest.mark.parametrize('clock', [
    None, ROSClock(), Clock(clock_type=ClockType.SYSTEM_TIME),
    Clock(clock_type=ClockType.STEADY_TIME)])
def test_time_that_is_not_simulated_is_the_walls(watch, fall_asleep, clock):
    if clock is not None:
        watch.use_clock(RosClock(clock))
    assert watch.simulated_now() is None
    deadline = ClockDeadline(watch, SECOND // 50, None)
    assert deadline.wait(threading.Event()) is False
    assert 0.02 <= deadline.elapsed_s() < PATIENCE_S
    assert deadline.why_early == ''
    event = threading.Event()
    waiting = fall_asleep(ClockDeadline(watch, 3600 * SECOND, None), event)
    event.set()
    assert waiting.result(PATIENCE_S) is True


@pytest.mark.parametrize('guard_s', [None, 3600.0])
def test_simulated_timeout_is_at_the_clocks_own_pace(watch, clock, fall_asleep, guard_s):
    deadline = ClockDeadline(watch, 2 * SECOND, guard_s)
    waiting = fall_asleep(deadline)
    show(clock, 11.0)
    show(clock, 11.999999999)
    assert not waiting.done()
    show(clock, 12.0)
    assert waiting.result(PATIENCE_S) is True, 'there is reason to look again'
    event = threading.Event()
    assert deadline.wait(event) is False
    assert deadline.elapsed_s() == 2.0
    assert deadline.why_early == ''
    # The end of the time does not hide what has arrived.
    event.set()
    assert deadline.wait(event) is True


def test_tick_wakes_everybody_whose_time_is_up(watch, switching_often):
    """In rclpy, unregistering a handle during a tick skips others, with a thread switch there."""
    def wait_out(deadline):
        event = threading.Event()
        while deadline.wait(event):
            event.clear()

    clock = simulated_clock(0.5)
    watch.use_clock(RosClock(clock))
    with ThreadPoolExecutor(40) as threads:
        try:
            for turn in range(10):
                waits = [threads.submit(wait_out, ClockDeadline(watch, SECOND, None))
                         for _ in range(40)]
                until_asleep(watch, 40)
                show(clock, 10.0 * (turn + 1))
                for wait in waits:
                    wait.result(PATIENCE_S)
        finally:
            watch.release()


@pytest.mark.parametrize(('times', 'expected'), [
    ((11.0, 12.0, 100.0), []),
    ((9.0,), [-SECOND]),
    ((11.0, 10.000000001, 10.999999999, 10.2), []),
    ((9.5, 9.0, 8.5), [-SECOND]),  # by small steps, of which tf2 sees none
    ((10.9, 10.0, 11.8, 10.9, 10.7), [-11 * SECOND // 10]),
    ((0.0, 5.0, 4.0, 3.5), [-10 * SECOND, -SECOND]),
])
def test_jumps_back_are_reported(clock, jumps, times, expected):
    for seconds in times:
        show(clock, seconds)
    assert jumps == expected


def test_changes_of_the_kind_of_time_are_reported(watch, jumps):
    clock, source = ROSClock(), TimeSource()
    source.attach_clock(clock)
    watch.use_clock(RosClock(clock))
    for count, simulated in enumerate((True, False, True), 1):
        source.ros_time_is_active = simulated
        assert len(jumps) == count


@pytest.mark.parametrize(('limit', 'expected'), [
    (0, [-1, -SECOND]), (1, [-1, -SECOND]), (2, [-SECOND - 1]), (2 * SECOND, [])])
def test_limit_of_a_step_back_can_be_chosen(limit, expected):
    jumps = []
    watch = ClockWatch(lambda jump: jumps.append(jump.delta.nanoseconds), limit)
    clock = simulated_clock(10.0)
    watch.use_clock(RosClock(clock))
    show(clock, 9.999999999)
    show(clock, 8.999999999)
    assert jumps == expected


def test_newest_clock_counts_and_the_one_before_when_it_leaves(watch, jumps):
    first, second = simulated_clock(10.0), simulated_clock(20.0)
    for clock in (first, second, second):
        watch.use_clock(RosClock(clock))
    # Who lends a clock twice has to take it back twice.
    watch.leave(RosClock(second))
    assert watch.simulated_now() == 20 * SECOND
    show(first, 3.0)
    assert jumps == []
    watch.leave(RosClock(second))
    assert watch.simulated_now() == 3 * SECOND
    show(second, 1.0)
    show(first, 0.5)
    assert jumps == [-5 * SECOND // 2]
    watch.leave(RosClock(first))
    assert watch.simulated_now() is None
    show(first, 0.1)
    assert len(jumps) == 1


def test_tick_of_a_clock_that_another_thread_has_just_replaced_is_no_jump_back(
        watch, jumps, monkeypatch):
    first, ticks, register = simulated_clock(100.0), [], ROSClock.create_jump_callback
    with monkeypatch.context() as patched:
        patched.setattr(ROSClock, 'create_jump_callback', lambda *clock, **callbacks: (
            ticks.append(callbacks['post_callback']), register(*clock, **callbacks))[1])
        watch.use_clock(RosClock(first))
    watch.use_clock(RosClock(simulated_clock(0.0)))
    show(first, 10.0)
    ticks[0](TimeJump(ClockChange.ROS_TIME_NO_CHANGE, lasting(-90.0)))
    assert jumps == []


class LeftMeanwhile(ClockWatch):
    """A watch whose clock leaves, in another thread, each time just after it was read."""

    leaves = False

    @property
    def _followed(self):
        followed = self.followed
        if self.leaves:
            self.followed = None
        return followed

    @_followed.setter
    def _followed(self, followed):
        self.followed = followed


@pytest.mark.parametrize(('ask', 'expected'), [
    (ClockWatch.simulated_now, 10 * SECOND), (ClockWatch.has_ended, False),
    (lambda watch: watch.clock.now().nanoseconds, 10 * SECOND)])
def test_clock_that_leaves_while_it_is_read_is_no_error(ask, expected):
    watch = LeftMeanwhile(lambda jump: None)
    watch.use_clock(RosClock(simulated_clock(10.0)))
    watch.leaves = True
    assert ask(watch) == expected


def test_sleeper_goes_by_another_clock_when_his_leaves(watch, clock, fall_asleep):
    second = simulated_clock(10.0)
    watch.use_clock(RosClock(second))
    deadline, hopeless = (ClockDeadline(watch, seconds * SECOND, None) for seconds in (1, 9))
    waiting = fall_asleep(deadline)
    watch.leave(RosClock(second))
    assert not waiting.done()
    show(second, 11.0)
    assert not waiting.done()
    show(clock, 11.0)
    assert waiting.result(PATIENCE_S) is True
    assert deadline.wait(threading.Event()) is False
    waiting = fall_asleep(hopeless)
    watch.leave(RosClock(clock))
    assert waiting.result(PATIENCE_S) is True
    assert hopeless.wait(threading.Event()) is False, 'no clock is left'
    assert hopeless.elapsed_s() < PATIENCE_S


def test_clock_whose_context_has_ended_counts_no_more(watch, context):
    watch.use_clock(RosClock(simulated_clock(10.0), context))
    assert watch.simulated_now() == 10 * SECOND
    deadline = ClockDeadline(watch, SECOND, None)
    context.shutdown()
    assert watch.simulated_now() is None
    # Also before the listener has noticed it, and releases the waits.
    assert deadline.wait(threading.Event()) is False
    assert deadline.why_early == 'Given up: the listener was closed, or ROS was shut down'


@pytest.mark.parametrize('make', [lambda: ClockWatch(print), Buffer], ids=['watch', 'buffer'])
def test_clock_may_outlive_who_uses_it(make, capsys):
    """Its C code keeps a bare pointer to the jump handle, so without unregistering it crashes."""
    clock = simulated_clock(10.0)
    user = make()
    user.use_clock(RosClock(clock) if isinstance(user, ClockWatch) else clock)
    gone = weakref.ref(user)
    del user
    gc.collect()
    assert gone() is None
    rubbish = [bytearray(64) for _ in range(10_000)]
    show(clock, 5.0)
    show(clock, 6.0)
    assert capsys.readouterr().out == '', 'no jump is reported'
    del rubbish


def lend(buffer, early, late):
    buffer.use_clock(late.clock)
    yield
    buffer.use_clock(early.clock)


def begin_to_listen(buffer, early, late):
    buffer.feeds.begin(late)
    yield
    buffer.feeds.begin(early)


def end_to_listen(buffer, early, late):
    buffer.feeds.begin(early)
    buffer.feeds.begin(late)
    yield
    buffer.feeds.end(late)


@pytest.mark.parametrize('follow', [lend, begin_to_listen, end_to_listen])
def test_stamps_are_compared_with_the_clock_that_is_followed_now(follow):
    buffer = Buffer(max_future=lasting(1.0))
    early, late = (RosClock(simulated_clock(seconds)) for seconds in (10.0, 1000.0))
    following = follow(buffer, early, late)
    next(following)
    assert buffer.set_transform(transform('map', 'base', 1000), 'me')
    next(following, None)
    assert not buffer.set_transform(transform('map', 'arm', 900), 'me')
    assert buffer.set_transform(transform('map', 'arm', 11), 'me')


def test_many_jump_back_while_many_ask(pool):
    """No deadlock between jump callbacks, insertions and lookups, and no torn result."""
    clock, buffer = simulated_clock(10.0), Buffer()
    buffer.use_clock(clock)
    stop = threading.Event()

    def ask():
        while not stop.is_set():
            with suppress(TransformException):
                found = buffer.lookup_transform('map', 'base', LATEST, lasting(0.5))
                assert found.transform.translation.x == found.header.stamp.sec

    def insert():
        for second in itertools.cycle(range(10, 1010)):
            buffer.set_transform(transform('map', 'base', second, x=float(second)), 'me')
            if stop.is_set():
                break

    running = [pool.submit(each) for each in (ask, ask, ask, ask, insert)]
    try:
        for turn in range(300):
            show(clock, 10.0 + turn % 7)
    finally:
        stop.set()
    seconds = itertools.count(1000)
    until(lambda: show(clock, next(seconds)) or all(each.done() for each in running))
    for each in running:
        each.result()
