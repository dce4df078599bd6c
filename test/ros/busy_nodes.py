# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Program: use every lock of the ROS layer; print in which order they are taken."""

from contextlib import suppress
import os
import threading
import types

import lock_order

lock_order.record()  # before the package and rclpy make any lock

from filter_helpers import Inbox, point  # noqa: E402, I100
import rclpy  # noqa: E402
from rclpy.executors import MultiThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.task import Future  # noqa: E402
from ros_helpers import (  # noqa: E402
    at,
    lasting,
    LATEST,
    PATIENCE,
    result_of,
    SIM_TIME,
    SimClock,
    Talker,
    transform,
    until,
    until_waiting,
)
from tf_tree_py import (  # noqa: E402
    Buffer,
    BufferClient,
    BufferServer,
    MessageFilter,
    shared_buffer,
    TransformException,
    TransformListener,
)
from tf_tree_py.core.buffer.waiting import WallDeadline  # noqa: E402
from tf_tree_py.health.doctor import Doctor  # noqa: E402
from tf_tree_py.ros.filtering import losses  # noqa: E402
from tf_tree_py.tools.missing import Refusals  # noqa: E402
from tf_tree_py.view.model.playhead import IncidentLog  # noqa: E402


class Spinning:
    """Nodes in the threads of an executor."""

    def __init__(self, *nodes):
        self.executor = MultiThreadedExecutor(2)
        for node in nodes:
            self.executor.add_node(node)
        self._stop = Future()
        self._thread = threading.Thread(
            target=self.executor.spin_until_future_complete, args=(self._stop,), daemon=True)
        self._thread.start()

    def end(self):
        self._stop.set_result(None)
        self.executor.wake()
        self._thread.join()
        self.executor.shutdown()


