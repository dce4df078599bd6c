# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limits of stamps and spans: the last value that is good, and the first that is not."""

from datetime import datetime, timezone
import math
import sys
import warnings

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.core import InvalidArgumentException, stamp
from tf_tree_py.core.errors import ArgumentTypeException
from tf_tree_py.core.times import checked_cache_time, checked_stamp, checked_stamps

SECOND = 1_000_000_000
LARGEST = 2 ** 63 - 1

NANOSECONDS = {'ns': 1, '2ns': 2, 'us': 1_000, '25us': 25_000, 'ms': 1_000_000, 's': SECOND,
               'm': 60 * SECOND, 'h': 3_600 * SECOND, 'D': 86_400 * SECOND, 'W': 604_800 * SECOND}


# --- stamps


def test_stamps_have_64_bits():
    for good in (-2 ** 63, -1, 0, LARGEST, np.int64(5), np.uint64(LARGEST)):
        assert checked_stamp(good) == good
        assert type(checked_stamp(good)) is int
    for bad in (-2 ** 63 - 1, 2 ** 63, np.uint64(2 ** 63)):
        with pytest.raises(InvalidArgumentException, match=f'^Invalid argument stamp {bad}: nano'):
            checked_stamp(bad)
    assert checked_stamps(np.array([0, LARGEST], np.uint64)).tolist() == [0, LARGEST]
    with pytest.raises(InvalidArgumentException, match=f'stamp {2 ** 63}: nanoseconds must fit'):
        checked_stamps(np.array([0, 2 ** 63], np.uint64))
    assert (stamp.BEGINNING, stamp.FOREVER, stamp.LATEST) == (-2 ** 63, 2 ** 63, 0)
    assert stamp.UNLIMITED == 2 ** 64


@for_each(unit=NANOSECONDS)
def test_times_of_each_unit_reach_as_far_as_64_bits_of_nanoseconds(unit):
    size, dtype = NANOSECONDS[unit], f'M8[{unit}]'
    last = LARGEST // size
    numbers = np.array([-last, 0, 7, last])
    assert checked_stamps(numbers.astype(dtype)).tolist() == [size * n for n in numbers.tolist()]
    assert checked_stamp(np.datetime64(last, unit)) == size * last
    if size == 1:  # the next one does not fit, and the one before is NaT
        return
    for far in ([last + 1, 0], [0, -last - 1]):
        with pytest.raises(InvalidArgumentException, match='which end in 2262: some datetime64'):
            checked_stamps(np.array(far).astype(dtype))


def test_months_and_years_begin_on_their_first_day():
    moments = np.array(['1971-03', '1969-12'], 'M8[M]')
    expected = [int(datetime(*month, 1, tzinfo=timezone.utc).timestamp()) * SECOND
                for month in ((1971, 3), (1969, 12))]
    assert checked_stamps(moments).tolist() == expected
    years = np.array([0, 2], 'M8[10Y]')
    assert checked_stamps(years).tolist() == [
        0, int(datetime(1990, 1, 1, tzinfo=timezone.utc).timestamp()) * SECOND]


@pytest.mark.parametrize(('unit', 'per_nanosecond'), [('ps', 10**3), ('fs', 10**6), ('as', 10**9)])
def test_finer_times_are_whole_nanoseconds(unit, per_nanosecond):
    whole = np.array([-2 * per_nanosecond, 0, 3 * per_nanosecond])
    assert checked_stamps(whole.astype(f'M8[{unit}]')).tolist() == [-2, 0, 3]
    assert checked_stamps(whole.astype(f'M8[7{unit}]')).tolist() == [-14, 0, 21]
    assert checked_stamps(whole.astype(f'M8[7{unit}]')).dtype == np.int64
    with pytest.raises(InvalidArgumentException, match='some datetime64.* lie between two: round'):
        checked_stamps((whole + [0, 1, 0]).astype(f'M8[{unit}]'))


def test_datetimes_are_exact_to_the_microsecond():
    for seconds, micro in ((0, 0), (0, 1), (-1, 1), (1_700_000_000, 999_999)):
        moment = datetime.fromtimestamp(seconds, timezone.utc).replace(microsecond=micro)
        assert checked_stamp(moment) == seconds * SECOND + micro * 1000


