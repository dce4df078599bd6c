# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups that wait for data that has not arrived yet."""

from concurrent.futures import wait
import re
import statistics
import threading
import time

import pytest
from rclpy.executors import MultiThreadedExecutor
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    transform,
    until,
    until_waiting,
    WAITED,
)
from tf_tree_py import (
    Buffer,
    ConnectivityException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LookupException,
    PastExtrapolationException,
    TransformException,
    TransformListener,
)


@pytest.fixture
def buffer(node, listen, talker):
    """Return a buffer with map -> odom from 1 s to 2 s, and base -> camera static."""
    buffer = listen(node)
    talker.fix(transform('base', 'camera', x=0.5))
    talker.move(transform('map', 'odom', 1.0, x=1.0))
    talker.move(transform('map', 'odom', 2.0, x=2.0))
    buffer.lookup_transform('map', 'odom', at(2.0), PATIENCE)
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    return buffer


def full(buffer, source_seconds, timeout):
    return buffer.lookup_transform_full(
        'odom', at(1.0), 'camera', at(source_seconds), 'map', timeout)


def test_waits_for_a_time_newer_than_all_data(buffer, talker, pool):
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(2.5), PATIENCE)
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 2.25, x=9.0))
    talker.move(transform('map', 'odom', 2.75, x=10.0))
    found = asked.result(PATIENCE_S)
    assert found.header.stamp == at(2.5).to_msg()
    assert found.transform.translation.x == 9.5


def test_waits_for_frames_that_nobody_knows_yet(buffer, talker, pool):
    asked = pool.submit(buffer.lookup_transform, 'map', 'gripper', LATEST, PATIENCE)
    until_waiting(buffer)
    talker.move(transform('camera', 'gripper', 7.0, x=0.25))
    talker.move(transform('odom', 'base', 2.0, x=0.125))
    talker.move(transform('map', 'odom', 7.0, x=2.0), transform('odom', 'base', 7.0, x=0.125))
    found = asked.result(PATIENCE_S)
    assert found.transform.translation.x == pytest.approx(2.0 + 0.125 + 0.5 + 0.25, abs=1.0)


def test_waits_for_the_edge_that_joins_two_trees(buffer, talker, pool):
    asked = pool.submit(buffer.lookup_transform, 'map', 'camera', LATEST, PATIENCE)
    until_waiting(buffer)
    talker.fix(transform('odom', 'base', x=0.25))
    assert asked.result(PATIENCE_S).transform.translation.x == 2.75


def test_waits_for_the_slowest_edge_on_the_way(buffer, talker, pool):
    talker.move(transform('odom', 'base', 3.0))
    buffer.lookup_transform('odom', 'base', at(3.0), PATIENCE)
    asked = pool.submit(buffer.lookup_transform, 'map', 'camera', at(3.0), PATIENCE)
    until_waiting(buffer)
    talker.move(transform('odom', 'base', 4.0))
    buffer.lookup_transform('odom', 'base', at(4.0), PATIENCE)
    assert not asked.done()
    talker.move(transform('map', 'odom', 3.0, x=5.0))
    assert asked.result(PATIENCE_S).transform.translation.x == 5.5


def test_full_lookup_waits_too(buffer, talker, pool):
    asked = pool.submit(full, buffer, 3.0, PATIENCE)
    until_waiting(buffer)
    talker.fix(transform('odom', 'base'))
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 3.0, x=3.0))
    found = asked.result(PATIENCE_S)
    assert found.transform.translation.x == 3.0 - 1.0 + 0.5
    assert (found.header.frame_id, found.child_frame_id) == ('odom', 'camera')
    assert found.header.stamp == at(1.0).to_msg()


def test_can_transform_waits_and_says_yes(buffer, talker, pool):
    simple = pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE)
    with_text = pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE,
                            return_debug_tuple=True)
    through = pool.submit(buffer.can_transform_full, 'odom', at(3.0), 'odom', at(1.0), 'map',
                          PATIENCE)
    until_waiting(buffer, 3)
    talker.move(transform('map', 'odom', 3.0))
    assert simple.result(PATIENCE_S) is True
    assert with_text.result(PATIENCE_S) == (True, '')
    assert through.result(PATIENCE_S) is True


def test_can_transform_says_no_and_why(buffer):
    assert buffer.can_transform('map', 'odom', at(3.0)) is False
    assert buffer.can_transform('map', 'odom', at(3.0), lasting(0.01)) is False
    found, why = buffer.can_transform('map', 'odom', at(3.0), lasting(0.01), True)
    assert found is False
    assert 'extrapolation into the future' in why
    assert re.search(WAITED, why)
    found, why = buffer.can_transform_full('odom', at(1.0), 'camera', at(1.0), 'map',
                                           return_debug_tuple=True)
    assert found is False
    assert 'not part of the same tree' in why
    assert buffer.can_transform('', 'odom', LATEST) is False


