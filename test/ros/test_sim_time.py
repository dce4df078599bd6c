# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Simulated time over a real /clock."""

import threading

import pytest
from rclpy.parameter import Parameter
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    result_of,
    SIM_TIME,
    SimClock,
    simulated_seconds,
    transform,
    until,
    until_waiting,
)
from rosgraph_msgs.msg import Clock
from tf_tree_py import (
    Buffer,
    ClockJumpException,
    ExtrapolationException,
    LookupException,
    TransformListener,
)


@pytest.fixture
def node(make_node):
    return make_node('asking', **SIM_TIME)


@pytest.fixture
def buffer(node, listen, sim_clock):
    buffer = listen(node)
    sim_clock.show(10.0, buffer)
    return buffer


def switch(node, simulated):
    (result,) = node.set_parameters([Parameter('use_sim_time', value=simulated)])
    assert result.successful


def test_clock_that_is_not_heard_yet_stands_still(node, listen):
    assert simulated_seconds(listen(node)) == 0.0


def test_paused_clock_times_out_by_the_wall_guard_alone(
        buffer, node, listen, talker, pool, capfd):
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(11.0), lasting(0.001))
    until_waiting(buffer)
    guarded = listen(node, Buffer(wall_guard=lasting(0.05)))
    future = guarded.wait_for_transform_async('map', 'base', LATEST, PATIENCE)
    with pytest.raises(LookupException, match=r'Given up after \d+\.\d{3} s of wall time, the '
                                              r'wall_guard: is any node publishing /clock\?'):
        guarded.lookup_transform('map', 'base', LATEST, lasting(0.001))
    with pytest.raises(LookupException, match='wall_guard: is any node publishing /clock'):
        result_of(future)
    assert 'stood still' not in capfd.readouterr().err, 'not for long enough'
    assert not asked.done(), 'although 50 times its timeout passed in real time'
    talker.move(transform('map', 'base', 11.0), listeners=2)
    assert asked.result(PATIENCE_S).header.stamp.sec == 11


@pytest.mark.parametrize('asks', [
    lambda buffer, pool: pool.submit(
        buffer.lookup_transform, 'map', 'base', at(11.0), lasting(0.001)),
    lambda buffer, _: buffer.wait_for_transform_async('map', 'base', at(11.0), lasting(0.001)),
], ids=['thread', 'future'])
def test_wait_by_a_clock_that_nobody_publishes_is_logged_once(
        node, listen, talker, pool, log, monkeypatch, asks):
    monkeypatch.setattr('tf_tree_py.ros.waiting.deadlines.STOPPED_S', 0.05)
    buffer = listen(node)
    asked = [asks(buffer, pool)]
    until(lambda: 'is any node publishing /clock?' in log())
    asked += [asks(buffer, pool)]
    until_waiting(buffer, 2)
    talker.move(transform('map', 'base', 11.0))
    for each in asked:
        assert result_of(each).header.stamp.sec == 11
    buffer.timeouts.watch.report_if_stopped(0)  # as another wait does
    assert log().count('stood still at 0.000000000 s for') == 1


def test_wait_by_a_clock_that_ticks_is_not_logged(
        buffer, sim_clock, pool, capfd, monkeypatch):
    monkeypatch.setattr('tf_tree_py.ros.waiting.deadlines.STOPPED_S', 0.05)
    report = buffer.timeouts.watch.report_if_stopped
    looked = []

    def look(before):
        sim_clock.show(10.5, buffer)
        report(before)
        looked.append(before)

    monkeypatch.setattr(buffer.timeouts.watch, 'report_if_stopped', look)
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(11.0), lasting(1.0))
    until(lambda: looked)
    sim_clock.show(11.0, buffer)
    with pytest.raises(LookupException):
        asked.result(PATIENCE_S)
    assert 'stood still' not in capfd.readouterr().err


def test_clock_ticks_while_the_users_executor_is_blocked(node, listen, sim_clock, spin):
    """The node's own clock needs the executor that waits here; the companion's does not."""
    buffer = listen(node, Buffer(node=node))
    sim_clock.show(10.0, buffer)
    spin(node)
    failures = []

    def ask():
        timer.cancel()
        with pytest.raises(LookupException) as raised:
            buffer.lookup_transform('map', 'base', LATEST, lasting(2.0))
        failures.append(raised.value)

    timer = node.create_timer(0.001, ask)
    # A timer of a simulated clock needs a separate tick.
    until(lambda: sim_clock.show(11.0, buffer) or len(buffer.waiting))
    sim_clock.show(20.0, buffer)
    until(lambda: failures)
    assert failures[0].waited_s >= 2.0


def test_jump_back_forgets_what_moves_once(node, make_node, listen, sim_clock, talker):
    """Also if two listeners of one buffer notice it."""
    buffer = listen(node)
    listen(make_node('second', **SIM_TIME), buffer)
    sim_clock.show(10.0, buffer)
    until(lambda: sim_clock.publisher.get_subscription_count() == 4)
    talker.fix(transform('base', 'camera'))
    talker.move(transform('map', 'base', 10.0), listeners=2)
    until(lambda: buffer.statistics().accepted == 4)
    sim_clock.show(1.0, buffer)
    until(lambda: not buffer.can_transform('map', 'base', LATEST))
    assert buffer.can_transform('base', 'camera', LATEST)
    assert set(buffer.frames()) == {'map', 'base', 'camera'}
    talker.move(transform('map', 'base', 1.0), listeners=2, into=buffer)
    sim_clock.show(2.0, buffer)
    assert buffer.can_transform('map', 'camera', at(1.0))


