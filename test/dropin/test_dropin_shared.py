# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Unchanged programs that look up in the tree of another process, by TF_TREE_SHARED=1."""

import os
import threading
import time

from dropin_helpers import run
import pytest
from rclpy.time import Time
from ros_helpers import at, PATIENCE_S, transform, until, until_waiting
from tf_tree_py import SharedTreeException
from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.listener import TransformListener

pytestmark = pytest.mark.usefixtures('shares')


@pytest.fixture
def shares(monkeypatch):
    monkeypatch.setenv('TF_TREE_SHARED', '1')


@pytest.fixture
def buffer():
    return Buffer()


@pytest.fixture
def listener(buffer, node, writer):
    listener = TransformListener(buffer, node)
    yield listener
    listener.unregister()


def test_listener_does_not_subscribe(buffer, node, listener, talker):
    assert buffer.is_shared
    talker.move(transform('map', 'base', 1.0, x=1.0))
    until(lambda: buffer.can_transform('map', 'base', at(1.0)))
    until(lambda: node.count_subscribers('/tf') == 1)


def test_loop_of_spin_once_ends_when_a_transform_has_arrived(buffer, listener, writer, node,
                                                             executor):
    executor.add_node(node)
    timer = threading.Timer(0.05, writer.set_transform, [transform('map', 'base'), 'me'])
    timer.start()
    while not buffer.can_transform('map', 'base', Time()):
        begin = time.monotonic()
        executor.spin_once(timeout_sec=PATIENCE_S)
        assert time.monotonic() - begin < PATIENCE_S, 'a program gives no timeout'
    timer.join()


def test_thread_that_spins_calls_back(buffer, listener, writer, node, executor):
    threads = []
    future = buffer.wait_for_transform_async('map', 'base', Time())
    future.add_done_callback(lambda _: threads.append(threading.current_thread()))
    until_waiting(buffer)
    writer.set_transform(transform('map', 'base'), 'me')
    until(future.done)
    executor.add_node(node)
    while not threads:
        executor.spin_once(timeout_sec=PATIENCE_S)
    assert threads == [threading.current_thread()]


def test_subscription_that_a_program_asks_for_changes_nothing(buffer, listener, writer, node,
                                                              talker, spin):
    assert listener.tf_sub.topic_name == '/tf' and listener.tf_static_sub
    spin(node)
    talker.move(transform('map', 'base', 1.0, x=1.0), listeners=2)
    until(lambda: buffer.can_transform('map', 'base', at(1.0)))
    listener.callback(_message(transform('map', 'other')))
    listener.static_callback(_message(transform('map', 'other')))
    assert 'other' not in buffer.frames()
    with pytest.raises(SharedTreeException):
        buffer.set_transform(transform('map', 'other'), 'me')


def _message(*transforms):
    from tf2_msgs.msg import TFMessage
    return TFMessage(transforms=transforms)


@pytest.mark.usefixtures('writer')
def test_listener_of_a_program_that_reads_messages_itself_fills_the_buffer(node, talker, spin):
    class Counting(TransformListener):
        count = 0

        def callback(self, data):
            self.count += len(data.transforms)
            super().callback(data)

    buffer = Buffer()
    listener = Counting(buffer, node)
    spin(node)
    talker.move(transform('map', 'base', 1.0), listeners=2)
    until(lambda: listener.count == 1)
    assert not buffer.is_shared and buffer.can_transform('map', 'base', at(1.0))
    listener.unregister()


@pytest.mark.parametrize('spin_thread', [False, True])
def test_nothing_of_it_is_left_on_the_node(writer, node, spin_thread):
    before = len(list(node.timers))
    TransformListener(Buffer(), node, spin_thread=spin_thread).unregister()
    assert len(list(node.timers)) == before


def test_program_runs_unchanged(writer, program):
    writer.set_transform(transform('map', 'base', 1.0, x=2.0), 'me')
    file = program("""
        import rclpy
        from rclpy.time import Time
        import tf2_ros

        rclpy.init()
        node = rclpy.create_node('listens')
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer, node)
        while not buffer.can_transform('map', 'base', Time()):
            rclpy.spin_once(node)
        print(buffer.lookup_transform('map', 'base', Time()).transform.translation.x)
        try:
            buffer.set_transform(tf2_ros.TransformStamped(), 'me')
        except tf2_ros.TransformException as error:
            print(error)
        rclpy.shutdown()
    """)
    result = run('-m', 'tf_tree_py.dropin', '--force', file)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith('2.0\nThis tree is that of another process')
    assert f'Looking up transforms in the tree of tf_share (process {os.getpid()}, ' in (
        result.stderr)
