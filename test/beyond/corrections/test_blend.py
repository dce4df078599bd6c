# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A follower: its start and end, its speed in between, and noisy goals."""

import math

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.beyond.corrections.blend import AT_REST, BlendLimits, planned, scale_of, way, ZERO

OVER = 500_000_000
numbers = st.floats(-3.0, 3.0).map(lambda number: round(number, 3))
vectors = st.tuples(*[numbers] * 6)
limits = st.builds(BlendLimits, st.integers(0, 2 * OVER), st.floats(0.05, 2.0),
                   st.floats(0.05, 2.0), st.sampled_from([0.0, 0.5, 3.0]))
LIMITS = [BlendLimits(OVER, 0.5, math.inf, 0.0), BlendLimits(OVER, math.inf, math.inf, 0.0),
          BlendLimits(300_000_000, 0.2, 0.1, 0.0), BlendLimits(0, 0.3, math.inf, 0.0),
          BlendLimits(OVER, math.inf, 0.5, 1.0), BlendLimits(OVER, 0.5, 0.5, 2.0)]


def place(offset, plan, seconds):
    """Return the remaining offset after a time in seconds, or after each of several."""
    gone = [np.multiply.outer(way(seconds, course[1:], np.minimum, np.maximum), course.line)
            for course in plan[:2]]
    return np.array(offset) + gone[0] + gone[1]


def begun(offset, limits):
    return planned(offset, ZERO, scale_of(limits), AT_REST)


def changed(first, offset, part, other, limits):
    """Return the offset when the goal changes at a fraction of a plan's time; the new plan."""
    then = part * first.seconds
    here = tuple((place(offset, first, then) + other).tolist())
    return here, planned(here, first.rates_at(then), scale_of(limits), first)


def speeds(plan, reach):
    """Return the speeds at a distance, and the turn rates, along a plan."""
    rates = np.array([plan.rates_at(s) for s in np.linspace(0.0, plan.seconds, 300)])
    turning = np.linalg.norm(rates[:, 3:], axis=1)
    return np.linalg.norm(rates[:, :3], axis=1) + reach * turning, turning


@given(offset=vectors, others=st.lists(st.tuples(vectors, st.floats(0.0, 1.0)), max_size=4),
       limits=limits)
def test_no_point_within_reach_is_faster_than_the_limits(offset, others, limits):
    plan = begun(offset, limits)
    for other, part in [(ZERO, 0.0), *others]:
        offset, plan = changed(plan, offset, part, other, limits)
        speed, turning = speeds(plan, limits.reach)
        assert speed.max() <= limits.max_speed * (1.0 + 1e-9)
        assert turning.max() <= limits.max_turn_rate * (1.0 + 1e-9)


@given(offset=vectors, others=st.lists(st.tuples(vectors, st.floats(0.0, 1.0)), max_size=4),
       limits=limits | st.sampled_from(LIMITS))
def test_value_and_rate_go_on_and_the_goal_is_reached_at_rest(offset, others, limits):
    plan = begun(offset, limits)
    for other, part in others:
        before, then = plan, part * plan.seconds
        offset, plan = changed(plan, offset, part, other, limits)
        np.testing.assert_allclose(plan.rates_at(0.0), before.rates_at(then), atol=1e-9)
        np.testing.assert_allclose(place(offset, plan, 0.0), offset, atol=1e-12)
    np.testing.assert_allclose(place(offset, plan, plan.seconds), ZERO, atol=1e-8)
    np.testing.assert_allclose(plan.rates_at(plan.seconds), ZERO, atol=1e-9)


@given(offset=vectors, other=vectors, part=st.floats(0.05, 0.95),
       limits=limits | st.sampled_from(LIMITS))
def test_rates_are_those_of_finite_differences(offset, other, part, limits):
    offset, plan = changed(begun(offset, limits), offset, part, other, limits)
    step = 1e-6
    for seconds in np.linspace(0.01, 0.99, 7) * plan.seconds:
        rate = (place(offset, plan, seconds + step) - place(offset, plan, seconds - step)) / (
            2.0 * step)
        steepest = 40.0 * plan.acceleration * step / min(plan.scale[:2])
        np.testing.assert_allclose(plan.rates_at(seconds), rate, atol=1e-6 + steepest)


@given(offset=vectors, limits=limits)
def test_a_way_from_rest_takes_as_long_as_it_should_and_no_longer(offset, limits):
    plan, scale = begun(offset, limits), scale_of(limits)
    distance = scale.norm(offset)
    assert plan.seconds * 1e9 >= limits.over * (1.0 - 1e-9) or not distance
    assert plan.seconds <= scale.seconds + distance / scale.most + 1e-9


