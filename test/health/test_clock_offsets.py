# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Delays that are constant, and stamps that are ahead, in small scenes beside each limit."""

from clock_scenes import (
    case_of,
    edge_of,
    found,
    late,
    mixed,
    MS,
    regular,
    roaming,
    SECOND,
    standing,
)
import numpy as np
import pytest

TIMES = regular()
SIMULATED = 10 * SECOND


def in_time(name, **how):
    return edge_of(name, TIMES, **how)


# --- constant delays

def received(edge, usual, rest, part='90 of 100 of those delays differ by 0.0 ms at most'):
    """Return the usual finding of a constant delay."""
    return ('warning', edge.replace(' -> ', '>'), f'{edge} is received {usual} ms after the '
            f'stamp, and {part}{rest[0]}', rest[1])


def test_constant_delay_is_reported_with_that_of_the_others():
    assert found('clock_offset', case_of(late('a>b', 250))) == [
        received('a -> b', 250, ('', 'edges=1, p50_delay_s=0.25, spread_s=0'))]
    assert found('clock_offset', case_of(in_time('x>y'), late('a>b', 250.4, 0.1),
                                         late('b>c', 30))) == [
        received('a -> b', 250, ('; most other edges after 4 ms',
                                 'edges=1, p50_delay_s=0.2504, spread_s=0.0089'),
                 '90 of 100 of those delays differ by 8.9 ms at most')]


def test_few_delays_that_are_far_from_the_others_are_left_out():
    for far, part in ((0.9, '90 of 100 of those delays differ by 0.9'),
                      (1.0, '50 of 100 of those delays differ by 0.5'),
                      (40.0, '50 of 100 of those delays differ by 0.5')):
        delays = np.full(100, 200 * MS) + mixed() * 10_000
        delays[mixed() >= 94] = round((200.05 + far) * MS)
        assert found('clock_offset', case_of(edge_of('a>b', TIMES, delays))) == [
            received('a -> b', 201 if far < 0 else 200,
                     ('', f'edges=1, p50_delay_s=0.2005, spread_s={far * 1e-3:g}'),
                     f'{part} ms at most')]


@pytest.mark.parametrize(('edges', 'expected'), [
    ([late('a>b', 100), in_time('b>c')], False),
    ([late('a>b', 100.1), in_time('b>c')], True),
    ([late('a>b', 250, count=19), in_time('b>c')], False),
    ([late('a>b', 250, count=20), in_time('b>c')], True),
    # Steady: 90 of 100 delays are 89 steps apart.
    ([late('a>b', 150, 0.112), in_time('b>c')], True),
    ([late('a>b', 150, 0.113), in_time('b>c')], False),
    ([late('a>b', 300, 0.168), in_time('b>c')], True),
    ([late('a>b', 300, 0.169), in_time('b>c')], False),
    ([late('a>b', 250, 0.5)], False),
    # As steady as the others, and far behind them.
    ([late('a>b', 210, 0.4), late('b>c', 10, 0.4)], False),
    ([late('a>b', 210.1, 0.4), late('b>c', 10, 0.4)], True),
    ([late('a>b', 250, 0.599), late('b>c', 10, 0.4)], True),
    ([late('a>b', 250, 0.6), late('b>c', 10, 0.4)], False)])
def test_delay_is_constant_within_limits(edges, expected):
    assert bool(found('clock_offset', case_of(*edges))) is expected


def test_offsets_of_one_computer_are_grouped():
    edges = [late('d>e', 350.1, 0.03), late('b>c', 250, 0.02), late('a>b', 200, 0.01),
             late('c>d', 300, 0.04), in_time('e>f')]
    assert [one[1:] for one in found('clock_offset', case_of(*edges))] == [
        ('a>b b>c c>d', 'a -> b and 2 more edges are received 200 ms after the stamp, and 90 of '
         '100 of those delays differ by 0.9 ms at most; most other edges after 300 ms',
         'edges=3, p50_delay_s=0.2, spread_s=0.00089'),
        ('d>e', 'd -> e is received 350 ms after the stamp, and 90 of 100 of those delays differ '
         'by 2.7 ms at most; most other edges after 250 ms',
         'edges=1, p50_delay_s=0.3501, spread_s=0.00267')]


COMPUTES = (
    'their node sets these stamps too early by a constant, or takes that long to compute each '
    'sample. Its clock is right: it sends {} in time',
    'lookups for the stamps of data need a timeout of this delay')


