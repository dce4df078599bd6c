# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The clock of a buffer: rclpy's real clocks, set by hand."""

import gc
import itertools
import sys
import threading
import time
import weakref

import pytest
from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.time import Time
from ros_helpers import lasting, LATEST, PATIENCE, PATIENCE_S, transform, until, until_waiting
from tf_tree_py import Buffer, ClockJumpException, LookupException, TransformException
from tf_tree_py.ros.waiting.clock import ClockDeadline, ClockWatch

SECOND = 1_000_000_000


def sim_clock(seconds=10.0):
    clock = ROSClock()
    clock._set_ros_time_is_active(True)
    show(clock, seconds)
    return clock


def show(clock, seconds):
    clock.set_ros_time_override(
        Time(nanoseconds=round(seconds * SECOND), clock_type=ClockType.ROS_TIME))


class Jumps:

    def __init__(self):
        self.seen = []

    def on_jump(self, jump):
        self.seen.append(jump.delta.nanoseconds)


@pytest.fixture
def jumps():
    return Jumps()


@pytest.fixture
def watch(jumps):
    return ClockWatch(jumps.on_jump)


def wait_in(pool, deadline, event=None):
    return pool.submit(deadline.wait, event or threading.Event())


def until_asleep(watch, count=1):
    until(lambda: len(watch._sleepers) == count)


@pytest.mark.parametrize('clock', [
    None, ROSClock(), Clock(clock_type=ClockType.SYSTEM_TIME),
    Clock(clock_type=ClockType.STEADY_TIME)])
