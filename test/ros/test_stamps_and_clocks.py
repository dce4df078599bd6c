# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps against the buffer's clock, and bags in a loop, over real DDS."""

import pytest
from ros_helpers import at, lasting, PATIENCE, result_of, SIM_TIME, transform, until, until_waiting
from tf_tree_py import Buffer, ClockJumpException
from tf_tree_py.core import Kind

BAG = [float(second) for second in range(100, 161)]


def count(buffer, kind):
    return buffer.statistics().incidents[kind]


def counted(buffer):
    return buffer.statistics().accepted + buffer.statistics().refused


def test_bag_in_a_loop_without_a_clock_begins_anew(node, listen, talker, log, pool):
    buffer = listen(node, Buffer(clear_on_jump_back=lasting(5.0)))
    talker.fix(transform('base', 'camera'))
    for loop in range(3):
        for second in BAG:
            talker.move(transform('map', 'base', second, x=float(loop)))
        until(lambda loop=loop: counted(buffer) == 1 + len(BAG) * (loop + 1))
        found = buffer.lookup_transform('map', 'camera', at(BAG[-1]))
        assert found.transform.translation.x == loop
        assert count(buffer, Kind.JUMP_BACK) == loop
    until(lambda: 'stamps went back by 59.000 s' in log())
    asked = [pool.submit(buffer.lookup_transform, 'map', 'base', at(BAG[-1] + 1.0), PATIENCE),
             buffer.wait_for_transform_async('map', 'base', at(BAG[-1] + 2.0))]
    until_waiting(buffer, 2)
    talker.move(*[transform('map', 'base', second) for second in BAG[:3]])
    for future in asked:
        with pytest.raises(ClockJumpException, match='all stamps went back'):
            result_of(future)


def test_stamps_of_the_far_future_are_refused_by_the_clock_that_counts(
        make_node, listen, sim_clock, talker, log):
    def send(child, second):
        """Publish a transform, and return whether it was taken."""
        before, accepted = counted(buffer), buffer.statistics().accepted
        talker.move(transform('map', child, second))
        until(lambda: counted(buffer) > before)
        return buffer.statistics().accepted > accepted

    buffer = Buffer(max_future=lasting(2.0))
    assert buffer.set_transform(transform('map', 'base', 200.0)), 'by the wall clock, so far'
    assert not buffer.set_transform(transform('map', 'base', 2**31 - 1))
    listen(make_node('simulated', **SIM_TIME), buffer)
    assert send('early', 1_000.0), 'a clock that is not heard yet refuses nothing'
    sim_clock.show(100.0, buffer)
    assert not buffer.set_transform(transform('map', 'base', 201.0))
    assert send('child', 102.0)
    assert not send('child', 103.0)
    sim_clock.show(101.0, buffer)
    assert send('child', 103.0)
    # Two topics overtake each other: /clock jumps back, and an old transform arrives after it.
    sim_clock.show(50.0, buffer)
    assert not send('child', 103.1)
    assert send('child', 50.0), 'which is not older than the refused one'
    assert count(buffer, Kind.FAR_FUTURE) == buffer.statistics().refused == 4
    until(lambda: 'max_future allows 2.000 s' in log() and "from '/talking'" in log())


def test_publisher_that_ignores_simulated_time_is_logged(simulated_buffer, talker, log):
    for number in range(3):
        talker.move(transform('map', 'base', 1_700_000_000.0 + number))
    until(lambda: simulated_buffer.statistics().accepted == 3)
    assert count(simulated_buffer, Kind.AHEAD_OF_CLOCK) == 1
    until(lambda: 'simulated time and the other does not (use_sim_time)' in log())
