"""From one rigid motion to another: where it begins and ends, and how fast it is between."""

import math

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
from strategies import assert_same_pose, axes, components
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.blend import blend_to, Limits, Rates

SECOND = 1_000_000_000
PIVOT = (1.0, -2.0, 0.5)

motions = st.builds(
    lambda t, axis, angle: (*t, *so3.exp(tuple(angle * part for part in axis))),
    st.tuples(components, components, components), axes, st.floats(0.0, 1.5))
limits = st.builds(Limits, st.integers(0, 2 * SECOND), st.floats(0.05, 2.0), st.floats(0.05, 2.0),
                   st.floats(0.0, 3.0))


def rest_to(last, limits):
    return blend_to(last, 0, se3.IDENTITY, Rates(), PIVOT, limits)


def interrupted(blend, part, last, limits):
    """Return another blend that begins when a part of one is over."""
    stamp = blend.begin + round(part * (blend.end - blend.begin))
    return blend_to(last, stamp, blend.at(stamp), blend.rates_at(stamp, PIVOT), PIVOT, limits)


def points_within(reach):
    """Return the pivot and points around it, as far away as it goes."""
    corners = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)])
    sizes = np.maximum(np.linalg.norm(corners, axis=1), 1.0)
    return PIVOT + reach * corners / sizes[:, None]


def fastest(blend, reach):
    """Return how fast any point goes and how fast all turn, at most, of finite differences."""
    stamps = np.linspace(blend.begin, blend.end, 400).astype(np.int64)
    poses = blend.at_many(stamps)
    seconds = np.maximum(np.diff(stamps), 1) / SECOND
    places = np.stack([se3.apply_many(pose, points_within(reach)) for pose in poses])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=2) / seconds[:, None]
    return speeds.max(), (se3.distance_many(poses[:-1], poses[1:])[1] / seconds).max()


@examples(1)
@given(last=motions, other=motions, limits=limits, part=st.floats(0.05, 0.95))
def test_no_point_within_reach_is_faster_than_the_limits(last, other, limits, part):
    blend = rest_to(last, limits)
    for one in (blend, interrupted(blend, part, other, limits)):
        if one.end - one.begin > 1000:  # nothing moves by less than a nanometre
            speed, turn_rate = fastest(one, limits.reach)
            assert speed <= limits.max_speed * (1.0 + 1e-3)
            assert turn_rate <= limits.max_turn_rate * (1.0 + 1e-3)


@examples(1)
@given(last=motions, other=motions, limits=limits, part=st.floats(0.05, 0.95))
def test_one_that_interrupts_another_goes_on_from_its_value_and_rate(last, other, limits, part):
    first = rest_to(last, limits)
    if first.end - first.begin < SECOND // 100:
        return
    second = interrupted(first, part, other, limits)
    assert_same_pose(second.at(second.begin), first.at(second.begin))
    step = (first.end - first.begin) // 10_000
    before, here, after = first.at(second.begin - step), second.first, second.at(
        second.begin + step)
    places = [np.array(se3.apply(pose, (3.0, 1.0, -1.0))) for pose in (before, here, after)]
    bend = (places[2] - places[1]) - (places[1] - places[0])
    # What is left of the difference is of the second order of the step.
    assert np.linalg.norm(bend) <= 1e-5


@examples(1)
@given(last=motions, limits=limits)
def test_it_begins_at_one_and_ends_at_the_other_and_rests_there(last, limits):
    blend = rest_to(last, limits)
    assert blend.at(blend.begin) == se3.IDENTITY and blend.at(-5) == se3.IDENTITY
    assert blend.at(blend.end) == last and blend.at(blend.end + 5) == last
    assert blend.rates_at(blend.end, PIVOT) == Rates()
    # The last piece before the end leads there.
    near = blend.end - (blend.end - blend.begin) // 1000
    assert_same_pose(blend.at(near), last, 1e-6)


@given(last=motions, part=st.floats(0.1, 0.9))
def test_rates_are_those_of_finite_differences(last, part):
    point = (0.3, 2.0, -1.0)
    blend = rest_to(last, Limits(SECOND, math.inf, math.inf, 0.0))
    stamp, step = round(part * SECOND), 10_000
    rates = blend.rates_at(stamp, point)
    before, after = blend.at(stamp - step), blend.at(stamp + step)
    moved = np.subtract(se3.apply(after, point), se3.apply(before, point)) / (2 * step / SECOND)
    turned = so3.log(so3.multiply(after[3:], so3.conjugate(before[3:])))
    np.testing.assert_allclose(rates.velocity, moved, atol=1e-6)
    np.testing.assert_allclose(rates.turning, np.array(turned) / (2 * step / SECOND), atol=1e-6)


def test_a_metre_at_a_metre_a_second_takes_the_peak_of_the_quintic():
    blend = rest_to((1.0, 0, 0, 0, 0, 0, 1), Limits(0, 1.0, math.inf, 0.0))
    assert blend.end - blend.begin == 1.875 * SECOND
    assert blend.at(blend.end // 2)[0] == 0.5
