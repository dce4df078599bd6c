# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps far ahead of the clock: reported, or refused."""

from hand_clock import HandClock
from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore, Pose
from tf_tree_py.core import Kind, Sample
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.guards import FAR
from tf_tree_py.core.messages.sample import Batch

SECOND = 10**9
HOUR = 3600 * SECOND
NOW = 1000 * HOUR


@pytest.fixture
def clock():
    return HandClock(NOW)


def guarded(clock, max_future=SECOND, **options):
    return BufferCore(now=clock, max_future=max_future, **options)


def insert(buffer, stamp, child='base', authority='odometry'):
    return buffer.insert('odom', child, stamp, Pose(), authority=authority)


def kinds(incidents):
    return [incident.kind for incident in incidents]


# --- with a limit

def test_stamp_beyond_the_limit_is_refused_and_the_limit_itself_is_not(clock):
    buffer = guarded(clock)
    assert insert(buffer, NOW + SECOND) == []
    (incident,) = insert(buffer, NOW + SECOND + 1)
    assert incident.kind is Kind.FAR_FUTURE
    assert incident.refused
    assert buffer.latest_common_time('odom', 'base') == NOW + SECOND
    statistics = buffer.statistics()
    assert (statistics.accepted, statistics.refused) == (1, 1)


def test_refusal_names_the_publisher_by_how_much_and_what_to_do(clock):
    (incident,) = insert(guarded(clock), NOW + 3 * HOUR, authority='/laptop/odometry')
    text = str(incident)
    for words in ("'odom' -> 'base' from '/laptop/odometry'", '10800.000 s ahead of the clock',
                  'max_future allows 1.000 s', 'NTP', 'use_sim_time'):
        assert words in text


def test_refused_stamp_does_not_make_good_data_old(clock):
    buffer = guarded(clock)
    insert(buffer, NOW + 3 * HOUR)
    for _ in range(100):
        clock.now += SECOND
        assert insert(buffer, clock.now) == []
    assert buffer.statistics().refused == 1


def test_refused_edge_is_not_registered(clock):
    buffer = guarded(clock)
    insert(buffer, NOW + HOUR)
    assert buffer.frames() == []


def test_leading_slashes_are_stripped_from_what_is_told(clock):
    buffer = guarded(clock)
    (incident,) = buffer.insert('/odom', '/base', NOW + HOUR, Pose())
    assert (incident.parent, incident.child) == ('odom', 'base')


def test_static_edges_have_no_stamp_to_judge(clock):
    buffer = guarded(clock)
    assert buffer.insert('base', 'camera', NOW + HOUR, Pose(), static=True) == []
    assert clock.read == 0


@pytest.mark.parametrize('count', [2, 40])
def test_the_others_of_a_message_are_taken(clock, count):
    buffer = guarded(clock)
    edges = [('odom', f'child{number}') for number in range(count)]
    stamps = [NOW] * count
    stamps[1] = NOW + HOUR
    batch = Batch(edges, stamps, [pack_pose(*Pose())] * count)
    (incident,) = buffer.insert_batch(batch)
    assert (incident.kind, incident.child) == (Kind.FAR_FUTURE, 'child1')
    assert buffer.statistics().accepted == count - 1
    assert len(buffer.edges()) == count - 1


def test_limit_goes_on_with_the_clock(clock):
    buffer = guarded(clock)
    assert kinds(insert(buffer, NOW + 2 * SECOND)) == [Kind.FAR_FUTURE]
    clock.now += SECOND
    assert insert(buffer, NOW + 2 * SECOND) == []


def test_limit_follows_a_clock_that_jumped_back(clock):
    buffer = guarded(clock)
    insert(buffer, NOW)
    clock.now = SECOND
    buffer.clear()
    # Messages of the other run are often still in flight.
    assert kinds(insert(buffer, NOW)) == [Kind.FAR_FUTURE]
    assert insert(buffer, SECOND) == []


def test_clock_that_was_set_back_is_noticed_beyond_the_limit(clock):
    buffer = guarded(clock)
    insert(buffer, NOW)
    clock.now -= HOUR
    assert kinds(insert(buffer, NOW + 2 * SECOND)) == [Kind.FAR_FUTURE]
    assert kinds(insert(buffer, NOW)) == [Kind.FAR_FUTURE]


