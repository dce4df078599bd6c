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

"""What is measured of an edge does not depend on when its samples are looked at."""

from hypothesis import given, strategies as st
import numpy as np
from tf_tree_py.core.vitals.edge import MovingEdge
from tf_tree_py.core.vitals.limits import Limits
from tf_tree_py.core.vitals.spread import Spread
from tf_tree_py.core.vitals.stretch import Rows

NUMBERS = st.lists(st.integers(-10**6, 10**6), max_size=2000)
SECOND = 10**9


def parts_of(sequence, borders):
    begins = [0, *sorted(border % (len(sequence) + 1) for border in borders), len(sequence)]
    return [slice(*pair) for pair in zip(begins, begins[1:], strict=False)]


@given(NUMBERS, st.lists(st.integers(0, 2000), max_size=5))
def test_spread_is_the_same_however_the_numbers_come(numbers, borders):
    array = np.array(numbers, dtype=np.int64)
    whole, pieces = Spread(), Spread()
    whole.add(array)
    for part in parts_of(numbers, borders):
        pieces.add(array[part])
    assert pieces.at(0.0, 0.1, 0.5, 0.9, 1.0) == whole.at(0.0, 0.1, 0.5, 0.9, 1.0)
    assert (pieces.count, pieces.least, pieces.most) == (whole.count, whole.least, whole.most)


@given(NUMBERS.filter(bool))
def test_extremes_are_exact_and_quantiles_nearly(numbers):
    spread = Spread()
    spread.add(np.array(numbers))
    assert (spread.least, spread.most) == (min(numbers), max(numbers))
    if len(numbers) <= 256:
        assert spread.at(0.0, 0.5, 1.0) == [min(numbers), sorted(numbers)[round(
            0.5 * (len(numbers) - 1))], max(numbers)]


def facts(edge):
    timing, motion = edge.timing, edge.motion
    return {
        **{name: getattr(timing, name) for name in (
            'count', 'zeros', 'first', 'last', 'duplicates', 'differing', 'disorders', 'jumps',
            'back', 'longest', 'interval')},
        **{name: getattr(motion, name) for name in (
            'moved', 'planar', 'tilt', 'off_length', 'worst_length', 'fast', 'slow', 'turns')}}


@given(st.lists(st.tuples(st.sampled_from([20, 20, 20, 0, -30, 500, -5000, 3000]),
                          st.sampled_from([0.0, 0.01, 0.5, 3.0]),
                          st.sampled_from([0.0, 0.0, 1.0, np.nan])), min_size=1, max_size=60),
       st.lists(st.integers(0, 60), max_size=8))
def test_edge_is_the_same_wherever_a_block_ends(steps, borders):
    """The steps: milliseconds, metres, and what is added to a quaternion's w."""
    milliseconds, metres, odd = np.array(steps, dtype=float).T
    stamps = 100 * SECOND + np.cumsum(milliseconds).astype(np.int64) * 1_000_000
    poses = np.zeros((len(steps), 7))
    poses[:, 0], poses[:, 6] = np.cumsum(metres), 1.0 + odd
    received = 100 * SECOND + np.arange(len(steps)) * 20_000_000
    rows = Rows(received, stamps, poses)
    whole, pieces = MovingEdge(Limits()), MovingEdge(Limits())
    whole.add(rows, ())
    for part in parts_of(steps, borders):
        if part.start < part.stop:
            pieces.add(rows[part], ())
    assert facts(pieces) == facts(whole)
