# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is said about values, stamps and arrivals, beside each limit."""

import numpy as np
from small_scenes import after, BEGIN, every, fixed, poses, refused, said, sent, SIMULATED
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.doctor import Doctor

NANOSECOND = 1e-9
TEN_HZ = every(0.1, 60)


def short(code, *messages, **others):
    """Return the severities of findings, each with its edges."""
    return [one.partition(' | ')[0] for one in said(code, *messages, **others)]


# --- refusals

def test_refused_transforms():
    def found(code, kind, parent='a', child='b', times=1):
        others = refused(Kind.JUMP_BACK, 'x', 'y')
        return said(code, incidents=[refused(kind, parent, child, times, '/driver'), others])

    assert found('not_finite', Kind.NOT_FINITE) == [
        'error a>b | /driver | a -> b was NaN or infinite once | count=1']
    assert found('not_normalised', Kind.ZERO_ROTATION, times=2) == [
        'error a>b | /driver | a -> b has an all-zero quaternion, and was refused twice | '
        'count=2 worst_length=0 | cause: a message whose rotation was not set | fix: for no '
        'rotation send x 0, y 0, z 0, w 1']
    assert found('unreadable', Kind.MALFORMED, '', '', 3) == [
        'error () | /driver | refused 3 times: a detail | count=3']
    assert found('unreadable', Kind.BAD_NAME, '', 'b') == [
        'error (b) | /driver | refused once: a detail | count=1']
    assert found('unreadable', Kind.TOO_MANY_FRAMES) == [
        'error a>b | /driver | refused once: a detail | count=1']
    assert found('impossible_stamp', Kind.IMPOSSIBLE_STAMP, times=4) == [
        'error a>b | /driver | a -> b has an impossible stamp 4 times; the first: a detail | '
        'count=4']


def test_quaternions_whose_length_is_not_one():
    at = poses(60)
    at[::20] *= 1.01
    at[5, 3:] *= 0.5
    assert said('not_normalised', sent('a b', TEN_HZ, at=at, node='/filter')) == [
        'warning a>b | /filter | a -> b has quaternions of length 0.5, 4 of 60 | count=4 '
        'samples=60 worst_length=0.5']
    assert said('not_normalised', sent('a b', TEN_HZ)) == []


# --- stamps

def test_stamps_that_are_zero():
    stamps = np.where(np.arange(60) % 20, TEN_HZ, -BEGIN)
    assert said('zero_stamps', sent('a b', stamps, TEN_HZ, node='/driver')) == [
        'error a>b | /driver | a -> b has 3 of 60 stamps that are zero | count=3 samples=60']
    assert said('zero_stamps', sent('a b', TEN_HZ), fixed('b c')) == []


def test_lone_stamps():
    stamps = TEN_HZ.copy()
    stamps[[20, 40]] -= from_seconds([4000.0, 100.0])
    assert said('lone_stamp', sent('a b', stamps, TEN_HZ, node='/driver')) == [
        'warning a>b | /driver | a -> b has 2 of 60 samples with a stamp far older than the '
        'others, first 1699996002.000000000 s, received at 1700000002.000000000 s: 4000.100 s '
        'before the next stamp | count=2 samples=60 stamp_s=1699996002 received_s=1700000002 '
        'behind_s=4000.1']
    assert said('lone_stamp', sent('a b', TEN_HZ)) == []


def test_stamps_that_jump_back():
    stamps = np.concatenate([every(0.1, 30), every(0.1, 30, 1.0), every(0.1, 30, -2.0)])
    assert said('jump_back', sent('a b', stamps, every(0.1, 90), node='/player')) == [
        'warning a>b | /player | a -> b jumped back twice, by up to 5.900 s | count=2 back_s=5.9']
    assert said('jump_back', sent('a b', TEN_HZ)) == []


def repeated(times, count, other_pose=0):
    """Return messages, some of which repeat the stamp before; some with another pose."""
    stamps, at = every(0.1, count), poses(count, x=1.0)
    places = 2 + 2 * np.arange(times)
    stamps[places] = stamps[places - 1]
    at[places[:other_pose], 0] = 2.0
    return sent('a b', stamps, every(0.1, count), at=at, node='/relay')


def test_repeated_stamps():
    assert said('duplicate_stamps', repeated(5, 60, 2)) == [
        'note a>b | /relay | a -> b repeats 5 of 60 stamps, 2 of them with another pose | '
        'count=5 differing=2 samples=60']
    assert [short('duplicate_stamps', repeated(times, 60)) for times in (2, 3)] == [
        [], ['note a>b']]
    assert [short('duplicate_stamps', repeated(4, count)) for count in (399, 400)] == [
        ['note a>b'], []]
    assert [short('duplicate_stamps', repeated(49, 100, poses)) for poses in (40, 41)] == [
        ['note a>b'], ['warning a>b']]


