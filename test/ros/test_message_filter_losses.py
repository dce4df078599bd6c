# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A message filter that drops every message says so once, with the cause."""

from collections import deque
import re

from filter_helpers import Inbox, point
from geometry_msgs.msg import PointStamped
from hand_clock import clock_of_logs, HandClock
from memory import bytes_of
import pytest
from ros_helpers import lasting, move, SIM_TIME, transform, until
from tf_tree_py import Buffer, ClockJumpException, TransformListener
from tf_tree_py.ros.filtering import losses
from tf_tree_py.ros.filtering.message_filter import Drop, MessageFilter

# Seconds of the clock, between two messages, and from a stamp to its transform.
BEGIN, INTERVAL, DELAY = 100.0, 0.05, 0.08
LATE = ("delivered none with a transform from 'base' to 'map': their transforms came up to "
        '80 ms after them, but they were held for 50 ms at most. Use a queue_size of at least 2 '
        'instead of 1\n')


class Robot:
    """A filter with a message every 50 ms, and its transform 80 ms later."""

    def __init__(self, make_filter, settle, clock, **options):
        self.buffer = options.setdefault('buffer', Buffer())
        self.filter, self.settle, self.clock = make_filter(**options), settle, clock
        self.now, self.pending = BEGIN, deque()

    def run(self, seconds, frame='base', delay=DELAY, stamp=0.0, lost=False):
        """
        Drive for some seconds.

        :param delay: of the transforms; None: there are none.
        :param stamp: how much later than now messages are stamped, seconds.
        :param lost: whether transforms that were on their way do not arrive.
        """
        if lost:
            self.pending.clear()
        for _ in range(round(seconds / INTERVAL)):
            self._set(self.now)
            self.filter.add(point(self.now + stamp, frame))
            if delay is not None:
                self.pending.append((self.now + delay, self.now))
            following = self.now + INTERVAL
            while self.pending and self.pending[0][0] < following:
                self._arrive()
            self.now = following
            self.settle(self.filter)

    def deliver(self, count=1):
        """Let the message that waits pass, and more: their transform is there already."""
        move(self.buffer, self.now - INTERVAL)
        for _ in range(count - 1):
            self.filter.add(point(self.now - INTERVAL))
            self.settle(self.filter)

    def dropped(self):
        return sum(self.filter.statistics().dropped.values())

    def _arrive(self):
        at, stamp = self.pending.popleft()
        self._set(at)
        move(self.buffer, stamp)

    def _set(self, now):
        self.clock.now = self.logs.now = round(now, 6)


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(BEGIN)
    monkeypatch.setattr(losses, 'time', clock)
    Robot.logs = clock_of_logs(monkeypatch)
    return clock


@pytest.fixture
def make_filter(node):
    """Make filters that are closed at the end of the test; then nothing waits any more."""
    filters = []

    def make(target_frames='map', *, buffer, **options):
        filters.append((buffer, MessageFilter(
            buffer, node, target_frames, Inbox().receive, **options)))
        return filters[-1][1]

    yield make
    for buffer, each in filters:
        each.close()
        assert len(buffer.waiting) == 0


@pytest.fixture
def start(make_filter, settle, clock):
    return lambda **options: Robot(make_filter, settle, clock, **options)


@pytest.fixture
def warnings(log):
    return lambda: [line + '\n' for line in log().splitlines() if 'Dropped' in line]


# --- transforms that come late


def test_line_names_the_delay_of_the_transforms_and_the_queue_that_suffices(start, warnings):
    robot = start(queue_size=1)
    robot.run(11.0)
    assert robot.filter.statistics().delivered == 0
    (line,) = warnings()
    assert '[WARN]' in line
    assert '[asking]: Dropped' in line
    assert line.endswith(LATE)
    assert re.search(r'Dropped 20\d messages in 10\.\d s \(20(\.\d)? Hz\)', line)


def test_queue_that_it_names_does_suffice(start, warnings):
    robot = start(queue_size=2)
    robot.run(30.0)
    assert robot.dropped() == 0
    assert not warnings()