@pytest.mark.parametrize(('senders', 'others', 'usual', 'expected'), [
    (['/n'], ['/n'], 4, True), (['/n'], ['/n'], 49.9, True), (['/n'], ['/n'], -49.9, True),
    (['/n'], ['/n'], 50, False), (['/n'], ['/n'], -50, False), (['/n'], ['/m'], 4, False),
    (['/n'], ['/n', '/m'], 4, False), (['/n', '/m'], ['/n', '/m'], 4, False), ([], [], 4, False),
    (['one of /n, /m'], ['one of /n, /m'], 4, False)])
def test_node_that_also_sends_in_time_has_the_right_clock(senders, others, usual, expected):
    edges = [in_time('x>y', senders=['/z']), late('a>b', 250, senders=senders),
             late('b>c', usual, senders=others), in_time('z>w', senders=['/z'])]
    one, = found('clock_offset', case_of(*edges))
    assert one == received('a -> b', 250, (
        '; most other edges after 4 ms', 'edges=1, p50_delay_s=0.25, spread_s=0')) + (
        (COMPUTES[0].format('b -> c'), COMPUTES[1]) if expected else ())


SEEN = (
    'each sample takes that long to compute, as vision usually does; or the clock of the '
    'computer that stamps these edges is behind',
    'lookups for the stamps of data need a timeout of this delay. If they are stamped on another '
    'computer, compare the clocks: chronyc tracking prints their offsets')


@pytest.mark.parametrize(('tags', 'expected'), [
    ([late('base>tag', 250, poses=roaming)], True),
    ([late('base>tag', 499.9, poses=roaming)], True),
    ([late('base>tag', 500, poses=roaming)], False),
    ([late('base>tag', 480, poses=roaming), late('base>other', 499.9, poses=roaming)], True),
    ([late('base>tag', 480, poses=roaming), late('base>other', 500, poses=roaming)], False),
    ([late('base>tag', 250, poses=roaming), late('base>arm', 250, poses=standing)], False),
    ([late('odom>tag', 250, poses=roaming)], False)])
def test_vision_takes_less_than_half_a_second(tags, expected):
    """An arm does not turn, and what is seen from the map may be a localiser's."""
    one, = found('clock_offset', case_of(in_time('odom>base'), *tags))
    assert (one[0], one[4:]) == (('note', SEEN) if expected else ('warning', ()))


def test_what_is_known_of_the_node_comes_before_vision():
    one, = found('clock_offset', case_of(
        in_time('odom>base', senders=['/n']), late('base>tag', 250, poses=roaming,
                                                   senders=['/n'])))
    assert (one[0], one[4]) == ('warning', COMPUTES[0].format('odom -> base'))


# --- clocks that differ from that of the arrivals

def of_simulation(*delays, **how):
    """Return edges ``r0>f0``, ``r1>f1`` and so on of a simulation, with delays, milliseconds."""
    return [late(f'r{number}>f{number}', delay, begin=SIMULATED, **how)
            for number, delay in enumerate(delays)]


GROUPS = (
    'two clocks, or a node that stamps too early or too late by a constant. The stamps are of '
    'another clock than the arrivals, so they do not show which group is right',
    'compare both with the clock: ros2 topic delay TOPIC --use-sim-time prints the delay of a '
    'sensor, which has the clock of its computer')


def test_two_groups_of_a_simulation_are_listed():
    assert found('clock_offset', case_of(*of_simulation(10, -240, 0, -250, 5, -5))) == [
        ('warning', 'r3>f3 r1>f1 r0>f0 r2>f2 r4>f4 r5>f5',
         'the edges fall into two groups, whose stamps are 250 ms apart: ahead are r3 -> f3, '
         'r1 -> f1; behind are r0 -> f0, r2 -> f2, r4 -> f4, r5 -> f5',
         'ahead=2, behind=4, apart_s=0.25', *GROUPS)]
    assert found('clock_offset', case_of(*of_simulation(0, -300))) == [
        ('warning', 'r1>f1 r0>f0', 'the edges fall into two groups, whose stamps are 300 ms '
         'apart: ahead is r1 -> f1; behind is r0 -> f0', 'ahead=1, behind=1, apart_s=0.3',
         *GROUPS)]
    # The next group is 50 ms behind the last edge of the one that leads.
    one, = found('clock_offset', case_of(*of_simulation(
        0, -250, 0, -150.2, 0, -200.1, -100.1, 0)))
    assert one[1] == 'r1>f1 r5>f5 r3>f3 r0>f0 r2>f2 r4>f4 r6>f6 r7>f7'
    one, = found('clock_offset', case_of(*of_simulation(0, -250, 0, -200, -150, 0, -149, 0)))
    assert one[1] == 'r1>f1 r3>f3 r4>f4 r6>f6 r0>f0 r2>f2 r5>f5 r7>f7'


