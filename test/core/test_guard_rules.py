# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The guards against wrong stamps alone: their limits, to the nanosecond, and their texts."""

from hand_clock import HandClock
import pytest
from tf_tree_py.core import Incident, Kind, LATEST, PlainBuffer, Pose, Sample, UNLIMITED
from tf_tree_py.core.messages.guards import CURE, FutureGuard, JumpBack, WHY_OLD

SECOND = 10**9
NOW = 1000 * SECOND
IDENTITY = tuple(Pose())
CLOCK = ("Most likely a publisher's clock is wrong (set it with chrony or NTP), or one side uses "
         'simulated time and the other does not (use_sim_time)')


def histories_of(**newest):
    """Return the histories of a buffer, by the newest stamp of each child; None: it is static."""
    buffer = PlainBuffer(UNLIMITED)
    for child, stamp in newest.items():
        buffer.insert('map', child, stamp or 0, Pose(), static=stamp is None)
    return buffer.intake.tree.histories


def samples_at(*stamps):
    return [Sample('map', f'child{number}', stamp, IDENTITY)
            for number, stamp in enumerate(stamps)]


# --- stamps of the far future

@pytest.mark.parametrize(('max_future', 'allowed'), [
    (None, 10 * SECOND), (0, 0), (1, 1), (3 * SECOND, 3 * SECOND)])
def test_limit_is_that_far_ahead_of_the_clock(max_future, allowed):
    clock = HandClock(NOW)
    guard = FutureGuard(clock, max_future)
    assert (guard.limit, clock.read) == (-2**63, 0)
    assert not guard.is_too_far(NOW + allowed)
    assert (guard.limit, clock.read) == (NOW + allowed, 1)
    assert not guard.is_too_far(NOW + allowed)
    assert clock.read == 1
    assert guard.is_too_far(NOW + allowed + 1)
    clock.now += 5
    assert not guard.is_too_far(NOW + allowed + 5)
    assert (guard.limit, clock.read, guard.now()) == (NOW + allowed + 5, 3, NOW + 5)
    again = guard.renewed()
    assert again.limit == -2**63
    assert not again.is_too_far(NOW + allowed + 5)
    assert again.is_too_far(NOW + allowed + 6)


@pytest.mark.parametrize(('now', 'too_far'), [(-1, False), (0, False), (1, True)])
def test_clock_that_has_not_begun_sets_no_limit(now, too_far):
    guard = FutureGuard(HandClock(now), SECOND)
    assert guard.is_too_far(NOW) is too_far
    assert guard.limit == (1 + SECOND if too_far else -2**63)


def test_guard_without_a_clock_allows_everything():
    guard = FutureGuard(None, None)
    assert (guard.limit, guard.renewed().limit, guard.now()) == (2**63, 2**63, 0)
    assert not guard.is_too_far(2**63 - 1)
    assert guard.why_old(2**63 - 1) == ''


@pytest.mark.parametrize(('now', 'max_future', 'error'), [
    (HandClock(NOW), -1, 'max_future is -1 ns, and cannot be negative'),
    (None, -1, 'max_future is -1 ns, and cannot be negative'),
    (None, 0, 'max_future needs a clock: pass now, such as time.time_ns')])
def test_limits_that_make_no_sense_are_an_error(now, max_future, error):
    with pytest.raises(ValueError) as raised:
        FutureGuard(now, max_future)
    assert str(raised.value) == error


def test_part_of_a_message_is_refused_beyond_the_limit():
    clock = HandClock(NOW)
    guard = FutureGuard(clock, SECOND)
    samples = samples_at(NOW + SECOND, NOW + SECOND + 1, 5, NOW + 3 * SECOND)
    assert guard.is_too_far(NOW + 3 * SECOND)
    # What is in the buffer does not matter.
    for histories in ({}, histories_of(child1=NOW + 9 * SECOND)):
        assert guard.part(samples, 'me', histories) == ([samples[0], samples[2]], [
            Incident(Kind.FAR_FUTURE, 'map', 'child1', NOW + SECOND + 1, 'me',
                     'its stamp 1001.000000001 is 1.000 s ahead of the clock, and max_future '
                     f'allows 1.000 s. {CLOCK}'),
            Incident(Kind.FAR_FUTURE, 'map', 'child3', NOW + 3 * SECOND, 'me',
                     'its stamp 1003.000000000 is 3.000 s ahead of the clock, and max_future '
                     f'allows 1.000 s. {CLOCK}')])
    assert clock.read == 1


