# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Exactly which rows of a stream are kept, and the quantiles of those."""

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.health.measures.spread import median, quantiles, Sampled, Spread

GOLDEN = 0.6180339887498949


def kept_of(count):
    """Return the numbers of the kept rows, as if each were added alone."""
    kept, every = [], 1
    for number in range(count):
        if number * GOLDEN % 1.0 < 1.0 / every:
            kept.append(number)
        while len(kept) > 256:
            every *= 2
            kept = [each for each in kept if each * GOLDEN % 1.0 < 1.0 / every]
    return kept


@for_each(count=[0, 1, 256, 257, 258, 513, 1000, 5000], size=[1, 100, 5000])
def test_rows_are_kept_by_multiples_of_the_golden_ratio(count, size):
    rows = np.array([np.arange(count), -np.arange(count)]).T
    sampled = Sampled(np.empty((0, 2), np.int64))
    for begin in range(0, count, size):
        sampled.add(rows[begin:begin + size])
    assert sampled.count == count
    assert sampled.kept.tolist() == [[number, -number] for number in kept_of(count)]


@given(st.lists(st.integers(-9, 9), max_size=40))
def test_quantiles_are_the_nearest_of_the_ordered_numbers(numbers):
    spread = Spread()
    for begin in range(0, len(numbers), 7):
        spread.add(np.array(numbers[begin:begin + 7]))
        spread.at(0.5)
    ordered, last, parts = sorted(numbers), len(numbers) - 1, (0.0, 0.05, 0.5, 0.95, 1.0)
    expected = [ordered[round(part * last)] for part in parts] if numbers else [0.0] * 5
    assert spread.at(*parts) == expected == quantiles(np.array(ordered), parts)
    assert spread.median == expected[2] == median(numbers)
    assert (spread.count, spread.kept) == (len(numbers), len(numbers))
    assert spread.least == min(numbers, default=np.inf)
    assert spread.most == max(numbers, default=-np.inf)
    assert spread.mean == pytest.approx(sum(numbers) / max(len(numbers), 1), abs=1e-12)
    for number in range(-10, 11):
        above = sum(each >= number for each in numbers) / max(len(numbers), 1)
        assert spread.part_above(number) == pytest.approx(above)


def test_no_numbers_change_nothing():
    spread = Spread()
    for expected in ([0, 0, np.inf, -np.inf, 0.0, 0.0, 0.0, [0.0, 0.0]],
                     [1, 1, 3.0, 3.0, 3.0, 3.0, 1.0, [3.0, 3.0]]):
        spread.add(np.empty(0))
        assert [spread.count, spread.kept, spread.least, spread.most, spread.mean, spread.median,
                spread.part_above(3.0), spread.at(0.2, 0.7)] == expected
        spread.add(np.array([3.0]))
