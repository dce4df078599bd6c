# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Listeners of tf2's kind, in programs that spin their node in tf2's ways."""

import textwrap
import threading
import time

from dropin_helpers import LISTENS, run
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
from ros_helpers import (
    at,
    lasting,
    PATIENCE,
    PATIENCE_S,
    result_of,
    SIM_TIME,
    simulated_seconds,
    transform,
    until,
)
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from tf_tree_py.dropin import listener as listener_module

pytestmark = pytest.mark.usefixtures('installed')


@pytest.fixture
def spinner(context, node):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield executor
    executor.shutdown()


def spin_until(executor, condition):
    """Spin like programs, each time until something happens on the node."""
    while not condition():
        begin = time.monotonic()
        executor.spin_once(timeout_sec=PATIENCE_S)
        assert time.monotonic() - begin < PATIENCE_S, 'nothing woke it'


@pytest.fixture
def begin():
    """Return a function that creates listeners of tf2_ros, closed at the end of the test."""
    listeners = []

    def make(*arguments, **options):
        import tf2_ros
        listeners.append(tf2_ros.TransformListener(*arguments, **options))
        return listeners[-1]

    yield make
    for listener in listeners:
        listener.unregister()


def test_loop_of_spin_once_ends_when_the_transform_has_come(node, talker, spinner, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    talker.move(transform('map', 'odom', 1.0))
    talker.move(transform('odom', 'base', 1.0))
    spin_until(spinner, lambda: buffer.can_transform('map', 'base', Time()))
    assert buffer.lookup_transform('map', 'base', Time()).child_frame_id == 'base'


def test_each_message_wakes_the_loop_anew(node, talker, spinner, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    for second in range(1, 4):
        talker.move(transform('map', 'odom', second))
        spin_until(spinner, lambda second=second: buffer.can_transform('map', 'odom', at(second)))


@pytest.fixture
def late(monkeypatch):
    """Insert each batch a moment later than it was received, until this event is set."""
    import tf2_ros
    insert_batch = tf2_ros.Buffer.insert_batch

    def insert_late(*batch, **options):
        late.wait(0.02)
        return insert_batch(*batch, **options)

    late = threading.Event()
    monkeypatch.setattr(tf2_ros.Buffer, 'insert_batch', insert_late)
    monkeypatch.setattr('tf_tree_py.dropin.buffer.LONGEST_S', PATIENCE_S)
    return late


@pytest.mark.parametrize('timeout', [[], [lasting(0.001)]], ids=['no timeout', 'a short timeout'])
def test_callback_sees_the_transform_that_was_sent_before_its_message(
        node, talker, spinner, begin, late, timeout):
    """As in tf2, where one thread reads both; here another thread reads transforms."""
    import tf2_ros
    buffer, found = tf2_ros.Buffer(), []
    begin(buffer, node)
    publisher = talker.node.create_publisher(Header, 'image', 10)
    node.create_subscription(Header, 'image', lambda header: found.append(
        buffer.lookup_transform('map', 'base', header.stamp, *timeout).header.stamp), 10)
    until(publisher.get_subscription_count)
    for second in range(1, 6):
        talker.move(transform('map', 'base', second))
        publisher.publish(Header(stamp=at(second).to_msg()))
        spin_until(spinner, lambda second=second: len(found) == second)
    # What will never come is not waited for.
    late.set()
    with pytest.raises(tf2_ros.ExtrapolationException):
        buffer.lookup_transform('map', 'base', at(9.0))


@pytest.mark.parametrize('look', [
    lambda buffer: buffer.lookup_transform('map', 'base', Time(), max_age=lasting(5e9)).header,
    lambda buffer: buffer.lookup_transform_newest('map', 'base').transform.header,
], ids=['no older', 'newest'])
def test_callback_sees_also_the_latest_that_was_sent_before_its_message(
        node, talker, spinner, begin, late, look):
    """With a limit that even a stamp of 1970 is within."""
    import tf2_ros
    buffer, found = tf2_ros.Buffer(), []
    begin(buffer, node)
    publisher = talker.node.create_publisher(Header, 'image', 10)
    node.create_subscription(
        Header, 'image', lambda header: found.append(look(buffer).stamp), 10)
    until(publisher.get_subscription_count)
    talker.move(transform('map', 'base', 1.0))
    publisher.publish(Header())
    spin_until(spinner, lambda: found)
    assert found == [at(1.0).to_msg()]


def test_callback_may_wait(node, talker, spinner, begin):
    """tf2 cannot do this."""
    import tf2_ros
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    found = []

    def look():
        timer.cancel()
        found.append(buffer.lookup_transform('map', 'base', Time(), PATIENCE))

    timer = node.create_timer(0.0, look)
    talker.fix(transform('map', 'base'))
    spin_until(spinner, lambda: found)
    assert found[0].header.frame_id == 'map'


EVENTS_EXECUTOR_SPINS = LISTENS + """
    import threading, time
    from rclpy.experimental import EventsExecutor

    executor = EventsExecutor()
    executor.add_node(node)
    async def look():
        await buffer.lookup_transform_async('base', 'lidar', Time())
    executor.create_task(look)
    future = buffer.wait_for_transform_async('base', 'lidar', Time())
    ended = threading.Event()
    future.add_done_callback(lambda future: ended.set())
    threading.Thread(target=executor.spin, daemon=True).start()
    for number in range(20):
        message.child_frame_id = f'sensor{number}'
        broadcaster.sendTransform(message)
        assert buffer.can_transform('base', message.child_frame_id, Time(),
                                    rclpy.duration.Duration(seconds=20))
    message.child_frame_id = 'lidar'
    broadcaster.sendTransform(message)
    assert ended.wait(20)
    print('goes on', flush=True)
    import os
    os._exit(0)
"""


def test_events_executor_that_spins_without_a_timeout_stops_no_thread(program):
    """It delivers nothing in the wheels; but it must not stop all threads of Python."""
    pytest.importorskip('rclpy.experimental')
    result = run('-m', 'tf_tree_py.dropin', '--force', program(EVENTS_EXECUTOR_SPINS))
    assert result.stdout == 'goes on\n', result.stderr


@pytest.mark.usefixtures('woken_events_executor')
def test_events_executor_spins_the_node_and_is_woken(node, talker, context, begin):
    import tf2_ros
    experimental = pytest.importorskip('rclpy.experimental')
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    executor = experimental.EventsExecutor(context=context)
    executor.add_node(node)
    talker.move(transform('map', 'odom', 1.0))
    spin_until(executor, lambda: buffer.can_transform('map', 'odom', Time()))
    executor.shutdown()


def test_timeout_passes_without_a_clock_as_in_tf2(make_node, begin, spin):
    import tf2_ros
    node = make_node('simulated', **SIM_TIME)
    buffer = tf2_ros.Buffer(node=node)
    begin(buffer, node)
    assert simulated_seconds(buffer) == 0.0
    with pytest.raises(tf2_ros.LookupException):
        buffer.lookup_transform('map', 'base', Time(), lasting(0.05))
    spin(node)
    with pytest.raises(tf2_ros.LookupException):
        result_of(buffer.wait_for_transform_async('map', 'base', Time(), lasting(0.05)))


WAITS_BY_SPIN_ONCE = LISTENS + """
    rclpy.spin_once(node)
    print('returned')
    rclpy.shutdown()
"""


def test_first_spin_once_returns_for_what_came_before(program):
    result = run('-m', 'tf_tree_py.dropin', '--force', program(WAITS_BY_SPIN_ONCE))
    assert 'returned' in result.stdout, result.stderr


@pytest.fixture
def spun_soon(monkeypatch):
    """Let the listener check early whether its node is spun; return the threads that do."""
    monkeypatch.setattr(listener_module, 'UNTIL_SPUN_S', 0.2)
    threads, spin_if_nobody_does = [], listener_module.spin_if_nobody_does
    monkeypatch.setattr(
        listener_module, 'spin_if_nobody_does',
        lambda node: threads.append(spin_if_nobody_does(node)))
    return threads


def test_node_that_nobody_spins_is_spun_with_spin_thread(node, begin, spun_soon):
    import tf2_ros
    ticked = threading.Event()
    node.create_timer(0.0, ticked.set)
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    assert ticked.wait(PATIENCE_S)
    assert node.executor is not None


def test_node_that_is_spun_is_left_to_who_spins_it(node, spin, begin, spun_soon):
    import tf2_ros
    spin(node)
    executor = node.executor
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    spun_soon[0].join(PATIENCE_S)
    assert not spun_soon[0].is_alive()
    assert node.executor is executor


def test_node_of_spin_thread_is_taken_over_by_who_spins_it_later(
        node, context, begin, spun_soon):
    import tf2_ros
    ticking = set()
    node.create_timer(0.01, lambda: ticking.add(threading.current_thread()))
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    until(lambda: spun_soon[0] in ticking)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spin_until(executor, lambda: threading.current_thread() in ticking)
    assert node.executor is executor
    executor.shutdown()


def test_node_of_spin_thread_is_left_alone(node, begin):
    import tf2_ros
    before = len(list(node.subscriptions)), len(list(node.guards))
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    assert node.executor is None
    assert (len(list(node.subscriptions)), len(list(node.guards))) == before


def test_static_listener_leaves_tf_alone(node, talker, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.StaticTransformListener(buffer, node)
    talker.fix(transform('base', 'camera'))
    buffer.lookup_transform('base', 'camera', Time(), PATIENCE)
    assert node.count_subscribers('/tf') == 0
    listener.unregister()


def test_overridden_callback_gets_every_message(node, talker, spinner):
    import tf2_ros
    heard = []

    class Listener(tf2_ros.TransformListener):
        """As in programs that process each message."""

        def callback(self, data):
            super().callback(data)
            heard.append([transform.child_frame_id for transform in data.transforms])

    buffer = tf2_ros.Buffer()
    listener = Listener(buffer, node)
    talker.move(transform('map', 'base', 1.0), transform('base', 'arm', 1.0))
    spin_until(spinner, lambda: heard)
    assert heard == [['base', 'arm']]
    assert buffer.can_transform('map', 'arm', at(1.0))
    listener.unregister()


def test_buffer_with_its_own_set_transform_gets_every_transform(node, talker, spinner, begin):
    import tf2_ros
    heard = []

    class Spying(tf2_ros.Buffer):
        """As in programs that observe the transforms that arrive."""

        def set_transform_static(self, transform, authority):
            heard.append(transform.child_frame_id)
            super().set_transform_static(transform, authority)

    buffer = Spying()
    begin(buffer, node)
    talker.fix(transform('base', 'camera'))
    spin_until(spinner, lambda: heard)
    assert heard == ['camera']
    assert buffer.can_transform('base', 'camera', Time())


def test_subscription_may_be_replaced(node, talker, spinner, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    listener = begin(buffer, node)
    assert node.destroy_subscription(listener.tf_sub)
    listener.tf_sub = node.create_subscription(TFMessage, '/robot/tf', listener.callback, 10)
    talker.send(TFMessage(transforms=[transform('map', 'base', 1.0)]), '/robot/tf')
    talker.fix(transform('base', 'camera'))
    spin_until(spinner, lambda: buffer.can_transform('map', 'camera', at(1.0)))
    assert node.count_subscribers('/tf') == 0
    listener.unregister()
    assert node.count_subscribers('/robot/tf') == node.count_subscribers('/tf_static') == 0


def test_buffer_may_be_replaced(node, talker, spinner, begin):
    import tf2_ros
    listener = begin(tf2_ros.Buffer(), node)
    for _ in range(2):
        listener.buffer = buffer = tf2_ros.Buffer()
        talker.move(transform('map', 'base', 1.0))
        spin_until(spinner, lambda: listener.buffer.can_transform('map', 'base', at(1.0)))
        assert len(buffer.frames()) == 2


LEAVES_THE_SPINNING_TO_THE_LISTENER = """
    import rclpy
    from tf2_ros import Buffer, TransformListener

    rclpy.init()
    node = rclpy.create_node('leaves_it')
    buffer = Buffer()
    listener = TransformListener(buffer, node, spin_thread=True)
    rate = node.create_rate(10)
    for _ in range(2):
        rate.sleep()
    print('slept')
"""


@pytest.mark.parametrize('end', [
    'rclpy.shutdown()', 'pass', 'raise SystemExit', 'node.destroy_node()'])
def test_program_that_nobody_spins_sleeps_and_ends(program, end):
    code = textwrap.dedent(LEAVES_THE_SPINNING_TO_THE_LISTENER) + end
    result = run('-m', 'tf_tree_py.dropin', '--force', program(code))
    assert 'slept' in result.stdout, result.stderr
    assert result.returncode == 0, result.stderr
    assert 'Traceback' not in result.stderr
