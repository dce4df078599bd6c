# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``max_age`` and the newest transform, with ROS: messages, timeouts, futures, /clock, servers."""

import asyncio
from contextlib import contextmanager
import time

from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    result_of,
    SIM_TIME,
    transform,
    until,
    until_waiting,
    WAITED,
    x_of,
)
from tf_tree_py import (
    Buffer,
    BufferClient,
    BufferInterface,
    BufferServer,
    ExtrapolationException,
    InvalidArgumentException,
    Linear,
    LookupException,
    SharedTree,
    StaleException,
    TransformException,
    UNLIMITED,
)
from tf_tree_py.ros.remote.lookup_goal import LookupCall

S = 1_000_000_000
NO_TIME = Duration()
ACTION = 'tf2_buffer_server'


@pytest.fixture
def simulated(make_node, listen, sim_clock, talker):
    """
    Return a function that returns a buffer at 10 s, of map -> odom -> base -> camera.

    The newest sample of odom is of 8 s, that of base of 9.9 s.
    """
    def begin(**options):
        buffer = listen(make_node('asking', **SIM_TIME), Buffer(**options))
        sim_clock.show(10.0, buffer)
        talker.fix(transform('base', 'camera', x=0.5), into=buffer)
        for seconds in 6.0, 8.0:
            talker.move(transform('map', 'odom', seconds, x=seconds), into=buffer)
        for seconds in 7.0, 9.9:
            talker.move(transform('odom', 'base', seconds, x=10.0), into=buffer)
        return buffer

    return begin


def point(seconds=0.0):
    message = PointStamped()
    message.header.frame_id = 'camera'
    message.header.stamp = at(seconds).to_msg()
    return message


LOOKUPS = {
    'lookup_transform': lambda buffer, timeout, limit: buffer.lookup_transform(
        'map', 'camera', LATEST, timeout, max_age=limit),
    'transform': lambda buffer, timeout, limit: buffer.transform(
        point(), 'map', timeout, max_age=limit),
    'lookup_uncertain': lambda buffer, timeout, limit: buffer.lookup_uncertain(
        'map', 'camera', LATEST, timeout, max_age=limit),
    'transform, uncertain': lambda buffer, timeout, limit: buffer.transform(
        PoseWithCovarianceStamped(header=point().header), 'map', timeout, max_age=limit,
        uncertain=True),
    'lookup_transform_newest': lambda buffer, timeout, limit: buffer.lookup_transform_newest(
        'map', 'camera', timeout=timeout, max_age=limit),
    'wait_for_transform_async': lambda buffer, timeout, limit: result_of(
        buffer.wait_for_transform_async('map', 'camera', LATEST, timeout, max_age=limit)),
    'lookup_transform_async': lambda buffer, timeout, limit: asyncio.run(
        buffer.lookup_transform_async('map', 'camera', LATEST, timeout, max_age=limit)),
}
for_each_lookup = pytest.mark.parametrize('look_up', LOOKUPS.values(), ids=LOOKUPS)


@for_each_lookup
def test_each_lookup_refuses_what_is_too_old(simulated, look_up):
    buffer = simulated()
    for limit in lasting(2.0), lasting(2.0).to_msg(), UNLIMITED, None:
        look_up(buffer, Duration(), limit)
    with pytest.raises(StaleException, match='map -> odom, .* max_age is 1.999 s') as caught:
        look_up(buffer, Duration(), lasting(1.999))
    assert caught.value.ages[0].authority == '/talking'


@for_each_lookup
def test_with_a_timeout_each_waits_for_a_fresh_one(simulated, look_up, talker, pool):
    buffer = simulated()
    asked = pool.submit(look_up, buffer, PATIENCE, lasting(0.5))
    until_waiting(buffer)
    talker.move(transform('map', 'odom', 9.4, x=7.0), into=buffer)
    assert len(buffer.waiting) == 1
    talker.move(transform('map', 'odom', 9.5, x=7.0), into=buffer)
    asked.result(PATIENCE.nanoseconds / 1e9)


