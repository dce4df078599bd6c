# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Checking callers' stamps and spans, and converting them to integer nanoseconds.

Integers are used as they are. ``datetime64`` of any unit, and the Timestamps and indexes of
pandas, count from 1970 in UTC and are converted exactly. pandas is not imported: its objects
have a method that converts them to ``datetime64``. Pure functions: no state, any thread.
"""

from collections.abc import Callable, Sequence
from datetime import datetime, timedelta, timezone
import operator
from typing import Any, SupportsIndex, TypeAlias

import numpy as np
import numpy.typing as npt

from .errors import ArgumentTypeException, InvalidArgumentException, warn
from .stamp import BEGINNING, FOREVER, format_span

Stamps = npt.NDArray[np.int64]  # (N,), nanoseconds
Mask = npt.NDArray[np.bool_]  # (N,), which of N things
Indices = npt.NDArray[np.intp]  # (N,), where in an array

Stamp: TypeAlias = SupportsIndex | np.datetime64 | datetime
"""One stamp of a caller: an integer, also numpy's; a ``datetime64``; a ``datetime`` with its zone,
such as a Timestamp of pandas."""

StampsLike: TypeAlias = npt.ArrayLike | Sequence[Stamp]
"""Many stamps of a caller: an array, an index or a column of pandas, or a list of ``Stamp``."""

# Nanoseconds in each of numpy's units of time, and the finer units.
_UNITS = {'ns': 1, 'us': 10**3, 'ms': 10**6, 's': 10**9, 'm': 60 * 10**9, 'h': 3600 * 10**9,
          'D': 86_400 * 10**9, 'W': 7 * 86_400 * 10**9}
_FINER = {'ps': 10**3, 'fs': 10**6, 'as': 10**9}

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)

# A shorter window is probably given in another unit.
_SHORT_WINDOW = 1_000_000

_HOW = ('Use the .nanoseconds of a Time of rclpy, a sec * 10**9 + nanosec, or '
        'tf_tree_py.from_seconds')


def checked_stamp(stamp: Any) -> int:
    """
    Return a caller's stamp as a plain int.

    :param stamp: an integer, a ``datetime64``, a Timestamp of pandas, or a ``datetime`` with
        its time zone.
    :raises ArgumentTypeException: another type, most likely float seconds.
    :raises InvalidArgumentException: not a time (NaT), or one that does not fit into 64 bits.
    """
    try:
        checked = operator.index(stamp)
    except TypeError:
        return _from_datetime(stamp)
    if BEGINNING <= checked < FOREVER:
        return checked
    raise InvalidArgumentException(
        f'Invalid argument stamp {stamp}: nanoseconds must fit into 64 bits, with a sign')


def _from_datetime(stamp: object) -> int:
    if hasattr(stamp, 'to_datetime64'):
        stamp = stamp.to_datetime64()
    if isinstance(stamp, np.datetime64):
        return int(_from_datetimes(np.array([stamp]))[0])
    if isinstance(stamp, datetime):
        if stamp.tzinfo is None:
            raise ArgumentTypeException(
                f'Invalid argument stamp {stamp!r}: a datetime without a time zone is ambiguous. '
                'If it is UTC, pass stamp.replace(tzinfo=datetime.timezone.utc); if it is the '
                'local time of this machine, stamp.astimezone()')
        return (stamp - _EPOCH) // timedelta(microseconds=1) * 1000
    raise ArgumentTypeException(
        f'Invalid argument stamp {stamp!r}: stamps are integer nanoseconds, such as .nanoseconds '
        'of a Time of rclpy; tf_tree_py.from_seconds converts seconds')


def checked_stamps(stamps: StampsLike,
                   one: Callable[[object], int] = checked_stamp) -> Stamps:
    """
    Return a caller's stamps as an array (N,) of 64-bit integers.

    :param stamps: (N,) integers, ``datetime64``, or an index or a column of such times
        of pandas.
    :param one: converts an element of any other type to a stamp.
    :raises InvalidArgumentException: another shape, an element that is not a time, or a mask.
    """
    if np.ma.is_masked(stamps):
        raise InvalidArgumentException(
            'some stamps are masked: pass stamps.compressed(), and look up only those')
    array = np.asarray(stamps)
    if array.ndim != 1:
        raise InvalidArgumentException(
            f'stamps must be integer nanoseconds of shape (N,), not of shape {array.shape}')
    if not len(array):
        return np.zeros(0, np.int64)
    if array.dtype.kind == 'M':
        return _from_datetimes(array)
    if array.dtype.kind == 'O':  # times with a time zone, for one
        array = np.array([one(stamp) for stamp in array], dtype=object)
    elif array.dtype.kind not in 'iu':
        raise ArgumentTypeException(_gap(array) or (
            f'stamps are integer nanoseconds, not {array.dtype}: a float64 of seconds would be '
            f'off by 200 ns. {_HOW}'))
    if array.dtype.kind == 'u':
        checked_stamp(array.max())
    return array.astype(np.int64)


def _gap(array: npt.NDArray[np.generic]) -> str:
    """Return a sentence if an array was one of integers before some went missing, else ''."""
    if array.dtype.kind != 'f':
        return ''
    given = array[~np.isnan(array)]
    missing = len(array) - len(given)
    if not 0 < missing < len(array) or (given != np.rint(given)).any():
        return ''
    return (f'stamps are integers with missing values: {missing} of {len(array)} are '
            f'NaN, which turned them into {array.dtype}, which cannot hold nanoseconds. Read the '
            "column as 'Int64' (pandas), drop the gaps, and convert it to 'int64'")


def _from_datetimes(array: npt.NDArray[np.datetime64]) -> Stamps:
    """
    Return times (N,) as nanoseconds since 1970, exactly.

    :raises InvalidArgumentException: some are NaT, too far from 1970 for 64 bits, or not whole
        nanoseconds.
    """
    missing = np.isnat(array)
    if missing.any():
        raise InvalidArgumentException(
            f'stamps[{int(np.argmax(missing))}] is NaT, not a time: drop it, or fill it in')
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
                "them, for example with .astype('datetime64[ns]')")
        return np.array([stamp for stamp, _ in exact], dtype=np.int64)
    factor = _UNITS[unit] * count
    largest = (FOREVER - 1) // factor
    if not -largest <= numbers.min() <= numbers.max() <= largest:
        raise InvalidArgumentException(
            f'stamps are nanoseconds since 1970 in 64 bits, which end in 2262: some {array.dtype} '
            'are further away')
    return numbers * factor


def checked_cache_time(cache_time: SupportsIndex) -> int:
    """
    Return how much history to keep, nanoseconds.

    Warns about a window shorter than a millisecond, which is probably given in another unit.

    :raises ArgumentTypeException: not an integer.
    :raises ValueError: negative.
    """
    try:
        span = operator.index(cache_time)
    except TypeError:
        raise ArgumentTypeException(
            f'Invalid argument cache_time {cache_time!r}: it must be integer nanoseconds. If it '
            f'is in seconds, pass tf_tree_py.from_seconds({cache_time!r}); UNLIMITED keeps '
            'everything') from None
    if span < 0:
        raise ValueError(f'cache_time is {span} ns, and cannot be negative')
    if 0 < span < _SHORT_WINDOW:
        warn(f'cache_time={span} keeps only {format_span(span)} of history, because it is in '
             f'nanoseconds. If you mean {span} s, pass tf_tree_py.from_seconds({span})')
    return span
