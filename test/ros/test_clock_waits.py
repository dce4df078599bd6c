# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a watch of the clock calls, when, and in which order: beside a naive version of it."""

import gc
import os
import random
import sys

import pytest
from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.time import Time
from rclpy.time_source import TimeSource
from ros_helpers import at, simulated_clock
from tf_tree_py.ros.waiting.clock import ClockWatch, RosClock

SECOND = 1_000_000_000


class Noted:
    """Notes in a list when it is started and reached."""

    def __init__(self, calls, name):
        self.calls, self.name = calls, name

    def start(self, now):
        self.calls.append(('start', self.name, now))

    def reach(self, now):
        self.calls.append(('reach', self.name, now))


class SetByHand:
    """A clock of simulated time, which can also be switched to the system's time."""

    def __init__(self, nanoseconds):
        self.ros, self.source, self.now = ROSClock(), TimeSource(), nanoseconds
        self.source.attach_clock(self.ros)
        self.source.ros_time_is_active = True
        self.simulated = True
        self.show(nanoseconds)

    def show(self, nanoseconds):
        self.now = nanoseconds
        self.ros.set_ros_time_override(
            Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME))

    def switch(self, simulated):
        self.simulated = self.source.ros_time_is_active = simulated

    def read(self):
        return self.now if self.simulated else None


class NaiveWatch:
    """What a ``ClockWatch`` should call; it looks at everything each time."""

    def __init__(self, limit):
        self.limit, self.calls, self.clocks, self.newest = max(limit, 1), [], [], 0
        self.waits = []  # lists of a name, a timeout, an end, and a number of its start

    def now(self):
        return self.clocks[-1].read() if self.clocks else None

    def begin(self, name, timeout):
        if self.now() is not None and timeout is not None:
            self.waits.append([name, timeout, None, None])
            self.start(silently=True)

    def start(self, silently=False):
        for wait in self.waits:
            if wait[2] is None and self.now():
                number = max([0, *(each[3] for each in self.waits if each[3] is not None)])
                wait[2:] = self.now() + wait[1], number + 1
                if not silently:
                    self.calls.append(('start', wait[0], self.now()))

    def reach(self, now):
        if now is None:
            due = [each for each in self.waits if each[2] is None]
            due += sorted((each for each in self.waits if each[2] is not None),
                          key=lambda each: each[2:])
        else:
            self.start()
            due = sorted((each for each in self.waits if each[2] is not None and each[2] <= now),
                         key=lambda each: each[2:])
        self.waits = [each for each in self.waits if each not in due]
        self.calls += [('reach', each[0], now) for each in due]

    def follow(self):
        self.newest = self.now() or 0
        self.reach(self.now())

    def tick(self):
        now = self.now()
        if now <= self.newest - self.limit:
            self.calls.append(('jump', now - self.newest))
            self.newest = now
        self.newest = max(self.newest, now)
        self.reach(now)

    def change(self):
        self.calls.append(('jump', 'another kind of time'))
        self.newest = self.now() or 0
        self.reach(self.now())


ACTIONS = ['tick'] * 6 + ['begin'] * 5 + ['drop', 'use', 'leave', 'switch', 'release']
STEPS = [0, 1, 1, 2, 3, 5, 8, 20, -1, -1, -2, -3, -7, -30]


@pytest.mark.parametrize('limit', [0, 1, 2, 5])
def test_watch_calls_what_a_naive_one_would_call(limit):
    for seed in range(60):
        draw, calls = random.Random(seed), []

        def note_jump(jump, calls=calls):
            changed = 'NO_CHANGE' not in jump.clock_change.name
            calls.append(('jump', 'another kind of time' if changed else jump.delta.nanoseconds))

        watch, naive = ClockWatch(note_jump, limit), NaiveWatch(limit)
        clocks = [SetByHand(nanoseconds) for nanoseconds in (0, 0, 40)]
        alive = {}
        for number in range(80):
            used = naive.clocks[-1] if naive.clocks else None
            action = draw.choice(ACTIONS)
            if action == 'tick' and used is not None and used.simulated:
                before, now = used.now, max(used.now + draw.choice(STEPS), 0)
                used.show(now)
                if now != before:
                    naive.tick()
            elif action == 'tick':
                # A clock that is not in use, or that is not simulated, ends nothing.
                other = draw.choice(clocks)
                if other is not used and other.simulated:
                    other.show(draw.randrange(60))
            elif action == 'begin':
                timeout = draw.choice([None, 0, 1, 1, 2, 3, 5, 8, 13, 40])
                alive[number] = Noted(calls, number)
                assert watch.begin(alive[number], timeout) == naive.now()
                naive.begin(number, timeout)
            elif action == 'drop' and alive:
                dropped = draw.choice([*alive])
                del alive[dropped]
                naive.waits = [each for each in naive.waits if each[0] != dropped]
            elif action == 'use':
                clock = draw.choice(clocks)
                naive.clocks.append(clock)
                watch.use_clock(RosClock(clock.ros))
                naive.follow()
            elif action == 'leave' and naive.clocks:
                clock = draw.choice(naive.clocks)
                naive.clocks.remove(clock)
                watch.leave(RosClock(clock.ros))
                naive.follow()
            elif action == 'switch' and used is not None:
                used.switch(not used.simulated)
                if used.simulated:
                    used.now = used.ros.now().nanoseconds
                naive.change()
            elif action == 'release':
                watch.release()
                naive.reach(None)
            assert calls == naive.calls, (seed, number, action)
            used = naive.clocks[-1] if naive.clocks else None
            assert watch.simulated_now() == naive.now()
            assert watch.simulated == (naive.now() is not None)
            assert watch.clock is (None if used is None else used.ros)
            assert watch.has_ended() == (used is None)
        watch.release()
        naive.reach(None)
        assert calls == naive.calls


