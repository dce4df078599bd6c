# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A stamp far from its neighbours is found, wherever it is; no healthy recording has one."""

from hypothesis import example, given, strategies as st
import numpy as np
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.measures.timing import lone_stamps_of

BEGIN = 1_700_000_000
HOUR, YEAR = 3600.0, 365 * 86_400.0


def columns(received, stamps):
    return from_seconds(np.asarray(received, float)), from_seconds(np.asarray(stamps, float))


def lone_stamps(received, stamps):
    return lone_stamps_of({'edge': (received, stamps)}).get('edge', np.array([]))


@st.composite
def runs(draw, least=0, most=30):
    """
    Return the arrivals and stamps of a run, seconds, each from zero on.

    It has any rate, is simulated at any pace, jitters, and was paused.
    """
    count = draw(st.integers(least, most))
    period, pace = draw(st.floats(0.005, 120.0)), draw(st.floats(0.01, 1000.0))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    steps = period * rng.uniform(0.5, 1.5, count)
    waited = steps / pace * rng.uniform(0.5, 1.5, count)
    for place in draw(st.lists(st.integers(0, max(count - 1, 0)), max_size=3)) if count else ():
        pause = draw(st.floats(0.0, 1e6))
        waited[place] += pause
        steps[place] += pause * pace * draw(st.sampled_from([0.0, 1.0, 3.0]))
    return np.cumsum(waited), np.cumsum(steps)


def joined(parts, gap_s=0.01):
    """Return runs one after the other: the arrivals go on, the stamps begin anew."""
    received, stamps, end = [], [], BEGIN
    for waited, moments in parts:
        received.append(end + gap_s + waited)
        stamps.append(moments + 1.0)
        end = received[-1].max(initial=end)
    return np.concatenate(received), np.concatenate(stamps)


@given(runs(), st.floats(0.0, 1e9))
def test_one_run_has_none(run, begin):
    received, stamps = run
    assert lone_stamps(*columns(BEGIN + received, begin + stamps)).tolist() == []


@given(runs(least=3), runs(least=3), st.integers(0, 2**31))
def test_runs_one_after_the_other_have_none(first, second, begin):
    received, stamps = joined([first, second])
    assert lone_stamps(*columns(received, stamps)).tolist() == []
    stamps[:len(first[0])] += begin
    assert lone_stamps(*columns(received, stamps)).tolist() == []


@given(st.floats(0.005, 60.0), st.floats(0.0, 1.0), st.floats(0.0, 200.0), st.integers(1, 4))
def test_loop_has_none_though_a_slow_edge_has_one_sample_on_one_side(period, part, begin, times):
    """The other edges show that all stamps begin anew."""
    length = 200.0
    edges = {}
    for name, every in (('fast', 0.1), ('slow', period)):
        moments = np.arange(part * every, length, every)
        received, stamps = (np.concatenate(parts) for parts in zip(*(
            (BEGIN + number * length + moments, 1.0 + moments) for number in range(times + 1)),
            strict=True))
        some = received >= BEGIN + begin
        edges[name] = columns(received[some], stamps[some])
    assert lone_stamps_of(edges) == {}


@given(runs(least=4), st.sampled_from([-YEAR, HOUR, 1e9]), st.sampled_from([0, 7]))
def test_without_arrivals_there_are_none(run, bad, received):
    stamps = from_seconds(BEGIN + run[1])
    stamps[len(stamps) // 2] += from_seconds(bad)
    with np.errstate(all='raise'):
        assert lone_stamps(np.full(len(stamps), received), stamps).tolist() == []


def test_pause_of_the_recorder_in_a_fast_simulation_is_none_at_either_end():
    stamps = np.concatenate([[0.0], 6000.0 + np.arange(10.0)])
    for both in (stamps, 7000.0 - stamps[::-1]):
        assert lone_stamps(*columns(BEGIN + both / 100.0, 1.0 + both)).tolist() == []


def test_good_sample_between_two_bad_ones_is_none():
    received, stamps = columns(*2 * [BEGIN + 0.1 * np.arange(200)])
    stamps[[100, 102]] = 0
    assert 101 not in lone_stamps(received, stamps)


def test_two_clocks_that_alternate_have_none():
    received = BEGIN + 0.1 * np.arange(100)
    for every in (2, 3, 4, 10):
        stamps = np.where(np.arange(100) % every, received, received - YEAR)
        assert lone_stamps(*columns(received, stamps)).tolist() == []


@given(st.integers(4, 60), st.floats(0.0, 0.999), st.floats(0.005, 10.0), st.sampled_from(
    [-2.0**31, 0.0, 1000.0, BEGIN - YEAR, BEGIN + 2 * HOUR]))
@example(4, 0.0, 0.1, 0.0)
@example(4, 0.999, 0.1, 0.0)
def test_one_is_found_wherever_it_is(count, where, period, bad):
    place = int(where * count)
    received, stamps = columns(*2 * [BEGIN + period * np.arange(count)])
    stamps[place] = from_seconds(bad)
    assert lone_stamps(received, stamps).tolist() == [place]
    mirrored = lone_stamps(received[-1] + 1 - received[::-1] + BEGIN, stamps[::-1])
    assert mirrored.tolist() == [count - 1 - place]
    early = np.concatenate([[0, 0], received]), np.concatenate([[5, 5], stamps])
    assert lone_stamps(*early).tolist() == [place + 2], 'before the clock began'


@given(runs(least=8, most=30), st.integers(3, 4), st.sampled_from([0.0, -1.0]))
def test_one_is_found_in_a_simulation_and_beside_a_pause(run, place, bad):
    received, stamps = columns(BEGIN + run[0], 3e8 + run[1])
    stamps[place] = from_seconds(bad * 2.0**31)
    found = lone_stamps(received, stamps).tolist()
    assert found in ([place], []), 'none, where the simulation is too fast to tell'


def test_several_of_many_are_found():
    received, stamps = columns(*2 * [BEGIN + 0.1 * np.arange(200)])
    stamps[[0, 50, 120, 199]] = 0
    assert lone_stamps(received, stamps).tolist() == [0, 50, 120, 199]


def test_first_message_of_a_robot_before_its_clock_was_set_is_found_on_all_edges():
    received, stamps = columns(*2 * [BEGIN + 0.1 * np.arange(20)])
    stamps[0] = from_seconds(30.0)
    assert {edge: places.tolist() for edge, places in lone_stamps_of(
        dict.fromkeys('abc', (received, stamps))).items()} == {'a': [0], 'b': [0], 'c': [0]}


def test_recording_that_began_just_before_all_stamps_began_anew_has_none():
    received, stamps = columns(*2 * [BEGIN + 0.1 * np.arange(20)])
    stamps[0] += from_seconds(HOUR)
    assert lone_stamps_of(dict.fromkeys('abc', (received, stamps))) == {}
