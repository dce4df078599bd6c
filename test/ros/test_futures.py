# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups as futures: awaited in executors and in asyncio, or not at all."""

import asyncio
from concurrent.futures import CancelledError
import gc
import itertools
from queue import SimpleQueue
import sys
import threading
import weakref

import pytest
from rclpy.clock import ClockType
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.time import Time
from ros_helpers import (
    at,
    ended,
    lasting,
    LATEST,
    move,
    PATIENCE,
    PATIENCE_S,
    result_of,
    simulated_clock,
    transform,
    until,
    until_waiting,
    x_of,
)
import tf_tree_py as tf
from tf_tree_py.ros.waiting.clock import ClockWatch, RosClock
from tf_tree_py.ros.waiting.deadlines import Alarms, ClockDeadline

EXECUTORS = pytest.mark.parametrize('of_type', [SingleThreadedExecutor, MultiThreadedExecutor])
HOUR = lasting(3600.0)
TENTHS = [3.0 + number / 10.0 for number in range(50)]


def wait_for(buffer, seconds, timeout=None):
    return buffer.wait_for_transform_async('map', 'base', at(seconds), timeout)


async def look_up(buffer, seconds=3.0):
    return await buffer.lookup_transform_async('map', 'base', at(seconds))


@pytest.fixture
def no_collection():
    gc.collect()
    gc.disable()
    yield
    gc.enable()


# --- results


def test_future_ends_as_soon_as_its_answer_is_certain(buffer):
    now, later, never = wait_for(buffer, 1.5), wait_for(buffer, 3.0), wait_for(buffer, 0.5)
    full = buffer.wait_for_transform_full_async('base', at(1.0), 'base', at(3.0), 'map')
    assert now.done()
    assert x_of(now.result()) == 1.5
    assert now.result().header.stamp == at(1.5).to_msg()
    assert later.result() is None
    move(buffer, 2.5)
    assert not later.done() and not full.done()
    move(buffer, 3.5)
    assert (x_of(later.result()), x_of(full.result())) == (3.0, 2.0)
    assert full.result().header.stamp == at(1.0).to_msg()
    # Then it stays what it is, and a time may become older than the buffer keeps.
    assert not never.done()
    for seconds in (20.0, 30.0):
        move(buffer, seconds)
    assert isinstance(never.exception(), tf.PastExtrapolationException)
    buffer.clear()
    assert x_of(later.result()) == 3.0


@EXECUTORS
def test_callback_awaits_what_a_listener_receives(listen, make_node, talker, spin, of_type):
    buffer, node = listen(make_node('asking')), make_node('spun')
    answers = []

    async def call_back():
        timer.cancel()
        answers.append(await look_up(buffer))
        answers.append(await buffer.lookup_transform_full_async(
            'base', at(3.0), 'base', at(4.0), 'map', PATIENCE))

    timer = node.create_timer(0.001, call_back)
    spin(node, of_type=of_type)
    for count, seconds in enumerate((3.0, 4.0), start=1):
        until_waiting(buffer)
        talker.move(transform('map', 'base', seconds, x=seconds))
        until(lambda count=count: len(answers) == count)
    assert [x_of(answer) for answer in answers] == [3.0, 1.0]


@EXECUTORS
def test_no_wake_up_is_missed_whenever_it_comes(buffer, make_node, spin, of_type):
    """The transform arrives shortly before, while or after the coroutine starts to wait."""
    executor = spin(make_node('spun'), of_type=of_type)
    for number in range(300):
        stamp = 3.0 + number / 100.0
        task = executor.create_task(look_up, buffer, stamp)
        for _ in range(number % 30 * 20):
            pass
        move(buffer, stamp)
        assert x_of(result_of(task)) == stamp, number


def test_executor_that_passed_over_a_task_looks_again(buffer, make_node, spin):
    """A MultiThreadedExecutor does so during the step in which the task awaits."""
    executor = spin(make_node('spun'), of_type=MultiThreadedExecutor)
    future = wait_for(buffer, 3.0)
    awaiting, going_on = threading.Event(), threading.Event()

    class Lingering:

        def __await__(self):
            for _ in future.__await__():
                awaiting.set()
                going_on.wait(PATIENCE_S)
                yield

    async def ask():
        await Lingering()

    task = executor.create_task(ask)
    assert awaiting.wait(PATIENCE_S)
    move(buffer, 3.0)
    result_of(executor.create_task(lambda: 'looked'))
    going_on.set()
    result_of(task)


