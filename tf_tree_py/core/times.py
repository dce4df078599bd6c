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

"""
What callers give as stamps and spans, checked and turned into integer nanoseconds.

Integers are taken as they are; ``datetime64`` of any unit, and the Timestamps and
indexes of pandas, count from 1970 in UTC and are converted exactly. pandas is not
imported: its objects say themselves what they are as ``datetime64``.
"""

from collections.abc import Callable
import operator
from typing import Any
import warnings

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentException
from .stamp import BEGINNING, FOREVER, format_span

Stamps = npt.NDArray[np.int64]

# Nanoseconds in each unit that numpy counts times in, and those that are finer.
_UNITS = {'ns': 1, 'us': 10**3, 'ms': 10**6, 's': 10**9, 'm': 60 * 10**9, 'h': 3600 * 10**9,
          'D': 86_400 * 10**9, 'W': 7 * 86_400 * 10**9}
_FINER = {'ps': 10**3, 'fs': 10**6, 'as': 10**9}

# A window shorter than this was meant in other units.
_SHORT_WINDOW = 1_000_000

_HOW = ('Use the .nanoseconds of a Time of rclpy, a sec * 10**9 + nanosec, or '
        'tf_tree_py.core.stamp.from_seconds')


def checked_stamp(stamp: Any) -> int:
    """
    Return a caller's stamp as a plain int.

    :param stamp: an integer, a ``datetime64``, or a Timestamp of pandas.
    :raises InvalidArgumentException: another type (float seconds, most likely), no time
        (NaT), or a stamp that does not fit into 64 bits.
    """
    try:
        checked = operator.index(stamp)
    except TypeError:
        return _from_datetime(stamp)
    if BEGINNING <= checked < FOREVER:
        return checked
    raise InvalidArgumentException(
        f'Invalid argument stamp {stamp}: nanoseconds have to fit into 64 bits, with a sign')


def _from_datetime(stamp: Any) -> int:
    if hasattr(stamp, 'to_datetime64'):
        stamp = stamp.to_datetime64()
    if isinstance(stamp, np.datetime64):
        return int(_from_datetimes(np.array([stamp]))[0])
    raise InvalidArgumentException(
        f'Invalid argument stamp {stamp!r}: stamps are integer nanoseconds, which a Time of '
        'rclpy has as .nanoseconds, and tf_tree_py.core.stamp.from_seconds makes of seconds')


def checked_stamps(stamps: npt.ArrayLike,
                   one: Callable[[Any], int] = checked_stamp) -> Stamps:
    """
    Return a caller's stamps as an array (N,) of 64-bit integers.

    :param stamps: (N,) integers, ``datetime64``, or an index or a column of such times
        of pandas.
    :param one: makes a stamp of anything else that may be in there.
    :raises InvalidArgumentException: another shape, what is no time, or a masked one.
    """
    if np.ma.is_masked(stamps):
        raise InvalidArgumentException(
            'some stamps are masked: pass stamps.compressed(), and look up only those')
    array = np.asarray(stamps)
    if array.ndim != 1:
        raise InvalidArgumentException(
            f'stamps are one row (N,) of integer nanoseconds, not of the shape {array.shape}')
    if array.dtype.kind == 'M':
        return _from_datetimes(array)
    if array.dtype.kind == 'O':  # times with a time zone, for one
        array = np.array([one(stamp) for stamp in array], dtype=object)
    elif array.dtype.kind not in 'iu' and len(array):
        raise InvalidArgumentException(
            f'stamps are integer nanoseconds, not {array.dtype}: a float64 of seconds would be '
            f'off by 200 ns. {_HOW}')
    if array.dtype.kind == 'u' and len(array):
        checked_stamp(array.max())
    return array.astype(np.int64)


def without_mask(stamps: npt.ArrayLike) -> tuple[npt.ArrayLike, npt.NDArray[np.bool_] | None]:
    """Return stamps, zero where masked, and which are not masked; None if there is no mask."""
    if not isinstance(stamps, np.ma.MaskedArray):
        return stamps, None
    masked, data = np.ma.getmaskarray(stamps), np.ma.getdata(stamps)
    return np.where(masked, np.zeros_like(data), data), ~masked


def _from_datetimes(array: npt.NDArray[Any]) -> Stamps:
    """
    Return times (N,) as nanoseconds since 1970, exactly.

    :raises InvalidArgumentException: some are NaT, too far from 1970 for 64 bits, or lie
        between two nanoseconds.
    """
    missing = np.isnat(array)
    if missing.any():
        raise InvalidArgumentException(
            f'stamps[{int(np.argmax(missing))}] is NaT, no time: drop it, or fill it in')
    unit, count = np.datetime_data(array.dtype)
    if unit in ('Y', 'M'):  # of unequal lengths
        array = array.astype('datetime64[D]')
        unit, count = 'D', 1
    numbers = array.astype(np.int64)
    if unit in _FINER:
        exact = [divmod(number * count, _FINER[unit]) for number in numbers.tolist()]
        if any(rest for _, rest in exact):
            raise InvalidArgumentException(
                f'stamps are whole nanoseconds, and some {array.dtype} lie between two: round '
                "them, for instance with .astype('datetime64[ns]')")
        return np.array([stamp for stamp, _ in exact], dtype=np.int64)
    factor = _UNITS.get(unit, 1) * count  # an empty array may have no unit
    largest = (FOREVER - 1) // factor
    if len(numbers) and not -largest <= numbers.min() <= numbers.max() <= largest:
        raise InvalidArgumentException(
            f'stamps are nanoseconds since 1970 in 64 bits, which end in 2262: some {array.dtype} '
            'are further away')
    return numbers * factor


def checked_cache_time(cache_time: Any) -> int:
    """
    Return how much history to keep, nanoseconds.

    Warns of a window shorter than a millisecond, which was meant in other units.

    :raises InvalidArgumentException: no integer.
    :raises ValueError: negative.
    """
    try:
        span = operator.index(cache_time)
    except TypeError:
        raise InvalidArgumentException(
            f'Invalid argument cache_time {cache_time!r}: it is integer nanoseconds. Of seconds, '
            f'tf_tree_py.core.stamp.from_seconds({cache_time!r}) makes them; UNLIMITED keeps '
            'everything') from None
    if span < 0:
        raise ValueError(f'cache_time is {span} ns, and cannot be negative')
    if 0 < span < _SHORT_WINDOW:
        warnings.warn(
            f'cache_time={span} keeps no more than {format_span(span)} of history, for it is '
            f'nanoseconds. If {span} s are meant: tf_tree_py.core.stamp.from_seconds({span})',
            stacklevel=3)
    return span
