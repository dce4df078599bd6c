# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The measures of an edge do not depend on when its samples are processed."""

from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py.health.measures.edge_record import MovingEdge
from tf_tree_py.health.measures.sample_rows import Rows, Steps
from tf_tree_py.health.measures.spread import Spread
from tf_tree_py.health.measures.thresholds import Thresholds

# Drawn as a whole: lists that hypothesis makes of single numbers are short, and only of more than
# 256 numbers are some left out.
NUMBERS = st.builds(
    lambda seed, count: np.random.default_rng(seed).integers(-10**6, 10**6, count),
    st.integers(0, 2**32), st.integers(0, 5000))
SECOND = 10**9


def parts_of(sequence, borders):
    begins = [0, *sorted(border % (len(sequence) + 1) for border in borders), len(sequence)]
    return [slice(*pair) for pair in zip(begins, begins[1:], strict=False)]


@given(NUMBERS, st.lists(st.integers(0, 5000), max_size=5))
def test_spread_is_the_same_however_the_numbers_come(numbers, borders):
    pieces = Spread()
    for part in parts_of(numbers, borders):
        pieces.add(numbers[part])
        whole = Spread()
        whole.add(numbers[:part.stop])
        assert pieces.at(0.0, 0.1, 0.5, 0.9, 1.0) == whole.at(0.0, 0.1, 0.5, 0.9, 1.0)
        assert (pieces.count, pieces.kept, pieces.least, pieces.most, pieces.mean) == (
            whole.count, whole.kept, whole.least, whole.most, whole.mean)


@given(NUMBERS.filter(len))
def test_extremes_are_exact_and_so_are_the_quantiles_of_few(numbers):
    spread = Spread()
    spread.add(numbers)
    assert (spread.least, spread.most) == (min(numbers), max(numbers))
    assert min(len(numbers), 128) <= spread.kept <= 256
    if len(numbers) <= 256:
        assert spread.at(0.0, 0.5, 1.0) == [min(numbers), sorted(numbers)[round(
            0.5 * (len(numbers) - 1))], max(numbers)]


@given(st.integers(100, 20_000), st.integers(1, 4))
def test_quantiles_of_many_are_those_of_rows_from_the_whole_time(count, patterns):
    """Also of a stream in which only every few rows have a meaning."""
    spread = Spread()
    spread.add(np.arange(count) + 10**9 * (np.arange(count) % patterns))
    pattern, number = divmod(spread.at(0.5 / patterns)[0], 10**9)
    assert pattern == 0 and number == pytest.approx(count / 2, abs=0.15 * count)


def facts(edge):
    timing, motion = edge.timing, edge.motion
    return {
        **{name: getattr(timing, name) for name in (
            'count', 'zeros', 'first', 'last', 'duplicates', 'differing', 'disorders', 'jumps',
            'back', 'longest', 'interval', 'whole_seconds', 'frozen')},
        **{name: getattr(motion, name) for name in (
            'moved', 'planar', 'tilt', 'travelled', 'off_length', 'worst_length', 'steps', 'fast',
            'slow', 'outliers', 'lone')},
        'rates': [(rates.count, rates.least, rates.most)
                  for rates in (motion.speeds, motion.turn_rates)],
        'turns': (motion.turns.all, motion.turns.first, motion.turns.last)}


# The x, y and z of quaternions: at rest, about the axis z, and tilted.
TURNED = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.4), (0.3, 0.0, 0.0), (-0.5, 0.7, 0.1)]


@given(st.lists(st.tuples(st.sampled_from([20, 20, 20, 0, -30, 500, -5000, 3000]),
                          st.sampled_from([0.0, 0.01, 0.5, 3.0]),
                          st.sampled_from([0.0, 0.0, 1.0, np.nan]),
                          st.sampled_from(TURNED)), min_size=1, max_size=60),
       st.lists(st.integers(0, 60), max_size=8))
def test_edge_is_the_same_wherever_a_block_ends(steps, borders):
    """The steps are milliseconds, metres, an addition to a quaternion's w, and its x, y, z."""
    milliseconds, metres, odd = np.array([step[:3] for step in steps], dtype=float).T
    stamps = 100 * SECOND + np.cumsum(milliseconds).astype(np.int64) * 1_000_000
    poses = np.zeros((7, len(steps)))
    poses[0], poses[6] = np.cumsum(metres), 1.0 + odd
    poses[3:6] = np.transpose([turned for *_, turned in steps])
    received = 100 * SECOND + np.arange(len(steps)) * 20_000_000
    rows = Rows(received, stamps, poses)
    whole, pieces = MovingEdge(Thresholds()), MovingEdge(Thresholds())
    whole.add(rows, ())
    for part in parts_of(steps, borders):
        if part.start < part.stop:
            pieces.add(rows[part], ())
    assert facts(pieces) == facts(whole)


@given(st.lists(st.tuples(st.floats(-4.0, 4.0),
                          st.sampled_from([1.0, -1.0, 1.001, 0.5, 1e-200, 1e200])),
                min_size=2, max_size=20))
def test_length_of_a_quaternion_turns_nothing(turns):
    angles, lengths = np.array(turns).T
    poses = np.zeros((7, len(turns)))
    poses[5], poses[6] = np.sin(angles / 2) * lengths, np.cos(angles / 2) * lengths
    stamps = np.arange(len(turns)) * SECOND
    steps = Steps(Rows(stamps, stamps, poses))
    for lag, sizes in ((1, steps.turned), (2, steps.sizes_of_two[1])):
        turned = np.abs(angles[lag:] - angles[:-lag])
        assert sizes == pytest.approx(np.minimum(turned, abs(2 * np.pi - turned)), abs=1e-11)


@given(st.lists(st.sampled_from([0.0, -0.0, 1e-200, -0.5, np.nan, np.inf]),
                min_size=7, max_size=7))
def test_rows_of_use_are_finite_and_have_a_rotation(numbers):
    poses = np.array([numbers, [0, 0, 0, 0, 0, 0, 1]], dtype=float).T
    rows = Rows(np.arange(2), np.arange(2), poses)
    useful = np.isfinite(numbers).all() and any(numbers[3:])
    assert rows.of_use().stamps.tolist() == ([0, 1] if useful else [1])