@for_each_lookup
def test_a_wait_in_vain_ends_with_the_age_of_then(simulated, look_up, sim_clock, pool):
    buffer = simulated()
    asked = pool.submit(look_up, buffer, lasting(3.0), lasting(0.5))
    until_waiting(buffer)
    sim_clock.show(13.0, buffer)
    with pytest.raises(StaleException, match=f'5.000 s old.*{WAITED}'):
        asked.result(PATIENCE.nanoseconds / 1e9)


@pytest.mark.parametrize(('limit', 'can'), [(lasting(2.0), True), (lasting(1.999), False),
                                            (UNLIMITED, True), (None, True)])
def test_can_transform_agrees(simulated, limit, can):
    buffer = simulated()
    assert buffer.can_transform('map', 'camera', LATEST, max_age=limit) is can
    found, why = buffer.can_transform(
        'map', 'camera', LATEST, return_debug_tuple=True, max_age=limit)
    assert (found, 'the edge map -> odom' in why) == (can, not can)


def test_the_default_of_a_buffer_is_for_all_of_these(simulated):
    buffer = simulated(max_age=lasting(1.999))
    assert buffer.max_age == lasting(1.999).nanoseconds
    for look_up in LOOKUPS.values():
        with pytest.raises(StaleException):
            look_up(buffer, Duration(), None)
        look_up(buffer, Duration(), lasting(2.0))
    assert not buffer.can_transform('map', 'camera', LATEST)
    assert buffer.can_transform('map', 'camera', at(8.0))
    assert buffer.can_transform('base', 'camera', LATEST)
    assert not buffer.can_transform_core('map', 'camera', LATEST)[0]
    assert not buffer.can_transform_full('map', LATEST, 'camera', at(9.0), 'odom')
    with pytest.raises(StaleException):
        buffer.lookup_transform_full('map', LATEST, 'camera', at(9.0), 'odom')
    with pytest.raises(StaleException):
        buffer.lookup_twist('camera', 'map', LATEST, lasting(0.1))


def test_a_stamp_other_than_zero_has_no_limit(simulated):
    buffer = simulated(max_age=lasting(0.001))
    assert buffer.lookup_transform('map', 'odom', at(7.0), max_age=lasting(0.0))
    assert buffer.transform(point(8.0), 'map', max_age=lasting(0.0)).point.x == 18.5


def test_before_the_first_clock_an_age_is_unknown(make_node, listen, sim_clock, talker, pool):
    buffer = listen(make_node('asking', **SIM_TIME))
    talker.move(transform('map', 'odom', 8.0), into=buffer)
    with pytest.raises(StaleException, match='has not started.*\n.*does any node publish /clock'):
        buffer.lookup_transform('map', 'odom', LATEST, max_age=lasting(100.0))
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', LATEST, PATIENCE,
                        max_age=lasting(1.0))
    until_waiting(buffer)
    sim_clock.show(10.0, buffer)
    talker.move(transform('map', 'odom', 9.5), into=buffer)
    assert asked.result(PATIENCE.nanoseconds / 1e9).header.stamp == at(9.5).to_msg()


def test_a_wait_ends_when_the_clock_starts_and_the_sample_is_fresh(
        make_node, listen, sim_clock, talker, pool):
    buffer = listen(make_node('asking', **SIM_TIME))
    talker.move(transform('map', 'odom', 8.0), into=buffer)
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', LATEST, PATIENCE,
                        max_age=lasting(1.0))
    future = buffer.wait_for_transform_async('map', 'odom', LATEST, max_age=lasting(1.0))
    until_waiting(buffer, 2)
    sim_clock.show(8.5, buffer)
    assert asked.result(PATIENCE.nanoseconds / S) == result_of(future)


def test_a_wait_ends_when_the_clock_steps_back_and_the_sample_is_fresh(simulated, sim_clock, pool):
    buffer = simulated()
    sim_clock.show(10.8, buffer)
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', LATEST, PATIENCE,
                        max_age=lasting(2.2))
    until_waiting(buffer)
    sim_clock.show(10.1, buffer)
    assert asked.result(PATIENCE.nanoseconds / S).header.stamp == at(8.0).to_msg()


