# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups that wait for data that has not arrived yet."""

from concurrent.futures import ThreadPoolExecutor
import re
import time

from inputs import for_each
import pytest
from rclpy.executors import MultiThreadedExecutor
from ros_helpers import (
    at,
    lasting,
    LATEST,
    move,
    PATIENCE,
    PATIENCE_S,
    result_of,
    transform,
    until,
    until_waiting,
    WAITED,
)
import tf_tree_py as tf


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


@pytest.mark.parametrize(('question', 'arrivals', 'stamp', 'x'), [
    (('map', 'odom', at(2.5)),
     [('map', 'odom', 2.25, 9.0), ('map', 'odom', 2.75, 10.0)], 2.5, 9.5),
    (('map', 'odom', at(0.5)), [('map', 'odom', 0.5, -1.0)], 0.5, -1.0),
    (('map', 'gripper', LATEST),
     [('camera', 'gripper', 7.0, 0.25), ('odom', 'base', 2.0, 0.125),
      ('odom', 'base', 7.0, 0.125), ('map', 'odom', 7.0, 2.0)], 7.0, 2.875),
    (('map', 'camera', at(3.0)),
     [('odom', 'base', 3.0), ('odom', 'base', 4.0), ('map', 'odom', 3.0, 5.0)], 3.0, 5.5),
], ids=['newer than all data', 'older than all data', 'unknown frames', 'slowest edge'])
def test_lookup_waits_for_all_that_it_lacks(
        buffer, talker, pool, question, arrivals, stamp, x):
    asked = pool.submit(buffer.lookup_transform, *question, PATIENCE)
    for arrival in arrivals:
        until_waiting(buffer)
        accepted = buffer.statistics().accepted
        talker.move(transform(*arrival))
        until(lambda before=accepted: buffer.statistics().accepted > before)
    found = asked.result(PATIENCE_S)
    assert found.header.stamp == at(stamp).to_msg()
    assert found.transform.translation.x == x


def test_lookups_wait_for_the_edge_that_joins_two_trees(buffer, talker, pool):
    simple = pool.submit(buffer.lookup_transform, 'map', 'camera', LATEST, PATIENCE)
    full = pool.submit(buffer.lookup_transform_full, 'odom', at(1.0), 'camera', at(3.0), 'map',
                       PATIENCE)
    until_waiting(buffer, 2)
    talker.fix(transform('odom', 'base', x=0.25))
    assert simple.result(PATIENCE_S).transform.translation.x == 2.75
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 3.0, x=3.0))
    found = full.result(PATIENCE_S)
    assert found == transform('odom', 'camera', 1.0, x=3.0 - 1.0 + 0.25 + 0.5, w=1.0)


def test_can_transform_waits_and_says_yes(buffer, talker, pool):
    asked = [pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE),
             pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE, True),
             pool.submit(buffer.can_transform_full, 'odom', at(3.0), 'odom', at(1.0), 'map',
                         PATIENCE)]
    until_waiting(buffer, 3)
    talker.move(transform('map', 'odom', 3.0))
    assert [each.result(PATIENCE_S) for each in asked] == [True, (True, ''), True]


def test_can_transform_says_no_and_why(buffer):
    assert buffer.can_transform('map', 'odom', at(3.0)) is False
    assert buffer.can_transform('map', 'odom', at(3.0), lasting(0.01)) is False
    assert buffer.can_transform('', 'odom', LATEST) is False
    found, why = buffer.can_transform('map', 'odom', at(3.0), lasting(0.01), True)
    assert found is False
    assert re.search('extrapolation into the future.*' + WAITED, why)
    found, why = buffer.can_transform_full('odom', at(1.0), 'camera', at(1.0), 'map',
                                           return_debug_tuple=True)
    assert found is False
    assert 'not part of the same tree' in why


