# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A wait that blocks no thread, and the future of a lookup: how each of them ends."""

import asyncio
from concurrent.futures import CancelledError
import gc
import math
import threading
import weakref

import pytest
from ros_helpers import at, lasting, move, PATIENCE_S, simulated_clock, until, x_of
from tf_tree_py import Buffer, LookupException, TransformException
from tf_tree_py.ros.waiting.timeouts import Wait

HOUR = 3600 * 10**9
CLOSED = 'Given up: the listener was closed, or ROS was shut down'


class Asker:
    """Notes its answers and errors, and ends its wait, as the owner of a wait does."""

    def __init__(self):
        self.got, self.wait, self.ended = [], None, threading.Event()

    def answered(self, answer):
        self.end(answer)

    def failed(self, error):
        self.end(error)

    def end(self, what):
        self.got.append(what)
        self.wait.end()
        self.ended.set()


class Held:
    """A lock that shows whether it is held."""

    def __init__(self):
        self.held = False

    def __enter__(self):
        self.held = True

    def __exit__(self, *_):
        self.held = False


def begin(buffer, timeout=None, seconds=3.0, lock=None, asked=None):
    """Begin to wait for map -> base; note each query in a list."""
    def query():
        if asked is not None:
            asked.append(None if lock is None else lock.held)
        return buffer.lookup('map', 'base', round(seconds * 1e9)).x

    asker = Asker()
    asker.wait = Wait(buffer.timeouts, asker, query, timeout, lock)
    asker.wait.ask()
    return asker


def counts(buffer):
    return len(buffer.waiting), len(buffer.timeouts.alarms)


# --- a wait


@pytest.mark.parametrize('timeout', [None, 0, -1, HOUR])
def test_answer_that_is_there_needs_no_wait(buffer, timeout):
    asker = begin(buffer, timeout, 1.5)
    assert asker.got == [1.5]
    assert counts(buffer) == (0, 0)
    assert asker.wait.released is False


@pytest.mark.parametrize('timeout', [0, -1])
def test_wait_without_time_fails_at_once(buffer, timeout):
    [error] = begin(buffer, timeout).got
    assert isinstance(error, TransformException)
    assert error.waited_s is None, 'it has not waited'
    assert error.__traceback__ is None
    assert counts(buffer) == (0, 0)


@pytest.mark.parametrize(('timeout', 'alarms'), [(None, 0), (HOUR, 1)])
def test_wait_is_asked_again_when_its_data_arrives(buffer, timeout, alarms):
    lock, asked = Held(), []
    asker = begin(buffer, timeout, lock=lock, asked=asked)
    assert asker.wait.is_being_woken is False
    assert counts(buffer) == (1, alarms)
    move(buffer, 2.5)
    assert (asker.got, len(asked)) == ([], 1)
    move(buffer, 3.5)
    assert asker.got == [3.0]
    assert asked == [True, True], 'with its lock'
    assert asker.wait.is_being_woken is True
    assert counts(buffer) == (0, 0)
    move(buffer, 4.0)
    asker.wait.ask()
    assert len(asked) == 2


def test_wait_that_is_over_in_time_says_how_long_it_lasted(buffer):
    buffer.use_clock(clock := simulated_clock(10.0))
    asker = begin(buffer, 2 * 10**9)
    clock.set_ros_time_override(at(11.0))
    asker.wait.ask()
    assert asker.got == []
    clock.set_ros_time_override(at(12.5))
    assert asker.ended.wait(PATIENCE_S)
    [error] = asker.got
    assert error.waited_s == 2.5
    assert error.__traceback__ is None
    assert counts(buffer) == (0, 0)


def test_wait_may_be_given_up_at_any_time(buffer):
    for ask in (Wait.expire, lambda wait: wait.ask(once_more=False)):
        asker = begin(buffer, HOUR)
        ask(asker.wait)
        [error] = asker.got
        assert isinstance(error, TransformException)
        assert 0.0 <= error.waited_s < PATIENCE_S
        assert counts(buffer) == (0, 0)
        ask(asker.wait)
        assert len(asker.got) == 1


def test_wait_that_ended_is_not_asked_any_more(buffer):
    asked = []
    asker = begin(buffer, HOUR, asked=asked)
    asker.wait.end()
    asker.wait.end()
    assert counts(buffer) == (0, 0)
    move(buffer, 3.0)
    asker.wait.ask()
    asker.wait.expire()
    assert (asker.got, len(asked)) == ([], 1)


def test_end_of_the_last_listener_ends_a_wait_at_the_next_question(buffer):
    asker = begin(buffer, HOUR)
    assert asker.wait.released is False
    buffer.timeouts.watch.release()
    assert asker.wait.released is True
    asker.wait.ask()
    assert asker.got[0].hint == CLOSED


@pytest.mark.parametrize(('timeout', 'alarms'), [(None, 0), (HOUR, 1)])
def test_wait_that_nothing_refers_to_is_forgotten(buffer, timeout, alarms):
    asker = begin(buffer, timeout)
    gone = weakref.ref(asker)
    del asker
    gc.collect()
    assert gone() is None
    if not alarms:
        assert counts(buffer) == (1, 0), 'until another one begins'
    until(lambda: counts(buffer)[1] == 0)
    buffer.timeouts.forget_orphans()
    assert counts(buffer) == (0, 0)