def test_without_a_limit_each_edge_is_reported_until_it_is_known():
    guard = FutureGuard(HandClock(NOW), None)
    assert guard.is_too_far(NOW + 30 * SECOND)
    limit = NOW + 10 * SECOND
    samples = samples_at(limit + 1, limit + 2, limit, limit + 4, limit + 5)
    histories = histories_of(child0=limit, child1=limit + 1, child2=limit + 1, child3=None)
    taken, remarks = guard.part(samples, 'me', histories)
    assert taken == samples
    assert [remark.child for remark in remarks] == ['child0', 'child3', 'child4']
    assert remarks[0] == Incident(
        Kind.AHEAD_OF_CLOCK, 'map', 'child0', limit + 1, 'me',
        'its stamp 1010.000000001 is 10.000 s ahead of the clock: good data of this edge is '
        f'older, and will be refused if it is older by more than the buffer keeps. {CLOCK}. '
        'Buffer(max_future=...) refuses such stamps')


def test_edge_that_was_cleared_is_reported_again():
    buffer = PlainBuffer()
    buffer.insert('map', 'child0', NOW + 30 * SECOND, Pose())
    buffer.clear()
    guard = FutureGuard(HandClock(NOW), None)
    assert guard.is_too_far(NOW + 30 * SECOND)
    _, remarks = guard.part(samples_at(NOW + 30 * SECOND), 'me', buffer.intake.tree.histories)
    assert [remark.kind for remark in remarks] == [Kind.AHEAD_OF_CLOCK]


def test_newest_stamp_beyond_the_limit_is_why_good_data_is_old():
    clock = HandClock(NOW)
    guard = FutureGuard(clock, None)
    assert guard.why_old(NOW + 10 * SECOND) == ''
    assert guard.why_old(NOW + 12 * SECOND) == (
        'The newest stamp of this edge is 12.000 s ahead of the clock: that stamp is wrong, and '
        'good data is refused until the clock reaches it. Buffer(max_future=...) refuses such '
        'stamps; clear() removes them')
    clock.now += 2 * SECOND
    assert guard.why_old(NOW + 12 * SECOND) == ''


# --- stamps that jump back

LIMIT = 5 * SECOND
FIRST = histories_of(a=NOW)
TWO = histories_of(a=NOW, b=NOW)
THREE = histories_of(a=NOW, b=NOW, c=NOW)


def judged(guard, histories, *messages):
    """Return at which of some messages, (stamp, children), a new run was noticed."""
    return [number for number, (stamp, children) in enumerate(messages)
            if guard.judge([('map', child) for child in children], [stamp] * len(children), 'me',
                           histories) is not None]


def at(*stamps, children='a'):
    return [(stamp, children) for stamp in stamps]


@pytest.mark.parametrize('limit', [0, -1])
def test_jump_has_a_length(limit):
    with pytest.raises(ValueError) as raised:
        JumpBack(limit)
    assert str(raised.value) == f'clear_on_jump_back is {limit} ns, and must be positive'
    JumpBack(1)


BACK = NOW - LIMIT - 1 - SECOND  # advancing for a second, it stays behind by more than the limit


