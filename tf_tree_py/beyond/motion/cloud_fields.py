# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Messages of points as arrays: the fields of a PointCloud2, and the rays of a LaserScan.

A message is an object of rclpy or of rosbags; both have the same fields.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array

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
