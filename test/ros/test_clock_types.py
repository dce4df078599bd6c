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
    'lookup_twist_uncertain': lambda buffer, time: buffer.lookup_twist_uncertain(
        'map', 'base', time, lasting(1.0)),
    'snapshot': lambda buffer, time: buffer.snapshot().lookup('map', 'base', time),
}


def time_of(clock_type, seconds=10):
    return Time(seconds=seconds, clock_type=clock_type)


def fill(buffer):
    for half in range(2, 39):
        buffer.set_transform(transform('map', 'base', half / 2), 'me')
    return buffer


@pytest.fixture
def simulated(simulated_buffer, sim_clock):
    sim_clock.show(20.0, simulated_buffer)
    return fill(simulated_buffer)


@for_each(lookup=LOOKUPS)
def test_times_that_cannot_be_compared_with_stamps_are_refused(simulated, lookup):
    for buffer, clock_type, why in (
            (fill(Buffer()), STEADY, 'counts from when the machine started'),
            (simulated, STEADY, 'counts from when the machine started'),
            (simulated, SYSTEM, 'while time is simulated')):
        LOOKUPS[lookup](buffer, time_of(ROS))
        with pytest.raises(InvalidArgumentException, match=why):
            LOOKUPS[lookup](buffer, time_of(clock_type))


def test_refusal_says_what_was_passed_and_what_to_pass(simulated):
    now = Clock(clock_type=STEADY).now()
    with pytest.raises(InvalidArgumentException) as refusal:
        fill(Buffer()).lookup_transform('map', 'base', now, PATIENCE)
    for words in (repr(now), 'header.stamp', 'node.get_clock().now()', 'Time() for the latest',
                  'clock_type=ClockType.ROS_TIME'):
        assert words in str(refusal.value)
    found, why = simulated.can_transform('map', 'base', time_of(SYSTEM), return_debug_tuple=True)
    assert not found
    assert 'header.stamp' in why


def test_times_that_can_be_compared_with_stamps_are_taken(simulated):
    plain = fill(Buffer())
    assert plain.lookup_transform('map', 'base', time_of(SYSTEM)).header.stamp.sec == 10
    for buffer in (plain, simulated):
        latest = [time_of(clock_type, 0) for clock_type in (SYSTEM, ROS, STEADY)]
        latest.append(buffer.get_latest_common_time('map', 'base'))
        assert [buffer.lookup_transform('map', 'base', time).header.stamp.sec
                for time in (*latest, time_of(ROS))] == [19] * 4 + [10]
        # Stamps of messages have no clock.
        stamp = time_of(SYSTEM).to_msg()
        assert buffer.lookup_transform('map', 'base', stamp).header.stamp == stamp
        assert buffer.can_transform('map', 'base', Time.from_msg(stamp))


def test_client_of_a_server_refuses_them_too(make_node, sim_clock, simulated, spin):
    server_node, asking = make_node('serving'), make_node('client', **SIM_TIME)
    with BufferServer(simulated, server_node), BufferClient(asking, 'tf2_buffer_server') as client:
        spin(server_node)
        ask = partial(client.lookup_transform, 'map', 'base')
        assert ask(time_of(ROS), PATIENCE).header.stamp.sec == 10
        for clock_type in (STEADY, SYSTEM):
            with pytest.raises(InvalidArgumentException, match=r'header\.stamp'):
                ask(time_of(clock_type), PATIENCE)


def test_programs_of_tf2_may_go_on_mixing_the_two(make_node, sim_clock, listen):
    """tf2 uses the nanoseconds of any ``Time``; for two of the clocks this is meaningful."""
    buffer = listen(make_node('simulated', **SIM_TIME), DropIn())
    sim_clock.show(20.0, buffer)
    fill(buffer)
    assert buffer.lookup_transform('map', 'base', time_of(SYSTEM)).header.stamp.sec == 10
    assert buffer.get_latest_common_time('map', 'base') == time_of(SYSTEM, 19)
    with pytest.raises(InvalidArgumentException, match='counts from when'):
        buffer.lookup_transform('map', 'base', time_of(STEADY))
