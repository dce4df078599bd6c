# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Point clouds whose sensor moved during the scan, corrected as if taken at one moment."""

from typing import Any

import numpy as np
import rclpy.logging
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.deskew import deskew
from tf_tree_py.core.stamp import LATEST

from .convert import as_nanoseconds, time_message
from .point_cloud import copy_of_cloud, points_of, write_points
from .point_times import point_times

# (frame, reading) pairs that have been logged: all clouds of one driver have the same reading.
_told: set[tuple[str, str]] = set()
_MAX_TOLD = 1000


def deskew_cloud(buffer: Any, cloud: PointCloud2, target_frame: str | None = None,
                 fixed_frame: str = 'odom', reference_stamp: Any = None, *,
                 field: str | None = None, unit: str | None = None, origin: Any = None,
                 timeout: Any = None) -> PointCloud2:
    """
    Return a cloud with each point where it would have been seen at one time.

    Its layout and all other fields stay. The times of the points stay, too: they still give when a
    point was taken, relative to the old stamp. A point without a time becomes NaN. The assumptions
    about the times are logged once; ``point_times`` returns them.

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
    reference = as_nanoseconds(cloud.header.stamp if reference_stamp is None else reference_stamp)
    points = points_of(cloud)
    seen = np.isfinite(points).all(axis=1)
    stamps, timed = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=bool)
    if len(points):
        times = point_times(
            cloud, field, unit, None if origin is None else as_nanoseconds(origin), seen)
        _warn_once(source_frame, times.reading)
        timed = seen & times.valid
        stamps = times.stamps[timed]

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


def _warn_once(frame: str, reading: str) -> None:
    if (frame, reading) in _told or len(_told) >= _MAX_TOLD:
        return
    _told.add((frame, reading))
    rclpy.logging.get_logger('tf_tree_py').info(f'Deskewing clouds in {frame!r}: {reading}')
