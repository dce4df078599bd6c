# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The thread that takes a listener's messages, with rclpy's wait set and without."""

from contextlib import closing, suppress
import functools
import os
import sys
import threading

import pytest
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from ros_helpers import (
    at,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    SIM_TIME,
    simulated_seconds,
    Talker,
    transform,
    until,
    until_waiting,
)
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, BufferClient, LookupException, TransformException, TransformListener
from tf_tree_py.ros.threads import receiver as receiver_module
from tf_tree_py.ros.threads.receiver import HAS_WAIT_SET, Receiver
from tf_tree_py.ros.topics import listener as listener_module


@pytest.fixture(params=[True, False], ids=['wait_set', 'executor'])
def use_wait_set(request):
    return request.param


@pytest.fixture
def receive(context, make_node, use_wait_set):
    """Serve callbacks of String topics in a receiver, which owns its node."""
    receivers = []

    def begin(**callbacks):
        node = make_node('received')
        for topic, callback in callbacks.items():
            node.create_subscription(String, topic, callback, 1000, raw=True)
        receivers.append(Receiver(node, ended.set, use_wait_set=use_wait_set))
        return receivers[-1]

    ended = threading.Event()
    begin.ended = ended
    yield begin
    for receiver in receivers:
        receiver.close()


@pytest.fixture
def publish(make_node):
    node = make_node('publishing')
    publishers = {}

    def send(topic, *texts):
        if topic not in publishers:
            publishers[topic] = node.create_publisher(String, topic, 1000)
            until(lambda: publishers[topic].get_subscription_count())
        for text in texts:
            publishers[topic].publish(String(data=text))

    return send


@pytest.fixture
def pour(make_node):
    """Publish continuously, like a robot, until the end of the test or of ROS."""
    stop, threads = threading.Event(), []

    def begin(topic):
        publisher = make_node('pouring').create_publisher(String, topic, 100)

        def publish():
            with suppress(Exception):  # after the context has ended
                while not stop.wait(0.0005):
                    publisher.publish(String(data='x'))

        threads.append(threading.Thread(target=publish))
        threads[-1].start()

    yield begin
    stop.set()
    for thread in threads:
        thread.join()


def text_of(data):
    return deserialize_message(data, String).data


def test_this_rclpy_has_what_the_fast_path_needs():
    assert HAS_WAIT_SET


def test_messages_arrive_in_order_in_one_daemon_thread(receive, publish):
    got, threads, done = [], set(), threading.Event()

    def take(data):
        got.append(text_of(data))
        threads.add(threading.current_thread())
        if got[-1] == 'end':
            done.set()

    receiver = receive(topic=take)
    texts = [str(i) for i in range(500)]
    publish('topic', *texts, 'end')
    assert done.wait(PATIENCE_S)
    assert got == [*texts, 'end']
    assert threads == {receiver.thread}
    assert receiver.thread.daemon


def test_exception_in_a_callback_is_logged_and_the_next_message_gets_through(
        receive, publish, log):
    done = threading.Event()

    def take(data):
        if text_of(data) == 'bad':
            raise ValueError('it was bad')
        done.set()

    receive(topic=take)
    publish('topic', 'bad', 'good')
    assert done.wait(PATIENCE_S)
    until(lambda: 'ValueError: it was bad' in log())
    assert 'failed:' in log()
    assert 'Traceback' in log()


def test_flooded_topic_does_not_starve_the_other(receive, publish):
    """The single message of the other is processed long before the end of the flood."""
    seen, done = [], threading.Event()

    def flood(data):
        seen.append('flood')
        if text_of(data) == 'end':
            done.set()

    blocked = threading.Event()

    def hold(_):
        if not blocked.is_set():
            blocked.wait(PATIENCE_S)
        seen.append('other')

    receive(flood=flood, other=hold)
    publish('other', 'hold')
    publish('flood', *['x'] * 900, 'end')
    publish('other', 'quick')
    blocked.set()
    assert done.wait(PATIENCE_S)
    assert seen.index('other', 1) < 500


