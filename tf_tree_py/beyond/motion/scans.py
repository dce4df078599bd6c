# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Scans of a moving sensor: their points, when each was taken, and all points at one time.

A message is an object of rclpy or of rosbags; both have the same fields.

Drivers use different field names, units and zeros for the times of points. Ouster: ``t``, UINT32,
nanoseconds after the header's stamp. Velodyne: ``time``, FLOAT32, seconds after (or before) it.
Livox: ``offset_time``, UINT32, nanoseconds after it, or ``timestamp``, FLOAT64, nanoseconds since
1970. Hesai, RoboSense: ``timestamp``, FLOAT64, seconds since 1970. Arguments that the caller does
not pass are inferred from these conventions.

A spinning lidar takes a tenth of a second for a scan. On a moving robot, it measures each
point from a different pose. ``deskew`` moves all points to one time, through a frame that does
not move meanwhile: it applies ``lookup_full`` to every point.
"""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.sample import message_stamp
from tf_tree_py.core.stamp import format_span, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Mask, Stamp, Stamps, StampsLike
from tf_tree_py.many_stamps import ManyStampQueries

POINT = ('x', 'y', 'z')

CODES = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}
"""The types of numbers by the datatype of a PointField, in numpy's notation."""


def point_count(cloud: Any) -> int:
    """Return how many points a cloud has, invalid ones included."""
    return int(cloud.height * cloud.width)


def points_of(cloud: Any, every: int = 1) -> npt.NDArray[np.floating]:
    """
    Return a copy of the coordinates, row by row.

    :param every: take every second or third point, and so on, from the first.
    :return: (N, 3), float32 or float64 as in the cloud.
    :raises InvalidArgumentException: no x, y and z of a floating type.
    """
    columns = float_columns(cloud, POINT)
    dtype = np.result_type(*(column.dtype for column in columns)).newbyteorder('=')
    return np.stack([column.reshape(-1)[::every] for column in columns], axis=1, dtype=dtype)


def write_points(cloud: Any, points: npt.NDArray[np.floating]) -> None:
    """Overwrite the coordinates of a cloud by (N, 3), row by row, in place."""
    for column, values in zip(float_columns(cloud, POINT), points.T, strict=True):
        column[:] = values.reshape(column.shape)


def float_columns(cloud: Any, names: Sequence[str]) -> list[npt.NDArray[np.number]]:
    """
    Return ``field_column`` of several fields, which must have a floating type.

    An empty cloud need not have the fields.
    """
    if point_count(cloud) == 0:
        return [np.empty((0, 0), dtype=np.float32) for _ in names]
    columns = [field_column(cloud, name) for name in names]
    for name, column in zip(names, columns, strict=True):
        if column.dtype.kind != 'f':
            raise InvalidArgumentException(
                f'The field {name!r} of the cloud holds {column.dtype.name}; only FLOAT32 and '
                'FLOAT64 can be transformed')
    return columns


def field_column(cloud: Any, name: str) -> npt.NDArray[np.number]:
    """
    Return a view of one field of all points: writing to it changes the cloud.

    :return: (rows, columns), which is (1, N) if there is no padding between rows.
    :raises InvalidArgumentException: there is no such field, or the message contradicts
        itself about where it is.
    """
    field = next((field for field in cloud.fields if field.name == name), None)
    if field is None:
        names = ', '.join(field.name for field in cloud.fields) or 'none at all'
        raise InvalidArgumentException(
            f'The cloud has no field {name!r}; its fields are: {names}')
    # Some drivers write a count of 0 where they mean 1.
    if field.datatype not in CODES or field.count > 1:
        raise InvalidArgumentException(
            f'The field {name!r} of the cloud has the datatype {field.datatype} and the count '
            f'{field.count}, and must be one number of a type from 1 to 8')
    dtype = np.dtype(CODES[field.datatype]).newbyteorder('>' if cloud.is_bigendian else '<')
    if field.offset + dtype.itemsize > cloud.point_step:
        raise InvalidArgumentException(
            f'The field {name!r} of the cloud begins at byte {field.offset} and does not fit '
            f'into a point of {cloud.point_step} bytes')
    rows, columns, row_step = _grid(cloud.height, cloud.width, cloud.point_step, cloud.row_step,
                                    len(cloud.data))
    return np.ndarray((rows, columns), dtype, cloud.data, field.offset,
                      (row_step, cloud.point_step))


def _grid(height: int, width: int, step: int, row_step: int, size: int) -> tuple[int, int, int]:
    """Return rows, columns, and bytes from row to row; one row where there is no padding."""
    least = width * step
    used = least if height == 1 else row_step
    if used < least or size < (height - 1) * used + least:
        raise InvalidArgumentException(
            f'The cloud declares {height} x {width} points of {step} bytes, in '
            f'rows of {row_step} bytes, and has {size} bytes of data')
    return (1, height * width, used) if used == least else (height, width, used)


def scan_points(scan: Any) -> Array:
    """Return the end point of each ray: (N, 3), NaN where it is invalid."""
    given = np.array(scan.ranges, dtype=np.float32)
    # Both in single precision: otherwise a range of exactly range_max would not count.
    valid = (np.float32(scan.range_min) <= given) & (given <= np.float32(scan.range_max))
    valid &= np.isfinite(given)
    ranges = np.where(valid, given, np.nan)
    angles = scan.angle_min + np.arange(len(ranges)) * float(scan.angle_increment)
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * ranges], axis=1)


# --- the times of the points

_FIELDS = ('t', 'time', 'timestamp', 'offset_time')

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
    for name in _FIELDS:
        if name in names:
            return name
    raise InvalidArgumentException(
        f'The cloud has no time for each point: none of {", ".join(_FIELDS)} is among its fields '
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


# --- deskewing

def deskew(tree: ManyStampQueries, points: npt.ArrayLike, stamps: StampsLike, target_frame: str,
           source_frame: str, reference_stamp: Stamp, fixed_frame: str = 'odom') -> Any:
    """
    Return the coordinates of points in the target frame, all at one time.

    target_p = (target <- fixed at reference_stamp) (fixed <- source at stamp) source_p.
    To leave a scan in its own frame, pass that frame as target and as source.

    :param tree: a buffer or a snapshot.
    :param points: (N, 3) metres, each in the source frame at its own stamp.
    :param stamps: (N,) integer nanoseconds, when each point was taken.
    :param reference_stamp: nanoseconds; ``LATEST`` for the newest possible.
    :param fixed_frame: a frame that does not move or jump meanwhile; by REP 105 that is
        odom, not map.
    :return: (N, 3) metres, of the points' own floating type. NaN stays NaN.
    :raises InvalidArgumentException: mismatched shapes, or stamps that are not integers.
    :raises TransformException: as in ``lookup_many``; the buffer must cover the whole scan.
    """
    array = np.asarray(points)
    count = np.asarray(stamps).shape
    if array.ndim != 2 or array.shape[1] != 3 or count != array.shape[:1]:
        raise InvalidArgumentException(
            f'points must be (N, 3) with stamps (N,), not {array.shape} and {count}')
    still = tree.snapshot()
    target_T_fixed = still.lookup(target_frame, fixed_frame, reference_stamp)
    fixed_T_source = still.lookup_many(fixed_frame, source_frame, stamps)
    moved = target_T_fixed @ (fixed_T_source @ array)
    dtype = array.dtype if array.dtype.kind == 'f' else np.dtype(float)
    return moved.astype(dtype, copy=False)