@pytest.mark.parametrize('clock_type', [ClockType.SYSTEM_TIME, ClockType.STEADY_TIME])
def test_clock_that_cannot_be_simulated_ends_no_wait(clock_type):
    calls, watch = [], ClockWatch(print)
    noted = Noted(calls, 'a')
    clock = simulated_clock(10.0)
    watch.use_clock(RosClock(clock))
    assert watch.begin(noted, SECOND) == 10 * SECOND
    watch.use_clock(RosClock(Clock(clock_type=clock_type)))
    assert calls == [('reach', 'a', None)], 'it ends, because its time comes no more'
    assert watch.begin(noted, SECOND) is None
    assert (watch.simulated, watch.simulated_now(), watch.has_ended()) == (False, None, False)


def test_tick_after_the_end_of_its_context_ends_the_waits_and_is_no_jump_back(context):
    calls, clock = [], simulated_clock(10.0)
    watch = ClockWatch(lambda jump: calls.append(jump))
    watch.use_clock(RosClock(clock, context))
    noted = Noted(calls, 'a')
    watch.begin(noted, SECOND)
    assert watch.has_ended() is False
    context.shutdown()
    assert watch.has_ended() is True
    clock.set_ros_time_override(at(5.0))
    assert calls == [('reach', 'a', None)]
    assert watch.clock is clock


def test_jump_back_that_fails_ends_the_waits_all_the_same():
    def fail(jump):
        raise ValueError('as a callback of a user')

    calls, clock, watch = [], simulated_clock(10.0), ClockWatch(fail)
    watch.use_clock(RosClock(clock))
    noted = Noted(calls, 'a')
    watch.begin(noted, -9 * SECOND)
    with pytest.raises(ValueError, match='as a callback of a user'):
        clock.set_ros_time_override(at(2.0))
    assert calls == [('reach', 'a', 2 * SECOND)]


@pytest.mark.parametrize('seconds', [0.0, 10.0], ids=['before the first time', 'later'])
def test_waits_that_nothing_refers_to_are_forgotten_long_before_their_end(seconds):
    """Those that are alive are not, whatever their number."""
    calls, clock, watch = [], simulated_clock(seconds), ClockWatch(print)
    watch.use_clock(RosClock(clock))
    for _ in range(200):
        watch.begin(Noted(calls, 'dropped'), 1000)
    alive = [Noted(calls, number) for number in range(50)]
    for each in alive:
        watch.begin(each, 1000)
    gc.collect()
    blocks = sys.getallocatedblocks()
    for _ in range(10_000):
        watch.begin(Noted(calls, 'dropped'), 1000)
    assert sys.getallocatedblocks() - blocks < 3_000
    for number in range(50, 500):
        alive.append(Noted(calls, number))
        watch.begin(alive[-1], 1000)
    clock.set_ros_time_override(at(100.0))
    clock.set_ros_time_override(at(200.0))
    assert [name for what, name, _ in calls if what == 'reach'] == [*range(500)]


def test_waits_end_in_the_order_of_their_ends_although_others_were_dropped():
    calls, clock, watch = [], simulated_clock(10.0), ClockWatch(print)
    watch.use_clock(RosClock(clock))
    ends = random.Random(5).sample(range(1, 100_000), 600)
    waits = {}
    for number, end in enumerate(ends):
        waits[end] = Noted(calls, end)
        watch.begin(waits[end], end)
        if number % 2:
            del waits[ends[number - 1]]
    clock.set_ros_time_override(at(11.0))
    assert [name for _, name, _ in calls] == sorted(waits)