def test_a_clock_that_jumps_back_leaves_nothing_that_is_stale(simulated, sim_clock, talker):
    buffer = simulated(max_age=lasting(2.0))
    buffer.lookup_transform('map', 'camera', LATEST)
    sim_clock.show(12.0, buffer)
    with pytest.raises(StaleException):
        buffer.lookup_transform('map', 'camera', LATEST)
    sim_clock.show(5.0, buffer)
    with pytest.raises(TransformException) as caught:
        buffer.lookup_transform('map', 'camera', LATEST)
    assert not isinstance(caught.value, StaleException)
    talker.move(transform('map', 'odom', 5.0), transform('odom', 'base', 5.0), into=buffer)
    assert buffer.lookup_transform('map', 'camera', LATEST).header.stamp == at(5.0).to_msg()


@pytest.mark.parametrize('wrong', [0.5, 2, '1 s'])
def test_a_limit_is_a_duration(wrong):
    for call in (lambda: Buffer(max_age=wrong),
                 lambda: Buffer().lookup_transform('map', 'base', LATEST, max_age=wrong),
                 lambda: Buffer().can_transform('map', 'base', LATEST, max_age=wrong)):
        with pytest.raises(TypeError, match=r'(max_age=.*Duration\(seconds=|is not a duration)'):
            call()


def test_a_limit_is_not_negative_and_not_a_point_in_time(simulated):
    buffer = simulated()
    for call in (lambda: Buffer(max_age=lasting(-1.0)),
                 lambda: buffer.can_transform('map', 'base', LATEST, max_age=lasting(-1.0))):
        with pytest.raises(InvalidArgumentException, match='cannot be negative'):
            call()
    for moment in at(1.0), at(1.0).to_msg():
        with pytest.raises(TypeError, match='is a point in time: pass an rclpy.duration.Duration'):
            buffer.lookup_transform('map', 'base', LATEST, max_age=moment)
    with pytest.raises(TypeError, match='positional argument'):
        buffer.lookup_transform_newest('map', 'base', at(1.0))


def test_lookups_of_the_core_take_a_duration_too(simulated):
    buffer = simulated()
    for tree in buffer, buffer.snapshot():
        assert tree.lookup('map', 'camera', max_age=lasting(2.0)) == tree.lookup(
            'map', 'camera', max_age=2 * S)
        for limit in lasting(1.0), S:
            with pytest.raises(StaleException):
                tree.lookup('map', 'camera', max_age=limit)
    with pytest.raises(TypeError, match='max_age 0.5.*from_seconds.0.5.'):
        buffer.lookup('map', 'camera', max_age=0.5)
    buffer.max_age = lasting(1.0)
    assert buffer.max_age == S


def test_a_users_interface_with_the_parameters_of_tf2_works_as_before():
    class Fixed(BufferInterface):

        def lookup_transform(self, target_frame, source_frame, time, timeout=NO_TIME):
            return transform(target_frame, source_frame, x=1.0)

    assert Fixed().transform(point(), 'map').point.x == 1.0
    assert Fixed().can_transform('map', 'base', Time())
    with pytest.raises(TypeError, match='max_age'):
        Fixed().transform(point(), 'map', max_age=lasting(1.0))


# --- the newest transform

def test_the_newest_transform_has_the_stamp_of_its_oldest_sample(simulated):
    newest, stamps = simulated().lookup_transform_newest('map', 'camera')
    assert (newest.header.frame_id, newest.child_frame_id) == ('map', 'camera')
    assert newest.header.stamp == at(8.0).to_msg()
    assert x_of(newest) == 18.5
    assert stamps == {'odom': at(8.0).to_msg(), 'base': at(9.9).to_msg()}


def test_the_newest_transform_waits_for_what_is_missing(simulated, talker, pool):
    buffer = simulated()
    asked = pool.submit(buffer.lookup_transform_newest, 'map', 'arm', timeout=PATIENCE)
    until_waiting(buffer)
    talker.move(transform('camera', 'arm', 9.95, x=0.25))
    assert x_of(asked.result(PATIENCE.nanoseconds / 1e9).transform) == 18.75


def test_where_nothing_moves_the_newest_transform_has_no_stamp(simulated):
    newest, stamps = simulated().lookup_transform_newest('base', 'camera')
    assert newest.header.stamp == LATEST.to_msg()
    assert stamps == {}


