# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot can only affect its own frames, and no bytes do any harm."""

import itertools
import logging
import time

from conditions import until
from effort import examples
from fleet_helpers import (
    message,
    PATIENCE_S,
    place,
    robot_of,
    router_here,
    SECOND,
    send_first,
    session_at,
    x_of,
)
from hypothesis import given, HealthCheck, strategies as st
import pytest
from serialized import serialize
from tf_tree_py.core import Kind
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import FleetListener, RobotPublisher
from tf_tree_py.fleet.keys import RMW_TYPE, TYPE_HASH


def test_a_robot_cannot_hang_what_is_shared_elsewhere_nor_touch_others(listen, robot):
    buffer = (listener := listen()).buffer
    robot('robot8').send(message(('map', 'base', 8)))
    assert x_of(buffer, 'map', 'robot8/base') == 8.0
    evil = robot('robot7')
    send_first(listener, evil, message(('trap', 'map', 1), ('map', 'base', 7)))
    for child in ('/map', 'robot8/base', '/robot8/base'):
        evil.send(message(('trap', child, 1), ('map', 'base', 7)))
    until(lambda: listener.robots()[0].transforms == 6)
    assert [(one.name, one.refused) for one in listener.robots()] == [('robot7', 2), ('robot8', 0)]
    assert buffer.statistics().incidents[Kind.NOT_ITS_OWN] == 2
    assert x_of(buffer, 'map', 'robot8/base') == 8.0
    assert {info.child: info.parent for info in buffer.edges()} == {
        'robot8/base': 'map', 'robot7/base': 'map', 'robot7/robot8/base': 'robot7/trap'}


def test_impossible_stamp_is_refused_whatever_else_a_message_has(listen, robot):
    buffer = (listener := listen()).buffer
    driver = robot('robot7')
    send_first(listener, driver, message(('map', 'base', 7)))
    driver.send(serialize([('base', 'imu', 1, SECOND, place(1))]))
    driver.send(serialize([('trap', 'map', 1, 0, place(1)), ('base', 'imu', 1, SECOND, place(1)),
                           ('base', 'arm', time.time_ns() // SECOND, 0, place(1))]))
    until(lambda: robot_of(listener, 'robot7').transforms == 2)
    assert robot_of(listener, 'robot7').refused == 3
    assert buffer.statistics().incidents[Kind.IMPOSSIBLE_STAMP] == 2
    assert {edge.child for edge in buffer.edges()} == {'robot7/base', 'robot7/arm'}


def test_frames_that_are_below_their_robot_already_stay(listen, robot):
    listener = listen()
    robot('robot7').send(message(('map', 'robot7/base', 7), ('robot7/base', 'fork', 1)))
    assert x_of(listener.buffer, 'map', 'robot7/fork') == 8.0
    assert listener.buffer.lookup('map', 'robot7/base').x == 7.0


def test_a_robot_among_whose_frames_another_would_get_is_not_heard(listen, robot, caplog):
    listener = listen('**')
    robot('robot7').send(message(('map', 'base', 7)))
    assert x_of(listener.buffer, 'map', 'robot7/base') == 7.0
    robot('robot7/arm').send(message(('map', 'base', 8)))
    until(lambda: 'robot7/arm' in caplog.text)
    assert 'would mix with those of another' in caplog.text
    assert [one.name for one in listener.robots()] == ['robot7']


def test_refusals_are_logged_and_no_more_than_a_person_reads(listen, robot, caplog):
    listener = listen()
    evil = robot('robot7')
    send_first(listener, evil, message(('trap', 'map', 1)))
    for _ in range(49):
        evil.send(message(('trap', 'map', 1)))
    until(lambda: listener.robots()[0].refused == 50)
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert 'shared by all robots' in caplog.text and "from 'robot7'" in caplog.text


# --- keys

KEY_PARTS = st.sampled_from(['tf', 'tf_static', 'robot8', '0', '8', 'domain8', '@tf_tree_py',
                             '@adv', '@ros2_lv', RMW_TYPE, TYPE_HASH])
FORMS = st.lists(KEY_PARTS, min_size=1, max_size=6) | st.sampled_from([
    ['robot8', 'tf', RMW_TYPE, TYPE_HASH], ['robot8', 'tf_static', RMW_TYPE, TYPE_HASH],
    ['tf', RMW_TYPE, TYPE_HASH], ['tf'], ['tf_static']])


@pytest.fixture(scope='module')
def wide():
    """Return a separate router's session, a listener to all, a robot, and numbers."""
    with router_here() as endpoint, session_at(endpoint) as session, \
            FleetListener(endpoint, '**') as listener:
        yield session, listener, RobotPublisher(session, 'robot8'), itertools.count(1)


@given(st.lists(FORMS, min_size=1, max_size=20))
@examples(4)
def test_robot_cannot_change_others_with_any_key_of_its_own(wide, written):
    session, listener, good, turns = wide
    for rest in written:
        session.put('/'.join(('robot7', *rest)), message(('map', 'base', 666)))
    turn = next(turns)
    good.send(message(('map', 'base', turn), stamp=turn * SECOND))
    assert listener.buffer.lookup_within(
        PATIENCE_S, 'map', 'robot8/base', turn * SECOND).x == turn
    assert listener.buffer.lookup('map', 'robot8/base').x == turn
    for edge in listener.buffer.edges():
        assert edge.child == 'robot8/base' or edge.child.startswith('robot7/')


# --- bytes

names = st.text(st.characters(exclude_categories=['Cs']), max_size=8) | st.sampled_from(
    ['map', '/map', 'base', 'robot8/base'])
poses = st.tuples(*[st.floats()] * 7)
stamps = st.integers(-2**31 * SECOND, 2**31 * SECOND - 1)
sound = st.lists(st.builds(Sample, names, names, stamps, poses), max_size=4).map(write)
cut = st.builds(lambda data, at: data[:at], sound, st.integers(0, 200))
flipped = st.builds(lambda data, at, byte: data[:at] + bytes([byte]) + data[at + 1:],
                    sound, st.integers(0, 200), st.integers(0, 255))


@given(st.lists(st.binary(max_size=200) | sound | cut | flipped, max_size=30))
@examples(4, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_bytes_harm_others_or_end_the_listening(pair, payloads):
    listener, evil, good, turns = pair
    for payload in payloads:
        evil.send(payload)
    # It is processed in the same way, after them.
    turn = next(turns)
    good.send(message(('map', 'base', turn), stamp=turn * SECOND))
    assert listener.buffer.lookup_within(
        PATIENCE_S, 'map', 'good/base', turn * SECOND).x == turn
    for edge in listener.buffer.edges():
        assert edge.child == 'good/base' or edge.child.startswith('evil/')
        assert edge.parent == 'map' or edge.parent.startswith('evil/')
    assert listener.robots()[1].refused == 0


@pytest.fixture
def pair(listen, robot):
    """Return a listener, a robot that sends anything, one that sends correctly, and numbers."""
    return listen(), robot('evil'), robot('good'), itertools.count(1)