@pytest.mark.parametrize(('stamps', 'noticed'), [
    # For a second; a nanosecond less is not enough.
    (at(NOW, BACK, BACK + SECOND), [2]), (at(NOW, BACK, BACK + SECOND - 1), []),
    (at(NOW, BACK, BACK + SECOND - 1, BACK + SECOND), [3]),
    # A stamp inside the limit belongs to the run, and begins anew.
    (at(NOW, BACK + 1, BACK + 1 + SECOND), []),
    (at(NOW, BACK, NOW - LIMIT, BACK + SECOND), []),
    (at(NOW, BACK, NOW - LIMIT - 1, BACK + SECOND), [2]),
    (at(NOW, BACK, NOW, BACK + SECOND, BACK + 2 * SECOND), []),
    # Before the first stamp of its steps, an edge begins anew; the first stamp itself is a step.
    (at(NOW, BACK, BACK - 1, BACK + SECOND - 2), []),
    (at(NOW, BACK, BACK - 1, BACK + SECOND - 1), [3]),
    (at(NOW, BACK, BACK, BACK + SECOND), [3]),
    # A stamp before the last one is a step, too, and the last one stays.
    (at(NOW, BACK - 9, BACK + 100, BACK - 3, BACK + SECOND - 10), []),
    (at(NOW, BACK - 9, BACK + 100, BACK - 3, BACK + SECOND - 9), [4]),
    # Stamps that do not advance, and the first message.
    (at(NOW, BACK, BACK, BACK, BACK), []), (at(BACK), []), (at(BACK, BACK + SECOND), [])])
def test_new_run_advances_for_a_second(stamps, noticed):
    assert judged(JumpBack(LIMIT), FIRST, *stamps) == noticed


@pytest.mark.parametrize(('step', 'noticed'), [(LIMIT, [2]), (LIMIT + 1, [])])
def test_step_is_no_longer_than_the_limit(step, noticed):
    far = NOW - 100 * SECOND
    assert judged(JumpBack(LIMIT), FIRST, *at(NOW, far, far + step)) == noticed


def test_step_begins_at_the_latest_stamp_of_the_edge():
    far = NOW - 100 * SECOND
    patient = SECOND - 1
    stamps = at(NOW, far, far + patient, far + 1, far + patient + LIMIT)
    assert judged(JumpBack(LIMIT), FIRST, *stamps) == [4]
    again = at(NOW, far, far + patient, far, far + patient + LIMIT)
    assert judged(JumpBack(LIMIT), FIRST, *again) == [4]
    late = at(NOW, far, far + patient, far + 1, far + patient + LIMIT + 1)
    assert judged(JumpBack(LIMIT), FIRST, *late) == []


@pytest.mark.parametrize(('histories', 'children', 'noticed'), [
    (FIRST, 'a', [2]), (TWO, 'a', []), (TWO, 'ab', [2]), (THREE, 'a', []), (THREE, 'ab', [2]),
    (THREE, 'axy', []), (THREE, 'cba', [2]), ({}, 'a', []),
    # Static edges and those that ended do not count; one at the edge of the limit does.
    (histories_of(a=NOW, b=None, c=None), 'a', [2]), (histories_of(a=NOW, b=None), 'b', []),
    (histories_of(a=NOW, b=NOW - LIMIT), 'a', []),
    (histories_of(a=NOW, b=NOW - LIMIT - 1), 'a', [2]),
    (histories_of(a=NOW, b=NOW - LIMIT - 1, c=NOW), 'ab', []),
    (histories_of(b=NOW - LIMIT - 1), 'b', [])])
def test_more_than_half_of_the_edges_that_were_alive_go_back(histories, children, noticed):
    guard = JumpBack(LIMIT)
    assert judged(guard, histories, (NOW, 'a'), (BACK, children), (BACK + SECOND, children)
                  ) == noticed


def test_edges_go_back_in_messages_of_their_own():
    guard = JumpBack(LIMIT)
    assert judged(guard, THREE, (NOW, 'abc'), (BACK, 'a'), (BACK, 'b'), (BACK + SECOND, 'a'),
                  (BACK + SECOND, 'b')) == [4]


def test_newest_stamp_of_a_message_decides_whether_it_went_back():
    guard = JumpBack(LIMIT)
    edges = [('map', 'a'), ('map', 'b')]
    for stamps in ([NOW, 0], [BACK, NOW - LIMIT], [BACK + SECOND, NOW - LIMIT]):
        assert guard.judge(edges, stamps, 'me', TWO) is None
    assert guard.judge(edges, [BACK, BACK - 7], 'me', TWO) is None
    got = guard.judge([('odom', 'b'), ('map', 'a')], [BACK - 7 + SECOND, BACK + SECOND], 'other',
                      TWO)
    assert got == Incident(
        Kind.JUMP_BACK, 'odom', 'b', BACK + SECOND, 'other',
        'stamps went back by 5.000 s and continue from there: a bag that loops, or a simulation '
        'that was restarted. All moving edges were cleared')