@pytest.mark.parametrize(('step', 'expected'), [(0.0, True), (4.0, True), (7.0, False)])
def test_edge_of_a_simulation_is_ahead_of_the_earliest_of_the_others(step, expected):
    """5 % of their delays are 45 steps shorter than usual."""
    edges = [late(f'r{number}>f{number}', usual, step * sign, begin=SIMULATED)
             for number, (usual, sign) in enumerate([(0, 1), (-300, 0), (0, -1), (0, 1), (0, -1)])]
    assert [one[1] for one in found('clock_offset', case_of(*edges))] == (
        ['r1>f1 r0>f0 r2>f2 r3>f3 r4>f4'] if expected else [])
    assert found('future_stamps', case_of(*edges)) == []
    assert found('post_dated', case_of(*edges)) == []


def test_edges_behind_most_of_a_simulation_are_late():
    one, = found('clock_offset', case_of(*of_simulation(0, 300, 0, step=0.1)))
    assert (one[0], one[1]) == ('warning', 'r1>f1')
    assert one[2].endswith('; most other edges after 0 ms')


@pytest.mark.parametrize(('delays', 'expected'), [
    ((0, -200, 0), 0), ((0, -200.1, 0), 1)])
def test_groups_of_a_simulation_are_far_apart(delays, expected):
    assert len(found('clock_offset', case_of(*of_simulation(*delays)))) == expected


def test_correction_of_a_simulation_is_post_dated_and_no_group():
    edges = [edge_of('map>odom', TIMES, -300 * MS, poses=standing, begin=SIMULATED),
             *(late(name, 4, begin=SIMULATED) for name in ('odom>base', 'base>arm'))]
    assert found('clock_offset', case_of(*edges)) == []
    assert found('future_stamps', case_of(*edges)) == []
    assert found('post_dated', case_of(*edges)) == [
        ('note', 'map>odom', 'map -> odom is stamped 304 ms ahead of the others',
         'usually_s=0.304, spread_s=0')]


# --- stamps that are ahead

def ahead(edges):
    """Return the edges that a check reports as too far ahead, and as post-dated."""
    case = case_of(*edges)
    return tuple(' '.join(one[1] for one in found(code, case))
                 for code in ('future_stamps', 'post_dated'))


def test_post_dated_edge_and_one_further_ahead():
    assert found('post_dated', case_of(late('a>b', -100, 0.1), in_time('b>c'))) == [
        ('note', 'a>b', 'a -> b is stamped 100 ms ahead of its arrival',
         'usually_s=0.1, spread_s=0.0089')]
    assert found('future_stamps', case_of(late('a>b', -3000, 1), late('b>c', -3050, 2),
                                          in_time('c>d'))) == [
        ('warning', 'b>c a>b', 'b -> c and 1 more edge are stamped 3050 ms ahead of the clock',
         'edges=2, usually_s=3.05, furthest_s=3.14')]


@pytest.mark.parametrize(('edge', 'expected'), [
    (late('a>b', -50), ('', '')), (late('a>b', -50.1), ('', 'a>b')),
    (late('a>b', -100, count=19), ('', '')), (late('a>b', -100, count=20), ('', 'a>b')),
    (late('a>b', -1999.9), ('', 'a>b')), (late('a>b', -2000), ('a>b', '')),
    # The middle half of the delays are 49 steps apart: 200 ms, half the lead, or 3 intervals.
    (late('a>b', -300, 4.08, hz=20.0), ('', 'a>b')), (late('a>b', -300, 4.09, hz=20.0), (
        'a>b', '')),
    (late('a>b', -1000, 10.2), ('', 'a>b')), (late('a>b', -1000, 10.21), ('a>b', '')),
    (late('a>b', -500, 6.12), ('', 'a>b')), (late('a>b', -500, 6.13), ('a>b', ''))])
def test_node_post_dates_by_a_constant_of_less_than_two_seconds(edge, expected):
    assert ahead([edge, in_time('b>c'), in_time('c>d')]) == expected


