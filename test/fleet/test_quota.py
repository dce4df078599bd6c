# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot that sends too much affects only itself, and is reported once."""

import gc
from itertools import count
import tracemalloc
from types import SimpleNamespace

from conditions import until
from fleet_helpers import message, robot_of, send_first, x_of
from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.fleet import FleetError, RobotQuota, transform_decoder
from tf_tree_py.fleet.connection import FleetLogs
from tf_tree_py.fleet.reception import Reception
from tf_tree_py.fleet.roster import Roster
from tf_tree_py.fleet.transform_decoder import FleetMessage, RobotPlace, TransformDecoder
from tf_tree_py.fleet.trust import Allowance, names_below
import zenoh


def many(count, begin=0, long=''):
    """Return a message with a number of new frames."""
    return message(*((f'p{number}{long}', f'c{number}{long}', 1)
                     for number in range(begin, begin + count)))


def test_messages_that_are_too_large_are_dropped_counted_and_told_once(listen, robot, caplog):
    listener = listen()
    evil, good = robot('evil'), robot('good')
    for number in range(5):
        evil.send(many(8_000, 8_000 * number))
    good.send(message(('map', 'base', 1)))
    assert x_of(listener.buffer, 'map', 'good/base') == 1.0
    # Zenoh itself may lose some of these large messages.
    until(lambda: robot_of(listener, 'evil').dropped > 1 or evil.send(many(8_000)))
    assert robot_of(listener, 'evil').frames == 0 and not robot_of(listener, 'good').dropped
    assert 'largest_message' in robot_of(listener, 'evil').limit
    assert caplog.text.count('are dropped') == 1 and "'evil'" in caplog.text


def test_messages_that_are_too_many_are_dropped(listen, robot):
    listener = listen(quota=RobotQuota(messages_per_s=1e-6, bytes_per_s=1e9))
    evil = robot('evil')
    for _ in range(5):
        evil.send(message(('map', 'base', 1)))
    until(lambda: robot_of(listener, 'evil') and robot_of(listener, 'evil').dropped)
    assert 'messages_per_s' in robot_of(listener, 'evil').limit


def test_frames_of_a_robot_are_limited_and_late_honest_ones_are_taken(listen, robot):
    listener = listen(quota=RobotQuota(frames=10))
    evil, good = robot('evil'), robot('good')
    send_first(listener, evil, message(('map', 'base', 1)))
    evil.send(many(20))
    evil.send(message(('map', 'base', 2)))
    until(lambda: robot_of(listener, 'evil').transforms == 6)
    assert x_of(listener.buffer, 'map', 'evil/base') == 2.0
    told = robot_of(listener, 'evil')
    # base, and four edges of two new frames.
    assert (told.frames, told.transforms, told.refused) == (9, 6, 16)
    assert '10 frames' in told.limit
    good.send(message(('map', 'base', 3)))
    assert x_of(listener.buffer, 'map', 'good/base') == 3.0
    assert robot_of(listener, 'good').limit == ''


def test_names_of_frames_are_limited_in_bytes(listen, robot):
    listener = listen()
    evil, good = robot('evil'), robot('good')
    numbers = count()

    def send_more():
        evil.send(many(20, 20 * next(numbers), 'x' * 900))

    for _ in range(20):
        send_more()
    good.send(message(('map', 'base', 3)))
    assert x_of(listener.buffer, 'map', 'good/base') == 3.0
    # On a busy machine, some of them exceed the robot's share of time, and are dropped.
    until(lambda: robot_of(listener, 'evil').refused > 100 or send_more())
    assert 100_000 < sum(map(len, listener.buffer.frames())) < 300_000


def test_robot_that_has_used_up_its_frames_keeps_those_it_has(
        listen, robot):
    listener = listen(separate=True, quota=RobotQuota(frames=2))
    one = robot('robot7')
    send_first(listener, one, message(('map', 'base', 1)))
    one.send(message(('base', 'arm', 1), ('map', 'base', 2)))
    until(lambda: robot_of(listener, 'robot7').transforms == 2)
    assert x_of(listener['robot7'], 'map', 'base') == 2.0
    assert robot_of(listener, 'robot7').refused == 1


@pytest.mark.parametrize('options', [
    {'frames': 0}, {'messages_per_s': -1}, {'bytes_per_s': 'many'}, {'largest_message': True},
    {'waiting_bytes': 5}, {'frames': float('nan')}])
def test_quota_that_cannot_be_is_refused(options):
    with pytest.raises(FleetError, match='quota'):
        RobotQuota(**options)


@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.integers(0, 1_200)), max_size=200))
def test_no_ten_seconds_and_a_burst_hold_more_than_the_quota(events):
    quota = RobotQuota(messages_per_s=2, bytes_per_s=1_000, largest_message=1_000)
    allowance, now, taken = Allowance(quota, 0.0), 0.0, []
    for passed, size in events:
        now += passed
        if not allowance.refusal(size, now):
            assert size <= 1_000
            taken.append((now, size))
    for begin, _ in taken:
        later = [size for when, size in taken if begin <= when <= begin + 10.0]
        assert len(later) <= 2 * 20 + 1e-6 and sum(later) <= 1_000 * 20 + 1e-6


def test_messages_beyond_a_share_of_time_are_refused():
    allowance = Allowance(RobotQuota(decoding_share=0.1), 0.0)
    assert allowance.refusal(1, 0.0) == ''
    allowance.spend(3.0)  # one second was available
    assert 'decoding_share' in allowance.refusal(1, 0.0)
    assert 'decoding_share' in allowance.refusal(1, 19.0)
    assert allowance.refusal(1, 21.0) == ''


def test_decoder_charges_a_robot_for_what_its_messages_cost(listen, robot):
    listener = listen(quota=RobotQuota(decoding_share=1e-9))
    evil = robot('evil')
    until(lambda: evil.send(message(('map', 'base', 1))) or (
        robot_of(listener, 'evil') and 'decoding_share' in robot_of(listener, 'evil').limit))
    assert robot_of(listener, 'evil').transforms and robot_of(listener, 'evil').dropped


# --- memory

def decoder_of(quota, buffer):
    roster, shared = Roster(True, quota), frozenset({'map'})

    def place_of(robot):
        roster.admit(robot)
        return RobotPlace(buffer, names_below(robot, shared), shared)

    return TransformDecoder(place_of, roster, FleetLogs())


def test_layouts_of_a_robot_and_of_all_are_limited(monkeypatch):
    monkeypatch.setattr(transform_decoder, 'LAYOUTS_OF_ONE', 100_000)
    monkeypatch.setattr(transform_decoder, 'LAYOUTS_OF_ALL', 500_000)
    decoder = decoder_of(RobotQuota(frames=10), BufferCore())
    for robot in range(20):
        # The layouts of every robot take 180 kB if all are stored.
        for number in range(3):
            decoder.decode(f'robot{robot}', FleetMessage('', False, many(100, number), 1))
    kept = [reader.remembered for reader in decoder._readers.values()]
    assert sum(kept) == decoder._remembered <= 500_000
    assert 0 < max(kept) <= 100_000 and len(kept) < 20


def test_keys_of_nobody_are_not_remembered():
    roster = Roster(True, RobotQuota())
    reception = Reception(lambda key: None, roster, None, None, None)

    def sample(number):
        return SimpleNamespace(key_expr=f'{number:_>1000}', kind=zenoh.SampleKind.PUT)

    tracemalloc.start()
    try:
        reception.receive(sample(0))
        gc.collect()
        before, _ = tracemalloc.get_traced_memory()
        for number in range(3_000):
            reception.receive(sample(number))
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 300_000
