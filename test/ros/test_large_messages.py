# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Large messages of a new layout: others overtake them, and none of their transforms is lost."""

import gc
import sys
import threading

import pytest
from rclpy.duration import Duration
from ros_helpers import at, PATIENCE, PATIENCE_S, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer
from tf_tree_py.core import Kind
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.message_layout import STEP
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.ros.threads.backlog import Backlog
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.topics import listener
from tf_tree_py.ros.topics.qos import static_listener_qos

LARGE = 2_000
EITHER_THREAD = pytest.mark.parametrize('spin_thread', [True, False])


class Order(Observer):
    """
    The number of transforms in each message, in the order in which a buffer takes them.

    The first message is only taken when ``go_on`` is set.
    """

    def __init__(self):
        self.sizes = []
        self.began, self.go_on = threading.Event(), threading.Event()

    def received(self, arrival):
        self.sizes.append(len(arrival.batch.edges))
        self.began.set()
        assert self.go_on.wait(PATIENCE_S)


def message(count, second=1, prefix='frame'):
    return write([Sample('map', f'{prefix}_{number}', second * 10**9,
                         (float(number), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
                  for number in range(count)])


def is_whole(buffer, second=1):
    return all(buffer.lookup_transform('map', f'frame_{number}', at(second), PATIENCE)
               .transform.translation.x == number for number in range(0, LARGE, STEP - 1))


@pytest.fixture
def publisher(make_node):
    node = make_node('crowd')
    return node.create_publisher(TFMessage, '/tf', 100)


def send_while_it_waits(buffer, publisher, *messages):
    """Send messages that have all arrived before the buffer takes the first of them."""
    order = Order()
    buffer.observers.add(order)
    until(publisher.get_subscription_count)
    publisher.publish(message(1))
    assert order.began.wait(PATIENCE_S)
    for each in messages:
        publisher.publish(each)
    assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE_S))
    order.go_on.set()
    return order


@pytest.mark.usefixtures('use_wait_set')
def test_other_messages_overtake_a_large_one_of_a_new_layout(node, listen, publisher):
    buffer = listen(node)
    order = send_while_it_waits(buffer, publisher, message(LARGE), message(2, 3, 'honest'))
    until(lambda: len(order.sizes) == 3)
    assert order.sizes == [1, 2, LARGE]
    until(lambda: buffer.statistics().accepted == LARGE + 3)
    assert is_whole(buffer)


def test_large_message_of_a_known_layout_stays_in_order(node, listen, publisher):
    buffer = listen(node)
    until(publisher.get_subscription_count)
    publisher.publish(message(LARGE))
    until(lambda: buffer.statistics().accepted == LARGE)
    order = send_while_it_waits(buffer, publisher, message(LARGE, 2), message(2, 3, 'honest'))
    until(lambda: len(order.sizes) == 3)
    assert order.sizes == [1, LARGE, 2]
    until(lambda: is_whole(buffer, 2))


@EITHER_THREAD
def test_robot_with_10000_frames_in_a_message_is_received(
        node, listen, spin, publisher, spin_thread):
    buffer = listen(node, spin_thread=spin_thread)
    if not spin_thread:
        spin(node)
    until(publisher.get_subscription_count)
    publisher.publish(message(10_000))
    publisher.publish(message(10_000, 2))
    until(lambda: buffer.statistics().accepted == 20_000)
    assert len(buffer.frames()) == 10_001
    assert is_whole(buffer, 2)


@pytest.mark.parametrize('most', [1, 1_000_000, 16_000_000])
def test_large_messages_keep_their_order_and_none_is_lost(
        node, listen, publisher, monkeypatch, most):
    """They are sent before the first of them is read; in another order, many would be too old."""
    monkeypatch.setattr(listener, 'MOST_WAITING_BYTES', most)
    buffer = listen(node)
    send_while_it_waits(buffer, publisher, *[message(LARGE, 8 * second) for second in range(20)])
    until(lambda: buffer.statistics().accepted == 20 * LARGE + 1)
    assert is_whole(buffer, 19 * 8)
    assert buffer.statistics().refused == 0