def test_clock_that_has_not_begun_judges_nothing():
    buffer = guarded(HandClock(0))
    assert insert(buffer, NOW) == []


def test_clock_is_read_seldom(clock):
    """The usual case is one comparison: reading a ROS clock costs as much as the insertion."""
    buffer = guarded(clock)
    for _ in range(1000):
        clock.now += SECOND // 100
        insert(buffer, clock.now)
    assert clock.read <= 11


@pytest.mark.parametrize(('options', 'words'), [
    ({'max_future': 1}, 'needs a clock'),
    ({'max_future': -1, 'now': HandClock(NOW)}, 'cannot be negative'),
])
def test_limit_that_makes_no_sense_is_refused(options, words):
    with pytest.raises(ValueError, match=words):
        BufferCore(**options)


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=40))
def test_what_is_taken_is_what_the_clock_allows_then(steps):
    """Even if the clock is read seldom."""
    clock = HandClock(NOW)
    buffer = guarded(clock, 5, cache_time=HOUR)
    for pause, ahead in steps:
        clock.now += pause
        told = insert(buffer, clock.now + ahead)
        assert kinds(told) == ([Kind.FAR_FUTURE] if ahead > 5 else [])


# --- without one

def test_without_a_limit_far_stamps_are_taken_and_told(clock):
    buffer = guarded(clock, None)
    assert insert(buffer, NOW + FAR) == []
    (remark,) = insert(buffer, NOW + 3 * HOUR)
    assert remark.kind is Kind.AHEAD_OF_CLOCK
    assert not remark.refused
    assert '10800.000 s ahead of the clock' in remark.detail
    assert 'Buffer(max_future=...)' in remark.detail
    assert buffer.latest_common_time('odom', 'base') == NOW + 3 * HOUR
    assert buffer.statistics().accepted == 2


def test_edge_is_told_of_when_it_gets_there_and_not_for_every_sample(clock):
    buffer = guarded(clock, None)
    told = [insert(buffer, NOW + HOUR + number) for number in range(5)]
    assert [kinds(each) for each in told] == [[Kind.AHEAD_OF_CLOCK], [], [], [], []]
    assert kinds(insert(buffer, NOW + HOUR, child='other')) == [Kind.AHEAD_OF_CLOCK]


def test_good_data_after_it_is_old_and_the_culprit_is_named(clock):
    buffer = guarded(clock, None)
    insert(buffer, NOW, authority='good')
    insert(buffer, NOW + 3 * HOUR, authority='bad')
    (incident,) = insert(buffer, NOW + SECOND, authority='good')
    assert incident.kind is Kind.OLD_DATA
    assert 'The newest stamp of this edge is 10800.000 s ahead of the clock' in incident.detail
    assert "the last publisher was 'bad'" in incident.detail
    assert 'A bag that loops' not in incident.detail


def test_old_data_of_another_cause_is_not_blamed_on_the_future(clock):
    buffer = guarded(clock, None)
    insert(buffer, NOW)
    (incident,) = insert(buffer, NOW - HOUR)
    assert 'ahead of the clock' not in incident.detail
    assert 'A bag that loops' in incident.detail
    assert 'clear_on_jump_back' in incident.detail


def test_without_a_clock_any_time_is_as_good_as_another():
    buffer = BufferCore()
    assert insert(buffer, 2**63 - 1) == []


def test_batch_and_its_samples_are_told_alike(clock):
    samples = [Sample('odom', f'child{number}', NOW + number * FAR, tuple(Pose()))
               for number in range(10)]
    batch = Batch([sample[:2] for sample in samples], [sample.stamp for sample in samples],
                  [pack_pose(*sample.pose) for sample in samples])
    for limit in (None, 3 * FAR):
        one, other = guarded(clock, limit), guarded(clock, limit)
        assert one.insert_batch(batch) == other.insert_many(samples)
        assert one.edges() == other.edges()
        assert one.statistics() == other.statistics()