@EXECUTORS
def test_many_coroutines_wait_at_once_some_for_one_future(buffer, make_node, spin, of_type):
    executors = [spin(make_node(f'spun_{number}'), of_type=of_type) for number in range(3)]
    future = wait_for(buffer, 3.0)

    async def share():
        return await future

    tasks = [executor.create_task(share) for executor in executors]
    tasks += [executors[0].create_task(look_up, buffer, seconds) for seconds in TENTHS]
    until_waiting(buffer, 51)
    for seconds in range(3, 9):
        move(buffer, float(seconds))
    assert [x_of(result_of(task)) for task in tasks] == pytest.approx([3.0] * 3 + TENTHS)


@pytest.mark.parametrize('name', [
    'executors.SingleThreadedExecutor', 'executors.MultiThreadedExecutor',
    'experimental.EventsExecutor'])
@pytest.mark.usefixtures('woken_events_executor')
def test_executor_spins_until_a_future_is_complete(buffer, context, name, pool):
    """With a timeout, because the EventsExecutor of the wheels does nothing without one."""
    module, executor_name = name.split('.')
    executor = getattr(pytest.importorskip(f'rclpy.{module}'), executor_name)(context=context)
    for number in range(100):
        stamp = 3.0 + number / 100.0
        future = wait_for(buffer, stamp) if number % 2 else executor.create_task(
            look_up, buffer, stamp)
        spinning = pool.submit(executor.spin_until_future_complete, future, PATIENCE_S)
        until_waiting(buffer)
        move(buffer, stamp)
        spinning.result(PATIENCE_S)
        assert x_of(future.result()) == stamp
    executor.shutdown()


def test_executor_that_cannot_be_found_goes_on_with_its_next_work(
        buffer, make_node, spin, monkeypatch):
    """As after a change inside rclpy: it costs only time."""
    monkeypatch.setattr('tf_tree_py.ros.waiting.futures.STEP_OF_TASK', None)
    executor = spin(make_node('spun'))
    task = executor.create_task(look_up, buffer)
    until_waiting(buffer)
    move(buffer, 3.0)
    executor.wake()
    result_of(task)


def test_executor_or_loop_that_has_ended_is_left_alone(buffer, executor):
    loop = asyncio.new_event_loop()
    # A task that never ends is intended here; otherwise asyncio would log it.
    loop.set_exception_handler(lambda *_: None)
    tasks = [executor.create_task(look_up, buffer), loop.create_task(look_up(buffer))]
    executor.spin_once(timeout_sec=0.0)
    loop.run_until_complete(asyncio.sleep(0))
    assert len(buffer.waiting) == 2
    executor.shutdown()
    loop.close()
    move(buffer, 3.0)
    assert not any(task.done() for task in tasks)


# --- timeouts


def test_simulated_timeouts_end_at_their_own_pace_and_in_their_order(simulated_buffer, sim_clock):
    """Whatever the order in which they began."""
    order = []
    futures = {seconds: wait_for(simulated_buffer, 3.0, lasting(seconds))
               for seconds in (6.0, 2.0, 5.0, 0.5, 4.0, 3.0)}
    for seconds, future in futures.items():
        future.add_done_callback(lambda _, seconds=seconds: order.append(seconds))
    first = ended(futures[0.5])
    sim_clock.show(10.25, simulated_buffer)
    assert not first.wait(0.02)
    sim_clock.show(10.5, simulated_buffer)
    assert first.wait(PATIENCE_S)
    assert futures[0.5].exception().waited_s == 0.5
    assert order == [0.5]
    sim_clock.show(99.0, simulated_buffer)
    until(lambda: len(order) == 6)
    assert order == [0.5, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert futures[5.0].exception().waited_s == 89.0


def test_end_that_is_reached_before_the_alarm_is_set_is_not_missed():
    """The clock has been set back by then."""
    clock, rang = simulated_clock(), threading.Event()
    watch = ClockWatch(lambda jump: None)
    watch.use_clock(RosClock(clock))

    def show(nanoseconds):
        clock.set_ros_time_override(Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME))

    show(1)
    deadline = ClockDeadline(watch, 5, None)
    show(10)
    show(2)

    class Sleeper:
        expire = rang.set

    sleeper = Sleeper()
    Alarms(watch, lambda: None).add(sleeper, deadline)
    assert rang.wait(PATIENCE_S)


# --- cancelling, and ending once


def test_cancelled_future_waits_no_longer_and_says_so(buffer):
    future = wait_for(buffer, 3.0, HOUR)
    has_ended = ended(future)
    future.cancel()
    assert has_ended.is_set()
    assert len(buffer.waiting) == 0
    # As a thread that was just going to ask.
    future._wait.ask()
    move(buffer, 3.0)
    assert len(buffer.waiting) == 0
    assert future.cancelled()
    with pytest.raises(CancelledError):
        future.result()


