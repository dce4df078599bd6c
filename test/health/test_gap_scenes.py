# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is a gap, just beside each limit, and all that is said about it."""

import re

import numpy as np
from small_scenes import after, BEGIN, every, poses, said, sent, SIMULATED
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.doctor import Doctor

NANOSECOND, MICROSECOND = 1e-9, 1e-6
SPAN = re.compile(r'for ([\d.]+ \w+) after ([\d.]+) s')
TEN_HZ = every(0.1, 60)
MONTH = 30 * 86_400.0


def gapped(gap, period=0.1, before=12, later=12):
    return after(*[period] * (before - 1), gap, *[period] * (later - 1))


def gaps(*messages, **others):
    """Return what was silent, how long, and after what stamp."""
    return [f"{one.partition(' | ')[0]}: {' after '.join(SPAN.search(one).groups())}"
            for one in said('gap', *messages, **others)]


def is_found(*messages, **others):
    return bool(said('gap', *messages, **others))


def test_gap_is_three_intervals_and_a_second():
    assert said('gap', sent('a b', gapped(1.001), node='/driver')) == [
        'warning a>b | /driver | a -> b was silent for 1.001 s after 1700000001.100000000 s; '
        'usually it comes every 100 ms | longest_s=1.001 usual_s=0.1 after_stamp_s=1700000001.1']
    assert not is_found(sent('a b', gapped(1.0)))
    assert is_found(sent('a b', gapped(1.0 + NANOSECOND)))
    assert not is_found(sent('a b', gapped(1.5, 0.5)))
    assert is_found(sent('a b', gapped(1.5 + NANOSECOND, 0.5)))


def test_intervals_of_late_stamps_are_usual_if_a_quarter_is_as_long():
    def late(gap, times):
        return sent('a b', after(*[0.1, 0.1, 0.6] * times, gap, *[0.1, 0.1, 0.6] * times))

    assert not is_found(late(1.8, 5))
    assert is_found(late(1.8 + NANOSECOND, 5))
    # Of eight intervals that are judged, two are longer. Of seven, one may be the gap.
    few = [0.1] * 5 + [0.6, 0.6, 1.7] + [0.1] * 2
    assert gaps(sent('a b', after(*few))) == [
        'warning a>b: 1.700 s after 1700000001.700000000']
    assert not is_found(sent('a b', after(0.1, *few)))


def test_stamps_that_alternate_because_the_clock_of_the_arrivals_was_set_back_have_no_gap():
    def set_back(edges, stamps):
        return sent(edges, stamps, stamps - from_seconds(1.1) * (stamps > from_seconds(30.0)))

    def found(gap):
        stamps = np.concatenate([every(0.3, 200), every(0.3, 200, 59.7 + gap)])
        return gaps(set_back('a b', every(0.1, 1200)), set_back('b c', stamps))

    assert [found(gap) for gap in (0.3, 0.6)] == [[], []]
    assert [found(gap) for gap in (2.0 - MICROSECOND, 2.0)] == [
        [], ['warning b>c: 2.000 s after 1700000059.700000000']]