def test_no_stamps_are_an_empty_array_of_integers():
    for kind in (int, float, np.uint64, bool, object, 'U3', 'M8', 'M8[us]', 'M8[M]', 'm8[s]'):
        empty = checked_stamps(np.array([], kind))
        assert (empty.shape, empty.dtype) == ((0,), np.int64)
    for shape in ((0, 2), (2, 0)):
        with pytest.raises(InvalidArgumentException, match=r'of shape \(N,\), not of shape'):
            checked_stamps(np.zeros(shape, int))


def test_elements_of_other_types_are_converted_by_the_given_function():
    assert checked_stamps(np.array(['a', 'bcd'], object), len).tolist() == [1, 3]
    assert checked_stamps([np.datetime64(5, 'ns'), 7, datetime(1970, 1, 1, tzinfo=timezone.utc)]
                          ).tolist() == [5, 7, 0]


@pytest.mark.parametrize(('stamps', 'sentence'), [
    ([5.0, math.nan, 7.0, math.nan], 'stamps are integers with missing values: 2 of 4 are NaN, '
     "which turned them into float64, which cannot hold nanoseconds. Read the column as 'Int64' "
     "(pandas), drop the gaps, and convert it to 'int64'"),
    (np.array([5.0, math.nan], np.float32), 'stamps are integers with missing values: 1 of 2 are '
     'NaN, which turned them into float32, which cannot hold nanoseconds. Read the column as '
     "'Int64' (pandas), drop the gaps, and convert it to 'int64'"),
    *[(floats, 'stamps are integer nanoseconds, not float64: a float64 of seconds would be off by '
       '200 ns. Use the .nanoseconds of a Time of rclpy, a sec * 10**9 + nanosec, or '
       'tf_tree_py.from_seconds')
      for floats in ([5.0, 7.0], [math.nan, math.nan], [5.0, 7.5, math.nan], [5.5, math.nan])],
], ids=range(6))
def test_floats_are_seconds_unless_they_are_integers_with_gaps(stamps, sentence):
    with pytest.raises(ArgumentTypeException) as raised:
        checked_stamps(stamps)
    assert str(raised.value) == sentence


# --- the window


@pytest.mark.parametrize(('window', 'warned'), [
    (0, False), (1, True), (2, True), (999_999, True), (1_000_000, False), (2 ** 64, False)])
def test_window_shorter_than_a_millisecond_is_warned_of(window, warned):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        assert checked_cache_time(window) == window
    assert [str(each.message) for each in caught] == [
        f'cache_time={window} keeps only {stamp.format_span(window)} of history, because it is in '
        f'nanoseconds. If you mean {window} s, pass tf_tree_py.from_seconds({window})'] * warned


def test_window_cannot_be_negative():
    with pytest.raises(ValueError, match='^cache_time is -1 ns, and cannot be negative$'):
        checked_cache_time(-1)


# --- seconds


def test_seconds_reach_as_far_as_stamps():
    first = -2 ** 63 / 1e9
    last = float(np.nextafter(2 ** 63 / 1e9, 0.0))
    assert first * 1e9 == -2 ** 63
    for seconds in (first, last, -first - 2e-6 - 2.0, 9_223_372_036, -9_223_372_036):
        assert stamp.from_seconds(seconds) == round(seconds * SECOND)
        assert stamp.from_seconds([0.0, seconds]).tolist() == [0, round(seconds * SECOND)]
        assert stamp.from_seconds(np.array(seconds)) == round(seconds * SECOND)
    for seconds in (-first, 9_223_372_037, -9_223_372_037, float(np.nextafter(first, -math.inf))):
        with pytest.raises(ValueError, match='do not fit into 64 bits of nanoseconds'):
            stamp.from_seconds(seconds)
        with pytest.raises(ValueError, match=r'^seconds\[1\] is -?9\d*\.?\d*, which is not a st'):
            stamp.from_seconds([0.0, seconds, seconds])


def test_first_wrong_number_of_seconds_is_named():
    with pytest.raises(ValueError, match=r'^seconds\[1, 0\] is nan, which is not a stamp'):
        stamp.from_seconds([[0.0, 1.0], [math.nan, 2.0], [3.0, math.inf]])


