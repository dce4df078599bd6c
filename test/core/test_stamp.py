# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math

from hypothesis import given, strategies as st
from hypothesis.extra import numpy as npst
import numpy as np
import pytest
from tf_tree_py.core import stamp


@given(st.integers(-10 ** 15, 10 ** 15))
def test_seconds_are_those_of_the_nanoseconds(nanoseconds):
    # A float of a million seconds still resolves nanoseconds.
    assert stamp.from_seconds(stamp.as_seconds(nanoseconds)) == nanoseconds


def test_seconds_become_the_nearest_nanosecond():
    assert stamp.from_seconds(0.1) == 100_000_000
    assert stamp.from_seconds(-1.5e-9) == -2
    assert type(stamp.from_seconds(1.0)) is int


@pytest.mark.parametrize(('nanoseconds', 'text'), [
    (0, '0.000000000'), (40, '0.000000040'), (12_000_000_040, '12.000000040'),
    (-1, '-0.000000001'), (-1_500_000_000, '-1.500000000'),
    (1_700_000_000_123_456_789, '1700000000.123456789'),
])
def test_stamp_is_written_exactly(nanoseconds, text):
    assert stamp.format_stamp(nanoseconds) == text


@pytest.mark.parametrize(('nanoseconds', 'text'), [
    (0, '0 ns'), (999, '999 ns'), (1_000, '1 us'), (1_500, '1.5 us'), (40_000_000, '40 ms'),
    (999_999, '1000 us'), (999_999_999, '1000 ms'), (1_000_000_000, '1.000 s'),
    (10_250_000_000, '10.250 s'), (-40_000_000, '-40 ms'), (-3, '-3 ns'),
])
def test_span_is_written_in_the_unit_of_its_size(nanoseconds, text):
    assert stamp.format_span(nanoseconds) == text


@given(npst.arrays(np.float64, npst.array_shapes(max_dims=3, min_side=0), elements=st.floats(
    -9e9, 9e9)))
def test_arrays_of_seconds_become_what_each_number_does(seconds):
    nanoseconds = stamp.from_seconds(seconds)
    assert nanoseconds.shape == seconds.shape
    assert nanoseconds.dtype == np.int64
    assert nanoseconds.ravel().tolist() == [stamp.from_seconds(s) for s in seconds.ravel()]


def test_whole_seconds_stay_exact_in_an_array():
    assert stamp.from_seconds(np.array([1_700_000_001, -7])).tolist() == [
        1_700_000_001_000_000_000, -7_000_000_000]
    assert stamp.from_seconds([0.25, 1]).tolist() == [250_000_000, 1_000_000_000]
    assert stamp.from_seconds(np.array(0.5)) == 500_000_000
    assert type(stamp.from_seconds(np.float64(0.5))) is int


@pytest.mark.parametrize(('seconds', 'match'), [
    ([0.0, math.nan], r'seconds\[1\] is nan'), ([[math.inf]], r'seconds\[0, 0\] is inf'),
    ([1e10], r'seconds\[0\] is 1\d*\.0, which is no'),
    (np.array([2**62]), r'seconds\[0\] is 4611'),
    (['now'], 'seconds are numbers, not <U3'), (np.array(['2020'], 'M8[s]'), 'not datetime64'),
])
def test_what_is_no_number_of_seconds_is_named(seconds, match):
    with pytest.raises(ValueError, match=match):
        stamp.from_seconds(seconds)
