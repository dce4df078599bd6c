# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages that wait for their transforms."""

from collections import Counter
from concurrent.futures import wait
import itertools
import sys
import threading
from types import SimpleNamespace

from filter_helpers import check, Inbox, point
from geometry_msgs.msg import PointStamped, PoseStamped
import pytest
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    qos_profile_sensor_data,
    QoSProfile,
    ReliabilityPolicy,
)
from ros_helpers import (
    at,
    lasting,
    move,
    PATIENCE_S,
    SIM_TIME,
    transform,
    until,
    until_waiting,
)
from tf_tree_py import (
    Buffer,
    TransformException,
    TransformListener,
)
from tf_tree_py.core.buffer import waiting
from tf_tree_py.ros.filtering.drop_reasons import Drop
from tf_tree_py.ros.filtering.message_filter import MessageFilter


@pytest.fixture
def inbox():
    return Inbox()


@pytest.fixture
def make_filter(node, buffer, inbox):
    """Make filters that are closed at the end of the test."""
    filters = []

    def make(target_frames='map', callback=inbox.take, buffer=buffer, **options):
        options.setdefault('on_drop', inbox.lose)
        filters.append(MessageFilter(buffer, node, target_frames, callback, **options))
        return filters[-1]

    yield make
    for each in filters:
        each.close()
        check(each.statistics())
        assert each.statistics().held == 0


@pytest.fixture
def settle(context, node):
    """Let the node's executor process everything pending, in this thread."""
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin(*filters):
        for each in filters:
            while each._ready or each._notices:
                executor.spin_once(timeout_sec=0.0)

    yield spin
    executor.shutdown()


# --- content, time and place of deliveries


def test_message_waits_for_its_transform_and_comes_with_it(
        node, make_node, make_filter, listen, talker, spin, inbox):
    each = make_filter(buffer=listen(make_node('hearing')))
    publisher = make_node('sensor').create_publisher(PointStamped, 'points', 10)
    each.subscribe(PointStamped, 'points')
    until(lambda: publisher.get_subscription_count())
    spin(node)
    publisher.publish(point(3.0, x=0.5))
    until(lambda: each.statistics().held == 1)
    talker.move(transform('map', 'base', 2.0, x=2.0))
    talker.move(transform('map', 'base', 4.0, x=4.0))
    until(lambda: inbox.delivered)
    assert inbox.xs() == [(0.5, 3.0)]
    found = inbox.delivered[0][1]
    assert (found.header.frame_id, found.child_frame_id) == ('map', 'base')
    assert found.header.stamp == at(3.0).to_msg()


@pytest.mark.parametrize('kind', [SingleThreadedExecutor, MultiThreadedExecutor])
def test_callbacks_run_in_the_nodes_executor(node, make_filter, buffer, spin, inbox, kind):
    spin(node, kind=kind)
    each = make_filter()
    each.add(point(1.5))
    each.add(point(3.0))
    each.add(point(1.0, ''))
    until(lambda: inbox.delivered and inbox.dropped)
    move(buffer, 3.0)
    until(lambda: len(inbox.delivered) == 2)
    assert threading.main_thread() not in inbox.threads


def test_what_is_answerable_at_once_still_waits_for_the_executor(make_filter, settle, inbox):
    each = make_filter()
    each.add(point(1.5))
    assert not inbox.delivered
    assert each.statistics().held == 1
    settle(each)
    assert inbox.xs() == [(0.0, 1.5)]
    assert each.statistics().delivered == 1


def test_transform_is_the_one_that_was_found(make_filter, buffer, settle, inbox):
    """At the time of the callback, the buffer may no longer have it."""
    each = make_filter()
    each.add(point(3.0))
    each.add(point(0.0))
    move(buffer, 3.0)
    buffer.clear()
    move(buffer, 50.0)
    settle(each)
    assert sorted(found.transform.translation.x for _, found in inbox.delivered) == [2.0, 3.0]


