# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sensor messages as points in a frame at a stamp, and camera images as RGB pixels; their source.

A message is an object of rclpy or of rosbags; both have the same fields. Readings are transformed
to the fixed frame, each point at the stamp at which it was measured. Images are small enough for
the controls of a page.
"""

from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from contextlib import suppress
import io
import threading
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from tf_tree_py.beyond.motion.scans import point_count, point_times, points_of, scan_points
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import InvalidArgumentException, TransformException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.sample import message_stamp
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamps

Pixels: TypeAlias = npt.NDArray[np.uint8]

_WIDEST: Final = 320
_COLOURS: Final = {'rgb8': 3, 'bgr8': 3, 'rgba8': 4, 'bgra8': 4}
# One number for each pixel. A Bayer image appears grey, with its pattern.
_GREYS: Final = {
    'mono8': 'u1', '8UC1': 'u1', 'mono16': 'u2', '16UC1': 'u2', '32FC1': 'f4',
    **{f'bayer_{pattern}8': 'u1' for pattern in ('rggb', 'bggr', 'gbrg', 'grbg')}}


def _raw_image(message: Any) -> Pixels:
    """
    Return the pixels of a sensor_msgs/Image, (H, W, 3).

    Depth images are scaled so that their smallest value is black and their largest is white.

    :raises ValueError: the encoding is not supported, or the message has too few bytes.
    """
    encoding, width = message.encoding, int(message.width)
    read: Callable[[npt.NDArray[np.uint8], int], Pixels]
    if encoding in _COLOURS:
        read = _coloured(encoding)
    elif encoding in _GREYS:
        read = _grey(('>' if message.is_bigendian else '<') + _GREYS[encoding])
    else:
        raise ValueError(f'images with the encoding {encoding!r} are not supported')
    data = np.frombuffer(bytes(message.data), np.uint8)
    if len(data) != message.height * message.step:
        raise ValueError(f'the image has {len(data)} bytes, but {message.height} rows of '
                         f'{message.step} bytes')
    rows = data.reshape(message.height, message.step)
    step = max(-(-width // _WIDEST), 1)
    return np.ascontiguousarray(read(rows, width)[::step, ::step])


def _coloured(encoding: str) -> Callable[[Pixels, int], Pixels]:
    channels = _COLOURS[encoding]

    def read(rows: Pixels, width: int) -> Pixels:
        pixels = rows[:, :width * channels].reshape(len(rows), width, channels)[:, :, :3]
        return pixels[:, :, ::-1] if encoding.startswith('bgr') else pixels

    return read


def _grey(dtype: str) -> Callable[[Pixels, int], Pixels]:
    def read(rows: Pixels, width: int) -> Pixels:
        values = np.ascontiguousarray(rows[:, :width * np.dtype(dtype).itemsize]).view(dtype)
        return np.repeat(_stretched(values)[:, :, None], 3, axis=2)

    return read


def _stretched(values: npt.NDArray[Any]) -> Pixels:
    """Return one byte for each value: as it is, or from black to white over the finite ones."""
    if values.dtype.itemsize == 1:
        return values
    finite = values[np.isfinite(values)].astype(float)
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
    scaled = (values.astype(float) - low) * (255.0 / max(high - low, 1e-9))
    return np.nan_to_num(np.clip(scaled, 0.0, 255.0)).astype(np.uint8)


def _compressed_image(message: Any) -> Pixels:
    """
    Return the pixels of a sensor_msgs/CompressedImage, (H, W, 3).

    :raises ValueError: the image is neither JPEG nor PNG, or it is damaged.
    """
    from PIL import Image
    if 'compressedDepth' in message.format:
        raise ValueError('compressed depth images are not supported')
    try:
        with Image.open(io.BytesIO(bytes(message.data)), formats=('JPEG', 'PNG')) as image:
            # A JPEG decoder can skip most of the work for a small picture.
            image.draft('RGB', (_WIDEST, _WIDEST))
            image.thumbnail((_WIDEST, image.height))
            return np.asarray(_as_rgb(image))
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(f'the compressed image cannot be read: {error}') from error


def _as_rgb(image: Any) -> Any:
    if image.mode.startswith('I') or image.mode == 'F':
        from PIL import Image
        return Image.fromarray(_stretched(np.asarray(image))).convert('RGB')
    return image.convert('RGB')


# --- readings

# Larger clouds are thinned. A browser can draw several clouds of this size at 10 Hz.
MOST_POINTS: Final = 8_000


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
    except (ValueError, OverflowError, InvalidArgumentException) as error:
        return Reading(message.header.frame_id, message_stamp(message), np.empty((0, 3)),
                       problem=str(error))


def is_known(type_name: str) -> bool:
    """Return whether messages of a type can be shown."""
    return _plain(type_name) in _READERS


def _plain(type_name: str) -> str:
    package, *_, name = type_name.split('/')
    return f'{package}/{name}'


def _scan(message: Any) -> Reading:
    points = scan_points(message)
    valid = np.isfinite(points[:, 0])
    stamp = message_stamp(message)
    times = None
    if message.time_increment:
        numbers = np.flatnonzero(valid)
        times = stamp + np.round(numbers * message.time_increment * 1e9).astype(np.int64)
    return Reading(message.header.frame_id, stamp, points[valid], times)


def _cloud(message: Any) -> Reading:
    every = max(-(-point_count(message) // MOST_POINTS), 1)
    points = points_of(message, every).astype(float)
    valid = np.isfinite(points).all(axis=1)
    times = None
    if valid.any():
        with suppress(InvalidArgumentException):  # Without usable times, all are of one moment.
            times = point_times(message, points_valid=valid, every=every)
            valid &= times.valid
    return Reading(message.header.frame_id, message_stamp(message), points[valid],
                   None if times is None else times.stamps[valid])


def _positions(read: Callable[[Any], list[Any]], is_line: bool = False
               ) -> Callable[[Any], Reading]:
    """Return a reader of the positions that a function returns of a message."""
    def positions(message: Any) -> Reading:
        points = [(each.x, each.y, each.z) for each in read(message)]
        return Reading(message.header.frame_id, message_stamp(message),
                       np.array(points, float).reshape(-1, 3), is_line=is_line)

    return positions


def _picture(pixels_of: Callable[[Any], Pixels]) -> Callable[[Any], Reading]:
    """Return a reader of the pixels that a function returns of a message."""
    return lambda message: Reading(message.header.frame_id, message_stamp(message),
                                   np.empty((0, 3)), image=pixels_of(message))


_READERS: Final[dict[str, Callable[[Any], Reading]]] = {
    'sensor_msgs/LaserScan': _scan,
    'sensor_msgs/PointCloud2': _cloud,
    'geometry_msgs/PoseArray': _positions(
        lambda message: [pose.position for pose in message.poses]),
    'nav_msgs/Path': _positions(
        lambda message: [stamped.pose.position for stamped in message.poses], is_line=True),
    'nav_msgs/Odometry': _positions(
        lambda message: [message.pose.pose.position], is_line=True),
    'vision_msgs/Detection3DArray': _positions(
        lambda message: [found.bbox.center.position for found in message.detections]),
    'sensor_msgs/Image': _picture(_raw_image),
    'sensor_msgs/CompressedImage': _picture(_compressed_image),
}


# --- in the fixed frame

def placed(tree: AllQueries, fixed_frame: str, reading: Reading, at_newest: bool = False
           ) -> Array | None:
    """
    Return the points of a reading in the fixed frame, (N, 3) metres.

    :param at_newest: use the newest transform instead of the one at the stamp. Many programs
        make this mistake, and a page can show its effect.
    :return: None: there is no transform. Points without a transform at their own stamp are
        left out.
    """
    frame = reading.frame.removeprefix('/')
    try:
        if at_newest or reading.stamps is None:
            pose = tree.lookup(fixed_frame, frame, LATEST if at_newest else reading.stamp)
            return np.asarray(pose @ reading.points)
        return _deskewed(tree, fixed_frame, frame, reading)
    except TransformException:
        return None


def _deskewed(tree: AllQueries, fixed_frame: str, frame: str, reading: Reading) -> Array:
    """Return the points that have a transform at their own stamps."""
    assert reading.stamps is not None
    # Many points of a cloud share a stamp, and each stamp is looked up once.
    stamps, places = np.unique(reading.stamps, return_inverse=True)
    poses, valid = tree.lookup_many(fixed_frame, frame, stamps, outside='mask')
    poses, measured = poses[places], valid[places]
    points: Array = so3.rotate_many(poses[:, 3:], reading.points) + poses[:, :3]
    return points[measured]


# --- the source

class Sensors:
    """
    Sensor messages. Only topics that a page wants are read.

    This one has no topics; those of a bag and of a running system derive from it.
    """

    def topics(self) -> list[str]:
        """Return the topics whose messages can be shown."""
        return []

    def want(self, topic: str, reader: object) -> None:
        """Start reading a topic for a reader."""

    def release(self, topic: str, reader: object) -> None:
        """Stop reading a topic for a reader."""

    def reading(self, topic: str, stamp: int) -> Reading | None:
        """Return the newest reading of a topic that is not later than a stamp, if any."""
        return next(iter(self.trail(topic, stamp, 1)), None)

    def trail(self, topic: str, stamp: int, most: int) -> list[Reading]:
        """Return the last readings of a topic that are not later than a stamp, oldest first."""
        return []

    def close(self) -> None:
        """Stop reading all topics."""


class Recent:
    """The last readings of one subscription."""

    def __init__(self, most: int) -> None:
        """
        Begin without readings.

        :param most: the number of readings to keep.
        """
        self._lock = threading.Lock()
        self._kept: deque[Reading] = deque(maxlen=most)

    def add(self, reading: Reading) -> None:
        """Add a reading."""
        with self._lock:
            self._kept.append(reading)

    def until(self, stamp: int, most: int) -> list[Reading]:
        """Return the last readings that are not later than a stamp, oldest first."""
        with self._lock:
            kept = sorted(self._kept, key=lambda reading: reading.stamp)
        end = bisect_right(kept, stamp, key=lambda reading: reading.stamp)
        return kept[max(end - most, 0):end]
