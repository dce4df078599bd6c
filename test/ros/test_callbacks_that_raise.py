# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Exceptions of a caller's callback in one of our threads: the thread continues and logs them."""

from types import SimpleNamespace

from hand_clock import clock_of_logs
import pytest
from ros_helpers import (
    at,
    lasting,
    PATIENCE,
    PATIENCE_S,
    SIM_TIME,
    transform,
    until,
    until_waiting,
)
import tf_tree_py as tf
from tf_tree_py.ros.threads.internal_node import CallbackFailures


class Unheard(BaseException):
    """Not an ``Exception``, so that hardly any code catches it."""


def raising(cls, *words):
    """Return a callback that raises a new exception whenever it is called."""
    def call_back(*_):
        raise cls(*words)

    return call_back


leave = raising(SystemExit, 'I am leaving')
CASES = [(leave, 'SystemExit: I am leaving'),
         (raising(Unheard, 'I have had enough'), 'I have had enough'),
         (raising(KeyboardInterrupt), 'KeyboardInterrupt')]
RAISING = pytest.mark.parametrize(
    ('raises', 'words'), CASES, ids=['sys.exit', 'BaseException', 'KeyboardInterrupt'])
FOREVER = None


def futures_that(raises, buffer, *timeouts, second=1.0):
    """Wait several times for one transform, each with a callback that raises."""
    futures = [buffer.wait_for_transform_async('map', 'base', at(second), timeout)
               for timeout in timeouts]
    for future in futures:
        future.add_done_callback(raises)
    return futures


# --- the listener's thread

@RAISING
def test_listener_goes_on_and_those_who_wait_beside_are_answered(
        node, listen, talker, pool, log, use_wait_set, raises, words):
    buffer, called = listen(node), []
    futures = futures_that(raises, buffer, *[FOREVER] * 4)
    futures[0].add_done_callback(called.append)
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(1.0), PATIENCE)
    until_waiting(buffer, 5)
    talker.move(transform('map', 'base', 1.0, x=1.0))
    assert asked.result(PATIENCE_S).transform.translation.x == 1.0
    until(lambda: all(future.done() for future in futures))
    until(lambda: called == futures[:1])
    until(lambda: words in log())
    talker.move(transform('map', 'base', 2.0), into=buffer)


@pytest.mark.parametrize(('raises', 'words'), [
    *CASES, (raising(ValueError, 'it was bad'), 'ValueError: it was bad')])
def test_filter_of_frames_that_raises_loses_its_message_only(
        node, talker, listen, log, use_wait_set, monkeypatch, raises, words):
    clock_of_logs(monkeypatch)
    buffer = listen(node, frame_filter=lambda parent, child: child != 'bad' or raises())
    for _ in range(5):
        talker.move(transform('map', 'bad', 1.0))
    talker.move(transform('map', 'good', 1.0), into=buffer)
    until(lambda: words in log())
    assert 'Traceback' in log()
    assert log().count('failed:') == 1, 'the same again is not written again'
    assert ('call rclpy.shutdown()' in log()) == (raises is leave)


@RAISING
def test_timeouts_jumps_and_the_end_reach_all_who_wait(
        make_node, sim_clock, talker, log, raises, words):
    """In simulated time: in real time, a future might end before it has its callback."""
    buffer = tf.Buffer()
    listener = tf.TransformListener(buffer, make_node('simulated', **SIM_TIME))
    sim_clock.show(10.0, buffer)
    futures = futures_that(raises, buffer, *map(lasting, (1.0, 1.0, 2.0)), second=11.0)
    futures.append(buffer.wait_for_transform_async('map', 'base', at(11.0), lasting(5.0)))
    for now, ended in ((11.5, futures[:2]), (20.0, futures)):
        sim_clock.show(now, buffer)
        until(lambda ended=ended: all(future.done() for future in ended))
    for future in futures:
        with pytest.raises(tf.TransformException, match='waited'):
            future.result()
    until(lambda: words in log())
    futures = futures_that(raises, buffer, FOREVER, FOREVER, second=21.0)
    sim_clock.show(5.0, buffer)
    for future in futures:
        until(future.done)
        with pytest.raises(tf.ClockJumpException):
            future.result()
    sim_clock.show(6.0, buffer)
    talker.move(transform('map', 'base', 6.0), into=buffer)
    futures = futures_that(raises, buffer, *[FOREVER] * 3, second=7.0)
    failures = log().count('failed:')
    listener.close()
    assert all(future.done() for future in futures)
    until(lambda: log().count('failed:') > failures)


@RAISING
def test_client_of_a_buffer_server_goes_on(make_node, spin, log, use_wait_set, raises, words):
    server_node, buffer = make_node('server'), tf.Buffer()
    buffer.set_transform(transform('map', 'base', 1.0, x=1.0), 'me')
    with (tf.BufferServer(buffer, server_node),
          tf.BufferClient(make_node('client'), 'tf2_buffer_server') as client):
        spin(server_node)
        assert client.wait_for_server(PATIENCE)
        futures = [*futures_that(raises, client, PATIENCE, PATIENCE, second=2.0),
                   *futures_that(raises, client, PATIENCE, second=3.0)]
        for second in (2.0, 3.0):
            buffer.set_transform(transform('map', 'base', second, x=second), 'me')
        for future in futures:
            until(future.done)
        until(lambda: words in log())
        found = client.lookup_transform('map', 'base', at(3.0), PATIENCE)
        assert found.transform.translation.x == 3.0
        late = futures_that(raises, client, *[PATIENCE] * 3, second=9.0)
        with pytest.raises(BaseException) as caught:
            client.close()
        assert words.split(': ')[-1] in repr(caught.value)
        assert all(future.done() for future in late)


# --- threads of the caller, which may end

@RAISING
def test_who_inserts_by_hand_gets_what_was_raised_when_all_are_awake(raises, words):
    buffer = tf.Buffer()
    futures = futures_that(raises, buffer, *[FOREVER] * 3)
    futures[0].add_done_callback(raising(ValueError, 'a bug in a callback'))
    with (pytest.warns(UserWarning, match='a bug in a callback'),
          pytest.raises(BaseException) as caught):
        buffer.set_transform(transform('map', 'base', 1.0), 'me')
    assert words.split(': ')[-1] in repr(caught.value)
    assert all(future.done() for future in futures)
    assert buffer.statistics().accepted == 1


def test_callback_of_an_ended_future_raises_at_once_and_can_be_taken_back():
    buffer = tf.Buffer()
    future = buffer.wait_for_transform_async('map', 'base', at(1.0))
    future.add_done_callback(leave)
    assert future.remove_done_callback(leave)
    assert not future.remove_done_callback(leave)
    buffer.set_transform(transform('map', 'base', 1.0), 'me')
    with pytest.raises(SystemExit, match='I am leaving'):
        future.add_done_callback(leave)


# --- the log

def test_logger_that_fails_does_no_harm(capfd):
    failures = CallbackFailures(SimpleNamespace())
    try:
        raise ValueError('bad')
    except ValueError:
        failures.report('it')
    assert 'it failed' in (written := capfd.readouterr().err) and 'ValueError: bad' in written