# --- a snapshot, a shared tree

def test_a_snapshot_keeps_its_time(simulated, sim_clock):
    buffer = simulated(max_age=lasting(2.0))
    still = buffer.snapshot()
    sim_clock.show(11.0, buffer)
    assert still.lookup('map', 'camera', at(0.0)) == still.lookup('map', 'camera')
    with pytest.raises(StaleException):
        still.lookup('map', 'camera', max_age=S)
    with pytest.raises(StaleException):
        buffer.snapshot().lookup('map', 'camera')


def test_a_buffer_that_shows_a_shared_tree_agrees(sharing, make_node, listen, talker):
    with sharing():
        buffer = listen(make_node('asking'), Buffer(shared=True))
        assert buffer.is_shared
        now = buffer.now() / 1e9
        talker.move(transform('map', 'odom', now - 1.0, x=1.0), into=buffer)
        talker.move(transform('map', 'odom', now, x=2.0), into=buffer)
        for _ in range(3):  # a known pose needs no lock
            assert x_of(buffer.lookup_transform('map', 'odom', LATEST)) == 2.0
            with pytest.raises(StaleException, match='the edge map -> odom, last published by'):
                buffer.lookup_transform('map', 'odom', LATEST, max_age=lasting(0.0))
            assert buffer.lookup_transform('map', 'odom', LATEST, max_age=PATIENCE)
            assert buffer.lookup_newest('map', 'odom').stamps
        buffer.max_age = 0
        with pytest.raises(StaleException):
            buffer.lookup_transform('map', 'odom', LATEST)


# --- a server in between

@contextmanager
def served(buffer, make_node, spin, client_node):
    node = make_node('serving')
    with BufferServer(buffer, node, ACTION):
        spin(node)
        with BufferClient(client_node, ACTION, timeout_padding=PATIENCE) as client:
            assert client.wait_for_server(PATIENCE)
            yield client


@pytest.fixture
def client(simulated, make_node, spin, sim_clock):
    """Return a buffer, and a client of it in simulated time."""
    buffer, node = simulated(), make_node('client', **SIM_TIME)
    spin(node)
    until(lambda: sim_clock.publisher.get_subscription_count() >= 2)
    sim_clock.show(10.0, buffer)
    until(lambda: node.get_clock().now().nanoseconds == 10 * S)
    with served(buffer, make_node, spin, node) as client:
        yield buffer, client


def test_a_client_compares_the_stamp(client):
    _, client = client
    for limit in lasting(2.0), UNLIMITED, None:
        assert x_of(client.lookup_transform(
            'map', 'camera', LATEST, max_age=limit)) == 18.5
    with pytest.raises(StaleException) as caught:
        client.lookup_transform('map', 'camera', LATEST, max_age=lasting(1.0))
    assert str(caught.value) == (
        'The latest transform is 2.000 s old, and max_age is 1.000 s, when looking up transform '
        'from frame [camera] to frame [map].\n'
        'tf_echo map camera --once --explain shows the age of each edge between them')
    assert not client.can_transform('map', 'camera', LATEST, max_age=lasting(1.0))
    assert client.transform(point(), 'map', max_age=lasting(2.0)).point.x == 18.5


def test_a_client_refuses_nothing_that_does_not_move(client):
    _, client = client
    for target, source in ('base', 'camera'), ('odom', 'odom'):
        assert client.lookup_transform(target, source, LATEST, max_age=lasting(0.0))
    assert client.lookup_transform('map', 'odom', at(7.0), max_age=lasting(0.0))


def test_a_client_waits_for_a_fresh_one(client, talker, pool):
    buffer, client = client
    asked = pool.submit(client.lookup_transform, 'map', 'camera', LATEST, PATIENCE,
                        max_age=lasting(0.5))
    until_waiting(buffer)  # the server waits, not the client
    talker.move(transform('map', 'odom', 9.4, x=8.0), into=buffer)
    talker.move(transform('map', 'odom', 9.8, x=7.0), into=buffer)
    found = asked.result(PATIENCE.nanoseconds / 1e9)
    assert (x_of(found), found.header.stamp) == (17.5, at(9.8).to_msg())


