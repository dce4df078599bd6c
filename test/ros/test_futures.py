# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups as futures: awaited in executors and in asyncio, or not at all."""

import asyncio
from concurrent.futures import CancelledError
from contextlib import contextmanager
import gc
import itertools
import sys
import threading
import time
import weakref

import pytest
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from ros_helpers import (
    at,
    lasting,
    LATEST,
    move,
    PATIENCE,
    PATIENCE_S,
    SIM_TIME,
    transform,
    until,
    until_waiting,
)
from tf_tree_py import (
    Buffer,
    ClockJumpException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LookupException,
    PastExtrapolationException,
    TransformException,
    TransformListener,
)
from tf_tree_py.core.buffer import waiting
from tf_tree_py.ros.waiting import awaitable
from tf_tree_py.ros.waiting.alarm_clock import AlarmDeadline, Alarms
from tf_tree_py.ros.waiting.clock import ClockWatch

EXECUTORS = pytest.mark.parametrize('kind', [SingleThreadedExecutor, MultiThreadedExecutor])
HOUR = lasting(3600.0)


def wait_for(buffer, seconds, timeout=None):
    return buffer.wait_for_transform_async('map', 'base', at(seconds), timeout)


def ended(future):
    """Return an event that is set when a future ends."""
    event = threading.Event()
    future.add_done_callback(lambda _: event.set())
    return event


def x_of(message):
    return message.transform.translation.x


# --- results


def test_what_is_there_is_there_at_once(buffer):
    future = wait_for(buffer, 1.5)
    assert future.done()
    assert x_of(future.result()) == 1.5
    assert future.result().header.stamp == at(1.5).to_msg()


def test_future_resolves_with_what_is_between_the_samples(buffer):
    future = wait_for(buffer, 3.0)
    assert not future.done()
    assert future.result() is None
    move(buffer, 2.5)
    assert not future.done()
    move(buffer, 3.5)
    assert x_of(future.result()) == 3.0


def test_result_is_what_was_found_when_it_was_there(buffer):
    future = buffer.wait_for_transform_async('map', 'camera', LATEST)
    buffer.set_transform(transform('base', 'camera', 2.0, x=0.5), 'me')
    buffer.set_transform(transform('base', 'camera', 2.0, x=9.0), 'me')
    buffer.clear()
    assert x_of(future.result()) == 2.5
    assert future.result().header.stamp == at(2.0).to_msg()
    assert future.result().header.frame_id == 'map'
    assert future.result().child_frame_id == 'camera'


def test_full_form_goes_through_the_fixed_frame(buffer):
    future = buffer.wait_for_transform_full_async('base', at(1.0), 'base', at(3.0), 'map')
    assert not future.done()
    move(buffer, 3.0)
    assert x_of(future.result()) == 2.0
    assert future.result().header.stamp == at(1.0).to_msg()


@EXECUTORS
def test_arrival_in_the_listeners_thread_wakes_the_executor(listen, make_node, talker, spin, kind):
    buffer = listen(make_node('asking'))
    executor = spin(make_node('spun'), kind=kind)
    task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(3.0))
    done = ended(task)
    until_waiting(buffer)
    talker.move(transform('map', 'base', 3.0, x=3.0))
    assert done.wait(PATIENCE_S)
    assert x_of(task.result()) == 3.0


@EXECUTORS
def test_callback_awaits_what_arrives_later(buffer, make_node, spin, kind):
    node = make_node('spun')
    answers, answered = [], threading.Event()

    async def call_back():
        timer.cancel()
        answers.append(await buffer.lookup_transform_async('map', 'base', at(3.0)))
        answers.append(await buffer.lookup_transform_full_async(
            'base', at(3.0), 'base', at(4.0), 'map', PATIENCE))
        answered.set()

    timer = node.create_timer(0.001, call_back)
    spin(node, kind=kind)
    for seconds in (3.0, 4.0):
        until_waiting(buffer)
        move(buffer, seconds)
        until(lambda seconds=seconds: len(answers) == seconds - 2.0)
    assert answered.wait(PATIENCE_S)
    assert [x_of(answer) for answer in answers] == [3.0, 1.0]