def test_stamp_zero_asks_for_the_latest(make_filter, settle, inbox):
    each = make_filter(tolerance=lasting(5.0))
    each.add(point(0.0))
    settle(each)
    assert inbox.delivered[0][1].header.stamp == at(2.0).to_msg()


def test_several_targets_must_all_be_reachable(make_filter, buffer, settle, inbox):
    each = make_filter(['map', '/odom'])
    each.add(point(1.5))
    move(buffer, 1.0, 'odom', 'map')
    settle(each)
    assert not inbox.delivered
    move(buffer, 2.0, 'odom', 'map')
    settle(each)
    ((message, found),) = inbox.delivered
    assert {frame: each.transform.translation.x for frame, each in found.items()} == {
        'map': 1.5, 'odom': 3.0}
    assert found['odom'].header.frame_id == 'odom'


def test_one_target_in_a_list_comes_as_a_dict_too(make_filter, settle, inbox):
    each = make_filter(['map'])
    each.add(point(1.5))
    settle(each)
    assert list(inbox.delivered[0][1]) == ['map']


def test_tolerance_wants_data_beyond_the_stamp(make_filter, buffer, settle, inbox):
    each = make_filter(tolerance=lasting(0.5))
    each.add(point(1.5, x=1.0))
    each.add(point(1.75, x=2.0))
    settle(each)
    assert inbox.xs() == [(1.0, 1.5)]
    move(buffer, 2.25)
    settle(each)
    assert inbox.xs() == [(1.0, 1.5), (2.0, 1.75)]


def test_leading_slash_of_a_frame_is_left_out(make_filter, settle, inbox):
    each = make_filter('/map')
    each.add(point(1.5, '/base'))
    settle(each)
    assert inbox.delivered[0][1].child_frame_id == 'base'
    assert inbox.delivered[0][1].header.frame_id == 'map'


def test_header_may_be_elsewhere(make_filter, settle, inbox):
    each = make_filter(header_of=lambda message: message['inside'].header)
    each.add({'inside': point(1.5)})
    settle(each)
    assert len(inbox.delivered) == 1


def test_message_without_a_time_is_refused_and_counts_for_nothing(make_filter):
    message = point(1.5)
    each = make_filter(header_of=lambda message: SimpleNamespace(frame_id='base', stamp=1.5))
    with pytest.raises(TypeError, match='1.5 is not a time'):
        each.add(message)
    assert each.statistics().received == 0


def test_several_topics_feed_one_filter(node, make_node, make_filter, spin, inbox):
    each = make_filter()
    kinds = {'points': PointStamped, 'poses': PoseStamped}
    for topic, kind in kinds.items():
        each.subscribe(kind, topic)
    spin(node)
    sensor = make_node('sensor')
    for topic, kind in kinds.items():
        message = kind()
        message.header = point(1.5).header
        publisher = sensor.create_publisher(kind, topic, 10)
        until(publisher.get_subscription_count)
        publisher.publish(message)
    until(lambda: len(inbox.delivered) == 2)
    assert {type(message) for message, _ in inbox.delivered} == {PointStamped, PoseStamped}


@pytest.mark.parametrize('profile', [
    qos_profile_sensor_data, QoSProfile(depth=5),
    QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)])
def test_sensors_are_heard_whatever_their_profile(
        node, make_node, make_filter, spin, inbox, profile):
    make_filter().subscribe(PointStamped, 'points')
    spin(node)
    publisher = make_node('sensor').create_publisher(PointStamped, 'points', profile)
    until(publisher.get_subscription_count)
    publisher.publish(point(1.5, x=0.5))
    until(lambda: inbox.delivered)
    assert inbox.xs() == [(0.5, 1.5)]


def test_profile_may_be_given(node, make_filter):
    subscription = make_filter().subscribe(PointStamped, 'points', 7)
    profile = subscription.qos_profile
    assert (profile.depth, profile.reliability) == (7, ReliabilityPolicy.RELIABLE)


def test_filter_of_message_filters_can_be_the_source(make_filter, settle, inbox):
    class Source:

        def registerCallback(self, callback):
            self.callback = callback

    each, source = make_filter(), Source()
    each.connect(source)
    source.callback(point(1.5))
    settle(each)
    assert len(inbox.delivered) == 1


