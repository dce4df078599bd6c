# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math
import random
import warnings

from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py import BufferCore, deskew, lookup_twist_many
from tf_tree_py.core import (
    InvalidArgumentException,
    Kind,
    PastExtrapolationException,
    Pose,
    UNLIMITED,
)
from tf_tree_py.core.times import checked_stamp, checked_stamps

SECOND = 1_000_000_000
SOME = 1_700_000_000_123_456_789
STAMPS = st.integers(-2**63, 2**63 - 1)


# --- datetimes


@given(st.sampled_from(['h', 'm', 's', 'ms', 'us', 'ns', '25s', '7us']),
       st.integers(-10**5, 10**5))
def test_datetimes_of_any_unit_are_exact(unit, count):
    moment = np.datetime64(count, unit)
    expected = int(moment.astype('datetime64[ns]').astype(np.int64))
    assert checked_stamp(moment) == expected
    assert checked_stamps(np.array([moment, moment])).tolist() == [expected] * 2


def test_datetimes_of_months_are_exact():
    assert checked_stamp(np.datetime64('2024-03')) == 1_709_251_200 * SECOND
    assert checked_stamp(np.datetime64('1970')) == 0
    assert checked_stamp(np.datetime64(5_000, 'ps')) == 5
    assert checked_stamp(np.datetime64(-1_000, 'ps')) == -1


@pytest.mark.parametrize(('moment', 'match'), [
    (np.datetime64('NaT', 'ns'), r'stamps\[0\] is NaT'),
    (np.datetime64('3000-01-01', 's'), 'end in 2262'),
    (np.datetime64('-5000', 'Y'), 'end in 2262'),
    (np.datetime64(5_001, 'ps'), 'lie between two'),
])
def test_datetimes_that_are_no_stamps_are_refused(moment, match):
    with pytest.raises(InvalidArgumentException, match=match):
        checked_stamp(moment)
    with pytest.raises(InvalidArgumentException, match=match):
        checked_stamps(np.array([moment]))


def test_first_missing_time_is_named():
    with pytest.raises(InvalidArgumentException, match=r'stamps\[1\] is NaT'):
        checked_stamps(np.array([1, 'NaT', 'NaT'], 'M8[ns]'))


# --- integers


@given(st.lists(STAMPS))
def test_integers_are_taken_as_they_are(stamps):
    assert checked_stamps(stamps).tolist() == stamps
    assert checked_stamps(np.array(stamps, dtype=object)).tolist() == stamps


@pytest.mark.parametrize(('stamps', 'match'), [
    ([2**63], '64 bits'), (np.array([5, 2**64 - 1], np.uint64), '64 bits'),
    ([2**70], '64 bits'), ([-2**63 - 1], '64 bits|float64'),
    ([1.0], 'not float64'), ([True], 'not bool'), ([[1]], r'shape \(1, 1\)'), (1, r'shape \(\)'),
    ([None], 'stamp None'), (['1'], 'not <U1'),
    (np.ma.masked_array([1, 2], mask=[False, True]), 'masked: pass stamps.compressed'),
])
def test_what_is_no_row_of_stamps_is_refused(stamps, match):
    with pytest.raises(InvalidArgumentException, match=match):
        checked_stamps(stamps)


def test_nothing_is_no_stamps():
    for nothing in ([], np.array([], 'M8'), np.array([], 'M8[s]'), np.array([], object)):
        assert checked_stamps(nothing).shape == (0,)


# --- everywhere


@pytest.fixture
def track():
    buffer = BufferCore()
    for second in range(3):
        buffer.insert('map', 'base', SOME + second * SECOND, Pose(float(second)))
    return buffer


