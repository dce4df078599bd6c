# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages that wait for their transforms."""

from collections import Counter
from concurrent.futures import wait
import itertools
import re
import threading
from types import SimpleNamespace

from filter_helpers import check, Inbox, point
from geometry_msgs.msg import PointStamped, PoseStamped
from nav_msgs.msg import Path
import pytest
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile, ReliabilityPolicy
from ros_helpers import at, lasting, move, PATIENCE_S, transform, until, until_waiting
from tf_tree_py import Buffer, TransformListener
from tf_tree_py.core.buffer import waiting
from tf_tree_py.ros.filtering.message_filter import Drop, MessageFilter
from tf_tree_py.ros.waiting.timeouts import Wait


@pytest.fixture
def inbox():
    return Inbox()


@pytest.fixture
def make_filter(node, buffer, inbox):
    """Make filters that are closed at the end of the test."""
    filters = []

    def make(target_frames='map', callback=inbox.receive, buffer=buffer, **options):
        options.setdefault('on_drop', inbox.lose)
        filters.append(MessageFilter(buffer, node, target_frames, callback, **options))
        return filters[-1]

    yield make
    for each in filters:
        each.close()
        check(each.statistics())
        assert each.statistics().held == 0


def add(each, *messages):
    for message in messages:
        each.add(message)


# --- content, time and place of deliveries


def test_messages_of_several_topics_wait_for_their_transforms(
        node, make_node, make_filter, listen, talker, spin, inbox):
    """Whatever the profiles of their publishers."""
    sensors = {
        'points': (PointStamped, qos_profile_sensor_data),
        'poses': (PoseStamped, QoSProfile(depth=5)),
        'paths': (Path, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))}
    each, sensor = make_filter(buffer=listen(make_node('hearing'))), make_node('sensor')
    for topic, (cls, _) in sensors.items():
        each.subscribe(cls, topic)
    spin(node)
    for topic, (cls, profile) in sensors.items():
        publisher = sensor.create_publisher(cls, topic, profile)
        until(publisher.get_subscription_count)
        publisher.publish(cls(header=point(3.0).header))
    until(lambda: each.statistics().held == 3)
    talker.move(transform('map', 'base', 2.0, x=2.0), transform('map', 'base', 4.0, x=4.0))
    publisher.publish(Path(header=point(3.0, '').header))
    until(lambda: len(inbox.delivered) == 3 and inbox.dropped)
    assert threading.main_thread() not in inbox.threads
    assert {type(message) for message, _ in inbox.delivered} == {PointStamped, PoseStamped, Path}
    for _, found in inbox.delivered:
        assert found == transform('map', 'base', 3.0, x=3.0)


@pytest.mark.parametrize(('options', 'message', 'stamp'), [
    ({}, point(1.5), 1.5),
    ({'tolerance': lasting(5.0)}, point(0.0), 2.0),
    ({'target_frames': '/map'}, point(1.5, '/base'), 1.5),
    ({'header_of': lambda message: message['inside'].header}, {'inside': point(1.5)}, 1.5),
], ids=['found', 'latest', 'slashes', 'header elsewhere'])
def test_answerable_message_comes_when_the_executor_runs(
        make_filter, settle, inbox, options, message, stamp):
    each, callbacks = make_filter(**options), []
    # As a filter of the package message_filters.
    each.connect(SimpleNamespace(registerCallback=callbacks.append))
    callbacks[0](message)
    assert not inbox.delivered
    assert each.statistics().held == 1
    settle(each)
    assert inbox.delivered == [(message, transform('map', 'base', stamp, x=stamp))]
    assert each.statistics().delivered == 1


def test_transforms_to_the_targets_in_a_list_come_in_a_dict(make_filter, buffer, settle, inbox):
    """As they were found: at the time of the callback, the buffer may no longer have them."""
    for targets in (['map'], ['map', '/other']):
        each = make_filter(targets)
        each.add(point(1.5))
        settle(each)
    assert len(inbox.delivered) == 1, 'all must be reachable'
    buffer.set_transform_static(transform('other', 'map', x=1.0), 'me')
    buffer.clear()
    settle(each)
    found = {'map': transform('map', 'base', 1.5, x=1.5),
             'other': transform('other', 'base', 1.5, x=2.5)}
    assert [answer for _, answer in inbox.delivered] == [{'map': found['map']}, found]


def test_message_without_a_time_is_refused_and_counts_for_nothing(make_filter):
    each = make_filter(header_of=lambda message: SimpleNamespace(frame_id='base', stamp=1.5))
    with pytest.raises(TypeError, match='1.5 is not a time'):
        each.add(point(1.5))
    assert each.statistics().received == 0


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


