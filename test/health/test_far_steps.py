# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which stamps are far from others, by loops over the samples, and at each limit."""

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.health.measures.timing import far_steps, FarSteps, lone_stamps_of

SECOND = 10**9
BEGIN = 1000 * SECOND


def naive(received, stamps):
    """Return the far steps, as ``far_steps`` does with lists for arrays."""
    known = [place for place, arrival in enumerate(received) if arrival > 0]
    times = [stamps[place] for place in known]
    steps = [after - before for before, after in zip(times, times[1:], strict=False)]
    sizes = [abs(step) for step in steps]
    waits = [abs(received[after] - received[before])
             for before, after in zip(known, known[1:], strict=False)]
    far = [False] * len(steps)
    if any(size > 60 * SECOND for size in sizes):
        usual_most = max(60 * SECOND, 100 * sorted(sizes)[int(0.2 * (len(sizes) - 1) + 1e-9)])
        usual = [pair for pair in zip(sizes, waits, strict=True) if pair[0] <= usual_most]
        waited = sum(wait for _, wait in usual)
        if waited:
            pace = max(1.0, sum(size for size, _ in usual) / waited)
            far = [size > max(60 * SECOND, 10 * pace * wait)
                   for size, wait in zip(sizes, waits, strict=True)]
    around = [False, *far, False]  # the steps before and after each place
    between = []
    for place in range(1, len(times) - 1):
        beside = (around[place - 1] if place > 1 else False, around[place + 2])
        apart = abs(times[place + 1] - times[place - 1])
        least = min(sizes[place - 1], sizes[place])
        if far[place - 1] and far[place] and not any(beside) and 10 * apart <= least:
            between.append(place)
    ends = []
    if len(far) >= 3 and far[0] and not any(far[1:4]):
        ends.append(0)
    if len(far) >= 3 and far[-1] and not any(far[max(0, len(far) - 4):-1]):
        ends.append(len(far))
    if len(between) + len(ends) > max(1.0, 0.05 * len(times)):
        return [], [], False, True
    back = any(steps[min(place, len(steps) - 1)] < 0 for place in ends)
    return ([known[place] for place in between], [known[place] for place in ends], back,
            sum(far) > 2 * len(between) + len(ends))


def found(received, stamps):
    steps = far_steps(np.array(received, np.int64), np.array(stamps, np.int64))
    assert isinstance(steps, FarSteps) and type(steps.back) is type(steps.others) is bool
    return steps.between.tolist(), steps.ends.tolist(), steps.back, steps.others


NONE = [], [], False, False


@given(st.integers(0, 2**32), st.integers(0, 90))
def test_far_steps_are_those_of_a_loop_over_the_samples(seed, count):
    rng = np.random.default_rng(seed)
    for pace in (1, 20):
        waits = rng.choice(np.array([1, 1, 1, 2, 0, 6]) * SECOND, count)
        stamps = BEGIN + np.cumsum(waits * pace)
        received = BEGIN + np.cumsum(waits)
        for place in rng.integers(0, max(count, 1), rng.integers(0, 5)) if count else ():
            far = rng.choice(np.array([-70, -500, 61, 200, 1500, 100_000, -100_000]) * SECOND)
            stamps[place:place + rng.choice([1, 1, 2, 3, 90])] += far
        received[:rng.choice([0, 0, 2])] = 0
        arguments = received.tolist(), stamps.tolist()
        assert found(*arguments) == naive(*arguments)


@given(st.integers(0, 2**32), st.lists(st.sampled_from(
    [10, 10, 10, 30, 60, 61, -60, -61, 2000, -2000, 6001, -6000]), max_size=9))
def test_far_steps_of_a_few_samples_are_those_of_a_loop(seed, seconds):
    rng = np.random.default_rng(seed)
    for waits in ([0, 1], [1, 2], [10], [0]):
        received = BEGIN + SECOND * np.cumsum([0, *rng.choice(waits, len(seconds))])
        stamps = BEGIN + SECOND * np.cumsum([0, *seconds])
        with np.errstate(all='raise'):
            assert found(received, stamps) == naive(received.tolist(), stamps.tolist())


@for_each(arrivals=[[], [5], [0, 5], [0, 0]])
def test_fewer_than_two_arrivals_have_no_steps(arrivals):
    assert found(arrivals, [10**15 * place for place in range(len(arrivals))]) == NONE


def regular(count):
    times = BEGIN + SECOND * np.arange(count)
    return times, times.copy()


@for_each(far=[60 * SECOND - 1, 60 * SECOND, 60 * SECOND + 1], sign=[-1, 1])
def test_far_is_more_than_a_minute(far, sign):
    received, stamps = regular(30)
    stamps[10:] += stamps[9] + sign * far - stamps[10]
    assert found(received, stamps) == ([], [], False, far > 60 * SECOND)


@for_each(case=[
    # (the step, its wait, whether it is far), where all other steps take a second
    (300 * SECOND, 30 * SECOND, False), (300 * SECOND + 1, 30 * SECOND, True),
    (300 * SECOND, 30 * SECOND - 1, True),
    # One of a hundred times a usual step shows the pace: 128 s of stamps in 37 s, so 3.46.
    (100 * SECOND, 9 * SECOND, False), (100 * SECOND + 1, 9 * SECOND, True)])
def test_far_is_more_than_ten_times_the_wait(case):
    far, waited, is_far = case
    received, stamps = regular(30)
    received[10:] += waited - SECOND
    stamps[10:] += far - SECOND
    assert found(received, stamps) == ([], [], False, is_far)