def test_static_message_is_not_overtaken_since_the_last_one_decides(node, listen, make_node):
    buffer = listen(node)
    publisher = make_node('crowd').create_publisher(
        TFMessage, '/tf_static', static_listener_qos())
    until(publisher.get_subscription_count)
    publisher.publish(message(LARGE))
    publisher.publish(write([Sample('late', 'frame_7', 0, IDENTITY)]))
    until(lambda: buffer.statistics().accepted == LARGE + 1)
    assert {edge.child: edge.parent for edge in buffer.edges()}['frame_7'] == 'late'


@pytest.mark.usefixtures('use_wait_set')
def test_large_bytes_that_are_no_message_are_refused_once(node, listen, publisher):
    buffer = listen(node)
    until(publisher.get_subscription_count)
    publisher.publish(message(LARGE)[:-9])
    publisher.publish(message(LARGE))
    until(lambda: buffer.statistics().accepted == LARGE)
    assert buffer.statistics().incidents[Kind.MALFORMED] == buffer.statistics().refused == 1


@pytest.mark.usefixtures('use_wait_set')
def test_longer_work_is_done_without_messages_and_despite_exceptions(make_node, log):
    """If each piece took until the next check of the context, the test would lose patience."""
    def work():
        if len(done) < 500:
            done.append(threading.current_thread())
            if len(done) % 2:
                raise ValueError('a bad piece')
        return len(done) < 500

    done = []
    receiver = Receiver(make_node('worker'), lambda: None, work=work)
    until(lambda: len(done) == 500)
    receiver.close()
    assert set(done) == {receiver.thread}
    assert 'a bad piece' in log()


def test_names_of_large_messages_are_not_kept(node, listen, publisher):
    """The reader keeps some and forgets them again, so the fewest objects are compared."""
    buffer = listen(node, Buffer(max_frames=10))
    until(publisher.get_subscription_count)
    objects = []
    for number in range(24):
        publisher.publish(message(LARGE, prefix=f'crowd_{number}'))
        until(lambda number=number: buffer.statistics().refused > (number + 0.99) * LARGE)
        gc.collect()
        objects.append(sys.getallocatedblocks())
    assert min(objects[16:]) - min(objects[:8]) < 8 * LARGE


# --- the backlog

def job(done, name, steps):
    for number in range(steps):
        done.append((name, number))
        yield
    done.append((name, 'end'))


def test_jobs_are_done_one_after_the_other_in_steps():
    backlog, done = Backlog(100), []
    assert (backlog.step(), len(backlog)) == (False, 0)
    backlog.add(job(done, 'a', 1), 50)
    backlog.add(job(done, 'b', 0), 50)
    assert (done, len(backlog)) == ([], 2)
    assert [backlog.step() for _ in range(4)] == [True, True, False, False]
    assert done == [('a', 0), ('a', 'end'), ('b', 'end')]


def test_jobs_beyond_the_limit_are_done_at_once_and_none_is_dropped():
    backlog, done = Backlog(100), []
    for name in 'abc':
        backlog.add(job(done, name, 2), 40)
    assert done == [('a', 0), ('a', 1), ('a', 'end')]
    backlog.add(job(done, 'd', 2), 1000)
    assert [name for name, number in done if number == 'end'] == list('abcd')
    assert not backlog.step()


def test_job_that_raises_is_over():
    def fail():
        yield
        raise ValueError('no')

    backlog, done = Backlog(100), []
    backlog.add(fail(), 60)
    backlog.add(job(done, 'b', 0), 40)
    assert backlog.step()
    with pytest.raises(ValueError, match='no'):
        backlog.step()
    assert not backlog.step()
    assert done == [('b', 'end')]
    backlog.add(job(done, 'c', 0), 100)
    assert done == [('b', 'end')], 'the failed one no longer counts'