@given(first=limits, second=limits, offset=vectors, part=st.floats(0.0, 1.0))
def test_lower_limits_are_kept_after_half_the_time_of_a_blend(first, second, offset, part):
    """Immediate limits would require a jump of the rate."""
    plan = begun(offset, first)
    _, after = changed(plan, offset, part, ZERO, second)
    norm = after.scale.norm
    for seconds in np.linspace(0.5 * after.scale.seconds, after.seconds, 50):
        if seconds < after.seconds and after.scale.most < math.inf:
            assert norm(after.rates_at(seconds)) <= after.scale.most * (1.0 + 1e-9)
        assert norm(after.rates_at(seconds)) <= max(
            norm(plan.rates_at(part * plan.seconds)), after.scale.most) * (1.0 + 1e-9)


def braked(offset, plan, then, scale, every, noise):
    """Return times since other limits apply, and rates, while noisy goals follow each other."""
    rng, begin, found = np.random.default_rng(0), 0.0, []
    while begin < scale.seconds:
        offset, rates = place(offset, plan, then), plan.rates_at(then)
        offset += rng.normal(0.0, noise, 6)
        plan, then = planned(tuple(offset.tolist()), rates, scale, plan), every
        found += [(begin + s, scale.norm(plan.rates_at(s))) for s in np.linspace(0.0, every, 5)]
        begin += every
    return np.array(found).T


@given(offset=vectors, part=st.floats(0.1, 0.9), most=st.floats(2.0, 8.0), second=limits,
       every=st.sampled_from([0.002, 0.01, 0.03]), noise=st.sampled_from([0.0, 1e-6, 0.001, 0.1]))
def test_lower_limits_are_kept_as_soon_if_noisy_goals_follow(
        offset, part, most, second, every, noise):
    first, scale = begun(offset, BlendLimits(OVER, most, most, 0.0)), scale_of(second)
    times, rates = braked(offset, first, part * first.seconds, scale, every, noise)
    assert (rates[times >= 0.5 * scale.seconds] <= scale.most * (1.0 + 1e-9)).all()


@for_each(every=[0.001, 0.01, 0.033], noise=[0.0, 1e-6, 1e-3])
def test_lower_limit_is_reached_with_the_deceleration_of_the_first_goal(every, noise):
    """In proportion to the remaining excess, the deceleration would decrease with each goal."""
    offset = (9.0, 0, 0, 0, 0, 0)
    first = begun(offset, BlendLimits(OVER, 8.0, math.inf, 0.0))
    lower = scale_of(BlendLimits(200_000_000, 0.5, math.inf, 0.0))
    times, rates = braked(offset, first, 0.5, lower, every, noise)
    speeds, during = rates / lower.translation, times < 0.1
    np.testing.assert_allclose(speeds[during], 8.0 - 75.0 * times[during], atol=0.1)
    assert speeds[~during].max() <= 0.5 * (1.0 + 1e-9)


def test_without_any_limit_it_takes_no_time():
    assert begun((1.0, 0, 0, 0, 0, 0), BlendLimits(0, math.inf, math.inf, 0.0)) is AT_REST


# --- noisy goals

def followed(limits, every, noise, seconds, seed=0):
    """Return the places, one per millisecond, of a follower of a noisy goal at 1."""
    rng, scale = np.random.default_rng(seed), scale_of(limits)
    plan, offset, goal, places = AT_REST, np.zeros(6), np.zeros(6), []
    end = round(1000 * seconds)
    every = end if noise is None else every
    for begin in range(0, end, every):
        passed = every / 1000 if begin else 0.0
        here, rates = goal + place(offset, plan, passed), plan.rates_at(passed)
        goal = np.array([1.0, 0, 0, 0, 0, 0]) + np.append(
            rng.normal(0.0, noise or 0.0, 3), (0, 0, 0))
        offset = here - goal
        plan = planned(tuple(offset.tolist()), rates, scale, plan)
        places.append(goal + place(offset, plan, np.arange(min(every, end - begin)) / 1000))
    return np.concatenate(places)[:, :3]


def arrival(places, tolerance):
    """Return the milliseconds after which all places are within this tolerance of the goal."""
    return int(np.flatnonzero(np.linalg.norm(places - (1.0, 0, 0), axis=1) > tolerance)[-1])


@for_each(limits=LIMITS[:4], every=[10, 33, 1000], noise=[0.001, 0.01])
def test_goal_that_trembles_is_reached_as_soon_as_one_that_does_not(limits, every, noise):
    seconds = 1.0 + 1.4 * begun((1.0, 0, 0, 0, 0, 0), limits).seconds
    near = 5.0 * noise + 0.002
    once = arrival(followed(limits, every, None, seconds), near)
    places = followed(limits, every, noise, seconds)
    assert arrival(places, near) <= 1.3 * once
    assert places[:, 0].max() <= 1.0 + 5.0 * noise + 1e-9


def test_goal_that_stays_leaves_the_plan_as_it_was():
    limits = LIMITS[0]
    once, again = (followed(limits, 20, noise, 3.0) for noise in (None, 0.0))
    np.testing.assert_allclose(again, once, atol=1e-9)


def test_blend_of_a_metre_takes_two_seconds_and_two_ramps():
    assert begun((1.0, 0, 0, 0, 0, 0), LIMITS[0]).seconds == pytest.approx(2.25)