def test_time_that_is_not_simulated_is_the_walls(watch, clock):
    if clock is not None:
        watch.use_clock(clock)
    assert watch.simulated_now() is None
    deadline = ClockDeadline(watch, SECOND // 50, None)
    begin = time.monotonic()
    assert deadline.wait(threading.Event()) is False
    assert time.monotonic() - begin >= 0.02
    assert 0.02 <= deadline.elapsed_s() < PATIENCE_S
    assert deadline.why_early == ''


def test_event_ends_a_wait_by_the_wall(watch, pool):
    event = threading.Event()
    waiting = wait_in(pool, ClockDeadline(watch, 3600 * SECOND, None), event)
    until_asleep(watch)
    event.set()
    assert waiting.result(PATIENCE_S) is True


def test_simulated_time_out_is_at_the_clocks_own_pace(watch, pool):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    deadline = ClockDeadline(watch, 2 * SECOND, None)
    waiting = wait_in(pool, deadline)
    until_asleep(watch)
    show(clock, 11.0)
    show(clock, 11.999999999)
    assert not waiting.done()
    assert len(watch._sleepers) == 1
    show(clock, 12.0)
    assert waiting.result(PATIENCE_S) is True, 'there is reason to look again'
    assert deadline.wait(threading.Event()) is False
    assert deadline.elapsed_s() == 2.0
    assert deadline.why_early == ''


def test_time_that_is_up_does_not_hide_what_has_arrived(watch):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    deadline = ClockDeadline(watch, SECOND, None)
    show(clock, 20.0)
    arrived = threading.Event()
    arrived.set()
    assert deadline.wait(arrived) is True


def test_clock_that_stands_still_times_out_by_the_guard_alone(watch):
    watch.use_clock(sim_clock(10.0))
    deadline = ClockDeadline(watch, SECOND, 0.02)
    assert deadline.wait(threading.Event()) is False
    assert deadline.elapsed_s() == 0.0
    assert 'of wall time, the wall_guard: is any node publishing /clock?' in deadline.why_early


def test_guard_does_not_lengthen_a_time_out(watch):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    deadline = ClockDeadline(watch, SECOND, 3600.0)
    show(clock, 11.0)
    assert deadline.wait(threading.Event()) is False
    assert deadline.why_early == ''


def test_tick_wakes_everybody_whose_time_is_up(watch):
    """In rclpy, unregistering a handle during a tick skips others, with a thread switch there."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        clock = sim_clock(0.5)
        watch.use_clock(clock)
        for turn in range(10):
            deadlines = [ClockDeadline(watch, SECOND, None) for _ in range(40)]

            def wait_out(deadline):
                event = threading.Event()
                while deadline.wait(event):
                    event.clear()

            threads = [threading.Thread(target=wait_out, args=(deadline,), daemon=True)
                       for deadline in deadlines]
            for thread in threads:
                thread.start()
            until_asleep(watch, 40)
            show(clock, 10.0 * (turn + 1))
            for thread in threads:
                thread.join(PATIENCE_S)
                assert not thread.is_alive()
    finally:
        sys.setswitchinterval(before)


@pytest.mark.parametrize(('times', 'told'), [
    ((11.0, 12.0, 100.0), []),
    ((9.0,), [-SECOND]),
    ((11.0, 10.999999999), [-1]),
    ((0.0, 5.0, 4.0), [-10 * SECOND, -SECOND]),
])
def test_only_jumps_back_are_told(watch, jumps, times, told):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    for seconds in times:
        show(clock, seconds)
    assert jumps.seen == told


def test_change_of_the_kind_of_time_is_told(watch, jumps):
    clock = ROSClock()
    watch.use_clock(clock)
    clock._set_ros_time_is_active(True)
    clock._set_ros_time_is_active(False)
    assert len(jumps.seen) == 2


def test_newest_clock_counts_and_the_one_before_when_it_leaves(watch, jumps):
    first, second = sim_clock(10.0), sim_clock(20.0)
    watch.use_clock(first)
    watch.use_clock(second)
    assert watch.simulated_now() == 20 * SECOND
    show(first, 1.0)
    assert jumps.seen == []
    watch.leave(second)
    assert watch.simulated_now() == SECOND
    show(second, 1.0)
    show(first, 0.5)
    assert jumps.seen == [-SECOND // 2]
    watch.leave(first)
    assert watch.simulated_now() is None
    show(first, 0.1)
    assert len(jumps.seen) == 1


def test_clock_that_is_lent_twice_is_left_twice(watch):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    watch.use_clock(clock)
    watch.leave(clock)
    assert watch.simulated_now() == 10 * SECOND
    watch.leave(clock)
    assert watch.simulated_now() is None


def test_sleeper_goes_by_another_clock_when_his_leaves(watch, pool):
    first, second = sim_clock(10.0), sim_clock(10.0)
    watch.use_clock(first)
    watch.use_clock(second)
    deadline = ClockDeadline(watch, SECOND, None)
    waiting = wait_in(pool, deadline)
    until_asleep(watch)
    watch.leave(second)
    assert waiting.result(PATIENCE_S) is True
    waiting = wait_in(pool, deadline)
    until_asleep(watch)
    show(first, 11.0)
    assert waiting.result(PATIENCE_S) is True
    assert deadline.wait(threading.Event()) is False


def test_sleeper_gives_up_when_no_clock_is_left(watch, pool):
    clock = sim_clock(10.0)
    watch.use_clock(clock)
    deadline = ClockDeadline(watch, SECOND, None)
    waiting = wait_in(pool, deadline)
    until_asleep(watch)
    watch.leave(clock)
    assert waiting.result(PATIENCE_S) is True
    assert deadline.wait(threading.Event()) is False
    assert deadline.elapsed_s() < PATIENCE_S


def test_clock_whose_context_has_ended_counts_no_more(watch, context):
    watch.use_clock(sim_clock(10.0), context)
    assert watch.simulated_now() == 10 * SECOND
    context.shutdown()
    assert watch.simulated_now() is None


def test_release_ends_the_waits_that_have_begun(watch, pool):
    watch.use_clock(sim_clock(10.0))
    deadline = ClockDeadline(watch, SECOND, None)
    waiting = wait_in(pool, deadline)
    until_asleep(watch)
    watch.release()
    assert waiting.result(PATIENCE_S) is True
    assert deadline.wait(threading.Event()) is False
    assert deadline.why_early.startswith('Given up: the listener was closed')
    later = wait_in(pool, ClockDeadline(watch, SECOND, None))
    until_asleep(watch)
    assert not later.done()
    watch.release()
    later.result(PATIENCE_S)


def test_clock_may_outlive_its_watch(jumps):
    """Its C code keeps a bare pointer to the jump handle, so without unregistering it crashes."""
    clock = sim_clock(10.0)
    watch = ClockWatch(jumps.on_jump)
    watch.use_clock(clock)
    gone = weakref.ref(watch)
    del watch
    gc.collect()
    assert gone() is None
    rubbish = [bytearray(64) for _ in range(10_000)]
    show(clock, 5.0)
    show(clock, 6.0)
    assert jumps.seen == []
    del rubbish


def test_clock_may_outlive_its_buffer():
    clock = sim_clock(10.0)
    buffer = Buffer()
    buffer.use_clock(clock)
    gone = weakref.ref(buffer)
    del buffer
    gc.collect()
    assert gone() is None
    show(clock, 1.0)


# --- the buffer on such a clock


def test_jump_back_forgets_what_moves_and_keeps_statics_and_names():
    clock = sim_clock(10.0)
    buffer = Buffer()
    buffer.use_clock(clock)
    buffer.set_transform(transform('map', 'base', 10.0), 'me')
    buffer.set_transform_static(transform('base', 'camera'), 'me')
    show(clock, 11.0)
    assert buffer.can_transform('map', 'camera', LATEST)
    show(clock, 3.0)
    assert not buffer.can_transform('map', 'base', LATEST)
    assert buffer.can_transform('base', 'camera', LATEST)
    assert set(buffer.frames()) == {'map', 'base', 'camera'}
    assert buffer.set_transform(transform('map', 'base', 3.0), 'me'), 'older, but accepted'


def test_jump_back_fails_all_who_wait(pool):
    clock = sim_clock(10.0)
    buffer = Buffer()
    buffer.use_clock(clock)
    asked = [pool.submit(buffer.lookup_transform, 'a', f'b{i}', LATEST, PATIENCE)
             for i in range(4)]
    until_waiting(buffer, 4)
    show(clock, 4.0)
    for future in asked:
        with pytest.raises(ClockJumpException, match=r'jumped by -6\.000 s') as raised:
            future.result(PATIENCE_S)
        assert 'Given up' not in str(raised.value)


def test_wall_guard_of_a_buffer_is_told_in_the_error():
    buffer = Buffer(wall_guard=lasting(0.02))
    buffer.use_clock(sim_clock(10.0))
    with pytest.raises(LookupException, match=r'Given up after \d+\.\d{3} s of wall time'):
        buffer.lookup_transform('a', 'b', LATEST, lasting(0.001))


def test_many_jump_back_while_many_ask():
    """No deadlock between jump callbacks, insertions and lookups, and no torn result."""
    clock = sim_clock(10.0)
    buffer = Buffer()
    buffer.use_clock(clock)
    stop = threading.Event()
    failures = []

    def ask():
        while not stop.is_set():
            try:
                found = buffer.lookup_transform('map', 'base', LATEST, lasting(0.5))
                if found.transform.translation.x != found.header.stamp.sec:
                    failures.append(found)
            except TransformException:
                pass
            except Exception as error:
                failures.append(error)

    def insert():
        second = 10
        while not stop.is_set():
            second = 10 + (second + 1) % 1000
            buffer.set_transform(transform('map', 'base', second, x=float(second)), 'me')

    threads = [threading.Thread(target=ask) for _ in range(4)]
    threads.append(threading.Thread(target=insert))
    for thread in threads:
        thread.start()
    for turn in range(300):
        show(clock, 10.0 + turn % 7)
    stop.set()
    seconds = itertools.count(1000)
    until(lambda: show(clock, next(seconds)) or not any(map(threading.Thread.is_alive, threads)))
    assert failures == []
