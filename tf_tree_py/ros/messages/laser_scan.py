# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The points of a LaserScan where its rays were reflected."""

from typing import Any

import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2

from .point_cloud import packed_cloud


def as_cloud(scan: LaserScan, keep_invalid: bool = False) -> PointCloud2:
    """
    Return a scan as a cloud in its own frame.

    Fields: x, y, z (FLOAT32); intensity (FLOAT32) if the scan has one for each ray; time (FLOAT32,
    seconds after the header's stamp) if its rays were not taken at once, so that ``deskew_cloud``
    can use it.

    A ray is valid if range_min <= range <= range_max, as the message defines it. NaN (an error)
    and +-inf (nothing seen, or too close: REP 117) are not.

    :param keep_invalid: keep invalid rays, too, as NaN, so that the n-th point is the n-th ray.
    """
    points = _points(scan)
    valid = np.isfinite(points[:, 0])
    columns: dict[str, npt.NDArray[Any]] = dict(
        zip(('x', 'y', 'z'), points.T.astype(np.float32), strict=True))
    if len(scan.intensities) == len(points):
        columns['intensity'] = np.array(scan.intensities, dtype=np.float32)
    if scan.time_increment:
        times = np.arange(len(points)) * float(scan.time_increment)
        columns['time'] = times.astype(np.float32)
    if not keep_invalid:
        columns = {name: values[valid] for name, values in columns.items()}
    return packed_cloud(scan.header, columns, is_dense=not keep_invalid or bool(valid.all()))


def points_of_scan(scan: LaserScan) -> npt.NDArray[np.float64]:
    """Return the points of the valid rays: (N, 3), in the scan's frame; see ``as_cloud``."""
    points = _points(scan)
    return points[np.isfinite(points[:, 0])]


def _points(scan: LaserScan) -> npt.NDArray[np.float64]:
    """Return the end point of each ray: (N, 3), NaN where it is invalid."""
    given = np.array(scan.ranges, dtype=np.float32)
    # Both in single precision: otherwise a range of exactly range_max would not count.
    valid = (np.float32(scan.range_min) <= given) & (given <= np.float32(scan.range_max))
    valid &= np.isfinite(given)
    ranges = np.where(valid, given, np.nan)
    angles = scan.angle_min + np.arange(len(ranges)) * float(scan.angle_increment)
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * ranges], axis=1)