def test_closing_ends_the_thread_and_destroys_the_node(receive, publish):
    receiver = receive(topic=lambda _: None)
    publish('topic', 'x')
    receiver.close()
    assert not receiver.thread.is_alive()
    assert receive.ended.is_set()
    receiver.close()
    receiver.stop()
    receiver.wake()


def test_closing_from_a_callback_does_not_wait_for_itself(receive, publish):
    returned = threading.Event()
    receiver = receive(topic=lambda _: (receiver.close(), returned.set()))
    publish('topic', 'x')
    assert returned.wait(PATIENCE_S)
    assert receive.ended.wait(PATIENCE_S)
    receiver.thread.join(PATIENCE_S)
    assert not receiver.thread.is_alive()


def test_closing_while_messages_pour_in(receive, pour):
    for i in range(3):
        arrived = threading.Semaphore(0)
        receiver = receive(**{f'topic_{i}': lambda _, arrived=arrived: arrived.release()})
        pour(f'topic_{i}')
        for _ in range(50):
            assert arrived.acquire(timeout=PATIENCE_S)
        receiver.stop()
        receiver.thread.join(PATIENCE_S)
        assert not receiver.thread.is_alive()


def test_end_of_the_context_ends_the_thread(receive, context):
    receiver = receive(topic=lambda _: None)
    context.shutdown()
    assert receive.ended.wait(PATIENCE_S)
    receiver.thread.join(PATIENCE_S)
    assert not receiver.thread.is_alive()


def test_end_of_the_context_while_messages_pour_in_is_quiet(receive, context, pour, log):
    arrived = threading.Semaphore(0)
    receiver = receive(topic=lambda _: arrived.release())
    pour('topic')
    for _ in range(50):
        assert arrived.acquire(timeout=PATIENCE_S)
    context.shutdown()
    receiver.thread.join(PATIENCE_S)
    assert not receiver.thread.is_alive()
    assert 'Traceback' not in log()


def test_subscription_that_comes_while_messages_pour_in_is_served(receive, publish, pour):
    receiver = receive(topic=lambda _: None)
    pour('topic')
    for i in range(5):
        served = threading.Event()
        subscription = receiver._node.create_subscription(
            String, f'other_{i}', lambda _, served=served: served.set(), 1, raw=True)
        receiver.wake()
        publish(f'other_{i}', 'x')
        assert served.wait(PATIENCE_S)
        receiver._node.destroy_subscription(subscription)
        receiver.wake()
    assert receiver.thread.is_alive()


def test_subscription_that_is_destroyed_just_before_the_wait_does_no_harm(receive, publish):
    receiver = receive(topic=lambda _: None)
    subscription = receiver._node.create_subscription(String, 'gone', print, 1, raw=True)
    # In the opposite order of rclpy's own, so that the receiver certainly sees it.
    subscription.destroy()
    receiver.wake()
    done = threading.Event()
    receiver._node.create_subscription(String, 'last', lambda _: done.set(), 1, raw=True)
    receiver._node.destroy_subscription(subscription)
    receiver.wake()
    publish('last', 'x')
    assert done.wait(PATIENCE_S)


# --- the listener on each of the two


@pytest.fixture
def either(monkeypatch, use_wait_set):
    """Make every listener of the test use one or the other."""
    monkeypatch.setattr(
        listener_module, 'Receiver',
        functools.partial(Receiver, use_wait_set=use_wait_set))


@pytest.mark.usefixtures('either')
def test_listener_hears_and_waits(node, listen, talker, pool):
    buffer = listen(node)
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(2.0), PATIENCE)
    until_waiting(buffer)
    talker.fix(transform('base', 'camera'))
    talker.move(transform('map', 'base', 2.0))
    asked.result(PATIENCE_S)
    talker.send(b'\0\1')
    talker.move(transform('map', 'base', 3.0))
    buffer.lookup_transform('map', 'camera', at(3.0), PATIENCE)


@pytest.mark.usefixtures('either')
def test_listener_follows_simulated_time(make_node, listen, sim_clock):
    node = make_node('simulated', **SIM_TIME)
    buffer = listen(node)
    sim_clock.show(10.0, buffer)
    sim_clock.show(5.0, buffer)
    node.set_parameters([Parameter('use_sim_time', value=False)])
    assert simulated_seconds(buffer) is None
    node.set_parameters([Parameter('use_sim_time', value=True)])
    sim_clock.show(6.0, buffer)