def test_new_run_is_judged_from_its_own_newest_stamp():
    guard = JumpBack(LIMIT)
    assert judged(guard, FIRST, *at(NOW, BACK, BACK + SECOND)) == [2]
    histories = histories_of(a=BACK + SECOND)
    further = BACK - LIMIT
    assert judged(guard, histories, *at(further - 1, further + SECOND - 1)) == [1]


def test_first_message_may_have_any_stamp():
    assert judged(JumpBack(LIMIT), FIRST, *at(0, NOW, BACK, BACK + SECOND)) == [3]
    begin = -NOW - LIMIT - 1 - SECOND
    assert judged(JumpBack(LIMIT), histories_of(a=-NOW), *at(-NOW, begin, begin + SECOND)) == [2]


def test_steps_of_an_edge_begin_when_it_is_known():
    guard = JumpBack(LIMIT)
    assert judged(guard, {}, *at(NOW, BACK, BACK + SECOND)) == []
    assert judged(guard, FIRST, *at(BACK + SECOND, BACK, BACK + SECOND - 1)) == []
    assert judged(guard, FIRST, *at(BACK + SECOND)) == [0]


def test_clear_forgets_all_stamps():
    guard = JumpBack(LIMIT)
    assert judged(guard, FIRST, *at(NOW, BACK)) == []
    guard.begin()
    assert judged(guard, FIRST, *at(BACK + SECOND, BACK - 2 * LIMIT, NOW)) == []
    assert judged(guard, FIRST, *at(BACK, BACK + SECOND)) == [1]


# --- an old run that goes on

def patience_after(*stamps, given_up=NOW):
    """Return the seconds that a new run must advance after such messages."""
    for seconds in (1, 2, 4, 8):
        guard = JumpBack(LIMIT)
        assert judged(guard, FIRST, *at(given_up, BACK, BACK + SECOND)) == [2]
        assert judged(guard, FIRST, *at(*stamps)) == []
        newest = max(stamps)
        histories = histories_of(a=newest)
        back = newest - 100 * SECOND
        steps = [(back + step * SECOND // 2, 'a') for step in range(2 * seconds)]
        assert judged(guard, histories, *steps) == []
        if judged(guard, histories, (back + seconds * SECOND, 'a')):
            return seconds
    return None


@pytest.mark.parametrize(('stamps', 'seconds'), [
    ([NOW + 1], 2), ([NOW], 1),
    # The new run got there by itself, in steps of the limit.
    ([BACK + SECOND + LIMIT, NOW + 1], 1), ([NOW + 1 - LIMIT, NOW + 1], 1),
    ([NOW - LIMIT, NOW + 1], 2),
    # The old run is only noticed once.
    ([NOW + 1, NOW + 2, NOW + 100 * SECOND], 2), ([NOW - 1, NOW], 1)])
def test_old_run_that_goes_on_doubles_the_patience(stamps, seconds):
    assert patience_after(*stamps) == seconds


def test_patience_doubles_each_time():
    guard = JumpBack(LIMIT)
    for seconds in (1, 2, 4, 8):
        assert judged(guard, FIRST, *at(NOW)) == []
        begin = NOW - 100 * SECOND
        steps = at(*(begin + step * SECOND // 2 for step in range(2 * seconds + 1)))
        assert judged(guard, FIRST, *steps) == [2 * seconds]
        assert judged(guard, FIRST, *at(NOW + 1)) == []
        guard.begin()


def test_advice_for_old_data_names_the_options():
    assert WHY_OLD == ('A bag that loops, a simulation that was restarted, or a second publisher '
                       'whose clock is slow')
    assert CURE == ('For the first two set use_sim_time and publish /clock; or, if all edges '
                    'jumped back, pass Buffer(clear_on_jump_back=...)')
    assert FutureGuard(HandClock(NOW), None).why_old(LATEST) == ''