def in_threads(*calls):
    """Call all at once, and return the results."""
    results = [None] * len(calls)

    def run(index, call):
        results[index] = call()

    threads = [threading.Thread(target=run, args=each) for each in enumerate(calls)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def look_up(buffer, talker, executor):
    """Wait in threads, futures and coroutines for what a publisher sends."""
    async def awaits():
        return await buffer.wait_for_transform_async('map', 'base', at(2), PATIENCE)

    task = executor.create_task(awaits)
    futures = [buffer.wait_for_transform_async('map', 'base', at(2), PATIENCE) for _ in range(3)]
    futures[0].cancel()
    waiting = threading.Thread(
        target=buffer.lookup_transform, args=('map', 'base', at(2), PATIENCE))
    waiting.start()
    until_waiting(buffer, 4)
    talker.move(transform('map', 'base', 1), transform('map', 'base', 3), into=buffer)
    talker.fix(transform('base', 'camera'), into=buffer)
    for future in (*futures[1:], task):
        result_of(future)
    waiting.join()
    with suppress(TransformException):
        buffer.lookup_transform('map', 'base', at(9), lasting(0.001))
    with suppress(TransformException):
        result_of(buffer.wait_for_transform_async('map', 'nowhere', LATEST, lasting(0.001)))
    talker.move(transform('base', 'map', 3), transform('map', 'late', 1), into=None)
    until(lambda: buffer.statistics().refused)


def insert_at_once(buffer):
    """Insert, look up and copy in several threads, while observers come and go."""
    def write(child):
        for second in range(1, 40):
            buffer.set_transform(transform('map', child, second), 'me')

    def observe():
        for _ in range(10):
            observers = Doctor(), Refusals(recorded=False), IncidentLog()
            for observer in observers:
                buffer.observers.add(observer)
            buffer.set_transform(transform('map', 'map'), 'me')  # refused
            for second in (50, 1):  # the second is too old
                buffer.set_transform(transform('map', 'old', second), 'me')
            observers[0].findings()
            for observer in observers:
                buffer.observers.remove(observer)

    def copy():
        for _ in range(20):
            buffer.snapshot().frames()
            buffer.edges()

    in_threads(lambda: write('a'), lambda: write('b'), observe, copy)
    # Here the query, and so its observers, run with the lock held.
    buffer.wait_for(lambda: buffer.lookup('map', 'a'), WallDeadline(0.0))


def filter_messages(buffer, node, talker):
    """Deliver and drop messages: too many, too old, too late, and at the end."""
    inbox, clock = Inbox(), types.SimpleNamespace(now=1000.0)
    losses.time = types.SimpleNamespace(monotonic=lambda: clock.now)
    with MessageFilter(buffer, node, 'map', inbox.receive, queue_size=2, timeout=PATIENCE,
                       on_drop=inbox.lose) as messages:
        for second in range(40, 60):
            messages.add(point(second, 'later'))
            clock.now += 1.0
        talker.move(*(transform('map', 'later', second) for second in (57, 60)), into=buffer)
        until(lambda: len(inbox.delivered) == 2)
        messages.add(point(99, 'later'))
        messages.add(point(1, ''))
        messages.statistics()
        brief = MessageFilter(buffer, node, 'map', inbox.receive, timeout=lasting(0.001),
                              on_drop=inbox.lose)
        for _ in range(12):
            brief.add(point(99, 'unknown'))
            clock.now += 1.0
        until(lambda: brief.statistics().held == 0)
        brief.close()
    until(lambda: messages.statistics().held == 0)


def jump_back(node, clock_node):
    """Wait by a simulated clock, which advances, jumps back and is switched off."""
    clock = SimClock(clock_node)
    buffer = Buffer(node=node, wall_guard=PATIENCE)
    with TransformListener(buffer, node):
        clock.show(5.0, buffer)
        asked = [buffer.wait_for_transform_async('map', 'base', LATEST, lasting(1.0)),
                 buffer.wait_for_transform_async('map', 'base', LATEST, PATIENCE)]
        sleeping = threading.Thread(target=lambda: fails(
            lambda: buffer.lookup_transform('map', 'base', LATEST, lasting(2.0))))
        sleeping.start()
        until_waiting(buffer, 3)
        clock.show(6.5, buffer)
        fails(lambda: result_of(asked[0]))
        clock.show(1.0, buffer)
        fails(lambda: result_of(asked[1]))
        sleeping.join()
        node.set_parameters([rclpy.Parameter('use_sim_time', value=False)])
        pending = buffer.wait_for_transform_async('map', 'base', LATEST)
    fails(lambda: result_of(pending))


def fails(call):
    try:
        call()
    except TransformException:
        return
    raise AssertionError('it has an answer')


def ask_a_server(buffer, node):
    """Look up in the buffer of a server, and give up."""
    with BufferServer(buffer, node, 'answers'), BufferClient(node, 'answers') as client:
        assert client.wait_for_server(PATIENCE)
        client.lookup_transform('map', 'base', at(2), PATIENCE)
        fails(lambda: client.lookup_transform('map', 'base', at(99), lasting(0.01)))
        client.wait_for_transform_async('map', 'base', at(99), PATIENCE)


def wait_for_the_users_executor(node):
    """Wait on a node that no executor spins."""
    buffer = Buffer()
    with TransformListener(buffer, node, spin_thread=False):
        fails(lambda: result_of(
            buffer.wait_for_transform_async('map', 'base', LATEST, lasting(0.001))))


def share(node, other):
    """Let two nodes, and a context, have one buffer each."""
    assert shared_buffer(node) is shared_buffer(other)
    shared_buffer()


def fork(buffer):
    """Let a child insert into the buffer, while other threads use it."""
    ended = threading.Event()

    def write():
        while not ended.is_set():
            buffer.set_transform(transform('map', 'a', 30), 'me')

    writer = threading.Thread(target=write)
    writer.start()
    child = os.fork()
    if not child:
        status = 1
        try:
            buffer.set_transform(transform('map', 'child', 30), 'me')
            buffer.lookup_transform('map', 'child', at(30), PATIENCE)
            status = 0
        finally:
            os._exit(status)
    ended.set()
    writer.join()
    assert os.waitpid(child, 0)[1] == 0


def main():
    rclpy.init()
    node, other, sends, simulated = (
        Node('asks'), Node('other'), Node('sends'), Node('simulated', **SIM_TIME))
    spinning = Spinning(node, other, sends)
    talker = Talker(sends)
    buffer = Buffer(node=node, audit=True)
    listener = TransformListener(buffer, node)
    look_up(buffer, talker, spinning.executor)
    insert_at_once(buffer)
    filter_messages(buffer, node, talker)
    ask_a_server(buffer, other)
    jump_back(simulated, sends)
    wait_for_the_users_executor(simulated)
    share(node, other)
    fork(buffer)
    pending = buffer.wait_for_transform_async('map', 'nowhere', LATEST)
    listener.close()
    fails(lambda: result_of(pending))
    spinning.end()
    rclpy.shutdown()
    for each in (node, other, sends, simulated):
        each.destroy_node()
    lock_order.print_pairs()


if __name__ == '__main__':
    main()
