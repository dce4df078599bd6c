# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which edges are silent, come irregularly, or are too slow, just beside each limit."""

from bisect import bisect_left

import numpy as np
from small_scenes import after, every, poses, said, sent, SIMULATED
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds

MICROSECOND = 1e-6
TEN_HZ = every(0.1, 60)
IRREGULAR = after(*[0.01, 0.2, 0.2, 0.4] * 20)


def severities(code, *messages, **others):
    """Return the severities of findings, each with its edges."""
    return [one.partition(' | ')[0] for one in said(code, *messages, **others)]


def wander(count):
    return poses(count, x=0.1 * np.arange(count), yaw=0.1 * np.arange(count))


def seen(edges, stamps, node='/detector', late=0.0):
    return sent(edges, stamps, stamps + from_seconds(late), wander(len(stamps)), node)


# --- stale

def test_edge_is_silent_after_a_second_and_dead_after_five():
    messages = sent('a b', TEN_HZ, node='/driver')
    assert said('stale', messages, now=8.4) == [
        'warning a>b | /driver | a -> b has been silent for 2.500 s; it came every 100 ms | '
        'silent_s=2.5 usual_s=0.1 samples=60']
    assert said('stale', messages, now=15.9) == [
        'error a>b | /driver | a -> b has been silent for 10.000 s; it came every 100 ms | '
        'silent_s=10 usual_s=0.1 samples=60']
    times = 6.9, 6.9 + MICROSECOND, 10.9, 10.9 + MICROSECOND
    assert [severities('stale', messages, now=now) for now in times] == [
        [], ['warning a>b'], ['warning a>b'], ['error a>b']]


def test_slow_edge_is_dead_after_ten_intervals():
    messages = sent('a b', every(1.0, 20))
    times = 22.0, 22.0 + MICROSECOND, 29.0, 29.0 + MICROSECOND
    assert [severities('stale', messages, now=now) for now in times] == [
        [], ['warning a>b'], ['warning a>b'], ['error a>b']]


def test_few_samples_do_not_show_that_an_edge_is_dead():
    assert said('stale', sent('a b', every(0.1, 7)), now=100.0) == [
        'warning a>b | a -> b has been silent for 99.400 s; it came every 100 ms | silent_s=99.4 '
        'usual_s=0.1 samples=7']
    assert severities('stale', sent('a b', every(0.1, 8)), now=100.0) == [
        'error a>b']
    assert said('stale', sent('a b', every(0.1, 2) * 0), now=9.0) == [
        'warning a>b | a -> b has been silent for 9.000 s; it came twice | silent_s=9 usual_s=0 '
        'samples=2']
    once = sent('a b', every(1.0, 1))
    assert said('stale', once, now=4.0) == [
        'warning a>b | a -> b has been silent for 4.000 s; it came once | silent_s=4 usual_s=0 '
        'samples=1']
    assert severities('stale', once, now=3.0) == []
    # The buffer has forgotten it then: slow_for_window reports that.
    assert [severities('stale', once, now=now) for now in (10.0, 10.0 + MICROSECOND)] == [
        ['warning a>b'], []]
    assert severities('stale', sent('a b', every(0.1, 2)), now=20.0) == [
        'warning a>b']


def test_edge_that_was_silent_for_as_long_before_is_not_dead():
    messages = sent('a b', after(*[0.1] * 20, 10.0, *[0.1] * 20))
    times = 14.0 + 12.0, 14.0 + 12.0 + MICROSECOND
    assert [severities('stale', messages, now=now) for now in times] == [
        ['warning a>b'], ['error a>b']]