def test_cancelling_a_task_forgets_what_it_waited_for(buffer, make_node, spin):
    task = spin(make_node('spun')).create_task(look_up(buffer))
    until_waiting(buffer)
    task.cancel()
    until(lambda: buffer.timeouts.forget_orphans() or len(buffer.waiting) == 0)


def test_callback_runs_in_the_thread_that_ends_the_future(buffer, pool):
    futures = [wait_for(buffer, 3.0), wait_for(buffer, 4.0, lasting(0.01))]
    threads = [SimpleQueue() for _ in futures]
    for future, queue in zip(futures, threads, strict=True):
        future.add_done_callback(lambda _, queue=queue: queue.put(threading.current_thread()))
    inserting = pool.submit(lambda: move(buffer, 3.0) or threading.current_thread())
    assert threads[0].get(timeout=PATIENCE_S) is inserting.result(PATIENCE_S)
    assert 'alarms' in threads[1].get(timeout=PATIENCE_S).name


def test_future_ends_once_whatever_comes_first(buffer, pool):
    """Arrival, cancelling and timeout race; the callback is called once, and no waiter is left."""
    for number in range(200):
        stamp = 3.0 + number
        future = wait_for(buffer, stamp, lasting(0.0005))
        calls = []
        future.add_done_callback(calls.append)
        racing = [pool.submit(move, buffer, stamp), pool.submit(future.cancel)]
        assert ended(future).wait(PATIENCE_S)
        for racer in racing:
            racer.result(PATIENCE_S)
        assert len(calls) == 1
        assert future.done() != future.cancelled()
        if future.done() and future.exception() is None:
            assert x_of(future.result()) == stamp


def test_future_that_is_ended_by_hand_waits_no_longer(buffer):
    future = wait_for(buffer, 3.0)
    future.set_result('by hand')
    assert len(buffer.waiting) == 0
    future.set_exception(ValueError('too late'))
    future.cancel()
    move(buffer, 3.0)
    assert future.result() == 'by hand'


# --- asyncio


def test_asyncio_awaits_the_same_coroutines(buffer, pool):
    async def main():
        return await asyncio.gather(*(look_up(buffer, seconds) for seconds in TENTHS[:11]))

    def arrive():
        until_waiting(buffer, 11)
        for seconds in (3.0, 3.5, 4.0):
            move(buffer, seconds)

    pool.submit(arrive)
    assert [x_of(answer) for answer in asyncio.run(main())] == pytest.approx(TENTHS[:11])


class CountingLoop(asyncio.SelectorEventLoop):
    """Counts the steps it takes."""

    steps = 0

    def call_soon(self, *arguments, **options):
        self.steps += 1
        return super().call_soon(*arguments, **options)


@pytest.mark.parametrize('inside', [False, True], ids=['outermost', 'inside_an_executor'])
def test_asyncio_sleeps_while_it_waits(buffer, executor, inside):
    """It does not poll, as it would with rclpy's own futures."""
    loop = CountingLoop()

    async def ask():
        task = asyncio.ensure_future(wait_for(buffer, 3.0))
        await asyncio.sleep(0.05)  # a future that polls would take steps now
        move(buffer, 3.0)
        return x_of(await task)

    if inside:
        task = executor.create_task(lambda: loop.run_until_complete(ask()))
        executor.spin_until_future_complete(task, PATIENCE_S)
        assert task.result() == 3.0
    else:
        assert loop.run_until_complete(ask()) == 3.0
    loop.close()
    assert loop.steps < 20


def test_asyncio_cancels_and_times_out(buffer):
    async def main():
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(look_up(buffer), 0.02)
        assert len(buffer.waiting) == 0
        future = wait_for(buffer, 3.0, HOUR)
        task = asyncio.ensure_future(future)
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert future.cancelled()

    asyncio.run(main())


def test_executor_inside_an_asyncio_loop_is_the_one_that_awaits(buffer, executor, pool):
    async def main():
        task = executor.create_task(look_up, buffer)
        executor.spin_once(timeout_sec=0.0)
        assert len(buffer.waiting) == 1
        pool.submit(move, buffer, 3.0)
        executor.spin_until_future_complete(task, PATIENCE_S)
        return task.result()

    assert x_of(asyncio.run(main())) == 3.0


# --- memory


def test_future_with_a_callback_lives_until_it_ends(buffer, no_collection):
    answers = []
    futures = [wait_for(buffer, 3.0) for _ in range(2)]
    futures[0].add_done_callback(lambda future: answers.append(future.result()))
    futures[1].add_done_callback(print)
    arriving, cancelled = map(weakref.ref, futures)
    del futures
    cancelled().cancel()
    assert cancelled() is None
    gc.collect()
    move(buffer, 3.0)
    assert x_of(answers[0]) == 3.0
    assert arriving() is None