def test_callback_may_be_a_coroutine_that_waits_itself(node, make_filter, buffer, spin):
    answers = []

    async def call_back(message, found):
        later = await buffer.lookup_transform_async('map', 'base', at(9.0))
        answers.append((found.transform.translation.x, later.transform.translation.x))

    spin(node)
    make_filter(callback=call_back).add(point(1.5))
    until_waiting(buffer)
    move(buffer, 9.0)
    until(lambda: answers)
    assert answers == [(1.5, 9.0)]


def test_callback_that_raises_does_not_lose_the_others(make_filter, settle, inbox):
    def call_back(message, found):
        inbox.take(message, found)
        if message.point.x == 1.0:
            raise ValueError('a bug in a callback')

    each = make_filter(callback=call_back)
    for x in range(3):
        each.add(point(1.5, x=float(x)))
    with pytest.raises(ValueError, match='a bug'):
        settle(each)
    settle(each)
    assert [x for x, _ in inbox.xs()] == [0.0, 1.0, 2.0]


def test_callback_may_add_and_close(make_filter, settle, inbox):
    def call_back(message, found):
        inbox.take(message, found)
        if len(inbox.delivered) == 1:
            each.add(point(1.5))
        else:
            each.add(point(9.0))
            each.close()

    each = make_filter(callback=call_back)
    each.add(point(1.5))
    settle(each)
    assert len(inbox.delivered) == 2
    assert inbox.reasons() == [Drop.CLOSED]


# --- order


def test_messages_of_one_frame_come_in_the_order_they_were_added(
        make_filter, buffer, settle, inbox):
    each = make_filter()
    for seconds in (5.0, 3.0, 4.0):
        each.add(point(seconds))
    move(buffer, 6.0)
    settle(each)
    assert inbox.stamps() == [5, 3, 4]


def test_message_without_an_answer_does_not_hold_up_those_behind_it(
        make_filter, buffer, settle, inbox):
    each = make_filter()
    each.add(point(5.0))
    each.add(point(3.0))
    move(buffer, 4.0)
    settle(each)
    assert inbox.stamps() == [3]
    move(buffer, 5.0)
    settle(each)
    assert inbox.stamps() == [3, 5]


def test_message_added_while_others_are_woken_does_not_overtake_them(
        make_filter, buffer, settle, inbox, monkeypatch):
    """A sensor's next message comes between the arrival of a transform and its effect."""
    wake_all = waiting.wake_all
    each = make_filter()
    for seconds in (3.0, 4.0, 9.0):
        each.add(point(seconds))

    def wake_later(waiters):
        monkeypatch.undo()
        each.add(point(5.0))
        wake_all(waiters)

    monkeypatch.setattr(waiting, 'wake_all', wake_later)
    move(buffer, 6.0)
    settle(each)
    assert inbox.stamps() == [3, 4, 5]


# --- drops


def only_drop(inbox):
    ((message, drop, why),) = inbox.dropped
    return drop, why


@pytest.mark.parametrize(('message', 'target', 'drop', 'why'), [
    (point(1.5, 'nowhere'), 'map', Drop.UNKNOWN_FRAME, 'nowhere.*does not exist'),
    (point(1.5), 'nowhere', Drop.UNKNOWN_FRAME, 'nowhere.*does not exist'),
    (point(1.5), 'island', Drop.NOT_CONNECTED, 'not part of the same tree'),
    (point(3.0), 'map', Drop.NO_DATA, r'future.*map -> base.*waited \d+\.\d{3} s'),
    (point(0.5), 'map', Drop.NO_DATA, 'past.*map -> base'),
])
def test_timeout_says_what_was_missing(
        make_filter, buffer, node, spin, inbox, message, target, drop, why):
    move(buffer, 1.0, 'island', 'tree')
    spin(node)
    each = make_filter(target, timeout=lasting(0.02))
    each.add(message)
    until(lambda: inbox.dropped)
    assert inbox.dropped[0][0] is message
    assert only_drop(inbox)[0] is drop
    with pytest.raises(TransformException, match=why):
        raise TransformException(inbox.dropped[0][2])
    assert each.statistics().dropped[drop] == 1


