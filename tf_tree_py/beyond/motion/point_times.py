# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The times at which the points of a cloud were taken.

Drivers use different field names, units and zeros for them.

Ouster: ``t``, UINT32, nanoseconds after the header's stamp. Velodyne: ``time``, FLOAT32, seconds
after (or before) it. Livox: ``offset_time``, UINT32, nanoseconds after it, or ``timestamp``,
FLOAT64, nanoseconds since 1970. Hesai, RoboSense: ``timestamp``, FLOAT64, seconds since 1970.
Arguments that the caller does not pass are inferred from these conventions.
"""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.messages.sample import message_stamp
from tf_tree_py.core.stamp import format_span, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Mask, Stamps

from .cloud_fields import field_column

FIELDS = ('t', 'time', 'timestamp', 'offset_time')

UNITS = {'s': 10**9, 'ms': 10**6, 'us': 10**3, 'ns': 1}

# The unit for times up to each limit: a scan takes milliseconds to seconds. Floats are read as
# seconds if that is possible, and integers as nanoseconds.
_FLOAT_LIMITS = (('s', 10.0), ('ms', 1e4), ('us', 1e7), ('ns', math.inf))
_INT_LIMITS = (('ms', 1e3), ('us', 1e6), ('ns', math.inf))

# A header's stamp beyond this counts from 1970; no offset is so large.
_CALENDAR = 10**6 * NANOSECONDS_PER_SECOND
# The longest time between a point and the stamp of its cloud.
_TOO_FAR = 60 * NANOSECONDS_PER_SECOND
# Steps of a floating type, nanoseconds, that cause a warning, and that are refused. During the
# first, a robot at 10 m/s drives 1 cm; the second is a tenth of the scan of most lidars. FLOAT32
# seconds reach these 4.6 and 36 hours after the start of a sensor. The steps of offsets from the
# stamp of a cloud, which are below a minute, are microseconds.
_COARSE_STEP, _COARSEST_STEP = 1_000_000, 10_000_000


class PointTimes(NamedTuple):
    """
    The times at which the points of a cloud were taken, and how they were read.

    :ivar stamps: (N,) nanoseconds, row by row; meaningless where not valid.
    :ivar valid: (N,) whether the point has a time at all.
    :ivar field: the field that was read.
    :ivar unit: 's', 'ms', 'us' or 'ns'; or the given unit in words.
    :ivar origin: the stamp, nanoseconds, of the field's zero.
    :ivar reading: one sentence with all of this, and with the assumptions.
    :ivar doubt: why the times are coarse, and what to do; '' if they are not.
    """

    stamps: Stamps
    valid: Mask
    field: str
    unit: str
    origin: int
    reading: str
    doubt: str = ''


def point_times(cloud: Any, field: str | None = None, unit: str | float | None = None,
                origin: int | None = None,
                points_valid: Mask | None = None, every: int = 1) -> PointTimes:
    """
    Return when each point of a cloud was taken.

    :param field: None for the first of t, time, timestamp and offset_time that the cloud has.
    :param unit: 's', 'ms', 'us' or 'ns'; or a number of seconds, such as the duration of a scan
        if the field holds fractions of it; None to infer it from type and range. A scan with few
        points may be too short for that: pass the unit if you know it.
    :param origin: the stamp, nanoseconds, of the field's zero: 0 if the field counts from the
        clock's own zero; None to infer whether it is that or the header's stamp.
    :param points_valid: (N,) the points from which unit and origin are inferred.
    :param every: take every second or third point, and so on, as ``points_of`` does.
    :raises InvalidArgumentException: no such field, an unknown unit, times that cannot belong
        to the cloud's stamp, or a type that is too coarse for them.
    """
    given = None if unit is None else _size_of(unit)
    name = _time_field([each.name for each in cloud.fields]) if field is None else field
    values = field_column(cloud, name).reshape(-1)[::every]
    values = values.astype(values.dtype.newbyteorder('='))
    valid = np.isfinite(values)
    known = values[valid if points_valid is None else valid & points_valid]
    stamp = message_stamp(cloud)
    first, last = (known.min().item(), known.max().item()) if len(known) else (0, 0)

    step = _step(values.dtype, max(abs(first), abs(last)))
    if given is None:
        limits = _FLOAT_LIMITS if values.dtype.kind == 'f' else _INT_LIMITS
        unit_read = _inferred_unit(first, last, step, name, stamp, limits)
        size = UNITS[unit_read]
    else:
        unit_read, size = given
    if origin is None:
        origin_read = 0 if _is_absolute(last * size, name, stamp) else stamp
    else:
        origin_read = origin
    _check_distance(name, unit_read, origin_read, first * size, last * size, step * size, stamp)
    doubt = _doubt(name, values.dtype.name, unit_read, last, step * size)
    if step * size > _COARSEST_STEP:
        raise InvalidArgumentException(doubt)
    return PointTimes(
        origin_read + _as_nanoseconds(np.where(valid, values, 0), size), valid, name, unit_read,
        origin_read, _reading(name, values.dtype.name, unit, unit_read, origin, origin_read),
        doubt)


def _size_of(unit: str | float) -> tuple[str, int]:
    """Return a unit in words, and its nanoseconds."""
    if isinstance(unit, str):
        if unit in UNITS:
            return unit, UNITS[unit]
    elif 1 <= unit * NANOSECONDS_PER_SECOND <= _TOO_FAR:
        return f'multiples of {unit:g} s', from_seconds(unit)
    raise InvalidArgumentException(
        f'unit is one of {", ".join(UNITS)}, or a number of seconds up to 60, not {unit!r}')


def _step(dtype: np.dtype[np.number], value: float) -> float:
    """Return the distance of a floating type's numbers around a value; 0 for integers."""
    return float(np.spacing(np.asarray(value, dtype))) if dtype.kind == 'f' else 0.0


