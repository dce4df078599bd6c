# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Exceptions of a caller's callback in one of our threads: the thread continues and logs them."""

import asyncio
import sys
import threading

from hand_clock import HandClock
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import deserialize_message
from ros_helpers import (
    at,
    lasting,
    PATIENCE_S,
    SIM_TIME,
    transform,
    until,
    until_waiting,
)
from std_msgs.msg import String
from tf_tree_py import (
    Buffer,
    BufferClient,
    BufferServer,
    ClockJumpException,
    MessageFilter,
    TransformException,
    TransformListener,
)
from tf_tree_py.ros.threads import (
    rate_limited_log as log_module,
    receiver as receiver_module,
    response_receiver as responses_module,
)
from tf_tree_py.ros.threads.rate_limited_log import RateLimitedLog
from tf_tree_py.ros.threads.receiver import Receiver


class Unheard(BaseException):
    """Not an ``Exception``, so that hardly any code catches it."""


def leave(*_):
    sys.exit('I am leaving')


def give_up(*_):
    raise Unheard('I have had enough')


def interrupt(*_):
    raise KeyboardInterrupt


RAISING = pytest.mark.parametrize(('raises', 'words'), [
    (leave, 'SystemExit: I am leaving'), (give_up, 'I have had enough'),
    (interrupt, 'KeyboardInterrupt')], ids=['sys.exit', 'BaseException', 'KeyboardInterrupt'])


@pytest.fixture(params=[True, False], ids=['wait_set', 'executor'])
def use_wait_set(request, monkeypatch):
    monkeypatch.setattr(receiver_module.Receiver.__init__, '__kwdefaults__', {
        **receiver_module.Receiver.__init__.__kwdefaults__, 'use_wait_set': request.param})
    monkeypatch.setattr(responses_module.Responses.__init__, '__kwdefaults__', {
        'use_wait_set': request.param})
    return request.param


# --- the listener's thread

@RAISING
def test_receiver_takes_the_next_message(context, make_node, log, use_wait_set, raises, words):
    done, node = threading.Event(), make_node('received')

    def take(data):
        if deserialize_message(data, String).data == 'bad':
            raises()
        done.set()

    node.create_subscription(String, 'topic', take, 10, raw=True)
    receiver = Receiver(node, lambda: None, use_wait_set=use_wait_set)
    publisher = make_node('publishing').create_publisher(String, 'topic', 10)
    until(publisher.get_subscription_count)
    for text in ('bad', 'bad', 'good'):
        publisher.publish(String(data=text))
    assert done.wait(PATIENCE_S)
    until(lambda: words in log())
    assert log().count('failed:') == 1, 'the same again is not written again'
    assert ('call rclpy.shutdown()' in log()) == (raises is leave)
    receiver.close()


@RAISING
def test_listener_goes_on_and_whoever_waits_beside_is_answered(
        node, listen, talker, pool, log, use_wait_set, raises, words):
    buffer = listen(node)
    called = []
    first = buffer.wait_for_transform_async('map', 'base', at(1.0))
    first.add_done_callback(raises)
    first.add_done_callback(called.append)
    others = [buffer.wait_for_transform_async('map', 'base', at(1.0)) for _ in range(3)]
    for other in others:
        other.add_done_callback(raises)
    asked = pool.submit(
        buffer.lookup_transform, 'map', 'base', at(1.0), lasting(PATIENCE_S))
    until_waiting(buffer, 5)
    talker.move(transform('map', 'base', 1.0, x=1.0))
    assert asked.result(PATIENCE_S).transform.translation.x == 1.0
    until(lambda: all(future.done() for future in (first, *others)))
    until(lambda: called == [first])
    until(lambda: words in log())
    talker.move(transform('map', 'base', 2.0, x=2.0))
    found = buffer.lookup_transform('map', 'base', at(2.0), lasting(PATIENCE_S))
    assert found.transform.translation.x == 2.0
    assert buffer.statistics().accepted == 2


def test_awaiting_coroutine_goes_on_beside_a_callback_that_exits(node, listen, talker):
    buffer = listen(node)

    async def main():
        future = buffer.wait_for_transform_async('map', 'base', at(1.0))
        future.add_done_callback(leave)
        asyncio.get_running_loop().call_soon(talker.move, transform('map', 'base', 1.0, x=1.0))
        return await asyncio.wait_for(_awaited(future), PATIENCE_S)

    assert asyncio.run(main()).transform.translation.x == 1.0


async def _awaited(future):
    return await future


def test_filter_of_frames_that_raises_loses_its_message_only(node, talker, log):
    def choose(parent, child):
        if child == 'bad':
            sys.exit('not this one')
        return True

    buffer = Buffer()
    with TransformListener(buffer, node, frame_filter=choose):
        for _ in range(5):
            talker.move(transform('map', 'bad', 1.0))
        talker.move(transform('map', 'good', 1.0))
        assert buffer.lookup_transform('map', 'good', at(1.0), lasting(PATIENCE_S))
    until(lambda: 'not this one' in log())


@RAISING
def test_jump_of_the_clock_is_survived(make_node, listen, sim_clock, talker, log, raises, words):
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    futures = [buffer.wait_for_transform_async('map', 'base', at(11.0)) for _ in range(2)]
    for future in futures:
        future.add_done_callback(raises)
    sim_clock.show(5.0, buffer)
    for future in futures:
        until(future.done)
        with pytest.raises(ClockJumpException):
            future.result()
    sim_clock.show(6.0, buffer)
    talker.move(transform('map', 'base', 6.0, x=6.0))
    assert buffer.lookup_transform('map', 'base', at(6.0), lasting(PATIENCE_S))