def test_coroutine_that_is_dropped_leaves_nothing(buffer, context):
    async def ask():
        await wait_for(buffer, 3.0)

    executor = SingleThreadedExecutor(context=context)
    executor.create_task(ask)
    executor.spin_once(timeout_sec=0.0)
    assert len(buffer.waiting) == 1
    executor.shutdown()
    del executor
    gc.collect()
    buffer.timeouts.forget_orphans()
    assert len(buffer.waiting) == 0


def test_error_of_a_lookup_that_did_not_wait_is_freed_at_once(no_collection):
    """It refers to the caller's frames, and their messages."""
    buffer, freed = tf.Buffer(), []
    buffer.feeds.add_thread(threading.current_thread())
    try:
        buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    except tf.LookupException as error:
        assert 'Did not wait' in str(error)
        weakref.finalize(error, freed.append, True)
    assert freed


def test_garbage_collection_of_a_coroutine_takes_no_lock(buffer, context, no_collection):
    async def ask():
        await buffer.lookup_transform_async('map', 'base', at(3.0), HOUR)

    executor = SingleThreadedExecutor(context=context)
    executor.create_task(ask)
    executor.spin_once(timeout_sec=0.0)
    executor.shutdown()
    del executor
    collecting = threading.Thread(target=gc.collect)
    with buffer.waiting.lock, buffer.timeouts.alarms._lock:
        collecting.start()
        collecting.join(PATIENCE_S)
        assert not collecting.is_alive()
    assert len(buffer.waiting) == len(buffer.timeouts.alarms) == 1
    buffer.timeouts.forget_orphans()
    assert len(buffer.waiting) == len(buffer.timeouts.alarms) == 0


def test_buffer_dies_with_its_futures():
    buffer = tf.Buffer()
    futures = [buffer.wait_for_transform_async('a', 'b', LATEST) for _ in range(3)]
    futures[0].add_done_callback(print)
    references = [weakref.ref(buffer), *map(weakref.ref, futures)]
    del buffer, futures
    gc.collect()
    assert [reference() for reference in references] == [None] * 4


def alarm_threads():
    return [thread for thread in threading.enumerate() if 'alarms' in thread.name]


def test_one_thread_watches_all_timeouts_and_ends(buffer):
    until(lambda: not alarm_threads())
    futures = [wait_for(buffer, 3.0, HOUR) for _ in range(100)]
    [thread] = alarm_threads()
    assert thread.daemon
    # Long ones, for which it already sleeps, hold no short one up.
    until(lambda: sys._current_frames()[thread.ident].f_code.co_name == 'wait')
    assert ended(wait_for(buffer, 4.0, lasting(0.02))).wait(PATIENCE_S)
    move(buffer, 3.0)
    assert all(future.done() for future in futures)
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    assert ended(wait_for(buffer, 4.0, lasting(0.01))).wait(PATIENCE_S)


ENDS = {
    'cancelled': lambda buffer, futures: [future.cancel() for future in futures],
    'arrived': lambda buffer, futures: move(buffer, 11.0),
    'failed': lambda buffer, futures: buffer.waiting.fail(tf.TransformException('given up')),
    'dropped': lambda buffer, futures: futures.clear() or wait_for(buffer, 11.0).cancel(),
}


def make_and_end(buffer, end, count, timeout):
    """Create futures and end them; return weak references to them."""
    nanoseconds = itertools.count(int(3e9))
    futures = [wait_for(buffer, next(nanoseconds) / 1e9, timeout) for _ in range(count)]
    assert len(buffer.waiting) == count
    references = [weakref.ref(future) for future in futures]
    end(buffer, futures)
    return references


@pytest.mark.parametrize('timeout', [None, HOUR], ids=['endless', 'timeout'])
@pytest.mark.parametrize('end', ENDS.values(), ids=ENDS)
def test_ten_thousand_futures_leave_nothing(buffer, no_collection, end, timeout):
    """No waiter, future or alarm, and almost no memory, without a garbage collection."""
    # Python keeps some blocks for reuse.
    make_and_end(buffer, ENDS['cancelled'], 3_000, HOUR)
    blocks = sys.getallocatedblocks()
    references = make_and_end(buffer, end, 10_000, timeout)
    if timeout is not None:
        # Another thread removes those that were dropped.
        until(lambda: len(buffer.waiting) == 0)
    assert len(buffer.waiting) == 0
    assert not any(reference() for reference in references)
    del references
    until(lambda: len(buffer.timeouts.alarms) == 0)
    assert sys.getallocatedblocks() - blocks < 1_000
