# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""An offset that fades: where it begins and ends, and how fast it is between."""

import math

from hypothesis import given, strategies as st
import numpy as np
from strategies import assert_same_pose, axes, components
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.blend import fade, Limits, Rates

SECOND = 1_000_000_000

offsets = st.builds(
    lambda t, axis, angle: (*t, *so3.exp(tuple(angle * part for part in axis))),
    st.tuples(components, components, components), axes, st.floats(0.0, 1.5))
limits = st.builds(Limits, st.integers(0, 2 * SECOND), st.floats(0.05, 2.0), st.floats(0.05, 2.0),
                   st.floats(0.0, 3.0))
unlimited = Limits(SECOND, math.inf, math.inf, 0.0)


def interrupted(before, part, offset, limits):
    """Return another that begins when a part of one is over, with its rates."""
    stamp = before.begin + round(part * (before.end - before.begin))
    return fade(offset, before.rates_at(stamp), stamp, limits)


def fastest(one, reach):
    """Return how fast a point so far away goes, and all turn, at most, of finite differences."""
    stamps = np.linspace(one.begin, one.end, 400).astype(np.int64)
    poses = one.at_many(stamps)
    seconds = np.maximum(np.diff(stamps), 1) / SECOND
    turn_rates = se3.distance_many(poses[:-1], poses[1:])[1] / seconds
    speeds = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1) / seconds
    return (speeds + reach * turn_rates).max(), turn_rates.max()


@given(offset=offsets, other=offsets, limits=limits, part=st.floats(0.05, 0.95))
def test_no_point_within_reach_is_faster_than_the_limits(offset, other, limits, part):
    first = fade(offset, Rates(), 0, limits)
    for one in (first, interrupted(first, part, other, limits)):
        if one.end - one.begin > 1000:  # nothing moves by less than a nanometre
            speed, turn_rate = fastest(one, limits.reach)
            assert speed <= limits.max_speed * (1.0 + 1e-3)
            assert turn_rate <= limits.max_turn_rate * (1.0 + 1e-3)


@given(offset=offsets, limits=limits)
def test_it_begins_with_the_offset_and_ends_with_none_and_rests_there(offset, limits):
    one = fade(offset, Rates(), 0, limits)
    assert one.rates_at(one.end) == Rates() and one.end >= limits.over
    if one.end > 1000:
        assert_same_pose(one.at(0), offset)
        assert_same_pose(one.at(-5), offset)
    for stamp in (one.end, one.end + 5):
        assert_same_pose(one.at(stamp), se3.IDENTITY)


@given(offset=offsets, other=offsets, part=st.floats(0.1, 0.9), then=st.floats(0.0, 0.9))
def test_rates_are_those_of_finite_differences(offset, other, part, then):
    first = fade(offset, Rates(), 0, unlimited)
    second = interrupted(first, part, other, unlimited)
    assert np.allclose(second.rates_at(second.begin), first.rates_at(second.begin))
    stamp, step = second.begin + round(then * SECOND) + 20_000, 10_000
    rates = second.rates_at(stamp)
    before, after = second.at(stamp - step), second.at(stamp + step)
    seconds = 2 * step / SECOND
    moved = np.subtract(after[:3], before[:3]) / seconds
    turned = so3.log(so3.multiply(after[3:], so3.conjugate(before[3:])))
    np.testing.assert_allclose(rates.velocity, moved, atol=1e-6)
    np.testing.assert_allclose(rates.turning, np.array(turned) / seconds, atol=1e-6)


@given(offset=offsets, other=offsets, part=st.floats(0.0, 0.9), stamp=st.integers(-5, 3 * SECOND))
def test_many_stamps_are_one_by_one(offset, other, part, stamp):
    one = interrupted(fade(offset, Rates(), 0, unlimited), part, other, unlimited)
    assert_same_pose(one.at_many(np.array([stamp, 0]))[0], one.at(stamp))


def test_a_metre_at_a_metre_a_second_takes_the_peak_of_the_quintic():
    one = fade((1.0, 0, 0, 0, 0, 0, 1), Rates(), 0, Limits(0, 1.0, math.inf, 0.0))
    assert one.end == 1.875 * SECOND
    assert one.at(one.end // 2)[0] == 0.5