def test_stamps_out_of_order():
    def disordered(times, count):
        stamps = every(0.1, count)
        stamps[10:10 + 4 * times:4] -= from_seconds(0.15)
        return sent('a b', stamps, every(0.1, count), node='/relay')

    assert said('out_of_order', disordered(5, 60)) == [
        'warning a>b | /relay | a -> b has 5 of 60 stamps that are older than the one before | '
        'count=5 samples=60']
    assert [short('out_of_order', disordered(times, 60)) for times in (2, 3)] == [
        [], ['warning a>b']]
    assert [short('out_of_order', disordered(4, count)) for count in (399, 400)] == [
        ['warning a>b'], []]


# --- the clock of the arrivals

def set_clock(edges, step, place=50, ahead=0.0, count=100, node=''):
    stamps = every(0.1, count)
    return sent(edges, stamps, stamps + from_seconds(ahead) + from_seconds(step) * (
        np.arange(count) >= place), node=node)


def test_clock_of_the_arrivals_was_set():
    assert said('recorder_clock', set_clock('a b', -2.0, node='/x')) == [
        'warning a>b | /x | the clock of the receiving computer was set back by 2.000 s at '
        '1700000004.900000000 s: the receive times of that edge jump by as much, and their '
        'stamps do not | edges=1 step_s=-2 received_s=1700000004.9']
    assert said('recorder_clock', set_clock('a b', -2.0), set_clock('b c', -2.0),
                doctor=Doctor(recorded=True)) == [
        'warning a>b, b>c | the clock of the recorder was set back by 2.000 s at '
        '1700000004.900000000 s: the receive times of all 2 edges that move jump by as much, and '
        'their stamps do not | edges=2 step_s=-2 received_s=1700000004.9 | fix: nothing to do '
        'here, if you go by the stamps: only the receive times are wrong, and the order of the '
        'messages where they overlap. Before the next recording, set the clock, and let chrony '
        'slew it afterwards']
    assert said('recorder_clock', set_clock('a b', 2.0, ahead=-2.0)) == [
        'warning a>b | the clock of the receiving computer was set forward by 2.000 s at '
        '1700000002.900000000 s: the receive times of that edge jump by as much, and their '
        'stamps do not | edges=1 step_s=2 received_s=1700000002.9']
    assert said('recorder_clock', set_clock('a b', 2.0), set_clock('b c', 2.0)) == [
        'warning a>b, b>c | the receive times of all 2 edges that move jump forward by 2.000 s '
        'at 1700000004.900000000 s, and their stamps do not | edges=2 step_s=2 '
        'received_s=1700000004.9 | cause: NTP or chrony set the clock of the computer that '
        'recorded or listened in one step; or all messages took longer by as much from then on, '
        'such as on another network']
    assert said('recorder_clock', sent('a b', TEN_HZ)) == []


# --- delays

def late(edges, seconds, count=60, node='', origin=BEGIN):
    stamps = every(0.1, count)
    return sent(edges, stamps, stamps + from_seconds(seconds), node=node, origin=origin)


def test_edges_that_arrive_late():
    assert said('delayed', late('a b', 0.7, node='/camera')) == [
        'warning a>b | /camera | a -> b arrives 700 ms after its stamp (95 of 100 are earlier; '
        'usually 700 ms) | p50_delay_s=0.7 p95_delay_s=0.7 count=60']
    assert [short('delayed', late('a b', seconds)) for seconds in (0.5, 0.5 + NANOSECOND)] == [
        [], ['warning a>b']]
    assert [short('delayed', late('a b', 0.7, count)) for count in (2, 3)] == [[], ['warning a>b']]
    seldom = 0.1 + 0.7 * (np.arange(60) % 10 == 5)
    assert said('delayed', late('a b', seldom)) == [
        'warning a>b | a -> b arrives 800 ms after its stamp (95 of 100 are earlier; usually 100 '
        'ms) | p50_delay_s=0.1 p95_delay_s=0.8 count=60']
    # If 5 of 100 are as late, the others matter.
    assert [short('delayed', late('a b', 0.1 + 0.7 * np.isin(np.arange(100), places), 100))
            for places in (range(10, 80, 15), range(10, 90, 15))] == [[], ['warning a>b']]


def test_edges_of_a_simulation_are_late_if_half_of_their_samples_are():
    def found(seconds, count=60):
        return short('delayed', *[late(f'a b{place}', 0.0, origin=SIMULATED)
                                  for place in range(5)],
                     late('a z', seconds, count, origin=SIMULATED))

    assert [found(0.7, count) for count in (19, 20)] == [[], ['warning a>z']]
    assert [found(seconds) for seconds in (0.45, 0.55)] == [[], ['warning a>z']]
    assert found(0.1 + 0.7 * (np.arange(60) % 10 == 5)) == []


