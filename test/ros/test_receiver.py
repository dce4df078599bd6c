# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The thread that takes a listener's messages, with rclpy's wait set and without."""

from contextlib import closing, suppress
import os
import sys
import threading

from domains import claim
import pytest
import rclpy
from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from ros_helpers import PATIENCE_S, until
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, BufferClient, TransformListener
from tf_tree_py.ros.threads.receiver import HAS_WAIT_SET, Receiver


@pytest.fixture
def receive(make_node, use_wait_set):
    """Serve callbacks of String topics in a receiver, which owns its node."""
    receivers = []

    def begin(**callbacks):
        begin.node = make_node('received')
        for topic, callback in callbacks.items():
            begin.node.create_subscription(String, topic, callback, 1000, raw=True)
        receivers.append(Receiver(begin.node, begin.ended.set))
        return receivers[-1]

    begin.ended = threading.Event()
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
def pour(publish, pool):
    """Publish continuously, like a robot, until the end of the test or of ROS."""
    stop = threading.Event()

    def publish_on(topic):
        with suppress(Exception):  # after the context has ended
            while not stop.wait(0.0005):
                publish(topic, 'x')

    yield lambda topic: pool.submit(publish_on, topic)
    stop.set()


def test_wait_set_is_used_where_rclpy_has_it():
    assert HAS_WAIT_SET
    assert Receiver.__init__.__kwdefaults__['use_wait_set'] is HAS_WAIT_SET


def test_flooded_topic_keeps_its_order_and_does_not_starve_the_other(receive, publish):
    """The single message of the other is processed long before the end of the flood."""
    def note(data):
        if not seen:
            published.wait(PATIENCE_S)
        seen.append(deserialize_message(data, String).data)
        threads.add(threading.current_thread())

    seen, threads, published = [], set(), threading.Event()
    receiver = receive(flood=note, other=note)
    texts = [str(number) for number in range(900)]
    publish('flood', *texts)
    publish('other', 'quick')
    published.set()
    until(lambda: len(seen) == 901)
    assert seen.index('quick') < 500
    assert [each for each in seen if each != 'quick'] == texts
    assert threads == {receiver.thread}
    assert receiver.thread.daemon


@pytest.mark.parametrize('end', ['close', 'stop', 'shutdown', 'close in a callback'])
def test_receiver_ends_quietly_while_messages_pour_in(receive, context, pour, log, end):
    def noted(_):
        if end == 'close in a callback':
            receiver.close()
        arrived.append('x')

    arrived = []
    receiver = receive(topic=noted)
    pour('topic')
    until(lambda: len(arrived) >= 50 or not receiver.thread.is_alive())
    {'close': receiver.close, 'stop': receiver.stop, 'shutdown': context.shutdown}.get(end, int)()
    receiver.thread.join(PATIENCE_S)
    assert not receiver.thread.is_alive()
    assert receive.ended.is_set()
    assert arrived, 'so a callback does not wait for its own thread'
    for again in (receiver.close, receiver.stop, receiver.wake):
        again()
    assert 'Traceback' not in log()


def test_subscriptions_may_come_and_go_while_messages_pour_in(receive, publish, pour):
    receiver = receive(topic=lambda _: None)
    pour('topic')
    gone = []
    for number in range(6):
        served = threading.Event()
        subscription = receive.node.create_subscription(
            String, f'other_{number}', lambda _, served=served: served.set(), 1, raw=True)
        for each in gone:
            receive.node.destroy_subscription(each)
        receiver.wake()
        publish(f'other_{number}', 'x')
        assert served.wait(PATIENCE_S)
        gone = [subscription]
        if number % 2:
            # In the opposite order of rclpy's own, so that the receiver certainly sees it.
            subscription.destroy()
            receiver.wake()
    assert receiver.thread.is_alive()


# --- the listener on each of the two


@pytest.mark.usefixtures('use_wait_set')
def test_publisher_whose_profile_does_not_match_is_warned_about(node, make_node, listen, log):
    listen(node)
    make_node('careless').create_publisher(TFMessage, '/tf_static', 1)
    until(lambda: "topic '/tf_static', offering incompatible QoS" in log()
          and 'DURABILITY' in log())


@pytest.fixture
def empty_domain():
    """Return a context in a DDS domain of its own, whose graph shows nothing of other tests."""
    context = Context()
    rclpy.init(context=context, args=[], domain_id=claim())
    yield context
    context.try_shutdown()


