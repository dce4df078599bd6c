# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps that jump back without a clock: the conditions for a new run."""

from concurrent.futures import ThreadPoolExecutor
import math

from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore, ClockJumpException, LATEST, Pose
from tf_tree_py.core import Kind
from tf_tree_py.core.buffer.waiting import WallDeadline
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.sample import Batch

SECOND = 10**9
HOUR = 3600 * SECOND
EDGES = (('map', 'odom'), ('odom', 'base'), ('base', 'arm'))
START = 10 * HOUR
# Only a fault takes this long.
PATIENCE_S = 20.0


@pytest.fixture
def buffer():
    return BufferCore(clear_on_jump_back=5 * SECOND)


def jumps(buffer):
    return buffer.statistics().incidents[Kind.JUMP_BACK]


def refused(buffer):
    return buffer.statistics().refused


def send(buffer, stamp, edges=EDGES, authority='player'):
    """Insert one message, like a listener."""
    return buffer.insert_batch(
        Batch(edges, [stamp] * len(edges), [pack_pose(*Pose())] * len(edges)), authority)


def play(buffer, begin, seconds, edges=EDGES, rate=10):
    """Insert the messages of a period, like a bag player."""
    for number in range(round(seconds * rate) + 1):
        send(buffer, begin + number * SECOND // rate, edges)


# --- a new run

def test_bag_that_loops_begins_anew_every_time(buffer):
    for _ in range(4):
        play(buffer, START, 60)
    assert jumps(buffer) == 3
    assert refused(buffer) == 3 * 3 * 10, 'the first second of every other loop'
    assert buffer.edges()[0].oldest >= START


def test_second_loop_is_refused_and_names_the_option():
    buffer = BufferCore()
    play(buffer, START, 60)
    (incident, *_) = send(buffer, START)
    assert incident.kind is Kind.OLD_DATA
    for words in ('A bag that loops, a simulation that was restarted', 'use_sim_time',
                  'if all edges jumped back, pass Buffer(clear_on_jump_back=...)'):
        assert words in incident.detail
    play(buffer, START, 49)
    assert buffer.latest_common_time('map', 'arm') == START + 60 * SECOND


def test_with_the_option_it_is_not_advised(buffer):
    play(buffer, START, 60)
    (incident, *_) = send(buffer, START)
    assert 'clear_on_jump_back' not in incident.detail


def test_jump_is_told_and_by_how_much(buffer):
    play(buffer, START, 60)
    play(buffer, START, 0.9)
    (remark,) = send(buffer, START + SECOND)
    assert remark.kind is Kind.JUMP_BACK
    assert not remark.refused
    assert 'went back by 59.000 s' in remark.detail
    assert (remark.parent, remark.child, remark.authority) == ('map', 'odom', 'player')


def test_jump_is_told_of_the_frames_as_the_buffer_calls_them(buffer):
    for stamp in (START, START + 30 * SECOND, START, START + SECOND):
        told = buffer.insert('/map', '/odom', stamp, Pose(), authority='player')
    assert [(jump.kind, jump.parent, jump.child) for jump in told] == [
        (Kind.JUMP_BACK, 'map', 'odom')]


def test_what_moves_is_forgotten_and_what_is_static_is_not(buffer):
    buffer.insert('arm', 'camera', 0, Pose(), static=True)
    play(buffer, START, 60)
    play(buffer, START, 1)
    assert {edge.child: edge.oldest for edge in buffer.edges()} == {
        'odom': START + SECOND, 'base': START + SECOND, 'arm': START + SECOND, 'camera': LATEST}
    assert buffer.lookup_stamped('map', 'camera')[0] == START + SECOND


def test_who_waits_is_told(buffer):
    play(buffer, START, 60)
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(
            buffer.wait_for, lambda: buffer.lookup('map', 'arm', START + 61 * SECOND),
            WallDeadline(PATIENCE_S))
        assert buffer.waiting.sleep_until_somebody(PATIENCE_S)
        play(buffer, START, 1)
        with pytest.raises(ClockJumpException, match='all stamps went back, as in a bag '):
            asked.result(PATIENCE_S)
    assert not buffer.waiting.sleep_until_somebody(0.0)


def test_most_edges_are_enough(buffer):
    """Some edges are late in a bag, or rare."""
    play(buffer, START, 60)
    play(buffer, START, 1, EDGES[:2])
    assert jumps(buffer) == 1


def test_edges_that_had_ended_do_not_count(buffer):
    play(buffer, START, 20)
    play(buffer, START + 20 * SECOND, 40, EDGES[:1])
    play(buffer, START, 1, EDGES[:1])
    assert jumps(buffer) == 1


@pytest.mark.parametrize(('silent_since', 'expected'), [(5 * SECOND, 0), (5 * SECOND + 1, 1)])
def test_half_of_the_edges_with_data_inside_the_limit_are_not_most(
        buffer, silent_since, expected):
    send(buffer, START + 60 * SECOND - silent_since, EDGES[1:2])
    send(buffer, START + 60 * SECOND, EDGES[:1])
    play(buffer, START, 1, EDGES[:1])
    assert jumps(buffer) == expected


def test_edges_that_were_cleared_and_those_that_are_static_do_not_count(buffer):
    for number in range(5):
        buffer.insert('base', f'sensor{number}', 0, Pose(), static=True)
    play(buffer, START, 1)
    buffer.clear()
    for _ in range(2):
        play(buffer, START, 60, EDGES[:1])
    assert jumps(buffer) == 1


def test_edges_that_come_in_messages_of_their_own_count_together(buffer):
    for begin in (START, START, START):
        for number in range(600):
            for edge in EDGES:
                send(buffer, begin + number * SECOND // 10, (edge,))
    assert jumps(buffer) == 2


def test_bag_that_is_shorter_than_the_window_is_noticed_too(buffer):
    for _ in range(3):
        play(buffer, START, 8)
    assert jumps(buffer) == 2
    assert refused(buffer) == 0
    assert buffer.edges()[0].oldest == START + SECOND


def test_long_message_counts_as_short_ones_do(buffer):
    edges = [('map', f'child{number}') for number in range(20)]
    poses = [pack_pose(*Pose())] * 20
    for _ in range(2):
        for number in range(300):
            buffer.insert_batch(Batch(edges, [START + number * SECOND // 10] * 20, poses))
    assert jumps(buffer) == 1


def test_gap_in_the_bag_is_none(buffer):
    for _ in range(4):
        play(buffer, START, 20)
        play(buffer, START + 100 * SECOND, 3)
    assert jumps(buffer) == 3


def test_one_stamp_of_the_far_future_is_cured(buffer):
    play(buffer, START, 5)
    send(buffer, START + HOUR)
    play(buffer, START + 5 * SECOND, 20)
    assert jumps(buffer) == 1
    assert buffer.latest_common_time('map', 'arm') == START + 25 * SECOND


def test_runs_that_grow_longer_are_noticed_as_soon_as_the_first(buffer):
    for seconds in range(20, 26):
        play(buffer, START, seconds)
    assert jumps(buffer) == 5
    assert refused(buffer) == 5 * 3 * 10


def test_clear_begins_anew(buffer):
    play(buffer, START, 60)
    buffer.clear()
    play(buffer, START - HOUR, 60)
    assert (jumps(buffer), refused(buffer)) == (0, 0)
    play(buffer, START - HOUR, 60)
    assert jumps(buffer) == 1


# --- no new run

GOOD = EDGES[:2]


def _one_straggler(number):
    return [(START - HOUR, EDGES)] if number == 300 else []


def _same_old_stamp_again_and_again(number):
    return [(START - HOUR, EDGES)] * 20


def _slow_clock_on_its_own_edge(number):
    return [(START - HOUR + number * SECOND // 10, (('base', 'lidar'),))]


def _slow_clock_on_its_own_edges_by_far_the_most(number):
    return [(START - HOUR + number * SECOND // 10 + ms * SECOND // 100,
             [('base', f'joint{joint}') for joint in range(10)]) for ms in range(10)]


def _slow_clock_on_the_same_edges(number):
    """Ten times as often as the correct one."""
    return [(START - HOUR + number * SECOND // 10 + ms * SECOND // 100, EDGES)
            for ms in range(10)]


def _clock_that_becomes_slow(number):
    return [(START - (HOUR if number > 300 else 0) + number * SECOND // 10, EDGES[2:])]


def _stragglers_inside_the_limit(number):
    return [(START + number * SECOND // 10 - 5 * SECOND, EDGES)]


@pytest.mark.parametrize('bad', [
    _one_straggler, _same_old_stamp_again_and_again, _slow_clock_on_its_own_edge,
    _slow_clock_on_its_own_edges_by_far_the_most, _slow_clock_on_the_same_edges,
    _clock_that_becomes_slow, _stragglers_inside_the_limit])
def test_what_is_no_new_run_clears_nothing(buffer, bad):
    for number in range(600):
        send(buffer, START + number * SECOND // 10, GOOD, 'good')
        for stamp, edges in bad(number):
            send(buffer, stamp, edges, 'bad')
    assert jumps(buffer) == 0
    assert buffer.latest_common_time('map', 'base') == START + 599 * SECOND // 10
    assert buffer.edges()[0].oldest <= START + 50 * SECOND


def test_silence_of_the_others_does_not_make_one_edge_a_new_run(buffer):
    play(buffer, START, 60)
    play(buffer, START - HOUR, 30, EDGES[:1])
    assert jumps(buffer) == 0


def test_edges_that_go_back_one_after_the_other_are_no_new_run(buffer):
    """Those that went back before the run continued do not count."""
    play(buffer, START, 60)
    for number, edge in enumerate(EDGES):
        play(buffer, START - HOUR, 2, [edge])
        send(buffer, START + (61 + number) * SECOND)
    assert jumps(buffer) == 0


def test_straggler_just_after_a_new_run_was_noticed_is_no_other_run(buffer):
    play(buffer, START, 60)
    play(buffer, START, 1)
    send(buffer, START - HOUR)
    assert jumps(buffer) == 1


def test_edges_that_nobody_knew_are_no_new_run(buffer):
    play(buffer, START, 60)
    play(buffer, START - HOUR, 30, [('world', 'a'), ('a', 'b')])
    assert jumps(buffer) == 0


@pytest.mark.parametrize('period_s', [1.5, 5, 30])
def test_two_publishers_of_one_edge_do_not_clear_it_alternately(buffer, period_s):
    """The correct one is so rare that the slow one alone looks like a new run."""
    edge, period = EDGES[:1], round(period_s * 10)
    for number in range(10_000):
        if number % period == 0:
            send(buffer, START + number * SECOND // 10, edge, 'good')
        send(buffer, START - HOUR + number * SECOND // 10, edge, 'bad')
    assert 1 <= jumps(buffer) <= 1 + max(0, math.ceil(math.log2(period_s)))


STEPS = st.tuples(st.integers(0, 20), st.integers(0, 50),
                  st.sets(st.integers(0, 2), min_size=1))


@given(st.lists(STEPS, max_size=60))
def test_time_that_goes_on_is_no_jump_however_late_some_are(steps):
    buffer = BufferCore(clear_on_jump_back=50)
    now = START
    for pause, late, edges in steps:
        now += pause
        send(buffer, now - late, [EDGES[edge] for edge in edges])
    assert jumps(buffer) == 0


# --- stragglers around a new run

@pytest.mark.parametrize('late_s', [7, 20, 27, 33, 59, 59.5])
def test_straggler_as_the_last_message_of_a_run_delays_nothing(buffer, late_s):
    for _ in range(3):
        play(buffer, START, 60)
        send(buffer, START + 60 * SECOND - round(late_s * SECOND))
        play(buffer, START, 1)
    assert jumps(buffer) == 3


@pytest.mark.parametrize('after', [1, 5, 9])
@pytest.mark.parametrize('late_s', [0, 1, 4, 7, 27, 59])
def test_straggler_just_after_the_loop_costs_a_second_at_most(buffer, late_s, after):
    play(buffer, START, 60)
    play(buffer, START, after / 10)
    send(buffer, START + round((60 - late_s) * SECOND))
    play(buffer, START + (after + 1) * SECOND // 10, 1)
    assert jumps(buffer) == 1


PERIOD = SECOND // 10
LATENESS = st.integers(0, 30 * SECOND)
SOME_EDGES = st.sets(st.integers(0, 2), min_size=1).map(
    lambda chosen: [EDGES[edge] for edge in sorted(chosen)])
# Each moment of a run: whether its edges share one message, and the late edges, if any.
MOMENTS = st.lists(st.tuples(st.booleans(), st.none() | st.tuples(LATENESS, SOME_EDGES)),
                   min_size=5, max_size=25)


def send_moment(buffer, stamp, moment, newest):
    """Send the edges of a stamp, and then possibly late samples of the old run."""
    together, straggler = moment
    for edges in [EDGES] if together else [(edge,) for edge in EDGES]:
        send(buffer, stamp, edges)
    if straggler is not None:
        late, edges = straggler
        send(buffer, newest - late, edges)


@given(MOMENTS, MOMENTS)
def test_new_run_is_noticed_a_second_after_the_last_straggler(before, after):
    buffer = BufferCore(clear_on_jump_back=5 * SECOND)
    end = START + 60 * SECOND
    send(buffer, START)
    for number, moment in enumerate(before):
        stamp = end + (number - len(before) + 1) * PERIOD
        send_moment(buffer, stamp, moment, stamp)
    assert jumps(buffer) == 0, 'while the old run goes on, whoever is late'
    # A run that starts after the newest possible stamp of the old one's stragglers.
    for number, moment in enumerate(after):
        send_moment(buffer, START + number * PERIOD, moment, end)
    last = max((number for number, (_, straggler) in enumerate(after) if straggler), default=0)
    play(buffer, START + len(after) * PERIOD, max(0, last + 11 - len(after)) / 10)
    assert jumps(buffer) >= 1
    assert buffer.edges()[0].latest <= end - 5 * SECOND, 'of the new run'


@pytest.mark.parametrize('limit', [0, -1])
def test_limit_that_makes_no_sense_is_refused(limit):
    with pytest.raises(ValueError, match='must be positive'):
        BufferCore(clear_on_jump_back=limit)


# --- with a guard against the future

def test_refused_stamps_begin_nothing():
    """Stamps that the guard refuses do not count as new time."""
    buffer = BufferCore(now=lambda: START + 10 * SECOND, max_future=SECOND,
                        clear_on_jump_back=SECOND)
    play(buffer, START, 10)
    for number in range(100):
        send(buffer, START + HOUR + number * SECOND, authority='bad')
        send(buffer, START + 10 * SECOND + number)
    assert jumps(buffer) == 0
    assert refused(buffer) == 300