@pytest.mark.parametrize(('options', 'delay', 'sentence'), [
    ({'timeout': lasting(0.0)}, DELAY,
     'came up to 80 ms after them, but they were held for 0 ns at most. Use a timeout of at least '
     '80 ms instead of 0 ns'),
    ({'queue_size': 1, 'timeout': lasting(4.0)}, 4.48,
     'came up to 4.480 s after them, but they were held for 50 ms at most. Use a queue_size of at '
     'least 90 instead of 1 and a timeout of at least 4.480 s instead of 4.000 s'),
    ({'queue_size': 3, 'tolerance': lasting(0.2)}, DELAY,
     'came up to 280 ms after them, but they were held for 150 ms at most; the tolerance requires '
     'data 200 ms beyond their stamps. Use a queue_size of at least 6 instead of 3'),
])
def test_line_names_the_option_that_drops(start, warnings, options, delay, sentence):
    start(**options).run(30.0, delay=delay)
    (line,) = warnings()
    assert line.endswith(f': their transforms {sentence}\n')


def test_delay_at_the_start_is_not_that_of_later_transforms(start, warnings):
    """Transforms stop, and go on while a dropped message still waits for them."""
    robot = start(queue_size=1)
    robot.run(0.1)
    robot.run(13.0, delay=None, lost=True)
    robot.run(4.0)
    (line,) = warnings()
    assert line.endswith(LATE)


# --- transforms that do not come


@pytest.mark.parametrize(('options', 'run', 'sentence'), [
    ({}, {'frame': 'nowhere'}, r"from 'nowhere' to 'map'\. The last one: .*nowhere.*not exist"),
    ({'target_frames': ['map', 'island']}, {},
     r"to 'map' and 'island'\. The last one: .*not part of the same tree"),
    ({'timeout': lasting(0.0)}, {'frame': 'nowhere'}, r'The last one: .*nowhere.*does not exist'),
    ({}, {'frame': ''}, r"from '' to 'map'\. The last one: its frame_id is empty$"),
    ({}, {'frame': '//base'}, r"The last one: .*'/base'.*no leading slash"),
    ({}, {'stamp': -60.0}, r'The last one: Lookup would require extrapolation into the past.*'
                           r'The buffer keeps 10'),
    ({}, {'stamp': 3600.0}, r'One of them: .*into the future.* the latest data is at time .*, '
                            r'\d{4}\.\d{3} s older, the edge map -> base,.*waited'),
], ids=['unknown', 'not connected', 'timeout', 'empty', 'impossible', 'too old', 'too new'])
def test_line_says_why_the_transforms_do_not_come(start, warnings, options, run, sentence):
    robot = start(**options)
    move(robot.buffer, 1.0, 'island', 'tree')
    robot.run(20.0, **run)
    (line,) = warnings()
    assert re.search(sentence, line), line


def test_line_names_the_edge_that_has_stopped(start, warnings):
    robot = start()
    robot.run(5.0)
    robot.run(20.0, delay=None, lost=True)
    (line,) = warnings()
    assert re.search(r'One of them: .*1\d\.\d{3} s older, the edge map -> base', line)


def test_cause_that_follows_another_is_logged_too(start, warnings):
    robot = start(queue_size=1)
    robot.run(12.0, delay=None)
    robot.run(40.0)
    first, second = warnings()
    assert 'does not exist' in first
    assert second.endswith(LATE)


def test_line_names_the_node_whose_executor_has_never_called_back(start, warnings):
    robot = start()
    robot.settle = lambda _: None
    robot.run(40.0, delay=-1.0)
    (line,) = warnings()
    assert "have come, but the executor of the node 'asking' has never called back" in line


def test_callback_that_takes_long_is_no_loss_of_all(start, warnings):
    robot = start(queue_size=1)
    robot.run(1.0, delay=0.01)
    robot.settle = lambda _: None
    robot.run(40.0, delay=0.01)
    assert robot.dropped() > 100
    assert not warnings()


# --- when there is no line


@pytest.mark.parametrize('steps', [
    # It starts before its transforms; they stop for a while.
    [(9.5, None), (20.0, 0.01)],
    [(5.0, 0.01), (9.5, None), (20.0, 0.01), (9.5, None), (5.0, 0.01)],
    # While the cause is being found, the transforms come in time again.
    [(5.0, 0.01), (10.5, None), (20.0, 0.01)],
    # Each second message, or less, is dropped.
    [(0.1, 0.12), (0.1, 0.01)] * 150,
    [(2.0, None), (0.1, 0.01)] * 15,
])
def test_filter_that_passes_messages_logs_nothing(start, warnings, steps):
    robot = start(queue_size=1)
    for seconds, delay in steps:
        robot.run(seconds, delay=delay, lost=True)
    assert robot.dropped() > 10
    assert not warnings()