@pytest.mark.parametrize('anew', ['cleared', 'another parent'])
def test_a_client_that_waits_is_answered_when_the_tree_begins_anew(client, talker, pool, anew):
    """The oldest stamp that was allowed when it began to wait will never be there."""
    buffer, client = client
    asked = pool.submit(client.lookup_transform, 'map', 'camera', LATEST, PATIENCE,
                        max_age=lasting(0.5))
    until_waiting(buffer)
    if anew == 'cleared':
        buffer.clear()
        talker.move(transform('map', 'odom', 9.95, x=1.0), transform('odom', 'base', 9.95, x=1.0))
    else:
        talker.move(transform('map', 'base', 9.95, x=2.0))
    assert x_of(asked.result(PATIENCE.nanoseconds / S)) == 2.5


class Hold(Linear):
    """Holds the newest sample for ever."""

    holds_for = 1000 * S


def test_a_client_pauses_where_no_wait_helps(client, monkeypatch):
    buffer, client = client
    buffer.set_interpolation('odom', Hold())
    sent = []
    goal = LookupCall.goal
    monkeypatch.setattr(LookupCall, 'goal', lambda call: sent.append(call) or goal(call))
    # The server holds the sample, and a client only knows its stamp.
    assert buffer.lookup_transform('map', 'odom', LATEST, max_age=lasting(1.0))
    begin = time.monotonic()
    future = client.wait_for_transform_async('map', 'odom', LATEST, max_age=lasting(1.0))
    until(lambda: len(sent) >= 20)
    future.cancel()
    assert time.monotonic() - begin > 0.3


def test_a_client_that_waits_in_vain_says_how_old_it_was(client, sim_clock, pool):
    buffer, client = client
    asked = pool.submit(client.lookup_transform, 'map', 'camera', LATEST, lasting(3.0),
                        max_age=lasting(0.5))
    until_waiting(buffer)
    sim_clock.show(20.0, buffer)
    until(lambda: client.node.get_clock().now().nanoseconds == 20 * S)
    with pytest.raises(StaleException, match=f'12.000 s old.*{WAITED}'):
        asked.result(PATIENCE.nanoseconds / 1e9)


def test_a_future_of_a_client_and_other_errors(client):
    _, client = client
    with pytest.raises(StaleException):
        result_of(client.wait_for_transform_async(
            'map', 'camera', LATEST, Duration(), max_age=lasting(0.0)))
    with pytest.raises(LookupException, match='nowhere'):
        client.lookup_transform('map', 'nowhere', LATEST, max_age=lasting(1.0))
    with pytest.raises(TypeError, match='max_age=1 is not a time'):
        client.lookup_transform('map', 'camera', LATEST, max_age=1)


def test_a_client_whose_clock_has_not_started_does_not_know_the_age(
        simulated, make_node, spin):
    node = make_node('client', **SIM_TIME)
    with served(simulated(), make_node, spin, node) as client:
        for timeout in 0.0, 0.3:
            with pytest.raises(StaleException, match='has not started.*\n.*/clock') as caught:
                client.lookup_transform('map', 'camera', LATEST, lasting(timeout),
                                        max_age=lasting(9.0))
            assert (caught.value.waited_s or 0.0) >= timeout


def test_the_default_of_a_server_is_an_error_of_its_clients(simulated, make_node, spin):
    buffer = simulated(max_age=lasting(1.0))
    with served(buffer, make_node, spin, make_node('client')) as client, \
            pytest.raises(ExtrapolationException, match='the edge map -> odom, last published by'):
        client.lookup_transform('map', 'camera', LATEST)


def test_a_shared_tree_without_ros_takes_a_clock(context, writer, talker):
    talker.move(transform('map', 'odom', 5.0, x=1.0), into=writer)
    with SharedTree(domain_id=context.get_domain_id(), now=lambda: 7 * S) as tree:
        for _ in range(2):  # the second time the path is known
            assert tree.lookup('map', 'odom', max_age=2 * S)
            with pytest.raises(StaleException, match='edge map -> odom'):
                tree.lookup('map', 'odom', max_age=S)