@pytest.mark.parametrize(('seconds', 'begin'), [
    (sys.float_info.max, '1.79769e+308 seconds do not fit'),
    (-sys.float_info.max, '-1.79769e+308 seconds do not fit'),
    (int(sys.float_info.max), '1.79769e+308 seconds do not fit'),
    (2 * int(sys.float_info.max), 'That many seconds do not fit'),
    (math.inf, 'inf seconds are not a time'), (-math.inf, '-inf seconds are not a time'),
    ('1', "seconds must be a number, and '1' is a str"),
], ids=range(7))
def test_number_of_seconds_that_is_no_stamp_is_written_if_it_can_be(seconds, begin):
    with pytest.raises(ValueError) as raised:
        stamp.from_seconds(seconds)
    assert str(raised.value).startswith(begin)


def test_number_of_seconds_is_an_int_or_an_array_of_64_bits():
    assert stamp.from_seconds(True) == SECOND
    assert type(stamp.from_seconds(np.array(2))) is int
    for array in ([1, 2], [1.0, 2.0], np.array([1, 2.0], object), np.array([1, 2], np.uint8)):
        nanoseconds = stamp.from_seconds(array)
        assert nanoseconds.tolist() == [SECOND, 2 * SECOND]
        assert nanoseconds.dtype == np.int64


# --- other units


@for_each(unit=[('seconds', SECOND, 'tf_tree_py.from_seconds({})'),
                ('milliseconds', 10**6, '{} * 1_000_000'), ('microseconds', 10**3, '{} * 1_000')])
def test_stamp_fits_in_another_unit_up_to_one_unit_beside_the_span(unit):
    name, size, cure = unit
    oldest, latest = 500 * SECOND + size // 2, 503 * SECOND + size // 2
    for number in (oldest // size, oldest // size + 1, latest // size, latest // size + 1):
        assert stamp.unit_that_fits(number, oldest, latest) == (
            f'Stamps are nanoseconds, and {number} would fit if it were {name}: '
            + cure.format(number))
    for number in (oldest // size - 1, latest // size + 2):
        assert stamp.unit_that_fits(number, oldest, latest) == ''
    # Whole units beside the span do not fit.
    assert stamp.unit_that_fits(500, 501 * SECOND, 503 * SECOND) == ''
    assert stamp.unit_that_fits(504, 501 * SECOND, 503 * SECOND) == ''


def test_zero_fits_in_no_unit():
    assert stamp.unit_that_fits(0, -SECOND, SECOND) == ''
    assert stamp.unit_that_fits(1, -SECOND, SECOND).endswith('seconds: tf_tree_py.from_seconds(1)')


# --- text


@pytest.mark.parametrize(('nanoseconds', 'text'), [
    (999, '999 ns'), (1_000, '1 us'), (-1_000, '-1 us'), (999_999, '1000 us'),
    (1_000_000, '1 ms'), (2_345_678, '2.346 ms'), (SECOND - 1, '1000 ms'), (SECOND, '1.000 s'),
    (-SECOND, '-1.000 s'), (90 * SECOND, '90.000 s')])
def test_unit_of_a_span_changes_at_a_thousand(nanoseconds, text):
    assert stamp.format_span(nanoseconds) == text


# --- the rule of silence


def test_usual_interval_is_the_span_over_the_steps():
    for samples, interval in ((0, 60.0), (1, 60.0), (2, 60.0), (3, 30.0), (4, 20.0)):
        assert stamp.mean_interval(60, samples) == interval


@pytest.mark.parametrize(('interval', 'silent_s', 'dead_s'), [
    (0, 3.0, 10.0),                     # only one sample is known: as if one came every second
    (SECOND // 100, 1.0, 5.0),
    (SECOND // 2, 1.5, 5.0),
    (2 * SECOND, 6.0, 20.0),
])
def test_edge_is_silent_after_three_intervals_and_dead_after_ten(interval, silent_s, dead_s):
    silence, death = round(silent_s * SECOND), round(dead_s * SECOND)
    assert stamp.silence_allowed(interval) == silence
    assert not stamp.is_silent(silence, interval)
    assert stamp.is_silent(silence + 1, interval)
    assert not stamp.is_dead(death, interval)
    assert stamp.is_dead(death + 1, interval)


def test_clocks_differ_from_thirty_seconds_on():
    assert stamp.ANOTHER_CLOCK == 30 * SECOND