def test_datetimes_are_stamps_wherever_stamps_are(track):
    moments = np.array([SOME + SECOND // 2, SOME + SECOND], 'M8[ns]')
    rough = moments.astype('M8[us]')
    floored = rough.astype('M8[ns]').astype(np.int64)
    assert track.lookup('map', 'base', moments[1]) == Pose(1.0)
    assert track.lookup_stamped('map', 'base', moments[1])[0] == SOME + SECOND
    assert track.lookup_full('map', moments[0], 'base', moments[1], 'map') == Pose(1.0)
    assert track.lookup_tree('map', moments[1])['base'] == Pose(1.0)
    assert track.frames_between('map', 'base', moments[1]) == ['base', 'map']
    assert track.edges_between('map', 'base', moments[1]) == track.edges()
    assert track.lookup_many('map', 'base', rough).tolist() == track.lookup_many(
        'map', 'base', floored).tolist()
    assert lookup_twist_many(track, 'base', 'map', rough, SECOND).tolist() == lookup_twist_many(
        track, 'base', 'map', floored, SECOND).tolist()
    points = deskew(track, np.zeros((2, 3)), moments, 'map', 'base', moments[0], 'map')
    assert points[:, 0] == pytest.approx([0.5, 1.0])
    track.insert('map', 'base', np.datetime64(SOME + 3 * SECOND, 'ns'), Pose(9.0))
    assert track.latest_common_time('map', 'base') == SOME + 3 * SECOND


def test_what_pandas_has_is_taken_as_stamps(track):
    pandas = pytest.importorskip('pandas')
    index = pandas.to_datetime([SOME, SOME + SECOND])
    for moments in (index, index.to_series(), pandas.Series(index, index=[7, 9]), list(index),
                    index.tz_localize('UTC').tz_convert('Asia/Tokyo'),
                    pandas.Series(index.tz_localize('UTC'))):
        assert track.lookup_many('map', 'base', moments)[:, 0].tolist() == [0.0, 1.0]
    assert track.lookup('map', 'base', index[1]) == Pose(1.0)
    assert track.lookup('map', 'base', index[1].tz_localize('UTC')) == Pose(1.0)
    assert checked_stamp(index[0].as_unit('s')) == SOME // SECOND * SECOND
    assert checked_stamps(index.as_unit('us')).tolist() == [
        SOME // 1000 * 1000, (SOME + SECOND) // 1000 * 1000]
    for missing in (pandas.to_datetime(['2020', None]), [index[0], pandas.NaT]):
        with pytest.raises(InvalidArgumentException, match='NaT'):
            track.lookup_many('map', 'base', missing)
    with pytest.raises(InvalidArgumentException, match='NaT'):
        track.lookup('map', 'base', pandas.NaT)


# --- the window


def test_unlimited_window_never_forgets():
    buffer = BufferCore(cache_time=UNLIMITED)
    rng = random.Random(8)
    ends = [-2**63, 2**63 - 1]
    stamps = ends + [rng.randrange(-2**63, 2**63) for _ in range(300)]
    for stamp in stamps:
        assert not buffer.insert('map', 'base', stamp, Pose(stamp / 2**63))
    assert buffer.edges()[0].samples == len(stamps)
    asked = sorted(stamps)
    poses = buffer.lookup_many('map', 'base', asked)
    assert poses[:, 0] == pytest.approx(np.array(asked) / 2**63)
    assert buffer.lookup('map', 'base', ends[0]).x == -1.0


def test_who_lost_the_past_is_told_how_to_keep_it():
    buffer = BufferCore()
    for second in range(60):
        buffer.insert('map', 'base', (100 + second) * SECOND, Pose())
    with pytest.raises(PastExtrapolationException, match='UNLIMITED keeps everything'):
        buffer.lookup('map', 'base', 100 * SECOND)
    told, = buffer.insert('map', 'base', 100 * SECOND, Pose())
    assert told.kind is Kind.OLD_DATA


@pytest.mark.parametrize('seconds', [10.0, 0.5, math.inf, '10', None])
def test_window_of_anything_but_nanoseconds_is_told(seconds):
    if seconds is None:
        assert BufferCore(seconds).cache_time == 10 * SECOND
        return
    with pytest.raises(InvalidArgumentException, match=r'cache_time .* integer nanoseconds.*'
                                                       r'from_seconds\(.*UNLIMITED'):
        BufferCore(seconds)


def test_window_of_a_few_nanoseconds_is_told():
    with pytest.warns(UserWarning, match=r'cache_time=10 keeps only 10 ns.*seconds\(10\)'):
        BufferCore(10)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        for fine in (0, 1_000_000, np.int64(SECOND), UNLIMITED):
            assert BufferCore(fine).cache_time == fine
