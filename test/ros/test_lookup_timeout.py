# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups that wait for data that has not arrived yet."""

import asyncio
import re
import time

from inputs import for_each
import pytest
from rclpy.task import Future
from ros_helpers import (
    at,
    lasting,
    LATEST,
    move,
    PATIENCE,
    result_of,
    transform,
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
    talker.move(transform('map', 'odom', 2.0, x=2.0), into=buffer)
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    return buffer


def test_lookups_wait_for_all_that_they_lack(buffer, talker, pool):
    asked = [pool.submit(buffer.lookup_transform, *question, PATIENCE) for question in (
        ('map', 'odom', at(0.5)), ('map', 'odom', at(3.0)), ('map', 'gripper', LATEST))]
    asked.append(pool.submit(
        buffer.lookup_transform_full, 'odom', at(1.0), 'camera', at(3.0), 'map', PATIENCE))
    until_waiting(buffer, 4)
    talker.move(transform('map', 'odom', 0.5, x=-1.0))
    assert result_of(asked[0]) == transform('map', 'odom', 0.5, x=-1.0)
    talker.fix(transform('odom', 'base', x=0.25))
    talker.move(transform('camera', 'gripper', 6.0, x=0.25))
    buffer.lookup_transform('odom', 'gripper', LATEST, PATIENCE)
    until_waiting(buffer, 3)
    talker.move(transform('map', 'odom', 6.0, x=6.0))
    assert [result_of(each) for each in asked[1:]] == [
        transform('map', 'odom', 3.0, x=3.0), transform('map', 'gripper', 6.0, x=7.0),
        transform('odom', 'camera', 1.0, x=2.75)]


def test_can_transform_waits_and_says_yes(buffer, talker, pool):
    asked = [pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE),
             pool.submit(buffer.can_transform, 'map', 'odom', at(3.0), PATIENCE, True),
             pool.submit(buffer.can_transform_full, 'odom', at(3.0), 'odom', at(1.0), 'map',
                         PATIENCE)]
    until_waiting(buffer, 3)
    talker.move(transform('map', 'odom', 3.0))
    assert [result_of(each) for each in asked] == [True, (True, ''), True]


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
    question, cls = case
    buffer = tf.Buffer()
    # The window ends at the newest stamp before each insertion, as in tf2.
    for seconds in (1.0, 100.0, 101.0):
        move(buffer, seconds)
    future = buffer.wait_for_transform_async(*question)
    assert future.done()
    errors = [pytest.raises(cls, future.result).value for _ in range(2)]
    errors.append(pytest.raises(cls, buffer.lookup_transform, *question).value)
    assert len(set(map(id, errors))) == 3
    assert len(set(map(str, errors))) == 1
    assert [error.waited_s for error in errors] == [None] * 3
    assert 'waited' not in str(errors[0])


@for_each(case=[
    ('lookup_transform', ('map', 'odom', at(3.0)), tf.FutureExtrapolationException,
     r'future\. Requested time 3\.0+ but the latest data is at time 2\.0+.*map -> odom'),
    ('lookup_transform', ('map', 'nowhere', LATEST), tf.LookupException,
     r'nowhere.*source_frame.*does not exist'),
    ('lookup_transform', ('map', 'camera', LATEST), tf.ConnectivityException,
     r'map.*camera.* because they are not part of the same tree'),
    ('lookup_transform_full', ('odom', at(1.0), 'odom', at(9.0), 'map'),
     tf.FutureExtrapolationException, ''),
    ('wait_for_transform_async', ('map', 'odom', at(3.0)), tf.FutureExtrapolationException,
     'map -> odom'),
    ('lookup_transform_async', ('map', 'nowhere', LATEST), tf.LookupException, 'nowhere'),
])
def test_expiry_says_what_was_missing_and_how_long_it_waited(buffer, case):
    method, question, cls, missing = case
    begin = time.monotonic()
    with pytest.raises(cls, match=f'{missing}.*{WAITED}') as raised:
        outcome(getattr(buffer, method)(*question, lasting(0.05)))
    assert time.monotonic() - begin >= 0.05
    assert raised.value.waited_s >= 0.05
    assert len(buffer.waiting) == 0


def outcome(answer):
    """Return the result of a future or coroutine, or the result itself."""
    if asyncio.iscoroutine(answer):
        return asyncio.run(answer)
    return result_of(answer) if isinstance(answer, Future) else answer


def test_each_wait_in_a_row_is_ended_by_its_arrival(buffer, talker, pool):
    for second in range(3, 303):
        asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(second), PATIENCE)
        until_waiting(buffer)
        talker.move(transform('map', 'odom', second))
        assert result_of(asked).header.stamp.sec == second