@EXECUTORS
def test_no_wake_up_is_missed_whenever_it_comes(buffer, make_node, spin, kind):
    """The transform arrives shortly before, while or after the coroutine starts to wait."""
    executor = spin(make_node('spun'), kind=kind)
    for number in range(300):
        stamp = 3.0 + number / 100.0
        task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(stamp))
        done = ended(task)
        for _ in range(number % 30 * 20):
            pass
        move(buffer, stamp)
        assert done.wait(PATIENCE_S), number
        assert x_of(task.result()) == stamp


def test_executor_that_passed_over_a_task_looks_again(buffer, make_node, spin):
    """A MultiThreadedExecutor does so during the step in which the task awaits."""
    executor = spin(make_node('spun'), kind=MultiThreadedExecutor)
    future = wait_for(buffer, 3.0)
    awaiting, going_on, looked = (threading.Event() for _ in range(3))

    class Lingering:

        def __await__(self):
            for _ in future.__await__():
                awaiting.set()
                going_on.wait(PATIENCE_S)
                yield

    async def ask():
        await Lingering()

    done = ended(executor.create_task(ask))
    assert awaiting.wait(PATIENCE_S)
    move(buffer, 3.0)
    executor.create_task(looked.set)
    assert looked.wait(PATIENCE_S)
    going_on.set()
    assert done.wait(PATIENCE_S)


@EXECUTORS
def test_many_coroutines_wait_at_once(buffer, make_node, spin, kind):
    executor = spin(make_node('spun'), kind=kind)
    tasks = [executor.create_task(buffer.lookup_transform_async, 'map', 'base',
                                  at(3.0 + number / 10.0)) for number in range(50)]
    events = [ended(task) for task in tasks]
    until_waiting(buffer, 50)
    for seconds in range(3, 9):
        move(buffer, float(seconds))
    assert all(event.wait(PATIENCE_S) for event in events)
    assert [x_of(task.result()) for task in tasks] == pytest.approx(
        [3.0 + number / 10.0 for number in range(50)])


@EXECUTORS
def test_future_can_be_spun_for(buffer, context, kind, pool):
    executor = kind(context=context)
    future = wait_for(buffer, 3.0)
    pool.submit(move, buffer, 3.0)
    executor.spin_until_future_complete(future, PATIENCE_S)
    assert x_of(future.result()) == 3.0
    executor.shutdown()


def test_executor_that_cannot_be_found_goes_on_with_its_next_work(
        buffer, make_node, spin, monkeypatch):
    """As after a change inside rclpy: it costs only time."""
    monkeypatch.setattr(awaitable, '_STEP_OF_TASK', None)
    executor = spin(make_node('spun'))
    task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(3.0))
    done = ended(task)
    until_waiting(buffer)
    move(buffer, 3.0)
    executor.wake()
    assert done.wait(PATIENCE_S)


def test_events_executor_is_woken_too(buffer, context, pool):
    """Spun with a timeout, because the executor of the wheels does nothing without one."""
    experimental = pytest.importorskip('rclpy.experimental')
    executor = experimental.EventsExecutor(context=context)
    for number in range(100):
        stamp = 3.0 + number / 100.0
        task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(stamp))
        spinning = pool.submit(executor.spin_until_future_complete, task, PATIENCE_S)
        until_waiting(buffer)
        move(buffer, stamp)
        spinning.result(PATIENCE_S)
        assert x_of(task.result()) == stamp
    executor.shutdown()


def test_executor_that_was_shut_down_is_left_alone(buffer, context):
    executor = SingleThreadedExecutor(context=context)
    task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(3.0))
    executor.spin_once(timeout_sec=0.0)
    until_waiting(buffer)
    executor.shutdown()
    move(buffer, 3.0)
    assert not task.done()


def test_same_future_is_awaited_by_several(buffer, make_node, spin):
    executors = [spin(make_node(f'spun_{number}')) for number in range(3)]
    future = wait_for(buffer, 3.0)

    async def share():
        return await future

    tasks = [executor.create_task(share) for executor in executors]
    events = [ended(task) for task in tasks]
    move(buffer, 3.0)
    assert all(event.wait(PATIENCE_S) for event in events)
    assert {x_of(task.result()) for task in tasks} == {3.0}