def _time_field(names: Sequence[str]) -> str:
    for name in FIELDS:
        if name in names:
            return name
    raise InvalidArgumentException(
        f'The cloud has no time for each point: none of {", ".join(FIELDS)} is among its fields '
        f'({", ".join(names)}). If another field holds the times, pass its name')


def _inferred_unit(first: float, last: float, step: float, name: str, stamp: int,
                   limits: Sequence[tuple[str, float]]) -> str:
    for unit, size in UNITS.items():
        if stamp > _CALENDAR and _is_near(first * size, last * size, step * size, stamp):
            return unit
    extent = last - first if name == 'timestamp' else max(abs(first), abs(last))
    return next(unit for unit, limit in limits if extent < limit or limit == math.inf)


def _is_absolute(last: float, name: str, stamp: int) -> bool:
    """Return whether times, nanoseconds, count from the clock's zero and not from the header."""
    # If the clock has just started, both are near the stamp: then the name decides.
    return bool((stamp > _CALENDAR or name == 'timestamp') and abs(last - stamp) < abs(last))


def _is_near(first: float, last: float, step: float, stamp: int) -> bool:
    # FLOAT32 seconds since 1970 have steps of 128 s: near ones must be recognised, to be refused.
    return bool(max(abs(first - stamp), abs(last - stamp)) < _TOO_FAR + step)


def _check_distance(name: str, unit: str, origin: int, first: float, last: float, step: float,
                    stamp: int) -> None:
    if not _is_near(origin + first, origin + last, step, stamp):
        begins = format_span(int(origin + first - stamp))
        raise InvalidArgumentException(
            f'The times in the field {name!r}, read as {unit}, begin {begins} from the stamp of '
            'the cloud. If the unit is wrong, pass the right one; if the times count from another '
            'moment, such as the start of the sensor, pass the stamp of that moment as origin')


def _doubt(name: str, dtype: str, unit: str, value: float, step: float) -> str:
    if step <= _COARSE_STEP:
        return ''
    return (f'The field {name!r} is {dtype} and holds {value:.10g}, read as {unit}: around this '
            f'value, {dtype} has steps of {format_span(round(step))}, too coarse for the times of '
            'points. Let the driver write FLOAT64, or times relative to the stamp of the cloud')


def _as_nanoseconds(values: npt.NDArray[np.number], size: int) -> Stamps:
    if values.dtype.kind != 'f':
        return values.astype(np.int64) * size
    # The integer part is converted separately, so that a time since 1970 loses no digits here.
    exact = values.astype(float)
    whole = np.floor(exact)
    with np.errstate(invalid='ignore'):  # Invalid points may hold anything.
        rest = np.rint((exact - whole) * size)
        return np.asarray(whole.astype(np.int64) * size + rest.astype(np.int64))


def _reading(name: str, dtype: str, unit: str | float | None, unit_read: str, origin: int | None,
             origin_read: int) -> str:
    zero = "the clock's zero" if origin_read == 0 else "the cloud's stamp"
    if origin is not None:
        zero = f'{origin_read / 1e9:.9f} s'
    assumed = [word for word, given in (('unit', unit), ('zero', origin)) if given is None]
    note = f' (assumed: {" and ".join(assumed)})' if assumed else ''
    return f'the field {name!r} ({dtype}) holds {unit_read} from {zero}{note}'