@pytest.mark.parametrize('timeout', [lasting(0.0), lasting(-1.0)])
def test_no_timeout_fails_at_once(buffer, timeout):
    with pytest.raises(FutureExtrapolationException) as raised:
        buffer.lookup_transform('map', 'odom', at(3.0), timeout)
    assert raised.value.waited_s is None
    assert 'waited' not in str(raised.value)


def test_older_than_the_window_fails_at_once(buffer, talker):
    # The window ends at the newest stamp before each insertion, as in tf2.
    for stamp in (100.0, 101.0):
        talker.move(transform('map', 'odom', stamp))
        buffer.lookup_transform('map', 'odom', at(stamp), PATIENCE)
    with pytest.raises(PastExtrapolationException, match=r'The buffer keeps 10\.000 s') as raised:
        buffer.lookup_transform('map', 'odom', at(1.0), PATIENCE)
    assert raised.value.waited_s is None
    with pytest.raises(PastExtrapolationException):
        buffer.lookup_transform_full('odom', at(101.0), 'odom', at(1.0), 'map', PATIENCE)


def test_wait_ends_as_soon_as_it_has_become_useless(buffer, talker, pool):
    """Data inside the window may still arrive late; expired data may not."""
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(0.5), PATIENCE)
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 10.0))
    talker.move(transform('map', 'odom', 30.0))
    with pytest.raises(PastExtrapolationException):
        asked.result(PATIENCE_S)


def test_late_sample_before_the_oldest_ends_the_wait(buffer, talker, pool):
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(0.5), PATIENCE)
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 0.5, x=-1.0))
    assert asked.result(PATIENCE_S).transform.translation.x == -1.0


@pytest.mark.parametrize(('frames', 'stamp', 'kind', 'missing'), [
    (('map', 'odom'), 3.0, FutureExtrapolationException,
     r'future\. Requested time 3\.0+ but the latest data is at time 2\.0+.*map -> odom'),
    (('map', 'nowhere'), 0.0, LookupException, r'nowhere.*source_frame.*does not exist'),
    (('map', 'camera'), 0.0, ConnectivityException,
     r'map.*camera.* because they are not part of the same tree'),
])
def test_expiry_says_what_was_missing_and_how_long_it_waited(buffer, frames, stamp, kind, missing):
    begin = time.monotonic()
    with pytest.raises(kind, match=f'{missing}.*{WAITED}') as raised:
        buffer.lookup_transform(*frames, at(stamp), lasting(0.05))
    assert time.monotonic() - begin >= 0.05
    assert raised.value.waited_s >= 0.05


def test_expiry_of_a_full_lookup_says_so_too(buffer, talker):
    talker.fix(transform('odom', 'base'))
    buffer.lookup_transform('map', 'camera', LATEST, PATIENCE)
    with pytest.raises(FutureExtrapolationException, match=WAITED):
        full(buffer, 9.0, lasting(0.02))


@pytest.mark.parametrize('frames', [('', 'odom'), ('map', ''), ('/map', 'odom'), ('map', '/odom')])
def test_name_that_can_never_be_right_is_not_waited_for(buffer, frames):
    with pytest.raises(InvalidArgumentException) as raised:
        buffer.lookup_transform(*frames, LATEST, PATIENCE)
    assert raised.value.waited_s is None


def test_what_is_no_time_is_not_waited_for(buffer):
    with pytest.raises(TypeError, match='is not a time'):
        buffer.lookup_transform('map', 'odom', 0.0, PATIENCE)
    with pytest.raises(TypeError, match='is not a time'):
        buffer.lookup_transform('map', 'odom', LATEST, 1.0)


def test_what_is_no_time_is_no_answer():
    """Otherwise a loop that waits for True would never end, without giving the reason."""
    buffer = Buffer()
    with pytest.raises(TypeError, match='is not a time'):
        buffer.can_transform('map', 'odom', 0.0)
    with pytest.raises(TypeError, match='is not a time'):
        buffer.can_transform('map', 'odom', LATEST, 1.0, return_debug_tuple=True)
    with pytest.raises(TypeError, match='is not a time'):
        buffer.can_transform_full('map', LATEST, 'odom', 1, 'map')


def test_many_threads_wait_at_once_and_each_gets_its_own_answer(buffer, talker):
    answers = {}

    def ask(i):
        stamp = at(3.0 + i / 10)
        answers[i] = buffer.lookup_transform('map', 'odom', stamp, PATIENCE)

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(100)]
    for thread in threads:
        thread.start()
    until_waiting(buffer, 100)
    for second in range(3, 14):
        talker.move(transform('map', 'odom', second, x=float(second)))
    for thread in threads:
        thread.join(PATIENCE_S)
    assert len(answers) == 100
    for i, found in answers.items():
        assert found.header.stamp == at(3.0 + i / 10).to_msg()
        assert found.transform.translation.x == pytest.approx(3.0 + i / 10)