# --- timeouts


def test_timeout_raises_what_was_missing_and_how_long_it_waited(buffer):
    begin = time.monotonic()
    future = wait_for(buffer, 3.0, lasting(0.05))
    assert ended(future).wait(PATIENCE_S)
    assert time.monotonic() - begin >= 0.05
    with pytest.raises(FutureExtrapolationException, match=r'map -> base.*\(waited \d'):
        future.result()
    assert future.exception().waited_s >= 0.05


def test_coroutine_gets_the_timeout_as_an_exception(buffer, make_node, spin):
    executor = spin(make_node('spun'))
    errors, told = [], threading.Event()

    async def ask():
        try:
            await buffer.lookup_transform_async('map', 'nowhere', LATEST, lasting(0.02))
        except LookupException as error:
            errors.append(error)
            told.set()

    executor.create_task(ask)
    assert told.wait(PATIENCE_S)
    assert 'nowhere' in str(errors[0])
    assert errors[0].waited_s >= 0.02


def test_timeouts_end_in_their_order_whatever_the_order_they_began_in(
        make_node, listen, sim_clock):
    """In simulated time, in which all of them begin at once, and end at once."""
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    order, events = [], []
    for seconds in (6.0, 2.0, 5.0, 1.0, 4.0, 3.0):
        future = wait_for(buffer, 3.0, lasting(seconds))
        future.add_done_callback(lambda _, number=seconds: order.append(number))
        events.append(ended(future))
    sim_clock.show(99.0, buffer)
    assert all(event.wait(PATIENCE_S) for event in events)
    assert order == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_short_timeout_is_not_held_up_by_a_long_one(buffer):
    long = wait_for(buffer, 3.0, HOUR)
    until(lambda: buffer.timeouts.watch._sleepers)
    short = wait_for(buffer, 3.0, lasting(0.02))
    assert ended(short).wait(PATIENCE_S)
    long.cancel()


class TickingWatch(ClockWatch):
    """Simulated time that advances at the moment in which a thread goes to sleep."""

    def __init__(self):
        super().__init__(lambda jump: None)
        self.now = 0

    def simulated_now(self):
        return self.now

    @contextmanager
    def waking(self, event, end):
        self.now = 10
        yield


def test_tick_just_before_the_alarms_sleep_is_not_missed():
    watch, rang = TickingWatch(), threading.Event()
    alarms = Alarms(watch, lambda: None)

    class Sleeper:

        def expire(self):
            rang.set()

    sleeper = Sleeper()
    alarms.add(sleeper, AlarmDeadline(watch, 5, None))
    assert rang.wait(PATIENCE_S)


@pytest.mark.parametrize('timeout', [lasting(0.0), lasting(-1.0)])
def test_no_time_to_wait_fails_at_once(buffer, timeout):
    future = wait_for(buffer, 3.0, timeout)
    with pytest.raises(FutureExtrapolationException) as raised:
        future.result()
    assert raised.value.waited_s is None


@pytest.mark.parametrize(('frames', 'seconds', 'kind'), [
    (('map', 'base'), 0.5, PastExtrapolationException),
    (('', 'base'), 1.0, InvalidArgumentException),
    (('map', '/base'), 1.0, InvalidArgumentException),
])
def test_what_can_never_be_fails_at_once(buffer, frames, seconds, kind):
    move(buffer, 100.0)
    move(buffer, 101.0)
    future = buffer.wait_for_transform_async(*frames, at(seconds), HOUR)
    assert future.done()
    with pytest.raises(kind) as raised:
        future.result()
    assert raised.value.waited_s is None


def test_what_is_no_time_is_refused_before_there_is_a_future(buffer):
    with pytest.raises(TypeError, match='is not a time'):
        buffer.wait_for_transform_async('map', 'base', 0.0)
    with pytest.raises(TypeError, match='is not a time'):
        wait_for(buffer, 3.0, 1.0)


