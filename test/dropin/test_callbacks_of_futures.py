# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Done callbacks of futures run in the thread that spins the node, as in tf2.

An unchanged program with one thread has no locks, because its callbacks never run at the same
time.
"""

import asyncio
import signal
import subprocess
import sys
import textwrap
import threading

from dropin_helpers import LISTENS, run
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
from ros_helpers import at, lasting, move, PATIENCE_S, transform, until, until_waiting
from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.listener import TransformListener

EXECUTORS = ['executors.SingleThreadedExecutor', 'executors.MultiThreadedExecutor',
             'experimental.EventsExecutor']


@pytest.fixture
def buffer():
    return Buffer()


@pytest.fixture
def listener(buffer, node):
    listener = TransformListener(buffer, node)
    yield listener
    listener.unregister()


@pytest.fixture
def called(buffer):
    """Wait for a transform; return a list, with the thread once it has been called back."""
    threads = []
    buffer.wait_for_transform_async('map', 'base', Time()).add_done_callback(
        lambda future: threads.append((future.result(), threading.current_thread())))
    return threads


def spin_until_called(executor, called):
    """Return the thread, after one spin that waits until there is something to do."""
    while not called:
        executor.spin_once(timeout_sec=PATIENCE_S)
    ((_, thread),) = called
    return thread


def until_arrived(buffer):
    """Wait until the future has its result: then the call is due."""
    until(lambda: buffer.can_transform('map', 'base', Time()) and not len(buffer.waiting))


@pytest.mark.parametrize('name', EXECUTORS)
@pytest.mark.usefixtures('listener', 'woken_events_executor')
def test_callback_runs_in_the_thread_that_spins(node, context, talker, called, name):
    module, executor_name = name.split('.')
    executor = getattr(pytest.importorskip(f'rclpy.{module}'), executor_name)(context=context)
    executor.add_node(node)
    talker.fix(transform('map', 'base'))
    thread = spin_until_called(executor, called)
    executor.shutdown()
    assert (thread is threading.current_thread()) or 'ThreadPoolExecutor' in thread.name
    assert [timer.is_canceled() for timer in node.timers] == [True], 'it would fire all the time'


@pytest.mark.usefixtures('listener')
def test_callback_is_due_until_the_node_is_spun(buffer, node, talker, called, executor):
    """No further message has to arrive for that."""
    talker.fix(transform('map', 'base'))
    until_arrived(buffer)
    assert not called
    executor.add_node(node)
    assert spin_until_called(executor, called) is threading.current_thread()


@pytest.mark.usefixtures('listener')
def test_callback_is_called_after_the_node_has_changed_its_executor(
        buffer, node, talker, called, executor, context):
    first = SingleThreadedExecutor(context=context)
    first.add_node(node)
    first.remove_node(node)
    talker.fix(transform('map', 'base'))
    until_arrived(buffer)
    executor.add_node(node)
    assert spin_until_called(executor, called) is threading.current_thread()
    first.shutdown()


@pytest.mark.usefixtures('listener')
def test_each_of_many_is_called_once_while_the_node_changes_its_executor(
        buffer, node, talker, context):
    executors = [SingleThreadedExecutor(context=context) for _ in range(3)]
    calls = []
    for number in range(1, 101):
        buffer.wait_for_transform_async('map', 'base', at(number)).add_done_callback(
            lambda _, number=number: calls.append((number, threading.current_thread())))
    for number in range(1, 101):
        talker.move(transform('map', 'base', number))
        executor = executors[number % 3]
        executor.add_node(node)
        executor.spin_once(timeout_sec=0.0)
        executor.remove_node(node)
    executors[0].add_node(node)
    while len(calls) < 100:
        executors[0].spin_once(timeout_sec=PATIENCE_S)
    assert sorted(number for number, _ in calls) == [*range(1, 101)]
    assert {thread for _, thread in calls} == {threading.current_thread()}
    for executor in executors:
        executor.shutdown()


@pytest.mark.usefixtures('listener')
def test_callback_after_a_timeout_runs_there_too(buffer, node, executor):
    threads = []
    buffer.wait_for_transform_async('map', 'base', Time(), lasting(0.01)).add_done_callback(
        lambda future: threads.append((future.exception(), threading.current_thread())))
    executor.add_node(node)
    assert spin_until_called(executor, threads) is threading.current_thread()
    assert 'map' in str(threads[0][0])


@pytest.mark.usefixtures('listener')
def test_callback_wakes_an_executor_that_has_nothing_to_do(buffer, node, spin):
    executor, threads = spin(node), []
    executor.create_task(node.get_name)  # it has begun to spin
    buffer.wait_for_transform_async('map', 'base', Time(), lasting(0.1)).add_done_callback(
        lambda _: threads.append(threading.current_thread()))
    until(lambda: threads)
    assert 'alarms' not in threads[0].name


@pytest.mark.usefixtures('listener')
def test_who_inserts_is_called_back_at_once(buffer, called):
    move(buffer, 1.0)
    assert called[0][1] is threading.current_thread()


@pytest.mark.usefixtures('listener')
def test_callback_that_raises_prevents_no_other(buffer, node, talker, executor):
    future = buffer.wait_for_transform_async('map', 'base', Time())
    called = []
    future.add_done_callback(lambda _: 1 / 0)
    future.add_done_callback(lambda _: called.append((None, threading.current_thread())))
    talker.fix(transform('map', 'base'))
    executor.add_node(node)
    with pytest.warns(UserWarning, match='Unhandled exception in done callback: division by '
                                         'zero') as caught:
        spin_until_called(executor, called)
    assert caught[0].filename == __file__  # where the program spins


@pytest.mark.usefixtures('listener')
def test_coroutine_of_asyncio_needs_no_spinning(buffer, talker, pool):
    async def look_up():
        return await buffer.lookup_transform_async('map', 'base', Time())

    waiting = pool.submit(asyncio.run, look_up())
    until_waiting(buffer)
    talker.fix(transform('map', 'base'))
    assert waiting.result(PATIENCE_S).child_frame_id == 'base'


def test_callback_needs_no_spin_of_ours_with_spin_thread(
        buffer, node, talker, called, monkeypatch):
    """As in tf2, whose thread spins the node at once."""
    monkeypatch.setattr('tf_tree_py.dropin.listener.spin_if_nobody_does', lambda _: None)
    listener = TransformListener(buffer, node, spin_thread=True)
    talker.fix(transform('map', 'base'))
    until(lambda: called)
    listener.unregister()


def test_callback_without_a_node_to_spin_is_called_at_once(
        buffer, make_node, talker, called, listener):
    """The node of the listener was destroyed, while a second listener goes on."""
    other = TransformListener(buffer, make_node('other'), spin_thread=True)
    listener.node.destroy_node()
    talker.fix(transform('map', 'base'))
    until(lambda: called)
    other.unregister()


def test_callback_of_a_listener_that_ends_is_not_called(buffer, node, listener, called):
    future = buffer.wait_for_transform_async('map', 'base', at(2.0))
    future.add_done_callback(called.append)
    node.destroy_node()
    listener.unregister()
    until(future.done)
    assert not called


# --- programs

ONLY_LISTENS = LISTENS + """
    print(getattr(rclpy, '__executor'))
    rclpy.shutdown()
"""


def test_listener_makes_no_executor(program):
    """Its guard condition could crash the program at Ctrl-C (docs/ending.md)."""
    result = run('-m', 'tf_tree_py.dropin', '--force', program(ONLY_LISTENS))
    assert result.stdout == 'None\n', result.stderr


WAITS = """
    import sys
    import threading
    import rclpy
    from rclpy.time import Time
    from IMPORT import Buffer, TransformListener

    rclpy.init()
    node = rclpy.create_node('waits')
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    future = buffer.wait_for_transform_async('map', 'nowhere', Time())
    future.add_done_callback(lambda ended: print(ended.result()))
    def begin():
        timer.cancel()
        print('ready', flush=True)

    timer = node.create_timer(0.0, begin)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    rclpy.try_shutdown()
"""


@pytest.mark.parametrize('name', ['tf2_ros', 'tf_tree_py'])
def test_ctrl_c_with_a_pending_future_is_silent(program, name):
    file = program(textwrap.dedent(WAITS).replace('IMPORT', name))
    with subprocess.Popen(
            [sys.executable, '-m', 'tf_tree_py.dropin', '--force', str(file)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == 'ready\n'
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=PATIENCE_S)
    assert (out, errors, process.returncode) == ('', '', 0)
