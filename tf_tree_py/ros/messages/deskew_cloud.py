# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Point clouds whose sensor moved during the scan, corrected as if taken at one moment.

Drivers use different field names, units and zeros for the times at which the points were taken.

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
import rclpy.logging
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.deskew import deskew
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.stamp import (
    as_seconds,
    format_span,
    from_seconds,
    LATEST,
    NANOSECONDS_PER_SECOND,
)
from tf_tree_py.core.text import shorten
from tf_tree_py.limited_log import LimitedLog

from .convert import as_nanoseconds, time_message
from .point_cloud import copy_of_cloud, field_column, points_of, write_points

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

    stamps: npt.NDArray[np.int64]
    valid: npt.NDArray[np.bool_]
    field: str
    unit: str
    origin: int
    reading: str
    doubt: str = ''


def point_times(cloud: PointCloud2, field: str | None = None, unit: str | float | None = None,
                origin: int | None = None,
                points_valid: npt.NDArray[np.bool_] | None = None) -> PointTimes:
    """
    Return when each point of a cloud was taken.

    :param field: None for the first of t, time, timestamp and offset_time that the cloud has.
    :param unit: 's', 'ms', 'us' or 'ns'; or a number of seconds, such as the duration of a scan
        if the field holds fractions of it; None to infer it from type and range. A scan with few
        points may be too short for that: pass the unit if you know it.
    :param origin: the stamp, nanoseconds, of the field's zero: 0 if the field counts from the
        clock's own zero; None to infer whether it is that or the header's stamp.
    :param points_valid: (N,) the points from which unit and origin are inferred.
    :raises InvalidArgumentException: no such field, an unknown unit, times that cannot belong
        to the cloud's stamp, or a type that is too coarse for them.
    """
    given = None if unit is None else _size_of(unit)
    name = _time_field(cloud) if field is None else field
    values = field_column(cloud, name).reshape(-1)
    values = values.astype(values.dtype.newbyteorder('='))
    valid = np.isfinite(values)
    known = values[valid if points_valid is None else valid & points_valid]
    stamp = as_nanoseconds(cloud.header.stamp)
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


def _step(kind: np.dtype[Any], value: Any) -> float:
    """Return the distance of a floating type's numbers around a value; 0 for integers."""
    return float(np.spacing(kind.type(value))) if kind.kind == 'f' else 0.0


def _time_field(cloud: PointCloud2) -> str:
    names = [field.name for field in cloud.fields]
    for name in FIELDS:
        if name in names:
            return name
    raise InvalidArgumentException(
        f'The cloud has no time for each point: none of {", ".join(FIELDS)} is among its fields '
        f'({", ".join(names)}). If another field holds the times, pass its name')


def _inferred_unit(first: Any, last: Any, step: float, name: str, stamp: int,
                   limits: Sequence[tuple[str, float]]) -> str:
    for unit, size in UNITS.items():
        if stamp > _CALENDAR and _is_near(first * size, last * size, step * size, stamp):
            return unit
    extent = last - first if name == 'timestamp' else max(abs(first), abs(last))
    return next(unit for unit, limit in limits if extent < limit or limit == math.inf)


def _is_absolute(last: Any, name: str, stamp: int) -> bool:
    """Return whether times, nanoseconds, count from the clock's zero and not from the header."""
    # If the clock has just started, both are near the stamp: then the name decides.
    return bool((stamp > _CALENDAR or name == 'timestamp') and abs(last - stamp) < abs(last))


def _is_near(first: Any, last: Any, step: float, stamp: int) -> bool:
    # FLOAT32 seconds since 1970 have steps of 128 s: near ones must be recognised, to be refused.
    return bool(max(abs(first - stamp), abs(last - stamp)) < _TOO_FAR + step)


def _check_distance(name: str, unit: str, origin: int, first: Any, last: Any, step: float,
                    stamp: int) -> None:
    if not _is_near(origin + first, origin + last, step, stamp):
        begins = format_span(int(origin + first - stamp))
        raise InvalidArgumentException(
            f'The times in the field {name!r}, read as {unit}, begin {begins} from the stamp of '
            'the cloud. If the unit is wrong, pass the right one; if the times count from another '
            'moment, such as the start of the sensor, pass the stamp of that moment as origin')


def _doubt(name: str, kind: str, unit: str, value: Any, step: float) -> str:
    if step <= _COARSE_STEP:
        return ''
    return (f'The field {name!r} is {kind} and holds {value:.10g}, read as {unit}: around this '
            f'value, {kind} has steps of {format_span(round(step))}, too coarse for the times of '
            'points. Let the driver write FLOAT64, or times relative to the stamp of the cloud')


def _as_nanoseconds(values: npt.NDArray[Any], size: int) -> npt.NDArray[np.int64]:
    if values.dtype.kind != 'f':
        return values.astype(np.int64) * size
    # The integer part is converted separately, so that a time since 1970 loses no digits here.
    exact = values.astype(float)
    whole = np.floor(exact)
    with np.errstate(invalid='ignore'):  # Invalid points may hold anything.
        rest = np.rint((exact - whole) * size)
        return np.asarray(whole.astype(np.int64) * size + rest.astype(np.int64))


def _reading(name: str, kind: str, unit: str | float | None, unit_read: str, origin: int | None,
             origin_read: int) -> str:
    zero = "the clock's zero" if origin_read == 0 else "the cloud's stamp"
    if origin is not None:
        zero = f'{origin_read / 1e9:.9f} s'
    assumed = [word for word, given in (('unit', unit), ('zero', origin)) if given is None]
    note = f' (assumed: {" and ".join(assumed)})' if assumed else ''
    return f'the field {name!r} ({kind}) holds {unit_read} from {zero}{note}'