@pytest.mark.parametrize('error', [ValueError, SystemExit])
def test_callback_that_raises_does_not_lose_the_others(make_filter, settle, inbox, error):
    """It ends the executor, and not the filter."""
    def call_back(message, found):
        inbox.receive(message, found)
        if message.point.x == 1.0:
            raise error

    each = make_filter(callback=call_back)
    add(each, *[point(1.5, x=float(x)) for x in range(3)])
    with pytest.raises(error):
        settle(each)
    settle(each)
    assert [x for x, _ in inbox.xs()] == [0.0, 1.0, 2.0]


def test_callback_may_add_and_close(make_filter, settle, inbox):
    def call_back(message, found):
        inbox.receive(message, found)
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


def test_message_added_while_others_are_woken_does_not_overtake_them(
        make_filter, buffer, settle, inbox, monkeypatch):
    """A sensor's next message comes between the arrival of a transform and its effect."""
    wake_all = waiting.wake_all
    each = make_filter()
    add(each, *map(point, (3.0, 4.0, 9.0)))

    def wake_later(waiters):
        monkeypatch.undo()
        each.add(point(5.0))
        wake_all(waiters)

    monkeypatch.setattr(waiting, 'wake_all', wake_later)
    move(buffer, 6.0)
    settle(each)
    assert inbox.stamps() == [3, 4, 5]


# --- drops


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
    ((dropped, reason, words),) = inbox.dropped
    assert dropped is message
    assert reason is drop
    assert re.search(why, words)
    assert each.statistics().dropped[drop] == 1


def test_message_that_can_never_be_answered_is_dropped_at_once(
        make_filter, buffer, settle, inbox):
    move(buffer, 20.0)
    move(buffer, 30.0)
    each = make_filter()
    add(each, *[point(1.5, frame) for frame in ('', '/', '//base', 'base')])
    assert each.statistics().held == 0
    settle(each)
    assert inbox.reasons() == [
        Drop.EMPTY_FRAME, Drop.EMPTY_FRAME, Drop.IMPOSSIBLE_FRAME, Drop.TOO_OLD]
    assert 'The buffer keeps 10' in inbox.dropped[3][2]


def test_end_of_the_last_listener_drops_what_waits(node, make_node, make_filter, settle, inbox):
    buffer = Buffer()
    listener = TransformListener(buffer, make_node('hearing'))
    each = make_filter(buffer=buffer)
    each.add(point(1.0))
    listener.close()
    settle(each)
    assert inbox.reasons() == [Drop.CLOSED]
    assert 'the listener was closed' in inbox.dropped[0][2]


def test_closing_drops_all_and_whatever_comes_later_at_once(make_filter, node, inbox):
    with make_filter() as each:
        profile = each.subscribe(PointStamped, 'points', 7).qos_profile
        assert (profile.depth, profile.reliability) == (7, ReliabilityPolicy.RELIABLE)
        guards = len(list(node.guards))
        add(each, point(3.0), point(1.5))
    assert inbox.reasons() == [Drop.CLOSED] * 2
    assert not inbox.delivered
    each.close()
    each.add(point(1.5))
    assert inbox.reasons() == [Drop.CLOSED] * 3
    assert '/points' not in [each.topic_name for each in node.subscriptions]
    assert len(list(node.guards)) == guards - 1


def test_node_that_is_gone_takes_nothing_any_more(context, buffer, inbox):
    node = Node('short_lived', context=context)
    each = MessageFilter(buffer, node, 'map', inbox.receive, queue_size=1)
    add(each, point(2.5), point(3.0))
    assert each.statistics().dropped[Drop.QUEUE_FULL] == 1, 'though nobody wants to hear of it'
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
    end, adding = Wait.end, []

    def add_meanwhile(answered):
        monkeypatch.undo()
        adding.append(pool.submit(each.add, point(9.0)))
        wait(adding, 0.05)  # in vain: it has to wait for this thread
        end(answered)

    monkeypatch.setattr(Wait, 'end', add_meanwhile)
    move(buffer, 3.0)
    adding[0].result(PATIENCE_S)
    settle(each)
    assert inbox.stamps() == [3]
    assert not inbox.dropped


def test_threads_add_while_transforms_arrive_and_none_is_lost_or_doubled(
        node, make_filter, spin, inbox, pool, switching_often):
    spin(node, of_type=MultiThreadedExecutor)
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

    working = [pool.submit(add, 1000.0 * thread) for thread in range(3)]
    for work in [*working, pool.submit(arrive)]:
        work.result(PATIENCE_S)
    move(buffer, latest + 1.0)
    until(lambda: each.statistics().held == 0)
    until(lambda: len(inbox.delivered) + len(inbox.dropped) == 600)
    names = Counter(message.point.x for message, *_ in inbox.delivered + inbox.dropped)
    assert len(names) == 600
    assert threading.main_thread() not in inbox.threads
    assert set(inbox.reasons()) <= {Drop.QUEUE_FULL}
    for message, found in inbox.delivered:
        assert found.header.stamp == message.header.stamp