def test_wait_that_is_kept_alive_is_kept_until_it_is_over(buffer):
    asker = begin(buffer)
    got, gone = asker.got, weakref.ref(asker)
    asker.wait.keep_alive()
    del asker
    gc.collect()
    assert gone() is not None
    move(buffer, 3.0)
    assert got == [3.0]
    gc.collect()
    assert gone() is None
    asker = begin(buffer, seconds=3.0)
    gone = weakref.ref(asker)
    asker.wait.keep_alive()
    del asker
    gc.collect()
    assert gone() is None, 'it was over already'


def test_guard_by_the_wall_limits_only_waits_with_a_timeout():
    buffer = Buffer(wall_guard=lasting(0.0))
    buffer.use_clock(simulated_clock(10.0))
    assert buffer.timeouts.deadline(HOUR).is_over()
    assert buffer.timeouts.deadline(None).wall_end == math.inf
    buffer.timeouts.by_wall = True
    assert not buffer.timeouts.deadline(HOUR).is_over()


def test_cause_is_looked_for_when_a_wait_begins_and_given_when_it_ends(buffer):
    buffer.timeouts.check_spinning = lambda: (lambda: 'nothing spins')
    asker = begin(buffer, HOUR)
    asker.wait.expire()
    assert asker.got[0].hint == 'nothing spins'


# --- the future of a lookup


def future_of(buffer, seconds=3.0, timeout=None):
    return buffer.wait_for_transform_async('map', 'base', at(seconds), timeout)


def by_result(future):
    future.set_result('by hand')


def by_error(future):
    future.set_exception(ValueError('by hand'))


def by_cancelling(future):
    future.cancel()


@pytest.mark.parametrize('end', [by_result, by_error, by_cancelling])
def test_future_that_has_ended_stays_what_it_is(buffer, end):
    future, calls = future_of(buffer, timeout=lasting(3600.0)), []
    future.add_done_callback(calls.append)
    removed = calls.append
    future.add_done_callback(removed)
    future.remove_done_callback(removed)
    for each in (end, by_result, by_error, by_cancelling):
        each(future)
    move(buffer, 3.0)
    assert counts(buffer) == (0, 0)
    future.add_done_callback(lambda _: calls.append('late'))
    assert calls[-1] == 'late'
    assert future.cancelled() is (end is by_cancelling)
    if end is by_result:
        assert future.result() == 'by hand'
    else:
        with pytest.raises(CancelledError if end is by_cancelling else ValueError):
            future.result()


def test_each_reader_gets_a_copy_of_the_error(buffer):
    future = future_of(buffer, timeout=lasting(0.0))
    errors = []
    for _ in range(2):
        with pytest.raises(TransformException) as raised:
            future.result()
        errors.append(raised.value)
    assert str(errors[0]) == str(errors[1]) == str(future.exception())
    assert len({*map(id, [*errors, future.exception()])}) == 3
    assert future.released is False


@pytest.mark.parametrize('end', [by_result, by_error, by_cancelling])
def test_callback_that_leaves_keeps_no_other_from_being_called(buffer, end):
    def leave(_):
        raise SystemExit('now')

    future, calls = future_of(buffer), []
    future.add_done_callback(leave)
    future.add_done_callback(calls.append)
    with pytest.raises(SystemExit, match='now'):
        end(future)
    assert calls == [future]
    with pytest.raises(SystemExit, match='now'):
        future.add_done_callback(leave)
    future.add_done_callback(calls.append)
    assert calls == [future, future]


@pytest.mark.parametrize('released', [False, True])
def test_error_of_a_lookup_in_a_callback_is_silent_after_the_end_of_ros(buffer, recwarn, released):
    future = future_of(buffer)
    calls = []

    def read(each):
        calls.append(each)
        each.result()

    future.add_done_callback(read)
    if released:
        buffer.timeouts.watch.release()
    buffer.waiting.fail(LookupException('given up'))
    assert calls == [future]
    assert future.released is released
    # rclpy warns of other errors.
    warned = [each for each in recwarn if 'given up' in str(each.message)]
    assert len(warned) == (not released)


async def look_up(buffer):
    return await buffer.lookup_transform_async('map', 'base', at(3.0))


def test_coroutine_that_nothing_runs_goes_on_with_the_next_step(buffer):
    """It is neither in an executor nor in a loop."""
    coroutine = look_up(buffer)
    for _ in range(3):
        coroutine.send(None)
        assert len(buffer.waiting) == 1
    move(buffer, 3.0)
    with pytest.raises(StopIteration) as stopped:
        coroutine.send(None)
    assert x_of(stopped.value.value) == 3.0


def test_coroutine_that_fails_from_outside_cancels_its_wait(buffer):
    coroutine = look_up(buffer)
    coroutine.send(None)
    with pytest.raises(ValueError, match='from outside'):
        coroutine.throw(ValueError('from outside'))
    assert counts(buffer) == (0, 0)
    coroutine = look_up(buffer)
    coroutine.send(None)
    coroutine.close()
    del coroutine
    buffer.timeouts.forget_orphans()
    assert counts(buffer) == (0, 0)


def test_loop_gets_the_errors_of_a_lookup(buffer):
    async def main():
        with pytest.raises(LookupException, match='given up'):
            task = asyncio.ensure_future(look_up(buffer))
            await asyncio.sleep(0)
            buffer.waiting.fail(LookupException('given up'))
            await task
        future = future_of(buffer)
        task = asyncio.ensure_future(future)
        await asyncio.sleep(0)
        future.set_result('by hand')
        future.cancel()
        assert await task == 'by hand'
        return await future

    assert asyncio.run(main()) == 'by hand'
    assert counts(buffer) == (0, 0)