@for_each(case=[
    (('map', 'base', at(200.0), lasting(0.0)), tf.FutureExtrapolationException),
    (('map', 'base', at(200.0), lasting(-1.0)), tf.FutureExtrapolationException),
    (('map', 'base', at(1.0), PATIENCE), tf.PastExtrapolationException),
    (('', 'base', LATEST, PATIENCE), tf.InvalidArgumentException),
    (('map', '', LATEST, PATIENCE), tf.InvalidArgumentException),
    (('/map', 'base', LATEST, PATIENCE), tf.InvalidArgumentException),
    (('map', '/base', at(1.0), PATIENCE), tf.InvalidArgumentException),
])
def test_lookup_without_time_or_without_hope_fails_at_once(case):
    """Every caller gets an exception of its own, also those who share a future."""
    question, kind = case
    buffer = tf.Buffer()
    # The window ends at the newest stamp before each insertion, as in tf2.
    for seconds in (1.0, 100.0, 101.0):
        move(buffer, seconds)
    future = buffer.wait_for_transform_async(*question)
    assert future.done()
    errors = [pytest.raises(kind, future.result).value for _ in range(2)]
    errors.append(pytest.raises(kind, buffer.lookup_transform, *question).value)
    assert len(set(map(id, errors))) == 3
    assert len(set(map(str, errors))) == 1
    assert [error.waited_s for error in errors] == [None] * 3
    assert 'waited' not in str(errors[0])
    if kind is tf.PastExtrapolationException:
        assert 'The buffer keeps 10.000 s' in str(errors[0])
        with pytest.raises(kind):
            buffer.lookup_transform_full('base', at(101.0), 'base', at(1.0), 'map', PATIENCE)


def test_wait_ends_when_its_time_has_become_too_old(buffer, talker, pool):
    """Data inside the window may still arrive late; expired data may not."""
    asked = [pool.submit(buffer.lookup_transform, 'map', 'odom', at(0.5), PATIENCE),
             buffer.wait_for_transform_async('map', 'odom', at(0.5), PATIENCE)]
    until_waiting(buffer, 2)
    talker.move(transform('map', 'odom', 10.0))
    buffer.lookup_transform('map', 'odom', at(10.0), PATIENCE)
    until_waiting(buffer, 2)
    talker.move(transform('map', 'odom', 30.0))
    for future in asked:
        with pytest.raises(tf.PastExtrapolationException, match='waited'):
            result_of(future)


@for_each(case=[
    ('lookup_transform', ('map', 'odom', at(3.0)), tf.FutureExtrapolationException,
     r'future\. Requested time 3\.0+ but the latest data is at time 2\.0+.*map -> odom'),
    ('lookup_transform', ('map', 'nowhere', LATEST), tf.LookupException,
     r'nowhere.*source_frame.*does not exist'),
    ('lookup_transform', ('map', 'camera', LATEST), tf.ConnectivityException,
     r'map.*camera.* because they are not part of the same tree'),
    ('lookup_transform_full', ('odom', at(1.0), 'odom', at(9.0), 'map'),
     tf.FutureExtrapolationException, ''),
])
def test_expiry_says_what_was_missing_and_how_long_it_waited(buffer, case):
    method, question, kind, missing = case
    begin = time.monotonic()
    with pytest.raises(kind, match=f'{missing}.*{WAITED}') as raised:
        getattr(buffer, method)(*question, lasting(0.05))
    assert time.monotonic() - begin >= 0.05
    assert raised.value.waited_s >= 0.05
    assert len(buffer.waiting) == 0


def test_many_threads_wait_at_once_and_each_gets_its_own_answer(buffer, talker):
    stamps = [at(3.0 + number / 10) for number in range(100)]
    with ThreadPoolExecutor(100) as threads:
        asked = [threads.submit(buffer.lookup_transform, 'map', 'odom', stamp, PATIENCE)
                 for stamp in stamps]
        until_waiting(buffer, 100)
        for second in range(3, 14):
            talker.move(transform('map', 'odom', second, x=float(second)))
            expected = min(100, 10 * (second - 3) + 1)
            until(lambda expected=expected: sum(each.done() for each in asked) == expected)
            assert len(buffer.waiting) == 100 - expected
    for stamp, found in zip(stamps, (each.result() for each in asked), strict=True):
        assert found.header.stamp == stamp.to_msg()
        assert found.transform.translation.x == pytest.approx(stamp.nanoseconds / 1e9)


def test_threads_of_a_multi_threaded_executor_wait_side_by_side(buffer, talker, make_node, spin):
    executor = spin(make_node('busy'), kind=MultiThreadedExecutor)
    tasks = [executor.create_task(buffer.lookup_transform, 'map', 'odom', at(3.0), PATIENCE)
             for _ in range(2)]
    until_waiting(buffer, 2)
    talker.move(transform('map', 'odom', 3.0))
    assert [result_of(task).header.stamp.sec for task in tasks] == [3, 3]


def test_each_wait_in_a_row_is_ended_by_its_arrival(buffer, talker, pool):
    for second in range(3, 303):
        asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(second), PATIENCE)
        until_waiting(buffer)
        talker.move(transform('map', 'odom', second))
        assert asked.result(PATIENCE_S).header.stamp.sec == second
