from hypothesis import given, strategies as st
import pytest
from tf_tree_py.core import stamp


@given(st.integers(-10 ** 15, 10 ** 15))
def test_seconds_are_those_of_the_nanoseconds(nanoseconds):
    # A float of a million seconds still tells nanoseconds apart.
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