@pytest.mark.parametrize(('frame', 'drop'), [
    ('', Drop.EMPTY_FRAME), ('/', Drop.EMPTY_FRAME), ('//base', Drop.IMPOSSIBLE_FRAME),
])
def test_frame_that_cannot_be_is_dropped_at_once(make_filter, settle, inbox, frame, drop):
    each = make_filter()
    each.add(point(1.5, frame))
    assert each.statistics().dropped[drop] == 1
    settle(each)
    assert only_drop(inbox)[0] is drop


def test_too_old_is_dropped_at_once_and_as_soon_as_it_is(make_filter, buffer, settle, inbox):
    each = make_filter()
    each.add(point(0.5))
    assert each.statistics().held == 1
    move(buffer, 20.0)
    move(buffer, 30.0)
    assert each.statistics().dropped[Drop.TOO_OLD] == 1
    each.add(point(0.6))
    settle(each)
    assert inbox.reasons() == [Drop.TOO_OLD] * 2
    assert 'The buffer keeps 10' in inbox.dropped[1][2]


def test_full_queue_drops_the_oldest(make_filter, buffer, settle, inbox):
    each = make_filter(queue_size=2)
    for seconds in (3.0, 4.0, 5.0):
        each.add(point(seconds))
    each.add(point(1.5))
    settle(each)
    assert only_drop(inbox)[0] is Drop.QUEUE_FULL
    assert inbox.dropped[0][0].header.stamp.sec == 3
    move(buffer, 9.0)
    settle(each)
    assert inbox.stamps() == [1, 4, 5]


def test_messages_that_nobody_takes_are_bounded_too(make_filter, settle, inbox):
    each = make_filter(queue_size=2)
    for number in range(5):
        each.add(point(1.5, x=float(number)))
    assert each.statistics().held == 2
    settle(each)
    assert [x for x, _ in inbox.xs()] == [3.0, 4.0]
    assert inbox.reasons() == [Drop.QUEUE_FULL] * 3


def test_queue_of_size_zero_has_no_end(make_filter, buffer, settle, inbox):
    each = make_filter(queue_size=0)
    for _ in range(1000):
        each.add(point(3.0))
    move(buffer, 4.0)
    settle(each)
    assert len(inbox.delivered) == 1000


def test_clock_jump_drops_what_waits(node, make_node, make_filter, listen, sim_clock, spin, inbox):
    buffer = listen(make_node('simulated', **SIM_TIME))
    spin(node)
    sim_clock.show(10.0, buffer)
    each = make_filter(buffer=buffer)
    each.add(point(10.0))
    sim_clock.show(5.0, buffer)
    until(lambda: inbox.dropped)
    assert only_drop(inbox)[0] is Drop.CLOCK_JUMPED


def test_timeout_goes_by_simulated_time(node, make_node, make_filter, listen, sim_clock, spin,
                                        inbox):
    buffer = listen(make_node('simulated', **SIM_TIME))
    spin(node)
    sim_clock.show(10.0, buffer)
    each = make_filter(buffer=buffer, timeout=lasting(5.0))
    each.add(point(10.0))
    sim_clock.show(14.0, buffer)
    assert each.statistics().held == 1
    sim_clock.show(15.0, buffer)
    until(lambda: inbox.dropped)
    assert only_drop(inbox) == (Drop.UNKNOWN_FRAME, inbox.dropped[0][2])
    assert 'waited 5.000 s' in inbox.dropped[0][2]


def test_end_of_the_last_listener_drops_what_waits(node, make_node, make_filter, settle, inbox):
    buffer = Buffer()
    listener = TransformListener(buffer, make_node('hearing'))
    each = make_filter(buffer=buffer)
    each.add(point(1.0))
    listener.close()
    settle(each)
    assert only_drop(inbox)[0] is Drop.CLOSED
    assert 'the listener was closed' in inbox.dropped[0][2]