def test_threads_of_a_multi_threaded_executor_wait_side_by_side(buffer, talker, make_node, spin):
    node = make_node('busy')
    found = threading.Semaphore(0)
    executor = spin(node, kind=MultiThreadedExecutor)

    def ask():
        buffer.lookup_transform('map', 'odom', at(3.0), PATIENCE)
        found.release()

    executor.create_task(ask)
    executor.create_task(ask)
    until_waiting(buffer, 2)
    talker.move(transform('map', 'odom', 3.0))
    assert found.acquire(timeout=PATIENCE_S)
    assert found.acquire(timeout=PATIENCE_S)


def test_one_arrival_wakes_only_those_who_can_go_on(buffer, talker, pool):
    soon = [pool.submit(buffer.lookup_transform, 'map', 'odom', at(3.0), PATIENCE)
            for _ in range(3)]
    later = pool.submit(buffer.lookup_transform, 'map', 'odom', at(4.0), PATIENCE)
    until_waiting(buffer, 4)
    talker.move(transform('map', 'odom', 3.5))
    assert not wait(soon, PATIENCE_S).not_done
    assert not later.done()
    assert len(buffer.waiting) == 1
    talker.move(transform('map', 'odom', 4.0))
    later.result(PATIENCE_S)


def test_nobody_is_left_in_the_line_after_a_wait(buffer):
    for stamp in (3.0, 4.0):
        with pytest.raises(TransformException):
            buffer.lookup_transform('map', 'odom', at(stamp), lasting(0.01))
    with pytest.raises(LookupException):
        buffer.lookup_transform('map', 'nowhere', LATEST, lasting(0.01))
    assert len(buffer.waiting) == 0


def test_transforms_set_by_hand_end_a_wait(pool):
    buffer = Buffer()
    asked = pool.submit(buffer.lookup_transform, 'a', 'b', at(1.0), PATIENCE)
    until_waiting(buffer)
    assert buffer.set_transform(transform('a', 'b', 1.0, x=2.0), 'me')
    assert asked.result(PATIENCE_S).transform.translation.x == 2.0


def test_closing_the_last_listener_ends_the_waits(node, make_node, pool):
    buffer = Buffer()
    first = TransformListener(buffer, node)
    second = TransformListener(buffer, make_node('second'))
    asked = pool.submit(buffer.lookup_transform, 'a', 'b', LATEST, PATIENCE)
    until_waiting(buffer)
    first.close()
    pool.submit(buffer.lookup_transform, 'a', 'c', LATEST, PATIENCE)
    until_waiting(buffer, 2)
    assert not asked.done()
    second.close()
    with pytest.raises(LookupException, match='Given up: the listener was closed') as raised:
        asked.result(PATIENCE_S)
    assert raised.value.waited_s < PATIENCE_S


def test_wait_that_begins_after_its_listener_was_closed_is_an_ordinary_one(node, pool):
    buffer = Buffer()
    TransformListener(buffer, node).close()
    with pytest.raises(LookupException, match=WAITED + r'\.\nNothing has been'):
        buffer.lookup_transform('a', 'b', LATEST, lasting(0.01))
    asked = pool.submit(buffer.lookup_transform, 'a', 'b', LATEST, PATIENCE)
    until_waiting(buffer)
    buffer.set_transform(transform('a', 'b'), 'me')
    asked.result(PATIENCE_S)


def test_latency_from_publishing_to_the_answer(buffer, talker, record_property, capsys):
    """Reported, not asserted: from the call of sendTransform to the return of the lookup."""
    count = 300
    asking = [threading.Semaphore(0), threading.Semaphore(0)]
    returned = []

    def ask():
        for i in range(count):
            asking[0].release()
            buffer.lookup_transform('map', 'odom', at(3.0 + i), PATIENCE)
            returned.append(time.perf_counter())
            asking[1].release()

    thread = threading.Thread(target=ask)
    thread.start()
    sent = []
    for i in range(count):
        assert asking[0].acquire(timeout=PATIENCE_S)
        until_waiting(buffer)
        message = transform('map', 'odom', 3.0 + i)
        sent.append(time.perf_counter())
        talker.move(message)
        assert asking[1].acquire(timeout=PATIENCE_S)
    thread.join(PATIENCE_S)
    microseconds = sorted((end - begin) * 1e6
                          for begin, end in zip(sent, returned, strict=True))
    p50, p99 = statistics.median(microseconds), microseconds[int(0.99 * count)]
    record_property('latency_us', {'p50': p50, 'p99': p99})
    with capsys.disabled():
        print(f'\n    publish to answer: p50 {p50:.0f} us, p99 {p99:.0f} us of {count}')
    until(lambda: len(buffer.waiting) == 0)