def held_back(edges, begin=3.0, end=5.0, until=5.0, node='', apart=0.0):
    """Return messages of which those of some time arrive at its end, within some time."""
    stamps = every(0.1, 100)
    held = (stamps >= from_seconds(begin)) & (stamps < from_seconds(end))
    arrived = np.linspace(0.0, apart, int(held.sum()))
    received = stamps.copy()
    received[held] = from_seconds(until + arrived)
    return sent(edges, stamps, np.maximum.accumulate(received), node=node)


def test_samples_that_were_held_back_arrive_together():
    assert said('delayed', held_back('a b', node='/x')) == [
        'warning a>b | /x | a -> b: samples up to 2.000 s old arrived together, at '
        '1700000005.000000000 s; the others arrive in time | edges=1 longest_s=2 '
        'received_s=1700000005 | cause: the network, or a computer or a queue on the way, held '
        'them back and then delivered all at once']
    assert said('delayed', held_back('a b'), held_back('b c', 2.5, 5.4, 5.4)) == [
        'warning a>b, b>c | a -> b, b -> c: samples up to 2.900 s old arrived together, at '
        '1700000005.000000000 s; the others arrive in time | edges=2 longest_s=2.9 '
        'received_s=1700000005 | cause: the network, or a computer or a queue on the way, held '
        'them back and then delivered all at once: what these edges have in common']
    # A delay as long as the limit is not late.
    stamps = every(0.1, 100)
    received = np.where(stamps < from_seconds(3.0), stamps + from_seconds(0.5), np.maximum(
        stamps + from_seconds(0.5), from_seconds(5.0)))
    assert said('delayed', sent('a b', stamps, received)) == [
        'warning a>b | a -> b: samples up to 2.000 s old arrived together, at '
        '1700000005.000000000 s; the others arrive in time | edges=1 longest_s=2 '
        'received_s=1700000005 | cause: the network, or a computer or a queue on the way, held '
        'them back and then delivered all at once']
    # Together are those that begin within a second after the end of others.
    ends = 6.0, 6.0 + 1e-6
    assert [short('delayed', held_back('a b'), held_back('b c', 3.0, 6.0, until))
            for until in ends] == [['warning a>b, b>c'], ['warning a>b', 'warning b>c']]
    assert said('delayed', held_back('b c', 4.0, 6.5, 6.5), held_back('a b')) == [
        'warning a>b | a -> b: samples up to 2.000 s old arrived together, at '
        '1700000005.000000000 s; the others arrive in time | edges=1 longest_s=2 '
        'received_s=1700000005 | cause: the network, or a computer or a queue on the way, held '
        'them back and then delivered all at once',
        'warning b>c | b -> c: samples up to 2.500 s old arrived together, at '
        '1700000006.500000000 s; the others arrive in time | edges=1 longest_s=2.5 '
        'received_s=1700000006.5 | cause: the network, or a computer or a queue on the way, held '
        'them back and then delivered all at once']
    three = [held_back('a b'), held_back('b c', 3.5, 5.9, 5.9), held_back('c d', 4.0, 6.8, 6.8)]
    assert short('delayed', *three) == [
        'warning a>b, b>c, c>d']
    first_ends_last = held_back('a b', 2.0, 5.0, 5.0, apart=1.3)
    assert short('delayed', first_ends_last, held_back('b c', 3.0, 5.1, 5.1),
                 held_back('c d', 4.0, 7.2, 7.2)) == [
        'warning a>b, b>c, c>d']


def test_late_samples_that_do_not_arrive_at_once_were_not_held_back():
    # At most within half of the longest delay of 2 s.
    assert [short('delayed', held_back('a b', apart=apart)) for apart in (1.0, 1.1)] == [
        ['warning a>b'], ['warning a>b']]
    assert 'arrived together' in said('delayed', held_back('a b', apart=1.0))[0]
    assert said('delayed', held_back('a b', apart=1.1)) == [
        'warning a>b | a -> b arrives 1789 ms after its stamp (95 of 100 are earlier; usually 0 '
        'ms) | p50_delay_s=0 p95_delay_s=1.78947 count=100']
    twice = np.where(np.isin(np.arange(100) // 5, (4, 14)), 0.7, 0.0)
    assert short('delayed', late('a b', twice, 100)) == [
        'warning a>b']
    # One finding for the edge that is usually late, another one for those that were held back.
    assert [one.split(' | ')[0] for one in said(
        'delayed', held_back('a b'), late('b c', 0.6, 100))] == [
        'warning b>c',
        'warning a>b']
    few = sent('a b', after(0.1, 0.1, 0.1), after(0.1, 0.1, 0.1) + from_seconds(
        [0.0, 0.0, 0.9, 0.8]))
    assert said('delayed', few) == [
        'warning a>b | a -> b arrives 900 ms after its stamp (95 of 100 are earlier; usually 800 '
        'ms) | p50_delay_s=0.8 p95_delay_s=0.9 count=4']