def test_irregular_edge_is_dead_after_ten_of_its_long_intervals():
    messages = sent('a b', after(*[0.1, 0.1, 0.1, 2.0] * 15))
    end = 15 * 2.3
    times = end + 20.0, end + 20.0 + MICROSECOND
    assert [severities('stale', messages, now=now) for now in times] == [
        ['warning a>b'], ['error a>b']]
    # Of stamps without a fraction of a second, the arrivals show the interval.
    stamps = every(0.5, 61)
    whole = sent('a b', stamps // 10**9 * 10**9, stamps)
    times = 30.0 + 3.0, 30.0 + 3.0 + MICROSECOND, 30.0 + 5.0, 30.0 + 5.0 + MICROSECOND
    assert [severities('stale', whole, now=now) for now in times] == [
        [], ['warning a>b'], ['warning a>b'], ['error a>b']]


def test_tag_is_out_of_view_if_its_detector_goes_on_with_another():
    tag, other = seen('camera tag', TEN_HZ, late=5.0), every(0.1, 90)
    assert said('stale', tag, seen('camera other', other, late=5.0)) == [
        'note camera>tag | /detector | camera -> tag has been silent for 3.000 s; it came every '
        '100 ms | silent_s=3 usual_s=0.1 samples=60 | cause: tag was out of view: its publisher '
        'went on with camera -> other | fix: nothing to do, if it can leave the view; lookups of '
        'it have to expect that']
    # The other one arrives once more after the tag has become silent.
    last = 10.9 + np.array([1.0, 1.0 + MICROSECOND])
    assert [severities('stale', tag, seen('camera other', np.concatenate([
        TEN_HZ, from_seconds([end - 5.0])]), late=5.0), now=14.0) for end in last] == [
        ['warning camera>tag', 'warning camera>other'],
        ['warning camera>other', 'note camera>tag']]
    # A glimpse of a tag says nothing, as long as others are seen.
    glimpse = seen('camera tag', every(0.1, 1))
    assert severities('stale', glimpse, seen('camera other', every(0.1, 150))) == [
        'note camera>tag']
    assert severities('stale', glimpse, seen('camera other', every(0.1, 150), '/x')) == []


def test_robot_was_stopped_if_its_nodes_ended_one_after_another():
    def at_end(*ends, period=0.1, recorded=True, now=20.0):
        return said('stale', *[
            sent(f'a b{place}', from_seconds(end) - every(period, 100)[::-1])
            for place, end in enumerate(ends)], now=now, doctor=Doctor(recorded=recorded))

    assert at_end(18.0, 18.5, 20.0) == [
        'note a>b0 | a -> b0 has been silent for 2.000 s; it came every 100 ms | silent_s=2 '
        'usual_s=0.1 samples=100 | cause: the robot was stopped before the recorder: its nodes '
        'ended one after another | fix: nothing to do, if it was stopped then; if not, check the '
        'log of the node that ended first',
        'note a>b1 | a -> b1 has been silent for 1.500 s; it came every 100 ms | silent_s=1.5 '
        'usual_s=0.1 samples=100 | cause: the robot was stopped before the recorder: its nodes '
        'ended one after another | fix: nothing to do, if it was stopped then; if not, check the '
        'log of the node that ended first']
    assert severities_of(at_end(18.0, 18.5, 20.0, recorded=False)) == [
        'warning a>b0',
        'warning a>b1']
    assert severities_of(at_end(18.0, 20.0)) == [
        'warning a>b0']
    # At least 0.2 s after each other.
    assert severities_of(at_end(18.0, 18.2)) == [
        'warning a>b0',
        'warning a>b1']
    assert severities_of(at_end(18.0, 18.2 + MICROSECOND)) == [
        'note a>b0',
        'note a>b1']
    # All of them within five seconds of the end, and later than three intervals and 0.2 s.
    assert severities_of(at_end(15.0, 18.2)) == [
        'note a>b0',
        'note a>b1']
    assert severities_of(at_end(15.0 - MICROSECOND, 18.2)) == [
        'error a>b0',
        'warning a>b1']
    assert severities_of(at_end(18.0, 19.5)) == [
        'warning a>b0']
    assert severities_of(at_end(18.0, 19.5 - MICROSECOND)) == [
        'note a>b0']
    assert severities_of(at_end(10.0, 16.0, 17.0)) == [
        'warning a>b0',
        'note a>b1',
        'note a>b2']


def severities_of(found):
    return [one.partition(' | ')[0] for one in found]


def test_what_left_the_view_of_a_robot_is_no_error():
    robot = sent('map odom', every(0.1, 300)), sent(
        'odom base', every(0.1, 300), at=poses(300, x=0.1 * np.arange(300)))
    person = seen('base person', TEN_HZ)
    assert said('stale', *robot, person) == [
        'warning base>person | /detector | base -> person has been silent for 24.000 s; it came '
        'every 100 ms | silent_s=24 usual_s=0.1 samples=60 | cause: what it shows, such as a '
        'tag, a person or an object, left the view of its sensor; or its node hangs, has crashed '
        'or was stopped, or the network is broken | fix: if it should still be there, check the '
        'log of its publisher: lookups for a later time fail']
    assert severities('stale', *robot, seen('map person', TEN_HZ)) == [
        'error map>person']
    assert severities('stale', *robot, sent('base person', TEN_HZ)) == [
        'error base>person']
    # Those that end together, within one second, have ended with their node.
    assert [severities('stale', *robot, person, seen('base other', TEN_HZ + from_seconds(late)))
            for late in (1.0 - MICROSECOND, 1.0)] == [
        ['error base>person', 'error base>other'], ['warning base>person', 'warning base>other']]


def test_several_that_ended_one_after_another_may_have_left():
    def belt(count, apart=2.0):
        return severities('stale', sent('a z', every(0.1, 300)), *[
            sent(f'a b{place}', TEN_HZ + from_seconds(apart * place)) for place in range(count)])

    assert belt(2) == [
        'error a>b0',
        'error a>b1']
    assert belt(3) == [
        'warning a>b0',
        'warning a>b1',
        'warning a>b2']
    assert belt(3, 0.5) == [
        'error a>b0',
        'error a>b1',
        'error a>b2']
    assert severities('stale', sent('a z', every(0.1, 300)), *[
        sent(f'a b{place}', TEN_HZ + from_seconds(2.0 * place)) for place in range(3)],
        sent('b0 c', every(0.1, 300))) == [
        'error a>b0',
        'error a>b1',
        'error a>b2']


# --- irregular_rate

def test_irregular_intervals():
    assert said('irregular_rate', sent('a b', IRREGULAR, node='/driver')) == [
        'warning a>b | /driver | a -> b comes irregularly: 80 of 100 intervals are between 10 ms '
        'and 400 ms | p10_interval_s=0.01 p50_interval_s=0.2 p90_interval_s=0.4']


def test_intervals_are_irregular_beyond_a_limit_that_falls_with_their_number():
    def least(pattern, times):
        """Return by how much the long intervals must differ, in hundredths of the short one."""
        def is_found(excess):
            return bool(said('irregular_rate', sent('a b', after(*[
                0.1 * (1.0 + 0.01 * excess * long) for long in pattern * times]))))

        return bisect_left(range(3000), True, key=is_found)

    assert [least([0, 0, 0, 0, 1], times) for times in (5, 10, 20, 40)] == [274, 257, 246, 238]
    assert [least([0, 1], times) for times in (12, 20, 80)] == [3000, 1512, 812]
    assert [least([0, 0, 1, 1, 1], times) for times in (10, 40)] == [3000, 1363]


def test_regularity_is_judged_from_twenty_intervals_on():
    def found(count):
        return severities('irregular_rate', sent('a b', after(*([0.1, 0.1, 0.9] * 9)[:count])))

    assert [found(count) for count in (22, 23)] == [[], ['warning a>b']]


def test_edge_that_changes_its_rate_is_a_note():
    assert said('irregular_rate', sent('a b', after(*[0.1] * 100, *[0.4] * 100))) == [
        'note a>b | a -> b changes its rate: 80 of 100 intervals are between 100 ms and 400 ms | '
        'p10_interval_s=0.1 p50_interval_s=0.1 p90_interval_s=0.4 | cause: its node sends faster '
        'in one mode than in another; or the node, or its computer, became slower | fix: nothing '
        'to do, if it is meant to change its rate']

    def found(fast, slow):
        return severities('irregular_rate', sent('a b', after(*fast * 60, *slow * 60)))

    # One mode is at least twice as fast as the other; one short interval makes both irregular.
    assert [severities('irregular_rate', sent('a b', after(
        *[0.1] * 20, 0.001, *[0.1] * 99, *[0.1, slow] * 60))) for slow in (0.28, 0.32)] == [
        ['warning a>b'], ['note a>b']]
    # Their intervals differ by hardly more.
    assert [found([0.1 - vary, 0.1 + vary], [0.5 - 5.0 * vary, 0.5 + 5.0 * vary])
            for vary in (0.024, 0.026)] == [['note a>b'], ['warning a>b']]
    # A few parts of 31 show another mode.
    assert [severities('irregular_rate', sent('a b', after(
        *[0.1] * few, *([0.2, 0.2, 0.6] * 85)[few:])))
        for few in (17, 25)] == [['warning a>b'], ['note a>b']]
    # Stamps that are out of order do not, nor arrivals.
    stamps = IRREGULAR.copy()
    stamps[[16, 32, 48, 64]] -= from_seconds(3.0)
    assert severities('irregular_rate', sent('a b', stamps, IRREGULAR)) == ['warning a>b']
    bursts = IRREGULAR // from_seconds(4.0) * from_seconds(4.0) + from_seconds(4.0)
    assert severities('irregular_rate', sent('a b', IRREGULAR, bursts)) == ['warning a>b']


# --- slow_for_window

def test_edge_is_too_slow_for_the_window():
    slow = sent('a b', every(12.0, 6), node='/driver')
    assert said('slow_for_window', slow) == [
        'warning a>b | /driver | a -> b comes every 12.0 s, and buffers keep 10.0 s: only '
        'lookups at the exact stamps succeed | interval_s=12 window_s=10']
    assert said('slow_for_window', slow, doctor=Doctor(Thresholds(
        cache_time=from_seconds(11.96)))) == [
        'warning a>b | /driver | a -> b comes every 12.0 s, and buffers keep 12.0 s: only '
        'lookups at the exact stamps succeed | interval_s=12 window_s=11.96']
    assert [severities('slow_for_window', sent('a b', every(period, 5)))
            for period in (10.0, 10.0 + MICROSECOND)] == [[], ['warning a>b']]
    assert [severities('slow_for_window', sent('a b', every(period, 30)))
            for period in (10.0, 10.0 + MICROSECOND)] == [[], ['warning a>b']]
    once = sent('a b', every(1.0, 1))
    assert said('slow_for_window', once, now=10.5) == [
        'warning a>b | a -> b came once, 10.5 s ago, and buffers keep 10.0 s: only lookups at '
        'the exact stamps succeed | interval_s=10.5 window_s=10']
    assert severities('slow_for_window', once, now=10.0) == []


def test_usual_interval_counts_not_a_gap():
    assert severities('slow_for_window', sent('a b', after(2.0, 40.0, 2.0))) == []
    assert said('slow_for_window', sent('a b', after(*[20.0] * 6))) == [
        'warning a>b | a -> b comes every 20.0 s, and buffers keep 10.0 s: only lookups at the '
        'exact stamps succeed | interval_s=20 window_s=10']
    assert severities('slow_for_window', sent('a b', after(20.0))) == ['warning a>b']
    # The median of eight intervals that are judged, and of all steps of fewer.
    assert [severities('slow_for_window', sent('a b', after(30.0, *[2.0] * few, *[30.0] * 5)))
            for few in (4, 5)] == [['warning a>b'], []]
    # Stamps that are repeated, or out of order, count once.
    stamps = from_seconds([0.0, 0.0, 0.0, 0.0, 12.0, 36.0, 24.0])
    assert said('slow_for_window', sent('a b', stamps, every(4.0, 7))) == [
        'warning a>b | a -> b comes every 12.0 s, and buffers keep 10.0 s: only lookups at the '
        'exact stamps succeed | interval_s=12 window_s=10']


def test_glimpses_of_a_tag_are_not_too_slow_while_others_are_seen():
    def found(count, node='/detector'):
        return severities('slow_for_window', seen('camera tag', every(12.0, count)),
                          seen('camera other', every(0.1, 1000), node))

    assert [found(7), found(8), found(7, '/x')] == [
        [], ['warning camera>tag'], ['warning camera>tag']]


def test_edge_of_a_simulation_is_too_slow_by_its_stamps():
    once = sent('a b', every(1.0, 1), origin=SIMULATED)
    fast = sent('b c', every(0.5, 100), every(0.1, 100), origin=SIMULATED)
    assert said('slow_for_window', once, fast) == [
        'warning a>b | a -> b came once, 49.5 s ago, and buffers keep 10.0 s: only lookups at '
        'the exact stamps succeed | interval_s=49.5 window_s=10']


# --- skew

def late(edges, seconds, period=0.1, begin=0.0, count=60):
    stamps = every(period, count, begin)
    return sent(edges, stamps, stamps + from_seconds(seconds), node=f'/{edges[-1]}')


def test_edge_that_is_older_than_another_on_its_path():
    assert said('skew', late('a b', 0.0), late('b c', 2.0)) == [
        'warning b>c | /c | b -> c is up to 2.00 s older than a -> b, on the same path: the '
        'latest transform through both is that old | apart_s=2']
    assert said('skew', late('a b', 2.0), late('b c', 0.0)) == [
        'warning a>b | /b | a -> b is up to 2.00 s older than b -> c, on the same path: the '
        'latest transform through both is that old | apart_s=2']
    assert [severities('skew', late('a b', 0.0), late('b c', 1.5 + more))
            for more in (0.0, MICROSECOND)] == [[], ['warning b>c']]
    # Beside each other they are on no path.
    assert severities('skew', late('a b', 0.0), late('a c', 2.0)) == []


def test_each_old_edge_is_reported_once_with_the_freshest_edge_down_to_there():
    assert said('skew', late('a b', 4.0), late('b c', 1.0), late('c d', 0.0), late('c e', 0.5)
                ) == [
        'warning a>b | /b | a -> b is up to 3.00 s older than b -> c, on the same path: the '
        'latest transform through both is that old | apart_s=3']
    assert said('skew', late('a b', 0.0), late('b c', 2.0), late('c d', 3.0), late('c e', 1.0)
                ) == [
        'warning b>c | /c | b -> c is up to 2.00 s older than a -> b, on the same path: the '
        'latest transform through both is that old | apart_s=2',
        'warning c>d | /d | c -> d is up to 3.00 s older than a -> b, on the same path: the '
        'latest transform through both is that old | apart_s=3']
    assert severities('skew', late('a b', 0.0), late('b c', 2.0), late('b d', 2.5)) == [
        'warning b>c',
        'warning b>d']


def test_slow_edge_is_old_just_before_its_next_sample():
    slow = late('b c', 0.0, 2.0, count=20)
    assert said('skew', late('a b', 0.0, count=400), slow) == [
        'warning b>c | /c | b -> c is up to 1.90 s older than a -> b, on the same path: the '
        'latest transform through both is that old | apart_s=1.9']
    assert [severities('skew', late('a b', 0.0, count=400), late('b c', 0.0, period, count=20))
            for period in (1.6, 1.6 + MICROSECOND)] == [[], ['warning b>c']]
    # All that are post-dated are of age zero.
    limits = Thresholds(max_skew=0)
    assert [severities('skew', late('a b', -5.0), late('b c', seconds), doctor=Doctor(limits))
            for seconds in (-0.1, -0.1 + 1e-9)] == [[], ['warning b>c']]
    # One that is post-dated is not older than now.
    assert [severities('skew', late('a b', -5.0), late('b c', seconds))
            for seconds in (1.4, 1.4 + MICROSECOND)] == [[], ['warning b>c']]


def test_usual_interval_of_few_is_the_mean_or_a_short_one():
    few = sent('b c', after(0.5, 9.0, 0.5, 9.0, 0.5, 9.0))
    assert said('skew', late('a b', 0.0, count=300), few) == []
    many = sent('b c', after(*[2.0, 9.0, 9.0] * 10))
    assert said('skew', late('a b', 0.0, count=2000), many) == [
        'warning b>c | b -> c is up to 1.90 s older than a -> b, on the same path: the latest '
        'transform through both is that old | apart_s=1.9']
    rounded = sent('b c', every(0.1, 300) // 2 // 10**9 * 2 * 10**9, every(0.1, 300))
    assert severities('skew', late('a b', 0.0, count=300), rounded) == []


def test_edges_of_another_clock_and_static_ones_are_passed_over():
    other = sent('b c', every(0.1, 60, 100.0), every(0.1, 60))
    assert severities('skew', late('a b', 0.0), late('x y', 0.0), other, late('c d', 2.0)) == [
        'warning c>d']
    other = sent('a b', every(0.1, 60, 100.0), every(0.1, 60))
    assert severities('skew', other, late('x y', 0.0), late('b c', 0.0), late('c d', 2.0)) == [
        'warning c>d']