@pytest.mark.usefixtures('either')
def test_listener_ends_with_its_context(context, node, pool):
    buffer = Buffer()
    TransformListener(buffer, node)
    asked = pool.submit(buffer.lookup_transform, 'a', 'b', LATEST, PATIENCE)
    until_waiting(buffer)
    context.shutdown()
    with pytest.raises(LookupException, match='Given up'):
        asked.result(PATIENCE_S)
    until(lambda: not [t for t in threading.enumerate() if t.name.endswith('receiver')])


@pytest.mark.usefixtures('either')
def test_publisher_of_another_quality_is_reported(node, make_node, listen, log):
    listen(node)
    make_node('careless').create_publisher(listener_module.TFMessage, '/tf_static', 1)
    until(lambda: 'offering incompatible QoS' in log())


def test_without_the_wait_set_an_executor_is_the_default():
    assert Receiver.__init__.__kwdefaults__['use_wait_set'] is receiver_module.HAS_WAIT_SET


def test_two_hundred_listeners_leave_nothing_behind(make_node, context):
    """Threads, file descriptors, DDS entities, callbacks of the context and of the node."""
    node = make_node('busy')

    def open_files():
        return len(os.listdir('/proc/self/fd')) if sys.platform == 'linux' else 0

    def turn(count):
        for _ in range(count):
            TransformListener(Buffer(), node).close()

    turn(5)
    threads, files = threading.active_count(), open_files()
    shutdown_callbacks = len(context._callbacks)
    turn(200)
    assert threading.active_count() == threads
    assert open_files() <= files + 2
    assert len(context._callbacks) == shutdown_callbacks
    assert node._post_set_parameters_callbacks == []
    # The graph also shows processes of earlier tests, until DDS has missed those that were killed.
    until(lambda: node.get_node_names() == ['busy'])
    until(lambda: node.get_subscriptions_info_by_topic('/tf') == [])
    with TransformListener(Buffer(), node) as listener:
        Talker(node).fix(transform('a', 'b'))
        listener.buffer.lookup_transform('a', 'b', LATEST, PATIENCE)


def test_receiver_rests_between_messages_that_come_fast(make_node, context):
    """Resting ends when a thread waits, so that it does not delay that thread."""
    buffer = Buffer()
    rests = []

    def rest(seconds):
        rests.append(seconds)
        buffer.waiting.sleep_until_somebody(seconds)

    home = make_node('home')
    receiver = Receiver(home, lambda: None, rest=rest)
    received = []
    home.create_subscription(TFMessage, '/tf', received.append, 1000, raw=True)
    receiver.wake()
    talker = Talker(make_node('talker'))
    for _ in range(300):
        talker.send(TFMessage())
    until(lambda: len(received) == 300)
    receiver.close()
    assert rests
    assert max(rests) < 0.005


def test_nobody_sleeps_while_somebody_waits():
    buffer = Buffer()
    began = threading.Event()

    def wait():
        began.set()
        with suppress(TransformException):
            buffer.lookup_transform('map', 'base', LATEST, PATIENCE)

    thread = threading.Thread(target=wait)
    thread.start()
    began.wait(PATIENCE_S)
    until(lambda: len(buffer.waiting) == 1)
    # Otherwise it would sleep for an hour.
    buffer.waiting.sleep_until_somebody(3600.0)
    buffer.waiting.fail(TransformException('enough'))
    thread.join(PATIENCE_S)
    assert not buffer.waiting.sleep_until_somebody(0.0)


def test_no_guard_condition_is_given_to_the_signal_thread_of_rclpy(node, listen, monkeypatch):
    """The signal thread may read one while it is destroyed (docs/ending.md)."""
    registered = []
    monkeypatch.setattr(rclpy_implementation, 'register_sigint_guard_condition',
                        registered.append)
    listen(node)
    with closing(BufferClient(node, 'server')):
        pass
    assert registered == []
