# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Times of other clocks than that of the stamps: refused, with the correct time in the error."""

import asyncio
from functools import partial

from inputs import for_each
import pytest
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.time import Time
from ros_helpers import lasting, LATEST, PATIENCE, SIM_TIME, transform
from tf_tree_py import Buffer, BufferClient, BufferServer, InvalidArgumentException
from tf_tree_py.dropin.buffer import Buffer as DropIn

STEADY, SYSTEM, ROS = ClockType.STEADY_TIME, ClockType.SYSTEM_TIME, ClockType.ROS_TIME

LOOKUPS = {
    'lookup_transform': lambda buffer, time: buffer.lookup_transform('map', 'base', time),
    'lookup_transform with a timeout': lambda buffer, time: buffer.lookup_transform(
        'map', 'base', time, lasting(0.01)),
    'lookup_transform_full, target': lambda buffer, time: buffer.lookup_transform_full(
        'map', time, 'base', LATEST, 'map'),
    'lookup_transform_full, source': lambda buffer, time: buffer.lookup_transform_full(
        'map', LATEST, 'base', time, 'map'),
    'lookup_transform_async': lambda buffer, time: asyncio.run(
        buffer.lookup_transform_async('map', 'base', time)),
    'lookup_transform_full_async': lambda buffer, time: asyncio.run(
        buffer.lookup_transform_full_async('map', time, 'base', time, 'map')),
    'lookup_transform_core': lambda buffer, time: buffer.lookup_transform_core(
        'map', 'base', time),
    'lookup_transform_full_core': lambda buffer, time: buffer.lookup_transform_full_core(
        'map', time, 'base', time, 'map'),
    'lookup_twist': lambda buffer, time: buffer.lookup_twist('map', 'base', time, lasting(1.0)),
    'lookup': lambda buffer, time: buffer.lookup('map', 'base', time),
    'lookup_full': lambda buffer, time: buffer.lookup_full('map', time, 'base', time, 'map'),
    'lookup_many': lambda buffer, time: buffer.lookup_many('map', 'base', [time, time]),
    'lookup_tree': lambda buffer, time: buffer.lookup_tree('map', time),
    'lookup_twist_many': lambda buffer, time: buffer.lookup_twist_many(
        'map', 'base', [time], lasting(1.0)),
    'snapshot': lambda buffer, time: buffer.snapshot().lookup('map', 'base', time),
}


def time_of(kind, seconds=10):
    return Time(seconds=seconds, clock_type=kind)


def fill(buffer):
    for second in range(1, 20):
        buffer.set_transform(transform('map', 'base', second), 'me')
    return buffer


@pytest.fixture
def simulated(make_node, sim_clock, listen):
    buffer = fill(listen(make_node('simulated', **SIM_TIME)))
    sim_clock.show(20.0, buffer)
    return fill(buffer)


@for_each(lookup=LOOKUPS)
def test_steady_time_is_refused_everywhere(lookup):
    buffer = fill(Buffer())
    LOOKUPS[lookup](buffer, time_of(ROS))
    with pytest.raises(InvalidArgumentException, match='counts from when the machine started'):
        LOOKUPS[lookup](buffer, time_of(STEADY))


@for_each(lookup=LOOKUPS)
def test_system_time_is_refused_everywhere_while_time_is_simulated(simulated, lookup):
    LOOKUPS[lookup](simulated, time_of(ROS))
    with pytest.raises(InvalidArgumentException, match='while time is simulated'):
        LOOKUPS[lookup](simulated, time_of(SYSTEM))


def test_refusal_says_what_was_passed_and_what_to_pass():
    buffer = fill(Buffer())
    now = Clock(clock_type=STEADY).now()
    with pytest.raises(InvalidArgumentException) as refusal:
        buffer.lookup_transform('map', 'base', now, PATIENCE)
    for words in (repr(now), 'header.stamp', 'node.get_clock().now()', 'Time() for the latest',
                  'clock_type=ClockType.ROS_TIME'):
        assert words in str(refusal.value)


def test_system_and_ros_time_are_one_while_nothing_is_simulated():
    buffer = fill(Buffer())
    for kind in (SYSTEM, ROS):
        assert buffer.lookup_transform('map', 'base', time_of(kind)).header.stamp.sec == 10


@pytest.mark.parametrize('kind', [SYSTEM, ROS, STEADY])
def test_zero_is_the_latest_whatever_its_clock(simulated, kind):
    assert simulated.lookup_transform('map', 'base', time_of(kind, 0)).header.stamp.sec == 19


def test_stamps_of_messages_have_no_clock(simulated):
    stamp = time_of(SYSTEM).to_msg()
    assert simulated.lookup_transform('map', 'base', stamp).header.stamp == stamp
    assert simulated.can_transform('map', 'base', Time.from_msg(stamp))


def test_can_transform_says_why_not(simulated):
    found, why = simulated.can_transform('map', 'base', time_of(SYSTEM), return_debug_tuple=True)
    assert not found
    assert 'header.stamp' in why


def test_latest_common_time_can_be_looked_up(simulated):
    for buffer in (simulated, fill(Buffer())):
        found = buffer.get_latest_common_time('map', 'base')
        assert buffer.lookup_transform('map', 'base', found).header.stamp.sec == 19


@pytest.mark.parametrize('kind', [STEADY, SYSTEM])
def test_client_of_a_server_refuses_them_too(make_node, sim_clock, simulated, spin, kind):
    server_node, asking = make_node('serving'), make_node('client', **SIM_TIME)
    with BufferServer(simulated, server_node), BufferClient(asking, 'tf2_buffer_server') as client:
        spin(server_node)
        ask = partial(client.lookup_transform, 'map', 'base')
        assert ask(time_of(ROS), PATIENCE).header.stamp.sec == 10
        with pytest.raises(InvalidArgumentException, match=r'header\.stamp'):
            ask(time_of(kind), PATIENCE)


def test_programs_of_tf2_may_go_on_mixing_the_two(make_node, sim_clock, listen):
    """tf2 uses the nanoseconds of any ``Time``; for two of the clocks this is meaningful."""
    buffer = listen(make_node('simulated', **SIM_TIME), DropIn())
    sim_clock.show(20.0, buffer)
    fill(buffer)
    assert buffer.lookup_transform('map', 'base', time_of(SYSTEM)).header.stamp.sec == 10
    assert buffer.get_latest_common_time('map', 'base') == time_of(SYSTEM, 19)
    with pytest.raises(InvalidArgumentException, match='counts from when'):
        buffer.lookup_transform('map', 'base', time_of(STEADY))
