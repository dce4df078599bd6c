# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sensor messages as points in a frame at a stamp.

A message is an object of rclpy or of rosbags; both have the same fields.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .images import compressed_image, Pixels, raw_image

# Larger clouds are thinned. A browser can draw several clouds of this size at 10 Hz.
MOST_POINTS: Final = 8_000
_SECOND: Final = 1_000_000_000
_NUMBERS: Final = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}


class Reading(NamedTuple):
    """
    The content of one message.

    :ivar frame: the frame of the points.
    :ivar stamp: of the message, nanoseconds.
    :ivar points: (N, 3) metres.
    :ivar stamps: (N,) the time at which each point was measured, nanoseconds; None: all
        points were measured at the stamp of the message.
    :ivar is_line: whether the points are the vertices of a path.
    :ivar image: (H, W, 3) the picture of a camera; None: the message has no picture.
    :ivar problem: why the message cannot be shown; empty if it can be shown.
    """

    frame: str
    stamp: int
    points: Array
    stamps: Stamps | None = None
    is_line: bool = False
    image: Pixels | None = None
    problem: str = ''


def stamp_of(message: Any) -> int:
    """Return the stamp in the header of a message, nanoseconds."""
    stamp = message.header.stamp
    return int(stamp.sec) * _SECOND + int(stamp.nanosec)


def reading_of(type_name: str, message: Any) -> Reading | None:
    """
    Return the content of a message; None if messages of this type cannot be shown.

    A message whose fields contradict each other has a ``problem`` and no points.
    """
    read = _READERS.get(_plain(type_name))
    if read is None:
        return None
    try:
        return read(message)
    except (ValueError, KeyError, OverflowError) as error:
        return Reading(message.header.frame_id, stamp_of(message), np.empty((0, 3)),
                       problem=str(error))


def is_known(type_name: str) -> bool:
    """Return whether messages of a type can be shown."""
    return _plain(type_name) in _READERS


def _plain(type_name: str) -> str:
    package, *_, name = type_name.split('/')
    return f'{package}/{name}'


def _scan(message: Any) -> Reading:
    ranges = np.asarray(message.ranges, float)
    numbers = np.arange(len(ranges))
    valid = np.isfinite(ranges) & (ranges >= message.range_min) & (ranges <= message.range_max)
    angles = message.angle_min + numbers * message.angle_increment
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles),
                       np.zeros(len(ranges))], axis=1)[valid]
    stamp = stamp_of(message)
    times = None
    if message.time_increment:
        times = stamp + np.round(numbers[valid] * message.time_increment * 1e9).astype(np.int64)
    return Reading(message.header.frame_id, stamp, points, times)


def _cloud(message: Any) -> Reading:
    order = '>' if message.is_bigendian else '<'
    fields = {field.name: field for field in message.fields if field.datatype in _NUMBERS}
    layout = np.dtype({'names': list(fields), 'itemsize': message.point_step,
                       'formats': [order + _NUMBERS[field.datatype] for field in fields.values()],
                       'offsets': [field.offset for field in fields.values()]})
    count = int(message.width) * int(message.height)
    rows = np.frombuffer(bytes(message.data), np.uint8)
    if int(message.height) > 1 and message.row_step != message.width * message.point_step:
        rows = rows.reshape(message.height, -1)[:, :message.width * message.point_step].ravel()
    data = rows[:count * message.point_step].view(layout)
    data = data[::max(-(-count // MOST_POINTS), 1)]
    points = np.stack([data[axis].astype(float) for axis in 'xyz'], axis=1)
    valid = np.isfinite(points).all(axis=1)
    stamp = stamp_of(message)
    times = _point_times(data, stamp)
    return Reading(message.header.frame_id, stamp, points[valid],
                   None if times is None else times[valid])


def _point_times(data: npt.NDArray[Any], stamp: int) -> Stamps | None:
    """
    Return the time at which each point was measured, nanoseconds; None if no field has it.

    Drivers use different names and units for this field.
    """
    names = data.dtype.names or ()
    for name in ('t', 'offset_time'):  # Ouster, Livox: nanoseconds after the stamp
        if name in names and data.dtype[name].kind == 'u':
            return stamp + data[name].astype(np.int64)
    for name in ('time', 'timestamp'):  # seconds after the stamp (Velodyne) or since 1970
        if name in names and data.dtype[name].kind == 'f':
            seconds = data[name].astype(float)
            if len(seconds) and seconds.max() > 1e6:
                return np.round(seconds * 1e9).astype(np.int64)
            return stamp + np.round(seconds * 1e9).astype(np.int64)
    return None


def _pose_array(message: Any) -> Reading:
    return Reading(message.header.frame_id, stamp_of(message),
                   _positions(message.poses, lambda pose: pose.position))


def _path(message: Any) -> Reading:
    return Reading(message.header.frame_id, stamp_of(message),
                   _positions(message.poses, lambda pose: pose.pose.position), is_line=True)


def _odometry(message: Any) -> Reading:
    return Reading(message.header.frame_id, stamp_of(message),
                   _positions([message], lambda each: each.pose.pose.position), is_line=True)


def _detections(message: Any) -> Reading:
    return Reading(message.header.frame_id, stamp_of(message), _positions(
        message.detections, lambda detection: detection.bbox.center.position))


def _positions(items: Any, position_of: Callable[[Any], Any]) -> Array:
    positions = [position_of(item) for item in items]
    return np.array([(each.x, each.y, each.z) for each in positions], float).reshape(-1, 3)


def _picture(pixels_of: Callable[[Any], Pixels], message: Any) -> Reading:
    return Reading(message.header.frame_id, stamp_of(message), np.empty((0, 3)),
                   image=pixels_of(message))


_READERS: Final[dict[str, Callable[[Any], Reading | None]]] = {
    'sensor_msgs/LaserScan': _scan,
    'sensor_msgs/PointCloud2': _cloud,
    'geometry_msgs/PoseArray': _pose_array,
    'nav_msgs/Path': _path,
    'nav_msgs/Odometry': _odometry,
    'vision_msgs/Detection3DArray': _detections,
    'sensor_msgs/Image': partial(_picture, raw_image),
    'sensor_msgs/CompressedImage': partial(_picture, compressed_image),
}