@pytest.mark.parametrize(('edges', 'expected'), [
    ([late('a>b', -300)], ('', 'a>b')),
    ([late('a>b', -300), late('b>c', -320)], ('b>c a>b', '')),
    ([late('a>b', -300), late('b>c', -320), in_time('c>d')], ('', 'b>c a>b')),
    # The one that is furthest ahead decides for both.
    ([late('a>b', -300, 6.2), late('b>c', -320), in_time('c>d')], ('', 'b>c a>b')),
    ([late('a>b', -300), late('b>c', -320, 6.2), in_time('c>d')], ('b>c a>b', '')),
    ([in_time('odom>base'), late('base>arm', -300, poses=standing), late('map>odom', -310)],
     ('map>odom base>arm', '')),
    ([in_time('odom>base'), late('base>arm', -300, poses=standing)], ('', 'base>arm'))])
def test_several_localisers_may_post_date_but_no_whole_robot(edges, expected):
    assert ahead(edges) == expected


@pytest.mark.parametrize(('lead', 'expected'), [
    (9.9, None), (10.0, None), (10.1, '10.1'), (25.0, '25.0')])
def test_stamps_beyond_the_window_are_an_error(lead, expected):
    """They are ahead from the first on, or one is ahead of those around it."""
    leads = np.where(np.arange(100) == 50, round(lead * SECOND) + 4 * MS, 0)
    error = None if expected is None else ('error', 'a>b', (
        f'a -> b has stamps up to {expected} s ahead of the clock: its good data is refused '
        'until the clock reaches them'), f'furthest_s={lead:g}')
    always = found('future_stamps', case_of(late('a>b', -1000 * lead), in_time('b>c')))
    assert always == ([error] if error else [
        ('warning', 'a>b', f'a -> b is stamped {1000 * lead:.0f} ms ahead of the clock',
         f'edges=1, usually_s={lead:g}, furthest_s={lead:g}')])
    once = found('future_stamps', case_of(edge_of('a>b', TIMES, lead=leads), in_time('b>c')))
    assert once == ([error] if error else [])


def test_stamp_far_ahead_of_those_around_it_is_an_error_by_any_clock():
    leads = np.where(np.arange(100) == 50, 20 * SECOND, 0)
    for begin in (SIMULATED, 1_699_000_000 * SECOND):
        case = case_of(edge_of('a>b', TIMES, lead=leads, begin=begin),
                       *(in_time(name, begin=begin) for name in ('b>c', 'c>d')))
        assert [one[::3] for one in found('future_stamps', case)] == [
            ('error', 'furthest_s=19.9')]


def test_stamps_of_another_clock_are_not_ahead():
    """That they are of another clock is another finding."""
    assert found('future_stamps', case_of(late('a>b', -100_000), in_time('b>c'), in_time(
        'c>d'))) == []


@pytest.mark.parametrize(('lead', 'expected'), [(4.4, []), (10.1, []), (25, ['furthest_s=25'])])
def test_stamps_are_ahead_beside_a_step_of_the_recorders_clock(lead, expected):
    """After a step of 10 s back, stamps are 10 s ahead of some arrivals."""
    step = np.where(TIMES > 5 * SECOND, -10 * SECOND, 0)
    far = np.where((TIMES > 2 * SECOND) & (TIMES < 2.2 * SECOND), round(lead * SECOND), 0)
    edges = [edge_of('a>b', TIMES, step - far), *(edge_of(f'b>{name}', TIMES, step)
                                                  for name in 'cde')]
    case = case_of(*edges)
    assert case.arrival_step.step == -10 * SECOND
    assert [one[3] for one in found('future_stamps', case)] == expected


# --- a recorder that goes by a simulation

NODE = ('a node that stamps by another clock than the simulation, or post-dates',
        'set use_sim_time for the node, or reduce its tolerance')
LATE_CLOCK = (
    'the clock that they are compared with is simulated: it stands still from one message of '
    '/clock to the next, which may arrive late',
    'nothing to do; with a faster /clock the lead becomes shorter')


@pytest.mark.parametrize(('usual', 'severity', 'own'), [
    (4, 'warning', NODE), (-160, 'note', LATE_CLOCK)])
def test_lead_of_all_edges_is_that_of_the_simulated_clock(usual, severity, own):
    edges = [late('a>b', delay, begin=SIMULATED, clock=SIMULATED) for delay in (-150, usual)]
    edges += [late('a>b', -3000, begin=SIMULATED, clock=SIMULATED)] if usual > 0 else []
    leading = found('future_stamps', case_of(*edges))
    assert [(one[0], one[4:]) for one in leading] == [(severity, own)]


@pytest.mark.parametrize(('now', 'expected'), [(10**18 - 1, True), (10**18, False)])
def test_time_of_a_simulation_begins_at_zero(now, expected):
    assert case_of(now=now).recorded_in_simulation is expected