@for_each(apart=[10, 10.5, 11], sign=[-1, 1])
def test_lone_stamp_is_ten_times_as_far_as_those_beside_it_are_apart(apart, sign):
    received, stamps = regular(30)
    received[11:] += round(apart * SECOND) - 2 * SECOND
    stamps[11:] += round(apart * SECOND) - 2 * SECOND
    stamps[10] = stamps[9 if sign < 0 else 11] + sign * 105 * SECOND
    assert found(received, stamps) == (([10] if apart <= 10.5 else []), [], False, apart > 10.5)


@for_each(count=[2, 3, 4, 5, 6, 7], place=range(7), sign=[-1, 1])
def test_single_far_stamp_of_few_samples(count, place, sign):
    """Without a small step no pace is known; at an end the lone stamp needs two of them."""
    if place >= count:
        return
    received, stamps = regular(count)
    stamps[place] += sign * 1000 * SECOND
    is_end = place in (0, count - 1)
    if count == 2 or (not is_end and count == 3):
        expected = NONE
    elif count == 3:
        expected = [], [], False, True
    elif is_end:
        # From a stamp that is ahead the first step goes back, as does that to a last one behind.
        expected = [], [place], (sign > 0) is (place == 0), False
    else:
        expected = [place], [], False, False
    assert found(received, stamps) == expected


@for_each(distance=[2, 3, 4, 5, 6], mirrored=[False, True])
def test_far_stamp_at_an_end_has_three_small_steps_beside_it(distance, mirrored):
    received, stamps = regular(200)
    stamps[[0, distance]] += 1000 * SECOND
    expected = [0, distance]
    if mirrored:
        stamps[[0, distance]] -= 1000 * SECOND
        stamps[[199, 199 - distance]] += 1000 * SECOND
        expected = [199, 199 - distance]
    between, ends, back, others = found(received, stamps)
    assert (between, others) == ([expected[1]] if distance > 2 else [], distance <= 4)
    assert ends == ([expected[0]] if distance > 4 else [])
    assert back is (distance > 4 and not mirrored)


@for_each(several=[1, 2, 3, 4], count=[19, 20, 39, 40, 41, 59, 60, 61, 80])
def test_at_most_a_twentieth_of_the_stamps_are_lone(several, count):
    received, stamps = regular(count)
    places = [4 * place + 4 for place in range(several)]
    stamps[places] -= 1000 * SECOND
    assert found(received, stamps) == (
        (places, [], False, False) if several <= max(1, count / 20) else ([], [], False, True))


def test_both_ends_count_beside_those_between():
    received, stamps = regular(60)
    stamps[[0, 30, 59]] += 1000 * SECOND
    assert found(received, stamps) == ([30], [0, 59], True, False)
    received, stamps = regular(59)
    stamps[[0, 30, 58]] += 1000 * SECOND
    assert found(received, stamps) == ([], [], False, True)
    received, stamps = regular(60)
    stamps[0], stamps[59] = stamps[0] - 1000 * SECOND, stamps[59] + 1000 * SECOND
    assert found(received, stamps) == ([], [0, 59], False, False)
    stamps[0] += 2000 * SECOND
    assert found(received, stamps) == ([], [0, 59], True, False), 'one of them goes back'


def test_step_to_another_run_is_no_lone_stamp_and_hides_none():
    received, stamps = regular(60)
    stamps[40:] -= 1000 * SECOND
    stamps[20] += 5000 * SECOND
    assert found(received, stamps) == ([20], [], False, True)


def test_places_count_the_samples_whose_arrival_is_not_known():
    received, stamps = regular(60)
    stamps[[10, 59]] += 1000 * SECOND
    received[:3] = 0
    assert found(received, stamps) == ([10], [59], False, False)


# --- several edges

def edge(*, first=0, middle=0, last=0, later=0):
    """Return an edge, with seconds added to three of its stamps, and to all of the last third."""
    received, stamps = regular(100)
    stamps[[0, 50, 99]] += SECOND * np.array([first, middle, last])
    stamps[70:] += later * SECOND
    return received, stamps


@pytest.mark.parametrize(('edges', 'expected'), [
    ([{}], {}),
    ([{'first': 1000}], {0: [0]}),
    ([{'first': 1000, 'middle': -1000, 'last': 1000}], {0: [0, 50, 99]}),
    # Time may begin anew where the ends of all edges of several go back.
    ([{'first': 1000}, {'first': 1000}], {}),
    ([{'first': 1000}, {'last': -1000}], {}),
    ([{'first': 1000, 'middle': -1000}, {'first': 1000}], {0: [50]}),
    ([{'first': 1000}, {}], {0: [0]}),
    ([{'first': 1000}, {'first': -1000}], {0: [0], 1: [0]}),
    ([{'first': 1000}, {'last': 1000}], {0: [0], 1: [99]}),
    # Another edge with a step to another run shows that time begins anew.
    ([{'first': -1000}, {'later': 1000}], {}),
    ([{'first': -1000, 'middle': 1000}, {'later': 1000}], {0: [50]}),
    ([{'first': -1000, 'middle': 1000}, {'later': 1000, 'middle': 9000}], {0: [50], 1: [50]}),
], ids=str)
def test_ends_are_judged_unless_time_begins_anew(edges, expected):
    places = lone_stamps_of(dict(enumerate(edge(**each) for each in edges)))
    assert {key: lone.tolist() for key, lone in places.items()} == expected