def test_wait_ends_when_the_time_has_become_too_old(buffer):
    future = wait_for(buffer, 0.5, HOUR)
    assert not future.done()
    move(buffer, 10.0)
    assert not future.done()
    move(buffer, 30.0)
    with pytest.raises(PastExtrapolationException, match='waited'):
        future.result()


def test_clock_that_jumps_back_ends_the_wait(make_node, listen, sim_clock):
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    future = wait_for(buffer, 3.0)
    gone = ended(future)
    sim_clock.show(5.0, buffer)
    assert gone.wait(PATIENCE_S)
    with pytest.raises(ClockJumpException, match='jumped by -5'):
        future.result()


def test_clock_that_jumps_back_while_it_is_just_being_woken_ends_the_wait(buffer, monkeypatch):
    wake_all = waiting.wake_all

    def wake_later(waiters):
        monkeypatch.undo()
        buffer.clear()
        buffer.waiting.fail(ClockJumpException('jumped'))
        wake_all(waiters)

    future = wait_for(buffer, 3.0)
    monkeypatch.setattr(waiting, 'wake_all', wake_later)
    move(buffer, 3.0)
    with pytest.raises(ClockJumpException, match='jumped'):
        future.result()


def test_simulated_time_times_out_at_its_own_pace(make_node, listen, sim_clock):
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    futures = [wait_for(buffer, 3.0, lasting(seconds)) for seconds in (5.0, 0.5)]
    events = [ended(future) for future in futures]
    sim_clock.show(10.25, buffer)
    assert not events[1].wait(0.02)
    sim_clock.show(10.5, buffer)
    assert events[1].wait(PATIENCE_S)
    assert futures[1].exception().waited_s == 0.5
    assert not events[0].is_set()
    sim_clock.show(99.0, buffer)
    assert events[0].wait(PATIENCE_S)
    assert futures[0].exception().waited_s == 89.0


def test_simulated_time_that_stands_still_is_ended_by_the_wall_guard(
        make_node, listen, sim_clock):
    buffer = Buffer(wall_guard=lasting(0.03))
    listen(make_node('simulated', **SIM_TIME), buffer)
    sim_clock.show(10.0, buffer)
    future = wait_for(buffer, 3.0, HOUR)
    assert ended(future).wait(PATIENCE_S)
    with pytest.raises(LookupException, match='wall_guard: is any node publishing /clock'):
        future.result()


def test_end_of_simulated_time_ends_the_wait(make_node, listen, sim_clock, context):
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    futures = [wait_for(buffer, 3.0, timeout) for timeout in (HOUR, None)]
    events = [ended(future) for future in futures]
    context.shutdown()
    assert all(event.wait(PATIENCE_S) for event in events)
    for future in futures:
        with pytest.raises(TransformException):
            future.result()


def test_closing_the_last_listener_ends_the_wait(node, make_node, pool):
    buffer = Buffer()
    first = TransformListener(buffer, node)
    second = TransformListener(buffer, make_node('second'))
    futures = [buffer.wait_for_transform_async('a', 'b', LATEST, timeout)
               for timeout in (None, HOUR)]
    first.close()
    assert not futures[0].done()
    second.close()
    for future in futures:
        assert future.done()
        with pytest.raises(LookupException, match='Given up: the listener was closed'):
            future.result()
    later = buffer.wait_for_transform_async('a', 'b', LATEST)
    assert not later.done()
    buffer.set_transform(transform('a', 'b'), 'me')
    assert later.done()


def test_end_of_a_wait_that_nobody_asks_about_is_no_complaint(node, capfd):
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    future = buffer.wait_for_transform_async('a', 'b', LATEST, HOUR)
    listener.close()
    assert future.done()
    del future
    assert 'never retrieved' not in capfd.readouterr().err


# --- cancelling, and ending once


def test_cancelled_future_waits_no_longer_and_says_so(buffer, make_node, spin):
    future = wait_for(buffer, 3.0, HOUR)
    told = ended(future)
    future.cancel()
    assert told.is_set()
    assert future.cancelled()
    assert len(buffer.waiting) == 0
    move(buffer, 3.0)
    with pytest.raises(CancelledError):
        future.result()