@RAISING
def test_end_of_the_listener_is_told_to_all(node, log, raises, words):
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    futures = [buffer.wait_for_transform_async('map', 'base', at(1.0)) for _ in range(3)]
    for future in futures:
        future.add_done_callback(raises)
    listener.close()
    assert all(future.done() for future in futures)
    until(lambda: words in log())


# --- other threads

@RAISING
def test_timeouts_of_others_ring_all_the_same(
        make_node, listen, sim_clock, log, raises, words):
    """In simulated time: in real time, a future might end before it has its callback."""
    buffer = listen(make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    futures = [buffer.wait_for_transform_async('map', 'base', at(11.0), lasting(seconds))
               for seconds in (1.0, 1.0, 2.0, 5.0)]
    for future in futures[:3]:
        future.add_done_callback(raises)
    for now, ended in ((11.5, futures[:2]), (20.0, futures)):
        sim_clock.show(now, buffer)
        until(lambda ended=ended: all(future.done() for future in ended))
    for future in futures:
        with pytest.raises(TransformException, match='waited'):
            future.result()
    until(lambda: words in log())


@RAISING
def test_client_of_a_buffer_server_goes_on(make_node, spin, log, use_wait_set, raises, words):
    server_node, client_node = make_node('server'), make_node('client')
    buffer = Buffer()
    buffer.set_transform(transform('map', 'base', 1.0, x=1.0), 'me')
    patience = lasting(PATIENCE_S)
    with (BufferServer(buffer, server_node),
          BufferClient(client_node, 'tf2_buffer_server') as client):
        spin(server_node)
        assert client.wait_for_server(patience)
        futures = [client.wait_for_transform_async('map', 'base', at(second), patience)
                   for second in (2.0, 2.0, 3.0)]
        for future in futures:
            future.add_done_callback(raises)
        for second in (2.0, 3.0):
            buffer.set_transform(transform('map', 'base', second, x=second), 'me')
        for future in futures:
            until(future.done)
        until(lambda: words in log())
        found = client.lookup_transform('map', 'base', at(3.0), patience)
        assert found.transform.translation.x == 3.0
        late = [client.wait_for_transform_async('map', 'base', at(9.0), patience)
                for _ in range(3)]
        for future in late:
            future.add_done_callback(raises)
        with pytest.raises(BaseException) as caught:
            client.close()
        assert words.split(': ')[-1] in repr(caught.value)
        assert all(future.done() for future in late)


# --- threads of the caller, which may end

@RAISING
def test_who_inserts_by_hand_gets_what_was_raised_when_all_are_awake(raises, words):
    buffer = Buffer()
    futures = [buffer.wait_for_transform_async('map', 'base', at(1.0)) for _ in range(3)]
    for future in futures:
        future.add_done_callback(raises)
    with pytest.raises(BaseException) as caught:
        buffer.set_transform(transform('map', 'base', 1.0), 'me')
    assert words.split(': ')[-1] in repr(caught.value)
    assert all(future.done() for future in futures)
    assert buffer.statistics().accepted == 1


def test_callback_of_an_ended_future_raises_at_once_and_can_be_taken_back():
    buffer = Buffer()
    future = buffer.wait_for_transform_async('map', 'base', at(1.0))
    future.add_done_callback(leave)
    assert future.remove_done_callback(leave)
    assert not future.remove_done_callback(leave)
    buffer.set_transform(transform('map', 'base', 1.0), 'me')
    with pytest.raises(SystemExit, match='I am leaving'):
        future.add_done_callback(leave)


def test_filters_callback_ends_the_executor_and_not_the_filter(context, node):
    buffer, got = Buffer(), []

    def take(message, _):
        got.append(message.header.stamp.sec)
        if len(got) == 1:
            leave()

    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    with MessageFilter(buffer, node, 'map', take) as filtered:
        for second in (1.0, 2.0):
            filtered.add(transform('base', 'any', second))
        for second in (1.0, 2.0):
            buffer.set_transform(transform('map', 'base', second), 'me')
        with pytest.raises(SystemExit):
            executor.spin_once(timeout_sec=PATIENCE_S)
        until(lambda: executor.spin_once(timeout_sec=0.1) or len(got) == 2)
    assert got == [1, 2]
    executor.shutdown()


# --- the log

class Lines(list):

    def error(self, line):
        self.append(line)


def log_failure(complaint, error):
    try:
        raise error
    except BaseException:  # noqa: B902 - the test needs it
        complaint.write('it')


def test_same_complaint_is_written_once_a_period_and_counted(monkeypatch):
    lines, clock = Lines(), HandClock(100.0)
    monkeypatch.setattr(log_module, 'time', clock)
    complaint = RateLimitedLog(lines)
    for _ in range(1000):
        log_failure(complaint, ValueError('bad'))
    assert len(lines) == 1
    log_failure(complaint, ValueError('another'))
    assert len(lines) == 2
    assert lines[1].startswith('999 more failed like the previous one. it failed:')
    clock.now += 11.0
    log_failure(complaint, ValueError('another'))
    assert len(lines) == 3


def test_logger_that_fails_does_no_harm(capfd):
    class Broken:

        def error(self, line):
            raise RuntimeError(line)

    log_failure(RateLimitedLog(Broken()), ValueError('bad'))
    assert 'ValueError: bad' in capfd.readouterr().err