def test_closing_drops_all_and_whatever_comes_later_at_once(make_filter, node, inbox):
    each = make_filter()
    each.subscribe(PointStamped, 'points')
    guards = len(list(node.guards))
    each.add(point(3.0))
    each.add(point(1.5))
    each.close()
    assert inbox.reasons() == [Drop.CLOSED] * 2
    assert not inbox.delivered
    each.close()
    each.add(point(1.5))
    assert inbox.reasons() == [Drop.CLOSED] * 3
    assert not [each for each in node.subscriptions if each.topic_name == '/points']
    assert len(list(node.guards)) == guards - 1


def test_drops_are_counted_also_when_nobody_wants_to_hear_of_them(make_filter, settle):
    with make_filter(on_drop=None, queue_size=1) as each:
        for seconds in (3.0, 4.0):
            each.add(point(seconds))
        assert each.statistics().dropped[Drop.QUEUE_FULL] == 1
    assert each.statistics().dropped[Drop.CLOSED] == 1


def test_node_that_is_gone_takes_nothing_any_more(context, buffer, inbox):
    node = Node('short_lived', context=context)
    each = MessageFilter(buffer, node, 'map', inbox.take)
    each.add(point(3.0))
    node.destroy_node()
    move(buffer, 4.0)
    assert each.statistics().held == 1
    each.close()
    assert each.statistics().dropped[Drop.CLOSED] == 1


@pytest.mark.parametrize('wrong', [
    {'target_frames': ''}, {'target_frames': []}, {'target_frames': ['map', '/']},
    {'queue_size': -1},
])
def test_filter_that_cannot_be_is_refused(make_filter, wrong):
    with pytest.raises(ValueError, match='target_frames are|queue_size is'):
        make_filter(**wrong)


# --- concurrency


def test_message_that_is_just_being_answered_is_not_dropped_meanwhile(
        make_filter, buffer, settle, inbox, pool, monkeypatch):
    each = make_filter(queue_size=1)
    each.add(point(3.0))
    found, adding = each._found, []

    def add_meanwhile(held):
        monkeypatch.undo()
        adding.append(pool.submit(each.add, point(9.0)))
        wait(adding, 0.05)  # in vain: it has to wait for this thread
        found(held)

    monkeypatch.setattr(each, '_found', add_meanwhile)
    move(buffer, 3.0)
    adding[0].result(PATIENCE_S)
    settle(each)
    assert inbox.stamps() == [3]
    assert not inbox.dropped


def test_threads_add_while_transforms_arrive_and_nothing_is_lost_or_doubled(
        node, make_filter, spin, inbox, pool):
    spin(node, kind=MultiThreadedExecutor)
    # It forgets nothing, however long a busy machine delays one of the threads.
    buffer = Buffer(Duration(seconds=1_000_000))
    move(buffer, 1.0)
    move(buffer, 2.0)
    each = make_filter(buffer=buffer, queue_size=3)

    hundredths = itertools.count(201)
    latest = 2.0

    def add(first):
        for number in range(200):
            each.add(point(latest + 0.005 * (number % 5), x=first + number))

    def arrive():
        nonlocal latest
        while not all(work.done() for work in working):
            latest = next(hundredths) / 100.0
            move(buffer, latest)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        working = [pool.submit(add, 1000.0 * thread) for thread in range(3)]
        for work in [*working, pool.submit(arrive)]:
            work.result(PATIENCE_S)
    finally:
        sys.setswitchinterval(interval)
    move(buffer, latest + 1.0)
    until(lambda: each.statistics().held == 0)
    until(lambda: len(inbox.delivered) + len(inbox.dropped) == 600)
    names = Counter(message.point.x for message, *_ in inbox.delivered + inbox.dropped)
    assert len(names) == 600
    assert set(inbox.reasons()) <= {Drop.QUEUE_FULL}
    for message, found in inbox.delivered:
        assert found.header.stamp == message.header.stamp