def test_only_stamps_have_a_gap_if_messages_went_on():
    def went_on(wait, count=12, gap=2.0, origin=BEGIN):
        begin, end = [0.1] * (count // 2), [0.1] * (count - count // 2 - 2)
        return sent('a b', after(*begin, gap, *end), after(*begin, wait, *end), origin=origin)

    assert not is_found(went_on(1.0 - NANOSECOND))
    assert gaps(went_on(1.0)) == [
        'warning a>b: 2.000 s after 1700000000.600000000']
    assert not is_found(went_on(0.1, 9))
    assert is_found(went_on(0.1, 8)), 'seven waits are too few to show it'
    assert is_found(went_on(0.5, 40, 2.0, SIMULATED), sent('b c', TEN_HZ, origin=SIMULATED)), (
        'a simulation may be faster for a while')


def test_frozen_stamp_is_no_gap_but_beside_a_gap_elsewhere():
    begin = 3.0 * 0.1 * np.arange(40)
    stamps = from_seconds(begin)
    stamps[20:35] = stamps[20]
    frozen = sent('a b', stamps, from_seconds(0.1 * np.arange(40)), origin=SIMULATED)
    others = sent('b c', every(0.3, 40), every(0.1, 40), origin=SIMULATED)
    assert gaps(frozen, others) == []
    short = np.where(np.arange(40) < 30, stamps, from_seconds(begin))
    short[30:] += from_seconds(5.0)
    frozen = sent('a b', short, from_seconds(0.1 * np.arange(40)), origin=SIMULATED)
    assert gaps(frozen, others) == [
        'warning a>b: 8.000 s after 106.000000000']
    later = stamps.copy()
    later[37:] += from_seconds(5.0)
    frozen = sent('a b', later, from_seconds(0.1 * np.arange(40)), origin=SIMULATED)
    assert gaps(frozen, others) == [
        'warning a>b: 5.300 s after 110.800000000']


# --- several edges

def test_edges_that_were_silent_at_once_are_one_finding():
    assert said('gap', sent('a b', gapped(2.0), node='/x'),
                sent('b c', gapped(3.0), node='/y')) == [
        'warning a>b, b>c | /x, /y | all 2 edges that move were silent at once, a -> b for 2.000 '
        's after 1700000001.100000000 s | edges=2 longest_s=2 usual_s=0.1 '
        'after_stamp_s=1700000001.1 | cause: the recording or the simulation was paused, what '
        'sends all of them or its network stopped, the computer was suspended, or its clock was '
        'set forward | fix: if other topics went on at that time, find out what stopped the '
        'senders of these edges; lookups in the gap are interpolated across it']
    assert said('gap', sent('a b', gapped(2.0)), sent('b c', gapped(3.0)),
                doctor=Doctor(recorded=True)) == [
        'note a>b, b>c | all 2 edges that move were silent at once, a -> b for 2.000 s after '
        '1700000001.100000000 s | edges=2 longest_s=2 usual_s=0.1 after_stamp_s=1700000001.1 | '
        'cause: the recording or the simulation was paused, what sends all of them or its '
        'network stopped, the computer was suspended, or its clock was set forward | fix: if '
        'other topics went on at that time, find out what stopped the senders of these edges; '
        'lookups in the gap are interpolated across it']
    assert said('gap', sent('a b', gapped(2.0), origin=SIMULATED),
                sent('b c', gapped(3.0), origin=SIMULATED)) == [
        'note a>b, b>c | all 2 edges that move were silent at once, a -> b for 2.000 s after '
        '101.100000000 s | edges=2 longest_s=2 usual_s=0.1 after_stamp_s=101.1 | cause: the '
        'recording or the simulation was paused, what sends all of them or its network stopped, '
        'the computer was suspended, or its clock was set forward | fix: if other topics went on '
        'at that time, find out what stopped the senders of these edges; lookups in the gap are '
        'interpolated across it']


def test_silence_of_more_than_a_month_is_a_clock_that_was_set():
    def cause(gap):
        return said('gap', sent('a b', gapped(gap)), sent('b c', gapped(gap)))[0].split(' | ')[3]

    assert cause(MONTH).startswith('cause: the recording or the simulation was paused')
    assert cause(MONTH + 1e-3) == (
        'cause: the clock of the computer was set, from its start (often 1970) to the '
        'present')


def test_only_edge_is_never_silent_at_once_with_others():
    assert said('gap', sent('a b', gapped(2.0)), doctor=Doctor(recorded=True)) == [
        'warning a>b | a -> b was silent for 2.000 s after 1700000001.100000000 s; usually it '
        'comes every 100 ms | longest_s=2 usual_s=0.1 after_stamp_s=1700000001.1']


def test_other_edge_that_is_too_slow_to_show_a_pause():
    messages = sent('a b', gapped(2.0)), sent('b c', every(3.0, 3))
    assert gaps(*messages) == [
        'warning a>b: 2.000 s after 1700000001.100000000']
    assert said('gap', *messages, doctor=Doctor(recorded=True)) == [
        'note a>b | a -> b was silent for 2.000 s after 1700000001.100000000 s; usually it comes '
        'every 100 ms | longest_s=2 usual_s=0.1 after_stamp_s=1700000001.1 | cause: its node '
        'hung, crashed or was restarted; or the recording or the simulation was paused, because '
        'the other edges did not come either | fix: check the log of its publisher at that time, '
        'if nothing was paused: lookups in the gap are interpolated across it']


def test_silences_begin_at_once_within_a_second_or_two_intervals():
    def count(apart, period):
        first = gapped(5.0, period)
        return len(said('gap', sent('a b', first), sent('b c', first + from_seconds(apart))))

    assert [count(apart, 0.1) for apart in (1.0, 1.0 + MICROSECOND)] == [1, 2]
    assert [count(apart, 0.6) for apart in (1.2, 1.2 + MICROSECOND)] == [1, 2]
    fast = sent('a b', gapped(5.0, 0.1))
    slow = [sent('b c', gapped(5.0, 0.6, 3) + from_seconds(1.1)),
            sent('b c', gapped(5.0, 0.6, 3) + from_seconds(1.2))]
    assert [len(said('gap', fast, each)) for each in slow] == [1, 2]


def test_sample_of_another_edge_within_the_silence_shows_that_it_was_no_pause():
    def count(sample, period=0.1, gap=3.0):
        silent, begin = gapped(gap, period, 24, 24), 23 * period
        other = np.concatenate([begin - 0.05 - every(2.0, 5)[::-1] / 1e9, [begin + sample],
                                begin + gap + 0.05 + every(2.0, 5) / 1e9])
        return len(said('gap', sent('a b', silent), sent('b c', silent),
                        sent('c d', from_seconds(other))))

    near = (0.2, 0.2 + MICROSECOND, 2.8 - MICROSECOND, 2.8)
    assert [count(sample) for sample in near] == [1, 2, 2, 1]
    # Within a third of the silence, if two intervals are longer.
    near = (0.4, 0.4 + MICROSECOND, 0.8 - MICROSECOND, 0.8)
    assert [count(sample, 0.3, 1.2) for sample in near] == [1, 2, 2, 1]


def test_only_the_time_in_which_all_were_silent_counts():
    def count(sample):
        begin = 23 * 0.6
        other = np.concatenate([begin - 0.05 - every(3.0, 5)[::-1] / 1e9, [begin + sample],
                                begin + 4.0 + every(3.0, 5) / 1e9])
        return len(said('gap', sent('a b', gapped(3.0, 0.6, 24, 24)),
                        sent('b c', gapped(3.2, 0.6, 24, 24) + from_seconds(0.9)),
                        sent('c d', from_seconds(other))))

    # From 0.9 to 3.0 s; without a third at both ends, from 1.6 to 2.3 s.
    assert [count(sample) for sample in (1.5, 1.59, 1.61, 2.29, 2.31, 3.0)] == [1, 1, 2, 2, 1, 1]


def test_silences_are_compared_by_arrival():
    early = sent('a b', gapped(4.0) + from_seconds(2.0), gapped(4.0))
    assert gaps(early, sent('b c', gapped(4.0))) == [
        'warning a>b, b>c: 4.000 s after 1700000003.100000000']
    # Of an edge with another clock, there is no usual delay.
    other = sent('b c', gapped(4.0) - from_seconds(100.0), gapped(4.0))
    assert gaps(sent('a b', gapped(4.0)), sent('a c', gapped(4.0)), other) == [
        'warning a>b: 4.000 s after 1700000001.100000000',
        'warning a>c: 4.000 s after 1700000001.100000000',
        'warning b>c: 4.000 s after 1699999901.100000000']
    in_the_silence = sent('c d', every(0.1, 24, 2.0), every(0.1, 24))
    assert gaps(sent('a b', gapped(4.0)), sent('b c', gapped(4.0)), in_the_silence) == [
        'warning a>b: 4.000 s after 1700000001.100000000',
        'warning b>c: 4.000 s after 1700000001.100000000']


def test_other_edge_of_a_simulation_is_compared_by_its_stamps():
    def simulated(stamps, edges):
        return sent(edges, stamps, stamps // 3, origin=SIMULATED)

    silent = gapped(6.0)
    others = simulated(np.concatenate([every(0.1, 12), every(0.1, 12, 7.1)]), 'c d')
    assert gaps(simulated(silent, 'a b'), others) == [
        'note a>b, c>d: 6.000 s after 101.100000000']
    others = simulated(every(0.1, 100), 'c d')
    assert gaps(simulated(silent, 'a b'), others) == [
        'warning a>b: 6.000 s after 101.100000000']


# --- tags

def wander(count):
    return poses(count, x=0.1 * np.arange(count), yaw=0.1 * np.arange(count))


def seen(edges, stamps, node='/detector', late=0.0):
    return sent(edges, stamps, stamps + from_seconds(late), wander(len(stamps)), node)


def test_tag_was_out_of_view_if_its_detector_went_on_with_others():
    tag = seen('camera tag', gapped(3.0))
    assert said('gap', tag, seen('camera other', TEN_HZ)) == [
        'note camera>tag | /detector | camera -> tag was silent for 3.000 s after '
        '1700000001.100000000 s; usually it comes every 100 ms | longest_s=3 usual_s=0.1 '
        'after_stamp_s=1700000001.1 | cause: tag was out of view: its publisher went on with '
        'camera -> other | fix: nothing to do, if it can leave the view; lookups of it have to '
        'expect that']
    assert said('gap', tag, seen('camera other', TEN_HZ), seen('camera third', TEN_HZ),
                seen('camera fourth', TEN_HZ)) == [
        'note camera>tag | /detector | camera -> tag was silent for 3.000 s after '
        '1700000001.100000000 s; usually it comes every 100 ms | longest_s=3 usual_s=0.1 '
        'after_stamp_s=1700000001.1 | cause: tag was out of view: its publisher went on with '
        'camera -> other and 2 more | fix: nothing to do, if it can leave the view; lookups of '
        'it have to expect that']
    assert 'with camera -> other and 1 more |' in said(
        'gap', tag, seen('camera other', TEN_HZ), seen('camera third', TEN_HZ))[0]
    assert gaps(tag, seen('camera other', TEN_HZ, '/another')) == [
        'warning camera>tag: 3.000 s after 1700000001.100000000']
    assert gaps(tag, seen('another other', TEN_HZ)) == [
        'warning camera>tag: 3.000 s after 1700000001.100000000']
    assert gaps(tag, seen('camera other', TEN_HZ), seen('other child', TEN_HZ)) == [
        'warning camera>tag: 3.000 s after 1700000001.100000000']


def test_another_tag_counts_that_was_stamped_within_the_gap():
    def severity(*within):
        stamps = np.concatenate([every(0.1, 12), from_seconds(1.1 + np.array([*within])),
                                 every(0.1, 12, 4.1)])
        return gaps(seen('camera tag', gapped(3.0), late=2.0),
                    seen('camera other', stamps, late=2.0), sent('a b', TEN_HZ))[0].split()[0]

    assert [severity(*within) for within in (
        (), (MICROSECOND,), (3.0 - MICROSECOND,))] == [
        'warning',
        'warning',
        'warning']


# --- coarse stamps

def test_gap_of_coarse_stamps_is_found_by_the_arrivals():
    def coarse(gap, before=30, later=30, round_to=10**9, **others):
        times = gapped(gap, 0.1, before, later)
        return sent('a b', times // round_to * round_to, times, **others)

    assert said('gap', coarse(1.5, node='/driver')) == [
        'warning a>b | /driver | a -> b was silent for 1.500 s after it arrived at '
        '1700000002.900000000 s; usually it arrives every 100 ms | longest_s=1.5 usual_s=0.1']
    assert [is_found(coarse(gap)) for gap in (1.0, 1.0 + NANOSECOND)] == [False, True]
    # Stamps that repeat half of the time are not coarse.
    assert gaps(coarse(1.5, 30, 30, 2 * 10**8)) == [
        'warning a>b: 1.600 s after 1700000002.800000000']
    # A gap that the stamps show, too, is reported once.
    assert gaps(coarse(5.0)) == [
        'warning a>b: 5.000 s after 1700000002.000000000']
    few = after(0.1, 0.1, 0.1, 0.1, 1.5, 0.1, 0.1)
    assert not is_found(sent('a b', 0 * few, few))
    assert is_found(sent('a b', 0 * after(*[0.1] * 6, 1.5, 0.1), after(*[0.1] * 6, 1.5, 0.1)))
