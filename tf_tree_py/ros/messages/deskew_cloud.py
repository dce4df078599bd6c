# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Point clouds whose sensor moved during the scan, corrected as if taken at one moment."""

from typing import Any

import numpy as np
import numpy.typing as npt
import rclpy.logging
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.scans import deskew, point_times, points_of, PointTimes, write_points
from tf_tree_py.core.stamp import as_seconds, format_span, LATEST, NANOSECONDS_PER_SECOND
from tf_tree_py.core.text import shorten
from tf_tree_py.limited_log import LimitedLog

from .convert import as_nanoseconds, DurationLike, time_message, TimeLike
from .point_cloud import copy_of_cloud

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
                 fixed_frame: str = 'odom', reference_stamp: TimeLike | None = None, *,
                 field: str | None = None, unit: str | float | None = None,
                 origin: TimeLike | None = None,
                 timeout: DurationLike | None = None) -> PointCloud2:
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
    result = copy_of_cloud(cloud, Header(stamp=time_message(reference), frame_id=target_frame))
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
    _log_once(_log, frame, times.reading, f'{what}{times.reading}{f". {cure}" if span else ""}')
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