# --- deskewing

# (frame, reading) pairs that have been logged: all clouds of one driver have the same reading.
_logged: set[tuple[str, str]] = set()
# By frame, the stamp of the last cloud whose times may be fractions of its scan.
_doubted: dict[str, int] = {}
_MAX_LOGGED = 1000
_log = LimitedLog(lambda line: rclpy.logging.get_logger('tf_tree_py').info(line))
_warnings = LimitedLog(lambda line: rclpy.logging.get_logger('tf_tree_py').warning(line))

# Times that begin at 0 and span so much, or more, of 1 may be fractions of a scan. So may those of
# a lidar that turns once a second, but its clouds do not overlap: they come so much of the span
# apart, or more.
_MOST_OF_A_SCAN, _APART = 0.9, 0.75


def deskew_cloud(buffer: Any, cloud: PointCloud2, target_frame: str | None = None,
                 fixed_frame: str = 'odom', reference_stamp: Any = None, *,
                 field: str | None = None, unit: str | float | None = None, origin: Any = None,
                 timeout: Any = None) -> PointCloud2:
    """
    Return a cloud with each point where it would have been seen at one time.

    Its layout and all other fields stay. The times of the points stay, too: they still give when a
    point was taken, relative to the old stamp. A point without a time becomes NaN. The assumptions
    about the times are logged once; ``point_times`` returns them. So is a warning if the times are
    coarse, or if they are probably no seconds but fractions of a scan, from 0 to 1.

    :param buffer: a ``Buffer``, a ``BufferCore`` or a snapshot.
    :param target_frame: None for the cloud's own.
    :param fixed_frame: a frame that does not move or jump: by REP 105 odom, not map.
    :param reference_stamp: an rclpy ``Time`` or a message's; None for the cloud's stamp,
        zero for the newest possible.
    :param field: the field that holds the times: see ``point_times``.
    :param unit: likewise.
    :param origin: likewise; an rclpy ``Time`` or a message's.
    :param timeout: an rclpy ``Duration`` to wait for the transforms; needs a ``Buffer``.
    :raises InvalidArgumentException: a cloud without times, or with impossible ones.
    :raises TransformException: as ``lookup_many``; the scan must lie inside the buffer.
    """
    source_frame = cloud.header.frame_id
    target_frame = target_frame or source_frame
    reference = as_nanoseconds(
        cloud.header.stamp if reference_stamp is None else reference_stamp, Time)
    points = points_of(cloud)
    seen = np.isfinite(points).all(axis=1)
    stamps, timed = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool)
    if len(points):
        times = point_times(
            cloud, field, unit, None if origin is None else as_nanoseconds(origin, Time), seen)
        timed = seen & times.valid
        stamps = times.stamps[timed]
        _log_reading(source_frame, as_nanoseconds(cloud.header.stamp), times,
                     0 if unit is not None else _span_of_fractions(times, stamps))

    if timeout is not None:
        last = int(stamps.max(initial=LATEST))
        buffer.lookup_transform(fixed_frame, source_frame, time_message(last), timeout)
        buffer.lookup_transform(target_frame, fixed_frame, time_message(reference), timeout)
    if reference == LATEST:
        reference, _ = buffer.lookup_stamped(target_frame, fixed_frame)
    points[timed] = deskew(
        buffer, points[timed], stamps, target_frame, source_frame, reference, fixed_frame)
    points[seen & ~timed] = np.nan
    result = copy_of_cloud(
        cloud, Header(stamp=time_message(reference), frame_id=target_frame))
    write_points(result, points)
    result.is_dense = bool(cloud.is_dense and timed.all())
    return result


def _span_of_fractions(times: PointTimes, stamps: npt.NDArray[np.int64]) -> int:
    """Return how long a scan lasts, nanoseconds, if its seconds may be fractions; else 0."""
    if times.unit != 's' or not len(stamps):
        return 0
    first, last = int(stamps.min()) - times.origin, int(stamps.max()) - times.origin
    second = NANOSECONDS_PER_SECOND
    fits = max(abs(first), abs(last)) <= second and last - first >= _MOST_OF_A_SCAN * second
    return last - first if fits else 0


def _log_reading(frame: str, stamp: int, times: PointTimes, span: int) -> None:
    """Log once how times were read; and warn if they are coarse, or no seconds but fractions."""
    # A message may have any frame.
    what = f'Deskewing clouds in {shorten(frame, 80)!r}: '
    cure = ('If these are fractions of a scan, pass its duration in seconds as unit, such as '
            'unit=0.1')
    _log_once(_log, frame, times.reading,
              f'{what}{times.reading}{f". {cure}" if span else ""}')
    if times.doubt:
        _log_once(_warnings, frame, f'coarse {times.field!r}', f'{what}{times.doubt}')
    if not span:
        return
    interval = abs(stamp - _doubted.get(frame, stamp))
    if frame in _doubted or len(_doubted) < _MAX_LOGGED:
        _doubted[frame] = stamp
    if 0 < interval < _APART * span:
        _log_once(
            _warnings, frame, f'fractions in {times.field!r}',
            f'{what}the times in the field {times.field!r} span {as_seconds(span):.4g}, read as '
            f'seconds, but the stamps of two clouds are {format_span(interval)} apart. {cure}; '
            "if each cloud holds points of so many seconds, from several scans, pass unit='s'")


def _log_once(log: LimitedLog, frame: str, about: str, line: str) -> None:
    if (frame, about) in _logged or len(_logged) >= _MAX_LOGGED:
        return
    if log.write('deskewing', frame, line, about):
        _logged.add((frame, about))