def test_two_hundred_listeners_leave_nothing_behind(empty_domain, make_node):
    """Threads, file descriptors, DDS entities, callbacks of the context and of the node."""
    node = make_node('busy', context=empty_domain)

    def open_files():
        return len(os.listdir('/proc/self/fd')) if sys.platform == 'linux' else 0

    def turn(count):
        for _ in range(count):
            TransformListener(Buffer(), node).close()

    def callbacks():
        return len(empty_domain._callbacks), len(node._post_set_parameters_callbacks)

    turn(5)
    threads, files, before = set(threading.enumerate()), open_files(), callbacks()
    turn(200)
    # Those of earlier tests may end meanwhile.
    assert set(threading.enumerate()) <= threads
    assert open_files() <= files + 2
    assert callbacks() == before and not before[1]
    until(lambda: node.get_node_names() == ['busy'])
    until(lambda: node.get_subscriptions_info_by_topic('/tf') == [])


def test_receiver_rests_between_messages_that_come_fast(make_node, publish):
    def note(data):
        begin.wait(PATIENCE_S)
        received.append(data)

    rests, received, begin, home = [], [], threading.Event(), make_node('home')
    home.create_subscription(String, 'topic', note, 1000, raw=True)
    receiver = Receiver(home, int, rest=rests.append)
    publish('topic', *['x'] * 900)
    begin.set()
    until(lambda: len(received) == 900)
    receiver.close()
    assert rests
    assert max(rests) < 0.005


@pytest.mark.parametrize('has_ended', [True, False])
def test_error_of_rclpy_is_raised_unless_ros_has_ended(
        make_node, pour, context, monkeypatch, has_ended):
    def rest(_):
        if has_ended:
            context.shutdown()
        raise RuntimeError('as of rclpy')

    raised, home, ended = [], make_node('home'), threading.Event()
    monkeypatch.setattr(threading, 'excepthook', lambda error: raised.append(error.exc_value))
    home.create_subscription(String, 'topic', lambda _: None, 1000, raw=True)
    receiver = Receiver(home, ended.set, rest=rest)
    pour('topic')
    receiver.thread.join(PATIENCE_S)
    assert ended.is_set()
    assert [str(error) for error in raised] == ([] if has_ended else ['as of rclpy'])


@pytest.mark.parametrize('use_wait_set', [True], indirect=True)
def test_shutdown_returns_when_no_message_is_read_any_more(
        receive, context, publish, monkeypatch):
    monkeypatch.setattr('tf_tree_py.ros.threads.receiver.LAST_READ_S', PATIENCE_S)
    order, is_reading, is_stopped = [], threading.Event(), threading.Event()

    def take(_):
        is_reading.set()
        is_stopped.wait(PATIENCE_S)
        order.append('read')

    receiver = receive(topic=take)
    stop = receiver.stop
    monkeypatch.setattr(receiver, 'stop', lambda: (stop(), is_stopped.set()))
    publish('topic', 'x')
    assert is_reading.wait(PATIENCE_S)
    context.shutdown()
    order.append('shut down')
    receiver.thread.join(PATIENCE_S)
    assert order == ['read', 'shut down']


@pytest.mark.parametrize('use_wait_set', [True], indirect=True)
def test_callbacks_that_hang_hold_up_a_shutdown_for_one_limit_together(
        receive, context, publish, monkeypatch):
    monkeypatch.setattr('tf_tree_py.ros.threads.receiver.LAST_READ_S', 0.05)
    hanging, ends = threading.Semaphore(0), threading.Event()

    def hang(_):
        hanging.release()
        ends.wait(PATIENCE_S)

    receivers = [receive(topic=hang) for _ in range(3)]
    publish('topic', 'x')
    for _ in receivers:
        assert hanging.acquire(timeout=PATIENCE_S)
    limits, wait = [], Receiver.wait_for_last_read
    monkeypatch.setattr(Receiver, 'wait_for_last_read', lambda receiver, limit: (
        limits.append(max(limit, 0.0)), wait(receiver, limit)))
    context.shutdown()
    ends.set()
    assert len(limits) == 3 and sum(limits) <= 0.06


def test_callback_that_ends_ros_does_not_wait_for_its_own_thread(
        receive, context, publish, monkeypatch):
    monkeypatch.setattr('tf_tree_py.ros.threads.receiver.LAST_READ_S', 10.0 * PATIENCE_S)
    receiver = receive(topic=lambda _: context.shutdown())
    publish('topic', 'x')
    receiver.thread.join(PATIENCE_S)
    assert not receiver.thread.is_alive()


def test_no_guard_condition_is_given_to_the_signal_thread_of_rclpy(node, listen, monkeypatch):
    """The signal thread may read one while it is destroyed (docs/ending.md)."""
    registered = []
    monkeypatch.setattr(rclpy_implementation, 'register_sigint_guard_condition',
                        registered.append)
    listen(node)
    with closing(BufferClient(node, 'server')):
        pass
    assert registered == []