@pytest.mark.parametrize(('options', 'seconds'), [
    ({}, 10.0),  # ten seconds have to pass after the first drop
    ({'queue_size': 300}, 28.0),  # and a queue, of 15 s, has to be lost as a whole
])
def test_line_needs_many_drops_in_ten_seconds(start, warnings, options, seconds):
    robot = start(**options)
    robot.run(seconds, 'nowhere')
    assert not warnings()
    robot.run(3.0, 'nowhere')
    assert len(warnings()) == 1


def test_few_messages_in_a_long_time_are_not_many(start, clock, warnings):
    robot = start(queue_size=1)
    for number in range(10):
        clock.now += 60.0
        robot.filter.add(point(number, 'nowhere'))
    assert not warnings()
    clock.now += 60.0
    robot.filter.add(point(10, 'nowhere'))
    assert len(warnings()) == 1


def test_line_is_repeated_only_after_many_messages_have_passed(start, warnings):
    robot = start(queue_size=1)
    robot.run(60.0)
    assert len(warnings()) == 1
    for _ in range(2):
        robot.deliver(9)
        robot.run(60.0)
        assert len(warnings()) == 1
    robot.deliver(10)
    robot.run(60.0)
    assert len(warnings()) == 2


def test_message_that_passes_ends_the_search_for_the_cause(start, warnings):
    robot = start(queue_size=1)
    robot.run(10.1, delay=0.12)
    assert len(robot.buffer.waiting) == 2, 'one waits though it was dropped'
    robot.filter.add(point(robot.now - 1.0))
    assert len(robot.buffer.waiting) == 1
    robot.run(9.0)
    assert not warnings()


def test_closing_ends_the_search_for_the_cause(start):
    robot = start(queue_size=1)
    robot.run(10.1, delay=0.12)
    assert len(robot.buffer.waiting) == 2
    robot.filter.close()
    assert len(robot.buffer.waiting) == 0


def test_jump_of_the_clock_and_the_end_of_a_listener_are_no_causes(
        make_node, start, clock, warnings):
    buffer = Buffer()
    listener = TransformListener(buffer, make_node('hearing'))
    robot = start(buffer=buffer, queue_size=1)
    robot.run(10.1, delay=0.12)
    assert len(buffer.waiting) == 2
    buffer.waiting.fail(ClockJumpException('jumped'))
    assert len(buffer.waiting) == 0
    robot.run(0.1, delay=0.12)
    assert len(buffer.waiting) == 2
    listener.close()
    assert robot.filter.statistics().dropped[Drop.CLOSED] == 1
    robot.filter.close()
    robot.run(20.0)
    assert not warnings()


# --- several topics, frames and clocks


def test_frames_are_counted_separately(start, warnings):
    robot = start()
    for _ in range(300):
        robot.run(INTERVAL, delay=0.01)
        robot.filter.add(point(robot.now, 'nowhere'))
    (line,) = warnings()
    assert "from 'nowhere'" in line


def test_invented_frames_use_up_neither_the_memory_nor_the_log(start, warnings):
    robot = start(queue_size=1)
    memory = []
    for number in range(300):
        robot.run(0.5, f'{number:03d}' * 1000)
        memory.append(bytes_of(robot.filter))
    assert memory[299] < memory[99] + 20 * 3000
    for _ in range(20):
        for number in range(50):
            robot.run(INTERVAL, f'{number:03d}' * 1000)
    # Each of the 50 has its tenth drop in the same 2.5 s.
    assert 1 <= len(warnings()) <= 3


def test_line_names_the_topic_and_measures_by_simulated_time(
        node, make_node, listen, sim_clock, spin, clock, warnings, make_filter):
    """Which runs at half speed here."""
    buffer = listen(make_node('simulated', **SIM_TIME))
    each = make_filter(buffer=buffer, queue_size=1)
    each.subscribe(PointStamped, 'scan')
    publisher = make_node('sensor').create_publisher(PointStamped, '/scan', 10)
    spin(node)
    until(publisher.get_subscription_count)
    for number in range(20):
        clock.now += 2.0
        now = 10.0 + number
        sim_clock.show(now, buffer)
        publisher.publish(point(now))
        until(lambda number=number: each.statistics().received == number + 1)
        sim_clock.show(now + 0.25, buffer)
        buffer.set_transform(transform('map', 'base', now - 1.0), 'me')
    (line,) = warnings()
    assert re.search(r'Dropped \d+ messages of /scan in .*came up to 1\.250 s after them, but they'
                     r' were held for 1\.000 s at most. Use a queue_size of at least 2', line)
