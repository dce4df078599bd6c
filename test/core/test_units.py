# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps in other units, and times of other libraries: converted exactly, or refused by name."""

from datetime import datetime, timedelta, timezone
from decimal import Decimal
import warnings

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ExtrapolationException,
    from_seconds,
    LookupException,
    PastExtrapolationException,
    Pose,
    TransformWarning,
)
from tf_tree_py.core.times import checked_stamp, checked_stamps

BEGIN = 1_700_000_000 * 10**9


@pytest.fixture
def buffer():
    buffer = BufferCore()
    for stamp in range(BEGIN, BEGIN + 5 * 10**9 + 1, 10**9):
        buffer.insert('map', 'base', stamp, Pose(x=1.0))
    return buffer


@pytest.mark.parametrize(('stamp', 'meant'), [
    (1_700_000_002, r'seconds: tf_tree_py\.from_seconds\(1700000002\)'),
    (1_700_000_002_000, r'milliseconds: 1700000002000 \* 1_000_000'),
    (1_700_000_002_000_000, r'microseconds: 1700000002000000 \* 1_000'),
])
def test_stamp_that_fits_in_another_unit_says_so(buffer, stamp, meant):
    with pytest.raises(PastExtrapolationException, match=f'would fit if it were {meant}'):
        buffer.lookup('map', 'base', stamp)
    with pytest.raises(PastExtrapolationException, match=f'would fit if it were {meant}'):
        buffer.lookup_many('map', 'base', [stamp])
    with pytest.warns(TransformWarning, match=f'None of 2 stamps has an answer.*{meant}'):
        buffer.lookup_many('map', 'base', [stamp, stamp], outside='mask')


@pytest.mark.parametrize('stamp', [BEGIN - 1, BEGIN + 6 * 10**9, 5, 1_600_000_000])
def test_stamp_that_fits_in_no_unit_is_not_suspected(buffer, stamp):
    with pytest.raises(ExtrapolationException) as raised:
        buffer.lookup('map', 'base', stamp)
    assert 'would fit' not in str(raised.value)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        buffer.lookup_many('map', 'base', [stamp], outside='mask')
        buffer.lookup_many('map', 'base', [1_700_000_002, BEGIN], outside='mask')


def test_column_with_a_gap_is_not_taken_for_seconds():
    with pytest.raises(TypeError, match='integers with missing values: 1 of 3 are NaN'):
        checked_stamps(np.array([BEGIN, np.nan, BEGIN + 10**9]))
    with pytest.raises(TypeError, match='a float64 of seconds would be'):
        checked_stamps(np.array([1.25, np.nan]))


@pytest.mark.parametrize(('seconds', 'sentence'), [
    (1.7e18, 'outside the years 1678 to 2262'), (-1e10, 'outside the years'),
    (float('nan'), 'are not a time'), (float('inf'), 'are not a time'),
    ('12', "'12' is a str"), (None, 'None is a NoneType'),
    (np.float64('nan'), 'are not a time'), (['a'], 'seconds are numbers'), ([1.7e18], '64 bits'),
    (1e300, r'^1e\+300 seconds do not fit'), (np.float64(-1e300), r'^-1e\+300 seconds do not fit'),
    (np.float32(3e38), r'^3e\+38 seconds do not fit'),
    pytest.param(10**400, '^That many seconds do not fit', id='huge'),
    pytest.param(np.array(-10**5000, dtype=object), '^That many seconds do not', id='huge 0-d'),
    (2**63 / 1e9, 'do not fit'), ([0.0, 1e300], r'^seconds\[1\] is 1e\+300'),
    ([Decimal('1e400')], r'^seconds\[0\] is 1E\+400'), ([10**30], r'^seconds\[0\] is 10{30},'),
    ([1, 10**400], '64 bits of nanoseconds: int too large'),
    ([0.5, None], r'^seconds\[1\] is None'),
    ([0.5, object()], '64 bits of nanoseconds: .* not .object'),
])
@pytest.mark.filterwarnings('error::RuntimeWarning')
def test_what_is_no_number_of_seconds_is_refused_in_words(seconds, sentence):
    with pytest.raises(ValueError, match=sentence):
        from_seconds(seconds)


def test_datetime_with_a_zone_is_taken_exactly():
    zone = timezone(timedelta(hours=2))
    assert checked_stamp(datetime(2023, 11, 15, 0, 13, 20, 123457, zone)) == BEGIN + 123457000
    assert checked_stamps([datetime(2023, 11, 14, 22, 13, 20, tzinfo=timezone.utc)]) == [BEGIN]
    assert checked_stamp(datetime(1969, 12, 31, 23, 59, 59, 1, timezone.utc)) == -999_999_000


def test_datetime_without_a_zone_is_explained():
    with pytest.raises(TypeError, match='without a time zone is ambiguous'):
        checked_stamp(datetime(2023, 11, 14))


def hint_for(buffer, frame):
    with pytest.raises(LookupException) as raised:
        buffer.lookup('lamp', frame)
    return raised.value.hint


def test_frame_that_is_part_of_others_is_suggested():
    buffer = BufferCore()
    for name in ('lamp', 'front_camera_link', 'front_camera_optical_frame', 'rear_camera'):
        buffer.insert('base_of_the_robot', name, 0, Pose(), static=True)
    hint = hint_for(buffer, 'camera')
    assert "3 frames have 'camera' in their names" in hint or "Did you mean 'rear_camera'" in hint
    assert 'Known: rear_camera, front_camera_link' in hint
    hint = hint_for(buffer, 'robot')
    assert "Did you mean 'base_of_the_robot'? Known: base_of_the_robot" in hint