def test_cancelling_a_task_forgets_what_it_waited_for(buffer, make_node, spin):
    executor = spin(make_node('spun'))
    task = executor.create_task(buffer.lookup_transform_async('map', 'base', at(3.0)))
    until_waiting(buffer)
    task.cancel()
    until(lambda: len(buffer.waiting) == 0)


def test_future_ends_once_whoever_is_first(buffer, pool):
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


def test_who_was_just_going_to_ask_when_it_ended_leaves_it_alone(buffer):
    future = wait_for(buffer, 3.0)
    future.cancel()
    future._wait.ask()
    assert len(buffer.waiting) == 0
    assert future.cancelled()


def test_whoever_ends_it_by_hand_ends_it(buffer):
    future = wait_for(buffer, 3.0)
    future.set_result('by hand')
    assert len(buffer.waiting) == 0
    future.set_exception(ValueError('too late'))
    future.cancel()
    move(buffer, 3.0)
    assert future.result() == 'by hand'


def test_every_caller_gets_an_exception_of_its_own(buffer):
    future = wait_for(buffer, 3.0, lasting(0.0))
    raised = []
    for _ in range(2):
        with pytest.raises(FutureExtrapolationException) as caught:
            future.result()
        raised.append(caught.value)
    assert raised[0] is not raised[1]
    assert str(raised[0]) == str(raised[1])


def test_callback_that_raises_keeps_nobody_else_from_being_told(buffer):
    futures = [wait_for(buffer, 3.0) for _ in range(2)]

    def fail(_):
        raise ValueError('a bug in a callback')

    futures[0].add_done_callback(fail)
    with pytest.warns(UserWarning, match='a bug in a callback'):
        move(buffer, 3.0)
    assert all(future.done() for future in futures)


# --- asyncio


def test_asyncio_awaits_the_same_coroutines(buffer, pool):
    async def main():
        begun = asyncio.Event()
        loop = asyncio.get_running_loop()

        def arrive():
            until_waiting(buffer, 10)
            for seconds in (3.0, 3.5, 4.0):
                move(buffer, seconds)
            loop.call_soon_threadsafe(begun.set)

        pool.submit(arrive)
        answers = await asyncio.gather(*(
            buffer.lookup_transform_async('map', 'base', at(3.0 + number / 10.0))
            for number in range(10)))
        await begun.wait()
        return [x_of(answer) for answer in answers]

    assert asyncio.run(main()) == pytest.approx([3.0 + number / 10.0 for number in range(10)])


class CountingLoop(asyncio.SelectorEventLoop):
    """Counts the steps it takes."""

    steps = 0

    def call_soon(self, *arguments, **options):
        self.steps += 1
        return super().call_soon(*arguments, **options)


@pytest.mark.parametrize('inside', [False, True], ids=['outermost', 'inside_an_executor'])
def test_asyncio_sleeps_while_it_waits(buffer, context, inside):
    """It does not poll, as it would with rclpy's own futures."""
    loop = CountingLoop()

    async def ask():
        task = asyncio.ensure_future(wait_for(buffer, 3.0))
        await asyncio.sleep(0.05)  # a future that polls would take steps now
        move(buffer, 3.0)
        assert x_of(await task) == 3.0

    if inside:
        executor = SingleThreadedExecutor(context=context)
        task = executor.create_task(lambda: loop.run_until_complete(ask()))
        executor.spin_until_future_complete(task, PATIENCE_S)
        executor.shutdown()
        assert task.exception() is None
    else:
        loop.run_until_complete(ask())
    loop.close()
    assert loop.steps < 20


def test_asyncio_cancels_and_times_out(buffer):
    async def main():
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(buffer.lookup_transform_async('map', 'base', at(3.0)), 0.02)
        assert len(buffer.waiting) == 0
        future = wait_for(buffer, 3.0, HOUR)
        task = asyncio.ensure_future(future)
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert future.cancelled()
        with pytest.raises(FutureExtrapolationException, match='waited'):
            await buffer.lookup_transform_async('map', 'base', at(3.0), lasting(0.01))

    asyncio.run(main())


