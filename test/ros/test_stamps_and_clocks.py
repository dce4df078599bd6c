# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps against the buffer's clock, and bags in a loop, over real DDS."""

import pytest
from ros_helpers import at, lasting, LATEST, PATIENCE, PATIENCE_S, SIM_TIME, transform, until
from tf_tree_py import Buffer, ClockJumpException, ExtrapolationException
from tf_tree_py.core import Kind

BAG = [float(second) for second in range(100, 161)]


def count(buffer, kind):
    return buffer.statistics().incidents[kind]


def until_seen(buffer, transforms):
    until(lambda: buffer.statistics().accepted + buffer.statistics().refused == transforms)


@pytest.fixture
def simulated(make_node):
    return make_node('simulated', **SIM_TIME)


# --- a bag in a loop

def test_bag_in_a_loop_with_a_clock(simulated, listen, sim_clock, talker):
    buffer = listen(simulated)
    talker.fix(transform('base', 'camera'))
    for loop in range(3):
        for second in BAG[::10]:
            sim_clock.show(second, buffer)
            talker.move(transform('map', 'base', second, x=loop + second))
            found = buffer.lookup_transform('map', 'camera', at(second), PATIENCE)
            assert found.transform.translation.x == loop + second
        with pytest.raises(ExtrapolationException):
            buffer.lookup_transform('map', 'camera', at(BAG[0]))
    assert buffer.statistics().refused == 0


def test_bag_in_a_loop_without_a_clock(node, listen, talker, log, pool):
    buffer = listen(node, Buffer(clear_on_jump_back=lasting(5.0)))
    talker.fix(transform('base', 'camera'))
    for loop in range(3):
        for second in BAG:
            talker.move(transform('map', 'base', second, x=float(loop)))
        until_seen(buffer, 1 + len(BAG) * (loop + 1))
        found = buffer.lookup_transform('map', 'camera', at(BAG[-1]))
        assert found.transform.translation.x == loop
    assert count(buffer, Kind.JUMP_BACK) == 2
    assert count(buffer, Kind.OLD_DATA) == 2, 'the first of each loop, which could be a straggler'
    until(lambda: 'stamps went back by 59.000 s' in log())

    asked = pool.submit(buffer.lookup_transform, 'map', 'base', at(BAG[-1] + 1.0), PATIENCE)
    later = buffer.wait_for_transform_async('map', 'base', at(BAG[-1] + 2.0))
    until(lambda: len(buffer.waiting) == 2)
    for second in BAG[:3]:
        talker.move(transform('map', 'base', second))
    with pytest.raises(ClockJumpException, match='All stamps went back'):
        asked.result(PATIENCE_S)
    until(later.done)
    assert isinstance(later.exception(), ClockJumpException)


# --- the far future

def test_stamp_of_the_far_future_is_refused_and_what_is_good_goes_on(node, listen, talker, log):
    buffer = listen(node, Buffer(max_future=lasting(2.0)))
    talker.move(transform('map', 'base', 2**31 - 1))
    talker.move(transform('map', 'base', 100.0, x=1.0))
    found = buffer.lookup_transform('map', 'base', at(100.0), PATIENCE)
    assert found.transform.translation.x == 1.0
    assert count(buffer, Kind.FAR_FUTURE) == buffer.statistics().refused == 1
    until(lambda: 'max_future allows 2.000 s' in log())
    assert "from '/talking'" in log()


def test_guard_goes_by_simulated_time_as_soon_as_it_is_heard(
        simulated, listen, sim_clock, talker):
    buffer = Buffer(max_future=lasting(2.0))
    assert buffer.set_transform(transform('map', 'base', 200.0)), 'by the wall clock, so far'
    listen(simulated, buffer)
    sim_clock.show(100.0, buffer)
    assert not buffer.set_transform(transform('map', 'base', 201.0))
    for number, second in enumerate((102.0, 103.0)):
        talker.move(transform('map', f'child{number}', second))
    until(lambda: count(buffer, Kind.FAR_FUTURE) == 2)
    sim_clock.show(101.0, buffer)
    talker.move(transform('map', 'child1', 103.0))
    buffer.lookup_transform('map', 'child1', LATEST, PATIENCE)
    assert count(buffer, Kind.FAR_FUTURE) == 2


def test_rest_of_the_last_loop_does_not_poison_the_next(simulated, listen, sim_clock, talker):
    """Two topics overtake each other: /clock jumps back, and an old transform arrives after it."""
    buffer = listen(simulated, Buffer(max_future=lasting(2.0)))
    for second in (100.0, 160.0):
        sim_clock.show(second, buffer)
        talker.move(transform('map', 'base', second))
    until(lambda: buffer.statistics().accepted == 2)
    sim_clock.show(100.0, buffer)
    talker.move(transform('map', 'base', 160.1))
    talker.move(transform('map', 'base', 100.0))
    found = buffer.lookup_transform('map', 'base', at(100.0), PATIENCE)
    assert found.header.stamp.sec == 100
    assert count(buffer, Kind.FAR_FUTURE) == 1


def test_clock_that_is_not_heard_yet_refuses_nothing(simulated, listen, talker):
    buffer = listen(simulated, Buffer(max_future=lasting(2.0)))
    talker.move(transform('map', 'base', 100.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert not any(buffer.statistics().incidents.values())


def test_publisher_that_ignores_simulated_time_is_told(simulated, listen, sim_clock, talker, log):
    buffer = listen(simulated)
    sim_clock.show(100.0, buffer)
    for number in range(3):
        talker.move(transform('map', 'base', 1_700_000_000.0 + number))
    until(lambda: buffer.statistics().accepted == 3)
    assert count(buffer, Kind.AHEAD_OF_CLOCK) == 1
    until(lambda: 'simulated time and the other does not (use_sim_time)' in log())