def test_jump_back_fails_all_who_wait(buffer, sim_clock, pool):
    asked = [pool.submit(buffer.lookup_transform, 'map', f'base{number}', LATEST, PATIENCE)
             for number in range(3)]
    question = pool.submit(buffer.can_transform, 'map', 'base', LATEST, PATIENCE, True)
    asked.append(buffer.wait_for_transform_async('map', 'base', at(3.0)))
    until_waiting(buffer, 5)
    sim_clock.show(9.0, buffer)
    for future in asked:
        with pytest.raises(ClockJumpException, match=(
                r'During the wait the clock went back by 1\.000 s, from 10\.000000000 to '
                r'9\.000000000; the buffer was cleared')) as raised:
            result_of(future)
        assert 'Given up' not in str(raised.value)
    found, why = question.result(PATIENCE_S)
    assert not found
    assert 'the clock went back by 1.000 s' in why


def test_jump_back_is_logged_and_the_failures_that_it_causes_name_it(
        buffer, sim_clock, talker, log):
    talker.move(transform('map', 'base', 9.0), into=buffer)
    talker.move(transform('map', 'base', 10.0), into=buffer)
    sim_clock.show(8.0, buffer)
    until(lambda: 'all moving transforms' in log())
    why = 'the clock went back by 2.000 s, from 10.000000000 to 8.000000000'
    assert f'Detected jump back in time: {why}. The buffer forgot' in log()
    assert 'nodes publish it' not in log(), 'there is one'
    with pytest.raises(ExtrapolationException, match='for that time, and forgot it: ' + why):
        buffer.lookup_transform('map', 'base', at(9.5))


def test_clock_that_trembles_forgets_nothing_and_its_publishers_are_named_once(
        buffer, make_node, sim_clock, talker, pool, capfd):
    talker.move(transform('map', 'base', 9.0), into=buffer)
    second = SimClock(make_node('second_simulation'))
    asked = [pool.submit(buffer.lookup_transform, 'map', 'base', at(10.5), PATIENCE),
             buffer.wait_for_transform_async('map', 'base', at(10.5), PATIENCE)]
    until_waiting(buffer, 2)
    for tick in range(1, 100):
        sim_clock.show((1000 + tick) / 100.0, buffer)
        second.show((998 + tick) / 100.0, buffer)
        assert buffer.can_transform('map', 'base', at(9.0))
    assert not any(each.done() for each in asked)
    talker.move(transform('map', 'base', 11.0))
    for each in asked:
        assert result_of(each).header.stamp.nanosec == 500_000_000
    text = capfd.readouterr().err
    assert text.count('2 nodes publish it: /second_simulation, /simulation') == 1, text
    assert text.count('WARN') == 1, text


def test_step_back_that_forgets_everything_can_be_chosen(node, listen, sim_clock, talker):
    buffer = listen(node, Buffer(clear_on_clock_jump_back=lasting(0.0)))
    sim_clock.show(10.0, buffer)
    talker.move(transform('map', 'base', 9.0), into=buffer)
    sim_clock.show(9.997, buffer)
    until(lambda: not buffer.can_transform('map', 'base', LATEST))


@pytest.mark.usefixtures('use_wait_set')
def test_switch_of_the_kind_of_time_begins_anew(make_node, listen, sim_clock, talker, pool):
    node = make_node('changing')
    buffer = listen(node)
    assert simulated_seconds(buffer) is None
    for simulated, seconds in ((True, 7.0), (False, 6.0), (True, 8.0)):
        talker.move(transform('map', 'base', 5.0), into=buffer)
        waiting = pool.submit(buffer.lookup_transform, 'map', 'nowhere', LATEST, PATIENCE)
        until_waiting(buffer)
        switch(node, simulated)
        with pytest.raises(ClockJumpException, match='use_sim_time was switched'):
            waiting.result(PATIENCE_S)
        assert not buffer.can_transform('map', 'base', LATEST), 'another kind of time begins'
        if simulated:
            sim_clock.show(seconds, buffer)
        assert simulated_seconds(buffer) == (seconds if simulated else None)
    talker.move(transform('map', 'base', 8.0), into=buffer)


def test_switching_back_and_forth_while_messages_flow(make_node, listen, talker, sim_clock, pool):
    node = make_node('changing')
    buffer = listen(node)
    stop = threading.Event()

    def flood():
        second = 1
        while not stop.is_set():
            second += 1
            talker.move(transform('map', 'base', second))
            sim_clock.publisher.publish(Clock())

    flooding = pool.submit(flood)
    try:
        for turn in range(60):
            switch(node, turn % 2 == 0)
    finally:
        stop.set()
    flooding.result(PATIENCE_S)
    talker.move(transform('map', 'fresh', 1e6), into=buffer)
    assert buffer.can_transform('map', 'fresh', at(1e6))


def test_buffer_goes_by_its_nodes_clock_again_when_the_listener_is_closed(node, sim_clock, spin):
    buffer = Buffer(node=node)
    spin(node)
    with TransformListener(buffer, node):
        sim_clock.show(10.0, buffer)
    sim_clock.show(11.0, buffer)
    assert simulated_seconds(buffer) == 11.0