def test_asyncio_loop_that_was_closed_is_left_alone(buffer):
    loop = asyncio.new_event_loop()
    task = loop.create_task(buffer.lookup_transform_async('map', 'base', at(3.0)))
    loop.run_until_complete(asyncio.sleep(0))
    loop.close()
    move(buffer, 3.0)
    assert not task.done()
    # Intended here; otherwise asyncio would log it.
    task._log_destroy_pending = False


def test_executor_inside_a_running_asyncio_loop_is_still_the_one_that_awaits(buffer, context):
    async def main():
        executor = SingleThreadedExecutor(context=context)
        task = executor.create_task(buffer.lookup_transform_async, 'map', 'base', at(3.0))
        executor.spin_once(timeout_sec=0.0)
        assert len(buffer.waiting) == 1
        threading.Timer(0.01, move, (buffer, 3.0)).start()
        executor.spin_until_future_complete(task, PATIENCE_S)
        executor.shutdown()
        return task

    assert x_of(asyncio.run(main()).result()) == 3.0


# --- memory


def test_future_that_nobody_keeps_is_forgotten(buffer):
    wait_for(buffer, 3.0)
    wait_for(buffer, 3.0)
    other = wait_for(buffer, 4.0)
    assert len(buffer.waiting) == 1
    other.cancel()


def test_future_that_nobody_keeps_loses_its_alarm_soon(buffer):
    wait_for(buffer, 3.0, HOUR)
    until(lambda: len(buffer.waiting) == 0)
    assert buffer.timeouts.alarms == 0


def test_future_with_a_callback_lives_until_it_ends(buffer):
    answers = []
    wait_for(buffer, 3.0).add_done_callback(lambda future: answers.append(future.result()))
    gc.collect()
    move(buffer, 3.0)
    assert x_of(answers[0]) == 3.0


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


def test_future_with_a_callback_needs_no_collection(buffer):
    future = wait_for(buffer, 3.0)
    future.add_done_callback(print)
    reference = weakref.ref(future)
    gc.disable()
    try:
        future.cancel()
        del future
        assert reference() is None
    finally:
        gc.enable()


def test_buffer_dies_with_its_futures():
    buffer = Buffer()
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
    assert len(alarm_threads()) == 1
    thread = alarm_threads()[0]
    assert thread.daemon
    move(buffer, 3.0)
    assert all(future.done() for future in futures)
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    again = wait_for(buffer, 4.0, lasting(0.01))
    assert ended(again).wait(PATIENCE_S)


def end_by_cancelling(buffer, futures):
    for future in futures:
        future.cancel()


def end_by_arrival(buffer, futures):
    move(buffer, 11.0)
    assert all(future.done() for future in futures)


def end_by_failure(buffer, futures):
    buffer.waiting.fail(TransformException('given up'))
    assert all(future.exception() for future in futures)


def end_by_dropping(buffer, futures):
    futures.clear()
    wait_for(buffer, 11.0).cancel()


def make_and_end(buffer, end, count, timeout):
    """Create futures and end them; return weak references to them."""
    nanoseconds = itertools.count(int(3e9))
    futures = [wait_for(buffer, next(nanoseconds) / 1e9, timeout) for _ in range(count)]
    assert len(buffer.waiting) == count
    references = [weakref.ref(future) for future in futures]
    end(buffer, futures)
    return references


@pytest.mark.parametrize(('end', 'timeout'), [
    (end_by_cancelling, None), (end_by_cancelling, HOUR), (end_by_arrival, HOUR),
    (end_by_failure, None), (end_by_dropping, HOUR),
])
def test_ten_thousand_futures_leave_nothing(buffer, end, timeout):
    """No waiter, future or alarm, and almost no memory, without a garbage collection."""
    gc.collect()
    gc.disable()
    try:
        # Python keeps some blocks for reuse.
        make_and_end(buffer, end_by_cancelling, 3_000, HOUR)
        blocks = sys.getallocatedblocks()
        references = make_and_end(buffer, end, 10_000, timeout)
        # Another thread removes those that were dropped.
        until(lambda: len(buffer.waiting) == 0)
        assert not any(reference() for reference in references)
        del references
        until(lambda: buffer.timeouts.alarms == 0)
        assert sys.getallocatedblocks() - blocks < 1_000
    finally:
        gc.enable()