def test_whoever_sleeps_is_woken_by_each_release_and_by_nothing_else():
    watch, calls, clock = ClockWatch(print), [], simulated_clock(10.0)
    watch.use_clock(RosClock(clock))
    assert watch.released == 0

    def wake():
        calls.append('woken')

    def wake_another():
        calls.append('another')

    with watch.waking(wake), watch.waking(wake_another):
        clock.set_ros_time_override(at(11.0))
        assert calls == []
        watch.release()
        watch.release()
    with pytest.raises(KeyError, match='an error of the sleeper'), watch.waking(wake):
        raise KeyError('an error of the sleeper')
    watch.release()
    assert sorted(calls) == ['another', 'another', 'woken', 'woken']
    assert watch.released == 3


@pytest.mark.filterwarnings('ignore:This process .* is multi-threaded:DeprecationWarning')
def test_child_of_a_fork_wakes_no_thread_of_its_parent():
    woken, watch = [], ClockWatch(print)
    with watch.waking(lambda: woken.append('a thread that only the parent has')):
        child = os.fork()
        if not child:
            watch.release()
            os._exit(len(woken))
        assert os.waitpid(child, 0)[1] == 0
        watch.release()
    assert len(woken) == 1


def test_clock_that_leaves_refers_to_nothing_any_more():
    clock, watch = simulated_clock(10.0), ClockWatch(print)

    def turn(count):
        for _ in range(count):
            watch.use_clock(RosClock(clock))
            watch.leave(RosClock(clock))

    turn(10)
    gc.collect()
    blocks = sys.getallocatedblocks()
    turn(1000)
    assert sys.getallocatedblocks() - blocks < 500


# --- what is logged


def test_time_that_stands_still_is_reported_once_with_the_time(log):
    watch, clock = ClockWatch(print), simulated_clock(1.5)
    for before in (None, 0):
        watch.report_if_stopped(before)  # it has no clock
    watch.use_clock(RosClock(clock))
    for before in (None, 0, SECOND):
        watch.report_if_stopped(before)
    assert watch.may_report is True
    assert log() == ''
    for _ in range(2):
        watch.report_if_stopped(3 * SECOND // 2)
    assert watch.may_report is False
    assert log().count('WARN') == 1
    assert ('A lookup waits for simulated time, which has stood still at 1.500000000 s for 3 s: '
            'is any node publishing /clock? Its timeout does not pass in the '
            'meantime. Buffer(wall_guard=Duration(seconds=5)) limits such a wait\n') in log()


LINE = ('/clock went back by 2 ms, and 2 nodes publish it: /a, /b. Time goes to and fro '
        'between them: stop all but one\n')


def step_back(clock, count=1, by_ms=2):
    for _ in range(count):
        clock.set_ros_time_override(at(10.0))
        clock.set_ros_time_override(at(10.0 - by_ms / 1000))


@pytest.mark.parametrize(('by_ms', 'text'), [(2, '2 ms'), (2000, '2.000 s')])
def test_publishers_are_named_at_the_third_step_back_and_never_again(log, by_ms, text):
    asked = []

    def publishers():
        asked.append('asked')
        return ['/b', '/a', '/b']

    clock, watch = simulated_clock(10.0), ClockWatch(lambda jump: None)
    watch.use_clock(RosClock(clock, publishers=publishers))
    step_back(clock, 2, by_ms)
    assert (asked, log()) == ([], '')
    clock.set_ros_time_override(at(10.0))
    assert asked == []
    step_back(clock, 1, by_ms)
    assert asked == ['asked']
    step_back(clock, 7, by_ms)
    assert asked == ['asked']
    assert log().count('WARN') == 1
    assert LINE.replace('2 ms', text) in log()


def test_one_publisher_is_not_named_and_another_one_is_as_soon_as_it_comes(log):
    names, clock, watch = ['/a', '/a'], simulated_clock(10.0), ClockWatch(lambda jump: None)
    watch.use_clock(RosClock(clock, publishers=lambda: names))
    step_back(clock, 4)
    assert log() == ''
    names.append('/b')
    step_back(clock, 1)
    assert log() == '', 'it counts three steps again'
    step_back(clock, 1)
    assert log().count('WARN') == 1
    assert LINE in log()


def test_step_back_of_a_nanosecond_counts():
    asked, clock, watch = [], simulated_clock(10.0), ClockWatch(lambda jump: None)
    watch.use_clock(RosClock(clock, publishers=lambda: asked.append('asked') or []))
    for nanoseconds in (1, 0, 1, 0, 1, 0):
        clock.set_ros_time_override(
            Time(nanoseconds=10 * SECOND + nanoseconds, clock_type=ClockType.ROS_TIME))
    assert asked == ['asked']


def test_switches_of_the_kind_of_time_are_no_steps_back():
    asked, clock = [], SetByHand(10)
    watch = ClockWatch(lambda jump: None)
    watch.use_clock(RosClock(clock.ros, publishers=lambda: asked.append('asked') or []))
    for turn in range(9):
        clock.switch(turn % 2 == 1)
    assert asked == []
